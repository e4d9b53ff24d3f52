//! From displaced points to phasors and back, as kernels for GPUs, in f32: the formulas of [`crate::paths`], like those of
//! `fused::moving`.

use burn_cubecl::cubecl;
use cubecl::prelude::*;

/// Where a leg begins in the row of a geometry: offset and length `[leg, point, 4]`, then phase, sweep and turns per metre at rest
/// `[path, point, 3]`; as `Geometry` has them.
#[cube]
fn leg_at(leg: usize, point: usize, points: usize) -> usize {
    4 * (leg * points + point)
}

#[cube]
fn at_rest_at(path: usize, which: usize, point: usize, points: usize, legs: usize) -> usize {
    4 * legs * points + 3 * (path * points + point) + which
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

/// A leg from its antenna to a point.
#[derive(CubeType, Clone, Copy)]
struct Leg {
    /// From the antenna to the point at rest.
    x: f32,
    y: f32,
    z: f32,
    /// At rest.
    length: f32,
}

#[cube]
fn leg_of(constants: &[f32], leg: usize, point: usize, points: usize) -> Leg {
    let first = leg_at(leg, point, points);
    Leg { x: constants[first], y: constants[first + 1], z: constants[first + 2], length: constants[first + 3] }
}

/// |v + u|² − |v|², and |v + u| softened.
#[cube]
fn grown(leg: &Leg, x: f32, y: f32, z: f32, softening: f32) -> (f32, f32) {
    let growth = x * (x + 2.0f32 * leg.x) + y * (y + 2.0f32 * leg.y) + z * (z + 2.0f32 * leg.z);
    let whole = (growth + (leg.length * leg.length + softening)).sqrt();
    (growth, whole)
}

/// The leg's change with the point's displacement.
#[cube]
fn change_of(leg: &Leg, x: f32, y: f32, z: f32, softening: f32) -> f32 {
    let (growth, whole) = grown(leg, x, y, z, softening);
    growth / (whole + leg.length)
}

/// Displacements `[point, chirp]` and amplitudes `[point, chirp]` or `[point, 1]` → phasors `[path, point, chirp]`, one per unit.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn phasors(
    x: &[f32],
    y: &[f32],
    z: &[f32],
    re: &[f32],
    im: &[f32],
    constants: &[f32],
    to_re: &mut [f32],
    to_im: &mut [f32],
    to_phase: &mut [f32],
    to_sweep: &mut [f32],
    paths: u32,
    points: u32,
    chirps: u32,
    amplitude_chirps: u32,
    sweep_per_metre: f32,
    sweep_per_step: f32,
    softening: f32,
    near_field: f32,
    #[comptime] complex: bool,
) {
    let paths = paths as usize;
    let points = points as usize;
    let chirps = chirps as usize;
    let at = ABSOLUTE_POS;
    if at >= paths * points * chirps {
        terminate!();
    }
    let chirp = at % chirps;
    let point = at / chirps % points;
    let path = at / chirps / points;
    let legs = paths + 1;
    let from_tx = leg_of(constants, 0usize, point, points);
    let to_receiver = leg_of(constants, path + 1, point, points);
    let first = point * chirps;
    let (dx, dy, dz) = (x[first + chirp], y[first + chirp], z[first + chirp]);
    let a = change_of(&from_tx, dx, dy, dz, softening);
    let b = change_of(&to_receiver, dx, dy, dz, softening);
    let change = a + b;
    let spreading = 1.0f32 / ((a + from_tx.length) * (b + to_receiver.length) + near_field);

    let mut sweep = change * sweep_per_metre + constants[at_rest_at(path, 1usize, point, points, legs)];
    if sweep_per_step != 0.0f32 && chirps > 1 {
        let mut step = 0.0f32;
        let begin = max(chirp, 2usize) - 2;
        let end = min(chirp + 3, chirps);
        for other in begin..end {
            let w = weight(chirp, other, chirps);
            if w != 0.0f32 {
                let (dx, dy, dz) = (x[first + other], y[first + other], z[first + other]);
                step += w * (change_of(&from_tx, dx, dy, dz, softening) + change_of(&to_receiver, dx, dy, dz, softening));
            }
        }
        sweep += step * sweep_per_step;
    }
    let amplitude_chirps = amplitude_chirps as usize;
    let amplitude = point * amplitude_chirps + chirp % amplitude_chirps;
    to_re[at] = re[amplitude] * spreading;
    if comptime!(complex) {
        to_im[at] = im[amplitude] * spreading;
    }
    to_phase[at] = change * constants[at_rest_at(path, 2usize, point, points, legs)]
        + constants[at_rest_at(path, 0usize, point, points, legs)];
    to_sweep[at] = sweep;
}

