//! Returns given as moving points and antennas: legs, phase, sweep and spreading are computed where they are needed.
//!
//! The same formulas as [`crate::paths`], which defines them; here they neither become tensors nor a tape.

mod adjoint;

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::kernel::{Output, Returns};
use super::lanes::{LANES, Lanes, ZERO, fma, load, map, multiply_add, zip};
use super::machine::{Work, widest};
use super::plan::Return;
use super::scratch::Scratch;
use crate::paths::{AtRest, NEAR_FIELD_M2, SOFTENING_M, Waveform, distance};
pub use adjoint::gradients;

/// Host constants of paths from one transmitter by way of points.
///
/// A point's legs are that from the transmitter, then one for each of its paths.
#[derive(Debug)]
pub struct Geometry {
    /// From each leg's antenna to the points at rest, and how long, `[leg, point, 4]`, then phase, sweep and turns per metre at rest,
    /// `[path, point, 3]`: one after the other, as GPUs take them.
    constants: Vec<f32>,
    points: usize,
    paths: usize,
    outputs: Vec<Output>,
    sweep_per_metre: f32,
    sweep_per_step: f32,
}

impl Geometry {
    /// Receivers that see all points: a path of each point to each.
    pub fn array(reference_m: &[[f64; 3]], tx_m: [f64; 3], receivers_m: &[[f64; 3]], waveform: &Waveform) -> Self {
        let outputs = (0..receivers_m.len()).map(|path| Output { path, points: 0..reference_m.len() }).collect();
        Self::new(reference_m, tx_m, receivers_m.len(), |path, _| (receivers_m[path], waveform), outputs, waveform)
    }

    /// Receivers that see some points each, and together all of them once: one path of each point.
    pub fn apart(reference_m: &[[f64; 3]], tx_m: [f64; 3], receivers: &[(Range<usize>, [f64; 3], &Waveform)]) -> Self {
        let (_, _, waveform) = receivers.first().expect("a receiver");
        let to: Vec<_> = receivers.iter().flat_map(|(points, to_m, waveform)| vec![(*to_m, *waveform); points.len()]).collect();
        let next = receivers.iter().try_fold(0, |next, (points, ..)| (points.start == next).then_some(points.end));
        assert_eq!(next, Some(reference_m.len()), "coherent sum: the receivers' points do not follow one another to the last");
        let outputs = receivers.iter().map(|(points, ..)| Output { path: 0, points: points.clone() }).collect();
        Self::new(reference_m, tx_m, 1, |_, point| to[point], outputs, waveform)
    }

    /// `to`: the receiver of a path of a point, and what a chirp makes of its length; waveforms differ in what follows the receiver.
    fn new<'a>(
        reference_m: &[[f64; 3]],
        tx_m: [f64; 3],
        paths: usize,
        to: impl Fn(usize, usize) -> ([f64; 3], &'a Waveform) + Sync,
        outputs: Vec<Output>,
        waveform: &Waveform,
    ) -> Self {
        let points = reference_m.len();
        let mut constants = vec![0.0; (4 * (paths + 1) + 3 * paths) * points];
        let (legs, at_rest) = constants.split_at_mut(4 * (paths + 1) * points);
        let (from_tx, to_receivers) = legs.split_at_mut(4 * points);
        let from_tx_m: Vec<f64> = from_tx
            .par_chunks_exact_mut(4)
            .zip(reference_m)
            .with_min_len(1024)
            .map(|(leg, point_m)| write_leg(leg, tx_m, *point_m))
            .collect();
        let rows = to_receivers.par_chunks_exact_mut(4).zip(at_rest.par_chunks_exact_mut(3)).enumerate();
        rows.with_min_len(1024).for_each(|(row, (leg, path))| {
            let (index, point) = (row / points, row % points);
            let (receiver_m, waveform) = to(index, point);
            let length_m = from_tx_m[point] + write_leg(leg, receiver_m, reference_m[point]);
            let AtRest { phase_turns, sweep_turns, turns_per_metre } = waveform.at_rest(length_m);
            path.copy_from_slice(&[phase_turns as f32, sweep_turns as f32, turns_per_metre as f32]);
        });
        let (per_metre, per_step) = waveform.sweep_factors();
        Self { constants, points, paths, outputs, sweep_per_metre: per_metre as f32, sweep_per_step: per_step as f32 }
    }

    pub fn points(&self) -> usize {
        self.points
    }

    pub fn paths(&self) -> usize {
        self.paths
    }

