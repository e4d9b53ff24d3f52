//! How the noise is shaped over the beat frequency.

use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Gamma};

use super::Evidence;
use crate::diagnosis::statistics;
use crate::grid::Grid;

/// Neighbouring range bins over which the noise's shape is taken together.
const SHAPE_BINS: usize = 5;
/// Ratio to the mean from which on the noise counts as shaped.
const SHAPED: f64 = 1.3;
/// Share of the cells, the quieter ones, by which a range's noise is told: what moves is in the others.
const QUIETER: f64 = 0.35;

/// The noise's variance in each range bin, over what all of them together gave; `None` where it is flat.
pub(super) fn noise_shape(evidence: &Evidence, maps: &Grid<f32, 3>) -> Option<Vec<f32>> {
    let [_, _, samples] = maps.shape();
    let channels = evidence.cube.channels() as f64;
    let noise = Gamma::new(channels, channels).expect("there are channels");
    let level = |range: usize| {
        let of_frame = |&frame: &usize| evidence.of_noise(range).map(move |doppler| f64::from(maps[[frame, doppler, range]]));
        let mut values: Vec<f64> = evidence.split.training.iter().flat_map(of_frame).collect();
        let index = ((values.len().max(1) - 1) as f64 * QUIETER) as usize;
        // Over what noise of variance one, a mean over the channels, has there.
        let place = (index + 1) as f64 / (values.len() + 1) as f64;
        (!values.is_empty()).then(|| *values.select_nth_unstable_by(index, f64::total_cmp).1 / noise.inverse_cdf(place))
    };
    let levels: Vec<Option<f64>> = (0..samples).into_par_iter().map(level).collect();
    let known = |levels: &[Option<f64>]| levels.iter().flatten().copied().collect::<Vec<f64>>();
    let middle = statistics::median(&mut known(&levels[..evidence.range_bins()])).max(f64::MIN_POSITIVE);
    let smooth: Vec<f64> = (0..samples)
        .map(|range| {
            let near = (0..SHAPE_BINS).map(|i| levels[(range + samples + i - SHAPE_BINS / 2) % samples]);
            let mut near = known(&near.collect::<Vec<_>>());
            // Where nothing is left nothing is known.
            if near.is_empty() { middle } else { statistics::median(&mut near) }
        })
        .collect();
    let is_shaped = smooth[..evidence.range_bins()].iter().any(|level| !(1.0 / SHAPED..SHAPED).contains(&(level / middle)));
    is_shaped.then(|| smooth.into_iter().map(|level| level.max(1e-6) as f32).collect())
}
