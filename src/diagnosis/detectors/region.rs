//! Powers of the range-Doppler maps where something moves, and a region of them to take out of the samples.

use std::sync::{Arc, LazyLock};

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::diagnosis::Evidence;
use crate::diagnosis::evidence::spectrum;
use crate::diagnosis::finding::Correction;
use crate::diagnosis::statistics::median;
use crate::diagnosis::tones::Tones;
pub use crate::diagnosis::tones::{Region, joined};

/// Doppler bins around zero where a Hann window leaves static clutter.
pub const CLUTTER_BINS: usize = 1;

/// Whether a Doppler bin is none of those.
pub fn moves(doppler: usize, loops: usize) -> bool {
    doppler.min(loops - doppler) > CLUTTER_BINS
}

/// Mean of a cell of the maps, `doppler · samples + range`, over some frames.
pub fn mean_power(evidence: &Evidence, frames: &[usize], cell: usize) -> f64 {
    let maps = evidence.maps();
    frames.iter().map(|&frame| f64::from(maps.below([frame])[cell])).sum::<f64>() / frames.len().max(1) as f64
}

/// The same of all cells.
pub fn mean_map(evidence: &Evidence, frames: &[usize]) -> Vec<f64> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    (0..loops * samples).map(|cell| mean_power(evidence, frames, cell)).collect()
}

/// Doppler bins, of so many frames as one, that move at a range and were not taken out.
pub fn left(evidence: &Evidence, range: usize, run: usize) -> impl Iterator<Item = usize> + '_ {
    let loops = run * evidence.cube.dims[3];
    (0..loops).filter(move |&doppler| moves(doppler, loops) && !evidence.is_emptied(doppler / run, range))
}

/// Median of a map, `doppler · samples + range`, of so many frames as one, over what moves at a range and was not taken out, if anything.
pub fn floor(evidence: &Evidence, map: &[f64], range: usize, run: usize) -> Option<f64> {
    let samples = evidence.cube.dims[4];
    let mut left: Vec<f64> = left(evidence, range, run).map(|doppler| map[doppler * samples + range]).collect();
    (!left.is_empty()).then(|| median(&mut left))
}

/// Log-likelihood that a cell's power in a frame, a mean over the channels of exponential laws, gains by an expected mean over noise alone.
pub fn power_gain(evidence: &Evidence, frame: usize, cell: usize, expected: f64) -> f64 {
    let (power, expected) = (f64::from(evidence.maps().below([frame])[cell]), expected.max(1.0));
    evidence.cube.channels() as f64 * (power * (1.0 - 1.0 / expected) - expected.ln())
}

/// Share of its noise without which a cell says nothing of it: 1 dB.
const LOST: f64 = 0.2;
/// How many consecutive frames follow one another without a gap, as blocks of one long frame do.
pub fn run(evidence: &Evidence) -> usize {
    if evidence.split.block_loops.is_none() {
        return 1;
    }
    let loop_s = evidence.radar.loop_period_s();
    let length_s = evidence.cube.dims[3] as f64 * loop_s;
    let gap = |pair: &[f64]| pair[1] - pair[0] - length_s > 0.5 * loop_s;
    let run = 1 + evidence.starts_s.windows(2).take_while(|pair| !gap(pair)).count();
    if evidence.cube.dims[0].is_multiple_of(run) { run } else { 1 }
}

/// Takes a region out of the samples, as they are then.
pub fn removal(evidence: &Evidence, run: usize, region: Region) -> Correction {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let tones = Arc::new(Tones::new([loops, samples], run, region, run as f64 * strongest(evidence, run, region)));
    let of = tones.clone();
    // Not before it is accepted, and then once.
    let held = LazyLock::new(move || held(&of));
    let holds = move |doppler: usize, range: usize| held[0][doppler] * held[1][range] > LOST;
    Correction::Emptied(tones, Arc::new(holds))
}

/// The largest power of a frame's cells in a region of so many frames as one.
fn strongest(evidence: &Evidence, run: usize, region: Region) -> f64 {
    let [frames, _, _, loops, samples] = evidence.cube.dims;
    let bins = |[low, high]: [f64; 2], scale: f64, length: usize| {
        ((low / scale).floor() as i64..=(high / scale).ceil() as i64).map(move |bin| bin.rem_euclid(length as i64) as usize)
    };
    let cells = bins(region.doppler, run as f64, loops)
        .flat_map(|doppler| bins(region.range, 1.0, samples).map(move |range| doppler * samples + range));
    let of_frame = |cell: usize| (0..frames).map(move |frame| f64::from(evidence.maps().below([frame])[cell]));
    cells.flat_map(of_frame).fold(0.0, f64::max)
}

/// Of a Doppler bin and of a range bin of a frame's maps, the share of its noise that lies in a region's tones.
fn held(tones: &Tones) -> [Vec<f64>; 2] {
    let [loops, samples] = tones.shape;
    let doppler = shares(tones.slow(), loops).into_iter().map(|sum| sum / tones.run as f64).collect();
    [doppler, shares(tones.fast(), samples)]
}

/// Of each bin under a Hann window over some samples, the share that lies in a basis; the sum over all stretches of so many.
fn shares(basis: &DMatrix<Complex64>, length: usize) -> Vec<f64> {
    let mut sum = vec![0.0; length];
    for stretch in basis.as_slice().chunks_exact(length) {
        sum.iter_mut().zip(spectrum(stretch)).for_each(|(sum, value)| *sum += value.norm_sqr());
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_that_are_taken_out_have_lost_their_noise_and_others_have_not() {
        for run in [1, 4] {
            let region = Region { range: [10.0, 13.0], doppler: [3.0 * run as f64, 6.0 * run as f64] };
            let [slow, fast] = held(&Tones::new([16, 64], run, region, 1e6));
            assert!(slow[4] > 0.99 && slow[5] > 0.99 && fast[11] > 0.99, "{run}: {slow:?}");
            assert!(slow[12] < 0.05 && fast[30] < 0.05, "{run}: {slow:?}");
        }
    }
}