    pub fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    #[cfg(any(feature = "wgpu", feature = "cuda"))]
    pub fn constants(&self) -> &[f32] {
        &self.constants
    }

    /// Growth of the sweep with the path's change, and with its difference from chirp to chirp.
    #[cfg(any(feature = "wgpu", feature = "cuda"))]
    pub fn sweep_factors(&self) -> (f32, f32) {
        (self.sweep_per_metre, self.sweep_per_step)
    }

    fn legs(&self) -> usize {
        self.paths + 1
    }

    /// From a leg's antenna to a point at rest, and how long.
    #[inline(always)]
    fn leg(&self, point: usize, leg: usize) -> &[f32; 4] {
        self.constants[4 * (leg * self.points + point)..][..4].try_into().expect("four numbers")
    }

    #[inline(always)]
    fn offset_m(&self, point: usize, leg: usize) -> [f32; 3] {
        let [x, y, z, _] = *self.leg(point, leg);
        [x, y, z]
    }

    #[inline(always)]
    fn length_m(&self, point: usize, leg: usize) -> f32 {
        self.leg(point, leg)[3]
    }

    /// A leg's length at rest, and its square softened.
    #[inline(always)]
    fn length<const FUSED: bool>(&self, point: usize, leg: usize) -> (f32, f32) {
        let length = self.length_m(point, leg);
        (length, multiply_add::<FUSED>(length, length, (SOFTENING_M * SOFTENING_M) as f32))
    }

    #[inline(always)]
    fn at_rest(&self, path: usize, point: usize) -> PathAtRest {
        let row = 4 * self.legs() * self.points + 3 * (path * self.points + point);
        let [phase_turns, sweep_turns, turns_per_metre] =
            *<&[f32; 3]>::try_from(&self.constants[row..][..3]).expect("three numbers");
        PathAtRest { phase_turns, sweep_turns, turns_per_metre }
    }
}

/// Offset and length of the leg from an antenna to a point; the length is that of the leg in f64.
fn write_leg(leg: &mut [f32], antenna_m: [f64; 3], point_m: [f64; 3]) -> f64 {
    let offset_m = [0, 1, 2].map(|axis| (point_m[axis] - antenna_m[axis]) as f32);
    let length_m = distance(point_m, antenna_m);
    leg.copy_from_slice(&[offset_m[0], offset_m[1], offset_m[2], length_m as f32]);
    length_m
}

#[derive(Clone, Copy, Debug)]
struct PathAtRest {
    phase_turns: f32,
    sweep_turns: f32,
    turns_per_metre: f32,
}

/// |v+u|² − |v|².
#[inline(always)]
fn growth(v: [f32; 3], x: f32, y: f32, z: f32) -> f32 {
    x * (x + 2.0 * v[0]) + y * (y + 2.0 * v[1]) + z * (z + 2.0 * v[2])
}

/// Displacements `[point, chirp]`, amplitudes `[point, chirp]` or `[point, 1]`, in row-major order.
#[derive(Clone, Copy)]
pub struct Tensors<'a> {
    pub axes: [&'a [f32]; 3],
    pub re: &'a [f32],
    pub im: Option<&'a [f32]>,
    pub chirps: usize,
    pub amplitude_chirps: usize,
}

/// Moving points with the changes of all their legs.
pub struct Moving<'a> {
    geometry: Arc<Geometry>,
    tensors: Tensors<'a>,
    /// `[point][leg][stride]`, metres; see [`extend`].
    changes_m: Scratch,
    stride: usize,
}

/// Finds the changes of a point's legs.
struct Changes<'a> {
    geometry: &'a Geometry,
    tensors: &'a Tensors<'a>,
    point: usize,
    /// `[leg][stride]`
    changes_m: &'a mut [f32],
    stride: usize,
}

impl Work for Changes<'_> {
    type Out = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let Self { geometry, tensors, point, changes_m, stride } = self;
        let chirps = tensors.chirps;
        let [x, y, z] = tensors.axes.map(|axis| &axis[point * chirps..][..chirps]);
        for (leg, row) in changes_m.chunks_mut(stride).enumerate() {
            let v = geometry.offset_m(point, leg);
            let (length, squared) = geometry.length::<FUSED>(point, leg);
            for (((change, x), y), z) in row[1..=chirps].iter_mut().zip(x).zip(y).zip(z) {
                let growth = growth(v, *x, *y, *z);
                *change = growth / ((growth + squared).sqrt() + length);
            }
            extend(row, chirps);
        }
    }
}

/// One of a point's paths at sixteen chirps.
struct Path {
    lengths_m: [Lanes; 2],
    spreading: Lanes,
    change_m: Lanes,
}

