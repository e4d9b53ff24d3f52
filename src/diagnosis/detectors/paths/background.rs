//! Power that is expected in free cells without any further path: noise, and what imperfections of the signal chain smear.

use rayon::prelude::*;

use crate::diagnosis::Evidence;
use crate::diagnosis::power::PowerModel;
use crate::diagnosis::statistics::median;
use crate::grid::Grid;

/// Noise, raised where a whole range or a whole Doppler is louder than noise, or clutter has sidebands: imperfections of
/// the signal chain do that, and a path does not. One frame, `[doppler, range]`; `clutter`: by range.
pub fn floor(map: &[f32], taken: &[bool], clutter: &[f64]) -> Vec<f32> {
    /// A median below this many times the noise is noise.
    const LOUD: f64 = 1.35;
    let (loops, samples) = (map.len() / clutter.len(), clutter.len());
    let raised = |values: &mut Vec<f64>| if values.len() < 8 { 1.0 } else { median(values) };
    let level = |median: f64| if median > LOUD { 2.0 * median } else { 1.0 };
    let mut base = vec![1.0f64; map.len()];
    for doppler in 0..loops {
        let cells = || (0..samples).filter(|range| !taken[doppler * samples + range]);
        let mut row: Vec<f64> = cells().map(|range| f64::from(map[doppler * samples + range])).collect();
        let row = level(raised(&mut row));
        let mut smear: Vec<f64> = cells()
            .filter(|&range| clutter[range] > 100.0)
            .map(|range| (f64::from(map[doppler * samples + range]) - 1.5).max(0.0) / clutter[range])
            .collect();
        let smear = if smear.len() < 8 { 0.0 } else { 3.0 * median(&mut smear) };
        for range in 0..samples {
            base[doppler * samples + range] = row.max(1.0 + smear * clutter[range]);
        }
    }
    for range in 0..samples {
        let mut column: Vec<f64> = (0..loops)
            .map(|doppler| doppler * samples + range)
            .filter(|&cell| !taken[cell])
            .map(|cell| f64::from(map[cell]))
            .collect();
        let column = level(raised(&mut column));
        for doppler in 0..loops {
            let cell = doppler * samples + range;
            base[cell] = base[cell].max(column);
        }
    }
    base.iter().map(|&value| value as f32).collect()
}

/// The noise's level in each range bin over that of the others, from the quieter of the free cells: where a filter that
/// was undone ends abruptly, neighbouring bins are not informative.
pub fn noise_levels(evidence: &Evidence, taken: &Grid<bool, 3>) -> Vec<f64> {
    const FEWEST_CELLS: usize = 48;
    let (maps, bins) = (evidence.maps(), evidence.range_bins());
    let [_, loops, samples] = maps.shape();
    let quiet = |range: usize| {
        let frames = evidence.split.training.iter();
        let cells = frames.flat_map(|&frame| (0..loops).map(move |doppler| [frame, doppler, range]));
        let mut powers: Vec<f64> = cells.filter(|&cell| !taken[cell]).map(|cell| f64::from(maps[cell])).collect();
        let index = powers.len() * 35 / 100;
        (powers.len() >= FEWEST_CELLS).then(|| *powers.select_nth_unstable_by(index, f64::total_cmp).1)
    };
    let quiet: Vec<Option<f64>> =
        (0..samples).into_par_iter().map(|range| if range < bins { quiet(range) } else { None }).collect();
    let usual = median(&mut quiet.iter().copied().flatten().collect::<Vec<_>>()).max(f64::MIN_POSITIVE);
    quiet.iter().map(|level| level.map_or(1.0, |level| level / usual)).collect()
}

/// Raises what is expected at ranges that show a share of whatever the body returns at the same Doppler, in most of the cells
/// where that is strongest. An undone filter ends abruptly where it would amplify too much; there a window's sidelobes no
/// longer cancel.
pub fn raise_for_leakage(base: &mut Grid<f32, 3>, maps: &Grid<f32, 3>, taken: &Grid<bool, 3>, model: &PowerModel) {
    const STRONG: f64 = 0.03;
    const FEWEST_CELLS: usize = 12;
    let [frames, loops, samples] = maps.shape();
    let body = Grid::from_fn(["frame", "doppler"], [frames, loops], |[frame, doppler]| {
        let support = &model.support(frame)[doppler * samples..][..samples];
        let powers = maps.below([frame, doppler]);
        support.iter().zip(powers).filter(|(support, _)| **support).map(|(_, &power)| f64::from(power)).sum::<f64>()
    });
    let strong = (STRONG * body.values().iter().copied().fold(0.0, f64::max)).max(100.0);
    let share = |range: usize| {
        let cells = (0..frames).flat_map(|frame| (0..loops).map(move |doppler| (frame, doppler)));
        let cells = cells.filter(|&(frame, doppler)| body[[frame, doppler]] > strong && !taken[[frame, doppler, range]]);
        let above =
            |(frame, doppler): (usize, usize)| (f64::from(maps[[frame, doppler, range]]) - 1.5).max(0.0) / body[[frame, doppler]];
        let mut shares: Vec<f64> = cells.map(above).collect();
        // The upper quartile, for what leaks is speckle.
        let index = shares.len() * 3 / 4;
        if shares.len() < FEWEST_CELLS { 0.0 } else { *shares.select_nth_unstable_by(index, f64::total_cmp).1 }
    };
    let shares: Vec<f64> = (0..samples).into_par_iter().map(share).collect();
    base.values_mut().par_chunks_exact_mut(samples).zip(body.values()).for_each(|(row, body)| {
        row.iter_mut().zip(&shares).for_each(|(base, share)| *base = base.max((1.0 + 3.0 * share * body) as f32));
    });
}

/// What [`Evidence::maps`] divides a range bin's powers by besides the noise's variance.
pub fn shape(evidence: &Evidence) -> Vec<f64> {
    let samples = evidence.cube.dims[4];
    let count = evidence.cube.channels() as f64;
    let mut power = vec![0.0; samples];
    for (channel, noise) in evidence.noise().iter().enumerate() {
        let map = evidence.range_doppler(0, channel);
        let weight = 1.0 / (noise.max(f64::MIN_POSITIVE) * count);
        for (cell, value) in map.iter().enumerate() {
            power[cell % samples] += value.norm_sqr() * weight;
        }
    }
    let mut flat = vec![0.0f64; samples];
    let first = evidence.maps().below([0]);
    first.iter().enumerate().for_each(|(cell, &value)| flat[cell % samples] += f64::from(value));
    power.iter().zip(flat).map(|(power, flat)| if flat > 0.0 && *power > 0.0 { power / flat } else { 1.0 }).collect()
}
