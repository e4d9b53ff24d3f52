//! From displaced points to phasors and back, as kernels for GPUs, in f32: the formulas of [`crate::paths`], like those of
//! `fused::moving`.

use burn_cubecl::cubecl;
use cubecl::prelude::*;

use crate::paths::{NEAR_FIELD_M2, SOFTENING_M};

const SOFTENING_M2: f32 = (SOFTENING_M * SOFTENING_M) as f32;
const NEAR_FIELD: f32 = NEAR_FIELD_M2 as f32;

/// Displaced points, as the operations have them.
#[derive(CubeType, CubeLaunch)]
pub struct Displaced {
    /// `[point, chirp]`, metres.
    x: Box<[f32]>,
    y: Box<[f32]>,
    z: Box<[f32]>,
    /// `[point, chirp]` or `[point, 1]`.
    re: Box<[f32]>,
    im: Box<[f32]>,
    /// Offsets and lengths of legs `[leg, point, 4]`, then phase, sweep and turns per metre at rest `[path, point, 3]`, as `Geometry` has
    /// them.
    constants: Box<[f32]>,
    paths: usize,
    points: usize,
    chirps: usize,
    amplitude_chirps: usize,
    sweep_per_metre: f32,
    sweep_per_step: f32,
}

/// What a chirp's central difference takes of another chirp; as [`crate::paths::difference`].
#[cube]
fn weight(of: usize, from: usize, chirps: usize) -> f32 {
    let mut weight = 0.0f32;
    if chirps == 2 {
        weight = f32::cast_from(from) * 2.0f32 - 1.0f32;
    } else if chirps > 2 {
        if of == 0 {
            if from == 0 {
                weight = -1.5f32;
            } else if from == 1 {
                weight = 2.0f32;
            } else if from == 2 {
                weight = -0.5f32;
            }
        } else if of + 1 == chirps {
            if from == of {
                weight = 1.5f32;
            } else if from + 1 == of {
                weight = -2.0f32;
            } else if from + 2 == of {
                weight = 0.5f32;
            }
        } else if from == of + 1 {
            weight = 0.5f32;
        } else if from + 1 == of {
            weight = -0.5f32;
        }
    }
    weight
}

/// A leg from its antenna to a point at rest.
#[derive(CubeType, Clone, Copy)]
struct Leg {
    x: f32,
    y: f32,
    z: f32,
    length: f32,
}

#[cube]
impl Displaced {
    fn leg(&self, leg: usize, point: usize) -> Leg {
        let first = 4 * (leg * self.points + point);
        let constants = &self.constants;
        Leg { x: constants[first], y: constants[first + 1], z: constants[first + 2], length: constants[first + 3] }
    }

    /// Phase, sweep or turns per metre of a path at rest.
    fn at_rest(&self, path: usize, point: usize, which: usize) -> f32 {
        self.constants[4 * (self.paths + 1) * self.points + 3 * (path * self.points + point) + which]
    }

    /// Where a point's amplitude at a chirp is.
    fn amplitude_at(&self, point: usize, chirp: usize) -> usize {
        point * self.amplitude_chirps + chirp % self.amplitude_chirps
    }

    /// |v + u|² − |v|², and |v + u| softened.
    fn grown(&self, leg: &Leg, at: usize) -> (f32, f32) {
        let (x, y, z) = (self.x[at], self.y[at], self.z[at]);
        let growth = x * (x + 2.0f32 * leg.x) + y * (y + 2.0f32 * leg.y) + z * (z + 2.0f32 * leg.z);
        let whole = (growth + (leg.length * leg.length + SOFTENING_M2)).sqrt();
        (growth, whole)
    }

    /// A leg's change with the point's displacement.
    fn change(&self, leg: &Leg, at: usize) -> f32 {
        let (growth, whole) = self.grown(leg, at);
        growth / (whole + leg.length)
    }

    /// The derivative of a leg's change to the displacement is this times (v + u): that of the growth is 2(v + u), that of
    /// growth/(whole + length) to it the half of this.
    fn slope(&self, leg: &Leg, at: usize) -> f32 {
        let (growth, whole) = self.grown(leg, at);
        let both = 1.0f32 / (whole + leg.length);
        2.0f32 * both - growth * both * both / whole
    }
}

