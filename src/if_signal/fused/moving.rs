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
    /// From each leg's antenna to the points at rest, `[leg, 3, point]`, the legs' lengths then, `[leg, point]`, and phase, sweep and
    /// turns per metre at rest, `[path, 3, point]`: one after the other, as GPUs take them.
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
        let paths = receivers_m.iter().map(|&receiver_m| vec![(receiver_m, waveform); reference_m.len()]).collect();
        let outputs = (0..receivers_m.len()).map(|path| Output { path, points: 0..reference_m.len() }).collect();
        Self::new(reference_m, tx_m, paths, outputs, waveform)
    }

    /// Receivers that see some points each, and together all of them once: one path of each point.
    pub fn apart(reference_m: &[[f64; 3]], tx_m: [f64; 3], receivers: &[(Range<usize>, [f64; 3], &Waveform)]) -> Self {
        let (_, _, waveform) = receivers.first().expect("a receiver");
        let to: Vec<_> = receivers.iter().flat_map(|(points, to_m, waveform)| vec![(*to_m, *waveform); points.len()]).collect();
        let next = receivers.iter().try_fold(0, |next, (points, ..)| (points.start == next).then_some(points.end));
        assert_eq!(next, Some(reference_m.len()), "coherent sum: the receivers' points do not follow one another to the last");
        let outputs = receivers.iter().map(|(points, ..)| Output { path: 0, points: points.clone() }).collect();
        Self::new(reference_m, tx_m, vec![to], outputs, waveform)
    }

    /// `paths`: `[path][point]`, the receiver and what a chirp makes of the length; waveforms differ in what follows the receiver.
    fn new(
        reference_m: &[[f64; 3]],
        tx_m: [f64; 3],
        paths: Vec<Vec<([f64; 3], &Waveform)>>,
        outputs: Vec<Output>,
        waveform: &Waveform,
    ) -> Self {
        let count = paths.len();
        let legs: Vec<LegRows> = (0..=count)
            .into_par_iter()
            .map(|leg| match leg {
                0 => LegRows::new(reference_m.iter().map(|&x| (x, tx_m))),
                _ => LegRows::new(reference_m.iter().zip(&paths[leg - 1]).map(|(&x, &(receiver_m, _))| (x, receiver_m))),
            })
            .collect();
        let at_rest = paths.par_iter().zip(&legs[1..]).map(|(path, to_receiver)| {
            let lengths = legs[0].lengths_m.iter().zip(&to_receiver.lengths_m);
            let mut rows = [(); 3].map(|()| Vec::with_capacity(reference_m.len()));
            for ((from_tx, to_receiver), (_, waveform)) in lengths.zip(path) {
                let AtRest { phase_turns, sweep_turns, turns_per_metre } = waveform.at_rest(from_tx + to_receiver);
                let values = [phase_turns, sweep_turns, turns_per_metre];
                rows.iter_mut().zip(values).for_each(|(row, value)| row.push(value as f32));
            }
            rows
        });
        let at_rest: Vec<[Vec<f32>; 3]> = at_rest.collect();
        let mut constants = Vec::with_capacity((4 * (count + 1) + 3 * count) * reference_m.len());
        legs.iter().flat_map(|leg| &leg.offsets_m).for_each(|row| constants.extend_from_slice(row));
        legs.iter().for_each(|leg| constants.extend(leg.lengths_m.iter().map(|&length| length as f32)));
        at_rest.iter().flatten().for_each(|row| constants.extend_from_slice(row));
        let (per_metre, per_step) = waveform.sweep_factors();
        Self {
            constants,
            points: reference_m.len(),
            paths: count,
            outputs,
            sweep_per_metre: per_metre as f32,
            sweep_per_step: per_step as f32,
        }
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

    /// From a leg's antenna to a point at rest.
    #[inline(always)]
    fn offset_m(&self, point: usize, leg: usize) -> [f32; 3] {
        [0, 1, 2].map(|axis| self.constants[(3 * leg + axis) * self.points + point])
    }

    /// A leg's length at rest.
    #[inline(always)]
    fn length_m(&self, point: usize, leg: usize) -> f32 {
        self.constants[(3 * self.legs() + leg) * self.points + point]
    }

    /// The same, and its square softened.
    #[inline(always)]
    fn length<const FUSED: bool>(&self, point: usize, leg: usize) -> (f32, f32) {
        let length = self.length_m(point, leg);
        (length, multiply_add::<FUSED>(length, length, (SOFTENING_M * SOFTENING_M) as f32))
    }

    #[inline(always)]
    fn at_rest(&self, path: usize, point: usize) -> PathAtRest {
        let first = 4 * self.legs() + 3 * path;
        let [phase_turns, sweep_turns, turns_per_metre] =
            [0, 1, 2].map(|row| self.constants[(first + row) * self.points + point]);
        PathAtRest { phase_turns, sweep_turns, turns_per_metre }
    }
}

#[derive(Clone, Copy, Debug)]
struct PathAtRest {
    phase_turns: f32,
    sweep_turns: f32,
    turns_per_metre: f32,
}

/// One leg of all points: from its antenna to the points at rest.
struct LegRows {
    offsets_m: [Vec<f32>; 3],
    lengths_m: Vec<f64>,
}

impl LegRows {
    /// Of points and their antennas.
    fn new(ends: impl ExactSizeIterator<Item = ([f64; 3], [f64; 3])>) -> Self {
        let mut offsets_m = [(); 3].map(|()| Vec::with_capacity(ends.len()));
        let mut lengths_m = Vec::with_capacity(ends.len());
        for (point, antenna) in ends {
            offsets_m.iter_mut().enumerate().for_each(|(axis, row)| row.push((point[axis] - antenna[axis]) as f32));
            lengths_m.push(distance(point, antenna));
        }
        Self { offsets_m, lengths_m }
    }
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
