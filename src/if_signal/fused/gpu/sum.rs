//! The coherent sum of phasors, and its adjoint, as kernels for GPUs, in f32.
//!
//! Every return is taken at every sample: exp(j2π(phase + sweep s_n)) by a sine at a unit's first sample and a rotation from sample to
//! sample. A GPU does these products faster than it could share a range grid's cells among its units. No unit adds to what another
//! writes, so that equal inputs give equal sums.

use std::f32::consts::TAU;

use burn_cubecl::cubecl;
use cubecl::prelude::*;

/// Chirps that a cube of units works on, and lanes per chirp: 256 units, the most that WebGPU's default limits allow
/// (`maxComputeInvocationsPerWorkgroup`).
pub const CHIRPS: usize = 8;
pub const LANES: usize = 32;
pub const UNITS: usize = CHIRPS * LANES;
/// Samples of a unit in the sum, `LANES` apart.
const STRIPES: usize = 8;
/// Samples of a chirp that a cube sums.
pub const BLOCK: usize = STRIPES * LANES;
/// A row of the tile: one more than its lanes, so that neither rows nor columns share a memory bank.
const ROW: usize = LANES + 1;
const TILE: usize = CHIRPS * ROW;

/// Turns without their whole part, which f32 subtracts exactly.
#[cube]
fn fraction(turns: f32) -> f32 {
    turns - (turns + 0.5f32).floor()
}

/// exp(j2π turns).
#[cube]
fn unit(turns: f32) -> (f32, f32) {
    let angle = fraction(turns) * TAU;
    (angle.cos(), angle.sin())
}

/// Parts of the sums, `[chunk, 2, output, chirp, sample]`, of phasors `[path, point, chirp]`. `outputs`: path, first point and the point
/// after the last, `[output, 3]`.
///
/// Cubes: blocks of chirps, outputs, chunks of points times blocks of samples.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn add_up(
    re: &[f32],
    im: &[f32],
    phase: &[f32],
    sweep: &[f32],
    outputs: &[u32],
    out: &mut [f32],
    count_outputs: usize,
    points: usize,
    chirps: usize,
    samples: usize,
    per_chunk: usize,
    #[comptime] complex: bool,
) {
    let at = UNIT_POS_X as usize;
    let first_chirp = CUBE_POS_X as usize * CHIRPS;
    let output = CUBE_POS_Y as usize;
    let path = outputs[3 * output] as usize;
    let blocks = samples.div_ceil(BLOCK);
    let chunk = CUBE_POS_Z as usize / blocks;
    let block = CUBE_POS_Z as usize % blocks;

    // While summing, units of one chirp are neighbours; while loading, those of one point.
    let row = at / LANES;
    let first_sample = block * BLOCK + at % LANES;
    let count = f32::cast_from(samples);
    let window = (f32::cast_from(first_sample) - 0.5f32 * count) / count;
    let apart = 32.0f32 / count;
    let load_row = at % CHIRPS;
    let load_point = at / CHIRPS;
    let load_chirp = first_chirp + load_row;
    let place = load_row * ROW + load_point;

    let mut tile_re = Shared::<[f32]>::new_slice(TILE);
    let mut tile_im = Shared::<[f32]>::new_slice(TILE);
    let mut tile_phase = Shared::<[f32]>::new_slice(TILE);
    let mut tile_sweep = Shared::<[f32]>::new_slice(TILE);
    let mut tile_cos = Shared::<[f32]>::new_slice(TILE);
    let mut tile_sin = Shared::<[f32]>::new_slice(TILE);
    let mut sum_re = Array::<f32>::new(STRIPES);
    let mut sum_im = Array::<f32>::new(STRIPES);
    #[unroll]
    for stripe in 0..STRIPES {
        sum_re[stripe] = 0.0f32;
        sum_im[stripe] = 0.0f32;
    }

    let start = outputs[3 * output + 1] as usize + chunk * per_chunk;
    let end = min(start + per_chunk, outputs[3 * output + 2] as usize);
    let mut tile = start;
    while tile < end {
        let point = tile + load_point;
        let mut r = 0.0f32;
        let mut i = 0.0f32;
        let mut p = 0.0f32;
        let mut v = 0.0f32;
        if point < end && load_chirp < chirps {
            let from = (path * points + point) * chirps + load_chirp;
            r = re[from];
            if comptime!(complex) {
                i = im[from];
            }
            p = fraction(phase[from]);
            v = sweep[from];
        }
        let (c, s) = unit(v * apart);
        tile_re[place] = r;
        tile_im[place] = i;
        tile_phase[place] = p;
        tile_sweep[place] = v;
        tile_cos[place] = c;
        tile_sin[place] = s;
        sync_cube();
        let here = min(end - tile, LANES);
        for local in 0..here {
            let from = row * ROW + local;
            let (c, s) = unit(tile_phase[from] + tile_sweep[from] * window);
            let (a, b) = (tile_re[from], tile_im[from]);
            let mut z_re = a * c - b * s;
            let mut z_im = a * s + b * c;
            let (turn_re, turn_im) = (tile_cos[from], tile_sin[from]);
            #[unroll]
            for stripe in 0..STRIPES {
                sum_re[stripe] += z_re;
                sum_im[stripe] += z_im;
                let next = z_re * turn_re - z_im * turn_im;
                z_im = z_re * turn_im + z_im * turn_re;
                z_re = next;
            }
        }
        sync_cube();
        tile += LANES;
    }

    let chirp = first_chirp + row;
    if chirp < chirps {
        let whole = count_outputs * chirps * samples;
        let to = chunk * 2 * whole + (output * chirps + chirp) * samples;
        #[unroll]
        for stripe in 0..STRIPES {
            let sample = first_sample + stripe * LANES;
            if sample < samples {
                out[to + sample] = sum_re[stripe];
                out[to + whole + sample] = sum_im[stripe];
            }
        }
    }
}