impl<'a> Moving<'a> {
    pub fn new(geometry: Arc<Geometry>, tensors: Tensors<'a>) -> Self {
        let (chirps, legs) = (tensors.chirps, geometry.legs());
        let stride = chirps.next_multiple_of(LANES) + 2;
        let size = geometry.points() * legs * stride;
        let mut changes_m = Scratch::new(size.div_ceil(LANES));
        let rows = &mut changes_m.as_flattened_mut()[..size];
        rows.par_chunks_mut(legs * stride).enumerate().with_min_len(256).for_each(|(point, changes_m)| {
            widest(Changes { geometry: &geometry, tensors: &tensors, point, changes_m, stride });
        });
        Self { geometry, tensors, changes_m, stride }
    }

    fn row(&self, point: usize, leg: usize) -> &[f32] {
        &self.changes_m.as_flattened()[(point * self.geometry.legs() + leg) * self.stride..][..self.stride]
    }

    #[inline(always)]
    fn path<const FUSED: bool>(&self, path: usize, point: usize, chirp: usize) -> Path {
        let (a, b) = (load(self.row(point, 0), chirp + 1, LANES), load(self.row(point, path + 1), chirp + 1, LANES));
        let lengths = (self.geometry.length_m(point, 0), self.geometry.length_m(point, path + 1));
        let lengths_m = [map(a, |change| change + lengths.0), map(b, |change| change + lengths.1)];
        let spreading = zip(lengths_m[0], lengths_m[1], |a, b| 1.0 / multiply_add::<FUSED>(a, b, NEAR_FIELD_M2 as f32));
        Path { lengths_m, spreading, change_m: zip(a, b, |a, b| a + b) }
    }

    #[inline(always)]
    fn amplitude(&self, values: &[f32], point: usize, chirp: usize) -> Lanes {
        match self.tensors.amplitude_chirps {
            1 => [values[point]; LANES],
            chirps => load(values, point * chirps + chirp, chirps - chirp),
        }
    }

    /// Difference of the path from chirp to chirp, metres.
    #[inline(always)]
    fn step(&self, path: usize, point: usize, chirp: usize) -> Lanes {
        let (a, b) = (self.row(point, 0), self.row(point, path + 1));
        let at = |from: usize| zip(load(a, from, LANES), load(b, from, LANES), |a, b| a + b);
        zip(at(chirp + 2), at(chirp), |next, last| 0.5 * (next - last))
    }
}

/// Fills what surrounds a row's values, which begin at 1: before and after them what makes the central difference of
/// the first and the last that of [`crate::paths::difference`], then the last one again up to a whole number of lanes.
fn extend(row: &mut [f32], chirps: usize) {
    let last = row[chirps];
    row[chirps + 1..].fill(last);
    match chirps {
        1 => row[0] = last,
        2 => (row[0], row[3]) = (2.0 * row[1] - row[2], 2.0 * row[2] - row[1]),
        _ => {
            row[0] = 3.0 * (row[1] - row[2]) + row[3];
            row[chirps + 1] = 3.0 * (last - row[chirps - 1]) + row[chirps - 2];
        }
    }
}

impl Returns for Moving<'_> {
    fn points(&self) -> usize {
        self.geometry.points()
    }

    fn chirps(&self) -> usize {
        self.tensors.chirps
    }

    fn paths(&self) -> usize {
        self.geometry.paths()
    }

    fn outputs(&self) -> &[Output] {
        self.geometry.outputs()
    }

    #[inline(always)]
    fn load<const FUSED: bool>(&self, index: usize, point: usize, chirp: usize) -> Return {
        let path = self.path::<FUSED>(index, point, chirp);
        let rest = self.geometry.at_rest(index, point);
        let mut sweep =
            map(path.change_m, |change| multiply_add::<FUSED>(change, self.geometry.sweep_per_metre, rest.sweep_turns));
        if self.geometry.sweep_per_step != 0.0 && self.tensors.chirps > 1 {
            sweep = fma::<FUSED>(self.step(index, point, chirp), [self.geometry.sweep_per_step; LANES], sweep);
        }
        let spread = |values: &[f32]| zip(self.amplitude(values, point, chirp), path.spreading, |a, w| a * w);
        Return {
            re: spread(self.tensors.re),
            im: self.tensors.im.map_or(ZERO, spread),
            phase: map(path.change_m, |change| multiply_add::<FUSED>(change, rest.turns_per_metre, rest.phase_turns)),
            sweep,
        }
    }
}
