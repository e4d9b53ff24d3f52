//! The way back: from gradients to phase, sweep and amplitudes to those of displacements and amplitudes.

use super::{Moving, growth};
use crate::if_signal::fused::kernel::{self, Returns, Sink};
use crate::if_signal::fused::lanes::{LANES, Lanes, ZERO, accumulate, fma, multiply_add, store, zip};
use crate::if_signal::fused::plan::Return;
use crate::if_signal::fused::scratch::Scratch;
use crate::paths::difference;

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
    /// `[point][chirp]`, of the path at hand.
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
    fn put<const FUSED: bool>(&mut self, index: usize, local: usize, chirp: usize, gradient: &Return) {
        let Moving { geometry, tensors, .. } = self.moving;
        let (point, width, chirps) = (self.first + local, tensors.chirps - chirp, tensors.chirps);
        let path = self.moving.path::<FUSED>(index, point, chirp);
        let spread = |gradient: Lanes| zip(gradient, path.spreading, |g, w| g * w);
        Self::to_amplitude(self.re, tensors.amplitude_chirps, local, chirp, width, spread(gradient.re));
        let mut to_spreading = zip(gradient.re, self.moving.amplitude(tensors.re, point, chirp), |g, a| g * a);
        if let (Some(values), Some(im)) = (&mut self.im, tensors.im) {
            Self::to_amplitude(values, tensors.amplitude_chirps, local, chirp, width, spread(gradient.im));
            to_spreading = fma::<FUSED>(gradient.im, self.moving.amplitude(im, point, chirp), to_spreading);
        }
        // The spreading is 1/(a·b + ε): to either length it falls by its square times the other one.
        let to_product = zip(to_spreading, path.spreading, |g, w| -g * w * w);
        let turns_per_metre = geometry.at_rest(index, point).turns_per_metre;
        let common = zip(gradient.phase, gradient.sweep, |phase, sweep| {
            multiply_add::<FUSED>(phase, turns_per_metre, sweep * geometry.sweep_per_metre)
        });
        for (leg, other) in [(0, 1), (index + 1, 0)] {
            let to_leg = fma::<FUSED>(to_product, path.lengths_m[other], common);
            accumulate(self.to_legs.as_flattened_mut(), (local * geometry.legs() + leg) * chirps + chirp, width, to_leg);
        }
        store(self.to_sweep.as_flattened_mut(), local * chirps + chirp, width, gradient.sweep);
    }

    #[inline(always)]
    fn close<const FUSED: bool>(&mut self, path: usize) {
        let (chirps, legs) = (self.moving.tensors.chirps, self.moving.geometry.legs());
        let per_step = self.moving.geometry.sweep_per_step;
        if per_step != 0.0 && chirps > 1 {
            let rows = self.to_legs.as_flattened_mut().chunks_mut(legs * chirps);
            for (sweep, to_legs) in self.to_sweep.as_flattened().chunks_exact(chirps).zip(rows).take(self.axes[0].len() / chirps)
            {
                for leg in [0, path + 1] {
                    add_difference_adjoint(sweep, per_step, &mut to_legs[leg * chirps..][..chirps]);
                }
            }
        }
        if path + 1 == self.moving.paths() {
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
