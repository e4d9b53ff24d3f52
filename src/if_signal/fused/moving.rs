//! Returns given as moving points and antennas: legs, phase, sweep and spreading are computed where they are needed.
//!
//! The same formulas as [`crate::paths`], which defines them; here they neither become tensors nor a tape.

use std::sync::Arc;

use rayon::prelude::*;

use super::kernel::{self, Returns, Sink};
use super::lanes::{LANES, Lanes, ZERO, accumulate, fma, load, map, multiply_add, store, zip};
use super::machine::{Work, widest};
use super::plan::Return;
use super::scratch::Scratch;
use crate::paths::{AtRest, NEAR_FIELD_M2, SOFTENING_M, Waveform, difference, distance};

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
/// the first and the last that of [`difference`], then the last one again up to a whole number of lanes.
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

/// Gradients to x, y, z, re and im; that to im is empty for a real amplitude.
pub fn gradients(moving: &Moving, upstream: &[f32], samples: usize) -> [Vec<f32>; 5] {
    let (points, chirps) = (moving.points(), moving.chirps());
    let amplitude_chirps = moving.tensors.amplitude_chirps;
    let zeros = |columns: usize| vec![0.0f32; points * columns];
    let im_columns = if moving.tensors.im.is_some() { amplitude_chirps } else { 0 };
    let mut all = [zeros(chirps), zeros(chirps), zeros(chirps), zeros(amplitude_chirps), zeros(im_columns)];
    let count = kernel::points_per_sink(points);
    let [x, y, z, re, im] = &mut all;
    let mut im = im.chunks_mut(count * amplitude_chirps);
    let sinks: Vec<Back> = (x.chunks_mut(count * chirps).zip(y.chunks_mut(count * chirps)))
        .zip(z.chunks_mut(count * chirps).zip(re.chunks_mut(count * amplitude_chirps)))
        .enumerate()
        .map(|(index, ((x, y), (z, re)))| Back {
            moving,
            first: index * count,
            to_legs: Scratch::new(0),
            to_sweep: Scratch::new(0),
            axes: [x, y, z],
            re,
            im: im.next(),
        })
        .collect();
    kernel::gradients(moving, upstream, samples, sinks);
    all
}

/// Takes the gradients to a range of points back to their displacements and amplitudes.
struct Back<'a> {
    moving: &'a Moving<'a>,
    first: usize,
    /// `[point][leg][chirp]`, to the legs' changes.
    to_legs: Scratch,
    /// `[point][chirp]`, of the receiver at hand.
    to_sweep: Scratch,
    axes: [&'a mut [f32]; 3],
    re: &'a mut [f32],
    im: Option<&'a mut [f32]>,
}

impl Back<'_> {
    fn to_amplitude(values: &mut [f32], amplitude_chirps: usize, local: usize, chirp: usize, width: usize, gradient: Lanes) {
        match amplitude_chirps {
            1 => values[local] += gradient[..width.min(LANES)].iter().sum::<f32>(),
            chirps => accumulate(values, local * chirps + chirp, width, gradient),
        }
    }
}