/// Phasors `[path, point, chirp]` of displaced points, one per unit.
#[cube(launch_unchecked)]
pub fn phasors(
    given: &Displaced,
    to_re: &mut [f32],
    to_im: &mut [f32],
    to_phase: &mut [f32],
    to_sweep: &mut [f32],
    #[comptime] complex: bool,
) {
    let (points, chirps) = (given.points, given.chirps);
    let at = ABSOLUTE_POS;
    if at >= given.paths * points * chirps {
        terminate!();
    }
    let chirp = at % chirps;
    let point = at / chirps % points;
    let path = at / chirps / points;
    let from_tx = given.leg(0usize, point);
    let to_receiver = given.leg(path + 1, point);
    let first = point * chirps;
    let a = given.change(&from_tx, first + chirp);
    let b = given.change(&to_receiver, first + chirp);
    let change = a + b;
    let spreading = 1.0f32 / ((a + from_tx.length) * (b + to_receiver.length) + NEAR_FIELD);

    let mut sweep = change * given.sweep_per_metre + given.at_rest(path, point, 1usize);
    if given.sweep_per_step != 0.0f32 && chirps > 1 {
        let mut step = 0.0f32;
        let begin = max(chirp, 2usize) - 2;
        let end = min(chirp + 3, chirps);
        for other in begin..end {
            let w = weight(chirp, other, chirps);
            if w != 0.0f32 {
                step += w * (given.change(&from_tx, first + other) + given.change(&to_receiver, first + other));
            }
        }
        sweep += step * given.sweep_per_step;
    }
    let amplitude = given.amplitude_at(point, chirp);
    to_re[at] = given.re[amplitude] * spreading;
    if comptime!(complex) {
        to_im[at] = given.im[amplitude] * spreading;
    }
    to_phase[at] = change * given.at_rest(path, point, 2usize) + given.at_rest(path, point, 0usize);
    to_sweep[at] = sweep;
}

/// The adjoint of [`phasors`], of all paths, one point and chirp per unit. Gradients to amplitudes are `[point, chirp]`, also where
/// the amplitudes are the same at all chirps.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn adjoint(
    given: &Displaced,
    of_re: &[f32],
    of_im: &[f32],
    of_phase: &[f32],
    of_sweep: &[f32],
    to_x: &mut [f32],
    to_y: &mut [f32],
    to_z: &mut [f32],
    to_re: &mut [f32],
    to_im: &mut [f32],
    #[comptime] complex: bool,
) {
    let (points, chirps) = (given.points, given.chirps);
    let at = ABSOLUTE_POS;
    if at >= points * chirps {
        terminate!();
    }
    let chirp = at % chirps;
    let point = at / chirps;
    let amplitude = given.amplitude_at(point, chirp);
    let (dx, dy, dz) = (given.x[at], given.y[at], given.z[at]);
    let from_tx = given.leg(0usize, point);
    let a = from_tx.length + given.change(&from_tx, at);
    let mut sum_x = 0.0f32;
    let mut sum_y = 0.0f32;
    let mut sum_z = 0.0f32;
    let mut sum_re = 0.0f32;
    let mut sum_im = 0.0f32;
    let mut to_first = 0.0f32;
    for path in 0..given.paths {
        let here = (path * points + point) * chirps;
        let to_receiver = given.leg(path + 1, point);
        let b = to_receiver.length + given.change(&to_receiver, at);
        let spreading = 1.0f32 / (a * b + NEAR_FIELD);
        let g_re = of_re[here + chirp];
        sum_re += g_re * spreading;
        let mut to_spreading = g_re * given.re[amplitude];
        if comptime!(complex) {
            let g_im = of_im[here + chirp];
            sum_im += g_im * spreading;
            to_spreading += g_im * given.im[amplitude];
        }
        // The spreading is 1/(a·b + ε): to either length it falls by its square times the other one.
        let to_product = -to_spreading * spreading * spreading;
        let mut common =
            of_phase[here + chirp] * given.at_rest(path, point, 2usize) + of_sweep[here + chirp] * given.sweep_per_metre;
        if given.sweep_per_step != 0.0f32 && chirps > 1 {
            let begin = max(chirp, 2usize) - 2;
            let end = min(chirp + 3, chirps);
            for other in begin..end {
                common += given.sweep_per_step * weight(other, chirp, chirps) * of_sweep[here + other];
            }
        }
        to_first += common + to_product * b;
        let factor = (common + to_product * a) * given.slope(&to_receiver, at);
        sum_x += factor * (to_receiver.x + dx);
        sum_y += factor * (to_receiver.y + dy);
        sum_z += factor * (to_receiver.z + dz);
    }
    let factor = to_first * given.slope(&from_tx, at);
    to_x[at] = sum_x + factor * (from_tx.x + dx);
    to_y[at] = sum_y + factor * (from_tx.y + dy);
    to_z[at] = sum_z + factor * (from_tx.z + dz);
    to_re[at] = sum_re;
    if comptime!(complex) {
        to_im[at] = sum_im;
    }
}