/// The adjoint of [`phasors`], of all paths, one point and chirp per unit. Gradients to amplitudes are `[point, chirp]`, also where
/// the amplitudes are the same at all chirps.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn adjoint(
    x: &[f32],
    y: &[f32],
    z: &[f32],
    re: &[f32],
    im: &[f32],
    constants: &[f32],
    of_re: &[f32],
    of_im: &[f32],
    of_phase: &[f32],
    of_sweep: &[f32],
    to_x: &mut [f32],
    to_y: &mut [f32],
    to_z: &mut [f32],
    to_re: &mut [f32],
    to_im: &mut [f32],
    paths: u32,
    points: u32,
    chirps: u32,
    amplitude_chirps: u32,
    sweep_per_metre: f32,
    sweep_per_step: f32,
    softening: f32,
    near_field: f32,
    #[comptime] complex: bool,
) {
    let paths = paths as usize;
    let points = points as usize;
    let chirps = chirps as usize;
    let at = ABSOLUTE_POS;
    if at >= points * chirps {
        terminate!();
    }
    let chirp = at % chirps;
    let point = at / chirps;
    let legs = paths + 1;
    let amplitude_chirps = amplitude_chirps as usize;
    let amplitude = point * amplitude_chirps + chirp % amplitude_chirps;
    let (dx, dy, dz) = (x[at], y[at], z[at]);
    let from_tx = leg_of(constants, 0usize, point, points);
    let a = from_tx.length + change_of(&from_tx, dx, dy, dz, softening);
    let mut sum_x = 0.0f32;
    let mut sum_y = 0.0f32;
    let mut sum_z = 0.0f32;
    let mut sum_re = 0.0f32;
    let mut sum_im = 0.0f32;
    let mut to_first = 0.0f32;
    for path in 0..paths {
        let here = (path * points + point) * chirps;
        let to_receiver = leg_of(constants, path + 1, point, points);
        let b = to_receiver.length + change_of(&to_receiver, dx, dy, dz, softening);
        let spreading = 1.0f32 / (a * b + near_field);
        let g_re = of_re[here + chirp];
        sum_re += g_re * spreading;
        let mut to_spreading = g_re * re[amplitude];
        if comptime!(complex) {
            let g_im = of_im[here + chirp];
            sum_im += g_im * spreading;
            to_spreading += g_im * im[amplitude];
        }
        // The spreading is 1/(a·b + ε): to either length it falls by its square times the other one.
        let to_product = -to_spreading * spreading * spreading;
        let mut common = of_phase[here + chirp] * constants[at_rest_at(path, 2usize, point, points, legs)]
            + of_sweep[here + chirp] * sweep_per_metre;
        if sweep_per_step != 0.0f32 && chirps > 1 {
            let begin = max(chirp, 2usize) - 2;
            let end = min(chirp + 3, chirps);
            for other in begin..end {
                common += sweep_per_step * weight(other, chirp, chirps) * of_sweep[here + other];
            }
        }
        to_first += common + to_product * b;
        let factor = (common + to_product * a) * slope(&to_receiver, dx, dy, dz, softening);
        sum_x += factor * (to_receiver.x + dx);
        sum_y += factor * (to_receiver.y + dy);
        sum_z += factor * (to_receiver.z + dz);
    }
    let factor = to_first * slope(&from_tx, dx, dy, dz, softening);
    to_x[at] = sum_x + factor * (from_tx.x + dx);
    to_y[at] = sum_y + factor * (from_tx.y + dy);
    to_z[at] = sum_z + factor * (from_tx.z + dz);
    to_re[at] = sum_re;
    if comptime!(complex) {
        to_im[at] = sum_im;
    }
}

/// The derivative of a leg's change to the displacement is this times (v + u): that of the growth is 2(v + u), that of
/// growth/(whole + length) to it the half of this.
#[cube]
fn slope(leg: &Leg, x: f32, y: f32, z: f32, softening: f32) -> f32 {
    let (growth, whole) = grown(leg, x, y, z, softening);
    let both = 1.0f32 / (whole + leg.length);
    2.0f32 * both - growth * both * both / whole
}