impl Sink for Back<'_> {
    fn points(&self) -> usize {
        self.axes[0].len() / self.moving.tensors.chirps
    }

    fn open(&mut self) {
        let size = self.axes[0].len();
        self.to_legs = Scratch::new((size * self.moving.geometry.legs()).div_ceil(LANES));
        self.to_legs.fill(ZERO);
        self.to_sweep = Scratch::new(size.div_ceil(LANES));
    }

    #[inline(always)]
    fn put<const FUSED: bool>(&mut self, receiver: usize, local: usize, chirp: usize, gradient: &Return) {
        let Moving { geometry, tensors, .. } = self.moving;
        let (point, width, chirps) = (self.first + local, tensors.chirps - chirp, tensors.chirps);
        let path = self.moving.path::<FUSED>(receiver, point, chirp);
        let spread = |gradient: Lanes| zip(gradient, path.spreading, |g, w| g * w);
        Self::to_amplitude(self.re, tensors.amplitude_chirps, local, chirp, width, spread(gradient.re));
        let mut to_spreading = zip(gradient.re, self.moving.amplitude(tensors.re, point, chirp), |g, a| g * a);
        if let (Some(values), Some(im)) = (&mut self.im, tensors.im) {
            Self::to_amplitude(values, tensors.amplitude_chirps, local, chirp, width, spread(gradient.im));
            to_spreading = fma::<FUSED>(gradient.im, self.moving.amplitude(im, point, chirp), to_spreading);
        }
        // The spreading is 1/(a·b + ε): to either length it falls by its square times the other one.
        let to_product = zip(to_spreading, path.spreading, |g, w| -g * w * w);
        let turns_per_metre = geometry.at_rest[receiver][point].turns_per_metre;
        let common = zip(gradient.phase, gradient.sweep, |phase, sweep| {
            multiply_add::<FUSED>(phase, turns_per_metre, sweep * geometry.sweep_per_metre)
        });
        for (leg, other) in [(0, 1), (receiver + 1, 0)] {
            let to_leg = fma::<FUSED>(to_product, path.lengths_m[other], common);
            accumulate(self.to_legs.as_flattened_mut(), (local * geometry.legs() + leg) * chirps + chirp, width, to_leg);
        }
        store(self.to_sweep.as_flattened_mut(), local * chirps + chirp, width, gradient.sweep);
    }

    #[inline(always)]
    fn close<const FUSED: bool>(&mut self, receiver: usize) {
        let (chirps, legs) = (self.moving.tensors.chirps, self.moving.geometry.legs());
        let per_step = self.moving.geometry.sweep_per_step;
        if per_step != 0.0 && chirps > 1 {
            let rows = self.to_legs.as_flattened_mut().chunks_mut(legs * chirps);
            for (sweep, to_legs) in self.to_sweep.as_flattened().chunks_exact(chirps).zip(rows).take(self.axes[0].len() / chirps)
            {
                for leg in [0, receiver + 1] {
                    add_difference_adjoint(sweep, per_step, &mut to_legs[leg * chirps..][..chirps]);
                }
            }
        }
        if receiver + 1 == self.moving.receivers() {
            self.close_legs::<FUSED>();
        }
    }
}

impl Back<'_> {
    #[inline(always)]
    fn close_legs<const FUSED: bool>(&mut self) {
        let Moving { geometry, tensors, .. } = self.moving;
        let chirps = tensors.chirps;
        let [to_x, to_y, to_z] = &mut self.axes;
        let rows = to_x.chunks_mut(chirps).zip(to_y.chunks_mut(chirps)).zip(to_z.chunks_mut(chirps));
        for ((local, ((to_x, to_y), to_z)), to_legs) in
            rows.enumerate().zip(self.to_legs.as_flattened().chunks(geometry.legs() * chirps))
        {
            let point = self.first + local;
            let [x, y, z] = tensors.axes.map(|axis| &axis[point * chirps..][..chirps]);
            for (leg, to_change) in to_legs.chunks(chirps).enumerate() {
                let v = geometry.offset_m(point, leg);
                let (length, squared) = geometry.length::<FUSED>(point, leg);
                let to = to_x.iter_mut().zip(to_y.iter_mut()).zip(to_z.iter_mut());
                for ((((x, y), z), to_change), ((to_x, to_y), to_z)) in x.iter().zip(y).zip(z).zip(to_change).zip(to) {
                    let growth = growth(v, *x, *y, *z);
                    let whole = (growth + squared).sqrt();
                    let both = 1.0 / (whole + length);
                    // The growth's derivative is 2(v + u), that of growth/(whole + length) to it half of this factor.
                    let factor = to_change * (2.0 * both - growth * both * both / whole);
                    *to_x = multiply_add::<FUSED>(factor, v[0] + x, *to_x);
                    *to_y = multiply_add::<FUSED>(factor, v[1] + y, *to_y);
                    *to_z = multiply_add::<FUSED>(factor, v[2] + z, *to_z);
                }
            }
        }
    }
}

/// to\[k\] += factor · Σ_m g\[m\] · (weight of k in the difference at m).
fn add_difference_adjoint(gradient: &[f32], factor: f32, to: &mut [f32]) {
    let chirps = gradient.len();
    if chirps < 4 {
        for (chirp, &g) in gradient.iter().enumerate() {
            for (from, weight) in difference(chirp, chirps) {
                to[from] += factor * weight as f32 * g;
            }
        }
        return;
    }
    for chirp in [0, chirps - 1] {
        for (from, weight) in difference(chirp, chirps) {
            to[from] += factor * weight as f32 * gradient[chirp];
        }
    }
    // Every chirp but the first and the last has weights −½ and ½ for its neighbours.
    let half = 0.5 * factor;
    for (to, &g) in to[..chirps - 2].iter_mut().zip(&gradient[1..chirps - 1]) {
        *to -= half * g;
    }
    for (to, &g) in to[2..].iter_mut().zip(&gradient[1..chirps - 1]) {
        *to += half * g;
    }
}
