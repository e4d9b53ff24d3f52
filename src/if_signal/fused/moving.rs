//! Returns given as moving points and antennas: legs, phase, sweep and spreading are computed where they are needed.
//!
//! The same formulas as [`crate::paths`], which defines them; here they neither become tensors nor a tape.

mod adjoint;

use std::sync::Arc;

use rayon::prelude::*;

use super::kernel::Returns;
use super::lanes::{LANES, Lanes, ZERO, fma, load, map, multiply_add, zip};
use super::machine::{Work, widest};
use super::plan::Return;
use super::scratch::Scratch;
use crate::paths::{AtRest, NEAR_FIELD_M2, SOFTENING_M, Waveform, distance};
pub use adjoint::gradients;

/// Host constants of paths from one transmitter by way of points to several receivers.
#[derive(Debug)]
pub struct Geometry {
    /// Transmitter first, then the receivers.
    antennas_m: Vec<[f32; 3]>,
    reference_m: Vec<[f32; 3]>,
    /// `[antenna][point]`: the leg's reference length.
    lengths_m: Vec<Vec<f32>>,
    /// `[receiver][point]`.
    at_rest: Vec<Vec<PathAtRest>>,
    sweep_per_metre: f32,
    sweep_per_step: f32,
}

#[derive(Clone, Copy, Debug)]
struct PathAtRest {
    phase_turns: f32,
    sweep_turns: f32,
    turns_per_metre: f32,
}

impl Geometry {
    pub fn new(reference_m: &[[f64; 3]], tx_m: [f64; 3], receivers_m: &[[f64; 3]], waveform: &Waveform) -> Self {
        let lengths = |antenna_m: [f64; 3]| -> Vec<f64> { reference_m.par_iter().map(|&x| distance(x, antenna_m)).collect() };
        let from_tx = lengths(tx_m);
        let narrow = |values: &[f64]| values.iter().map(|&value| value as f32).collect::<Vec<f32>>();
        let mut lengths_m = vec![narrow(&from_tx)];
        let mut at_rest = vec![];
        for &receiver_m in receivers_m {
            let to_rx = lengths(receiver_m);
            let paths = from_tx.par_iter().zip(&to_rx).map(|(a, b)| {
                let AtRest { phase_turns, sweep_turns, turns_per_metre } = waveform.at_rest(a + b);
                PathAtRest {
                    phase_turns: phase_turns as f32,
                    sweep_turns: sweep_turns as f32,
                    turns_per_metre: turns_per_metre as f32,
                }
            });
            at_rest.push(paths.collect());
            lengths_m.push(narrow(&to_rx));
        }
        let (per_metre, per_step) = waveform.sweep_factors();
        let position = |x: &[f64; 3]| x.map(|value| value as f32);
        Self {
            antennas_m: std::iter::once(&tx_m).chain(receivers_m).map(position).collect(),
            reference_m: reference_m.iter().map(position).collect(),
            lengths_m,
            at_rest,
            sweep_per_metre: per_metre as f32,
            sweep_per_step: per_step as f32,
        }
    }

    pub fn points(&self) -> usize {
        self.reference_m.len()
    }

    pub fn receivers(&self) -> usize {
        self.at_rest.len()
    }

    fn legs(&self) -> usize {
        self.antennas_m.len()
    }

    /// From a leg's antenna to a point at rest.
    #[inline(always)]
    fn offset_m(&self, point: usize, leg: usize) -> [f32; 3] {
        let (x0, r) = (self.reference_m[point], self.antennas_m[leg]);
        [x0[0] - r[0], x0[1] - r[1], x0[2] - r[2]]
    }

    /// Reference length of a leg, and its square softened.
    #[inline(always)]
    fn length<const FUSED: bool>(&self, point: usize, leg: usize) -> (f32, f32) {
        let length = self.lengths_m[leg][point];
        (length, multiply_add::<FUSED>(length, length, (SOFTENING_M * SOFTENING_M) as f32))
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

/// Of one receiver's path at sixteen chirps.
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
    fn path<const FUSED: bool>(&self, receiver: usize, point: usize, chirp: usize) -> Path {
        let (a, b) = (load(self.row(point, 0), chirp + 1, LANES), load(self.row(point, receiver + 1), chirp + 1, LANES));
        let lengths = (self.geometry.lengths_m[0][point], self.geometry.lengths_m[receiver + 1][point]);
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
    fn step(&self, receiver: usize, point: usize, chirp: usize) -> Lanes {
        let (a, b) = (self.row(point, 0), self.row(point, receiver + 1));
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

    fn receivers(&self) -> usize {
        self.geometry.receivers()
    }

    #[inline(always)]
    fn load<const FUSED: bool>(&self, receiver: usize, point: usize, chirp: usize) -> Return {
        let path = self.path::<FUSED>(receiver, point, chirp);
        let rest = self.geometry.at_rest[receiver][point];
        let mut sweep =
            map(path.change_m, |change| multiply_add::<FUSED>(change, self.geometry.sweep_per_metre, rest.sweep_turns));
        if self.geometry.sweep_per_step != 0.0 && self.tensors.chirps > 1 {
            sweep = fma::<FUSED>(self.step(receiver, point, chirp), [self.geometry.sweep_per_step; LANES], sweep);
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