/// Gradients to phasors `[path, point, chirp]`, from that to the samples, `[2, output, chirp, sample]`; those of points in no sum are left
/// as they are.
///
/// Cubes: blocks of chirps, outputs, blocks of points.
#[cube(launch_unchecked)]
#[allow(clippy::too_many_arguments)]
pub fn gradients(
    re: &[f32],
    im: &[f32],
    phase: &[f32],
    sweep: &[f32],
    upstream: &[f32],
    outputs: &[u32],
    to_re: &mut [f32],
    to_im: &mut [f32],
    to_phase: &mut [f32],
    to_sweep: &mut [f32],
    count_outputs: usize,
    points: usize,
    chirps: usize,
    samples: usize,
    #[comptime] complex: bool,
) {
    let at = UNIT_POS_X as usize;
    let row = at % CHIRPS;
    let first_chirp = CUBE_POS_X as usize * CHIRPS;
    let chirp = first_chirp + row;
    let output = CUBE_POS_Y as usize;
    let path = outputs[3 * output] as usize;
    let point = outputs[3 * output + 1] as usize + CUBE_POS_Z as usize * LANES + at / CHIRPS;
    let inside = point < outputs[3 * output + 2] as usize && chirp < chirps;
    let from = (path * points + point) * chirps + chirp;
    let whole = count_outputs * chirps * samples;
    // Of the sample that this unit loads.
    let load_row = at / LANES;
    let load_lane = at % LANES;
    let load_from = (output * chirps + first_chirp + load_row) * samples;

    let mut p = 0.0f32;
    let mut v = 0.0f32;
    if inside {
        p = fraction(phase[from]);
        v = sweep[from];
    }
    let count = f32::cast_from(samples);
    let (turn_re, turn_im) = unit(v / count);
    let mut up_re = Shared::<[f32]>::new_slice(TILE);
    let mut up_im = Shared::<[f32]>::new_slice(TILE);
    // Σ G conj(e), and the same weighted with s.
    let mut plain_re = 0.0f32;
    let mut plain_im = 0.0f32;
    let mut along_re = 0.0f32;
    let mut along_im = 0.0f32;
    let mut first = 0usize;
    while first < samples {
        let sample = first + load_lane;
        let mut r = 0.0f32;
        let mut i = 0.0f32;
        if sample < samples && first_chirp + load_row < chirps {
            r = upstream[load_from + sample];
            i = upstream[whole + load_from + sample];
        }
        up_re[load_row * ROW + load_lane] = r;
        up_im[load_row * ROW + load_lane] = i;
        sync_cube();
        let mut s = (f32::cast_from(first) - 0.5f32 * count) / count;
        let (e_re, e_im) = unit(p + v * s);
        let mut e_re = e_re;
        let mut e_im = e_im;
        for local in 0..LANES {
            let g_re = up_re[row * ROW + local];
            let g_im = up_im[row * ROW + local];
            let t_re = g_re * e_re + g_im * e_im;
            let t_im = g_im * e_re - g_re * e_im;
            plain_re += t_re;
            plain_im += t_im;
            along_re += s * t_re;
            along_im += s * t_im;
            let next = e_re * turn_re - e_im * turn_im;
            e_im = e_re * turn_im + e_im * turn_re;
            e_re = next;
            s += 1.0f32 / count;
        }
        sync_cube();
        first += LANES;
    }
    if inside {
        let a = re[from];
        to_re[from] = plain_re;
        let mut turned = a * plain_im;
        let mut turned_along = a * along_im;
        if comptime!(complex) {
            let b = im[from];
            to_im[from] = plain_im;
            turned -= b * plain_re;
            turned_along -= b * along_re;
        }
        to_phase[from] = turned * TAU;
        to_sweep[from] = turned_along * TAU;
    }
}
