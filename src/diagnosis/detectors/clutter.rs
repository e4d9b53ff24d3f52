//! Static clutter, and what moves, against the noise.

use num_complex::Complex64;
use rayon::prelude::*;

use crate::diagnosis::Cube;
use crate::diagnosis::cube::mean_chirp;
use crate::diagnosis::evidence::{Evidence, transform};

/// Power of static clutter over the noise of one frame's map, by range, mean over channels.
pub fn clutter_power(evidence: &Evidence) -> Vec<f64> {
    let samples = evidence.cube.dims[4];
    let count = evidence.cube.channels() as f64;
    let mut power = vec![0.0; samples];
    for (channel, clutter) in evidence.clutter().chunks_exact(samples).enumerate() {
        // One loop: a window of unit energy is one, so that the Doppler transform does nothing.
        let spectrum = transform(clutter, samples);
        let noise = evidence.noise()[channel].max(f64::MIN_POSITIVE);
        power.iter_mut().zip(spectrum).for_each(|(sum, value)| *sum += value.norm_sqr() / (noise * count));
    }
    let gain = evidence.cube.dims[3] as f64 / 1.5;
    power.iter().map(|power| power * gain).collect()
}

/// How much less likely frames are with one static clutter for all than with one each, noise included, nats: squares of what their mean
/// chirps deviate by from that of all, over the noise.
/// `noise`: variance of a sample, by channel.
pub fn unsteadiness(cube: &Cube, noise: &[f64]) -> f64 {
    let [frames, _, _, loops, samples] = cube.dims;
    let each: Vec<Vec<Complex64>> = (0..frames).into_par_iter().map(|frame| cube.clutter(&[frame])).collect();
    let clutter = mean_chirp(each.iter().map(Vec::as_slice), cube.channels() * samples);
    let of_frame = |own: &Vec<Complex64>| {
        let channels = own.chunks_exact(samples).zip(clutter.chunks_exact(samples)).zip(noise);
        channels
            .map(|((own, all), noise)| {
                own.iter().zip(all).map(|(own, all)| (own - all).norm_sqr()).sum::<f64>() / noise.max(f64::MIN_POSITIVE)
            })
            .sum::<f64>()
    };
    loops as f64 * each.iter().map(of_frame).sum::<f64>()
}

/// Energy of what moves over all samples: what the maps' cells hold beyond the noise.
pub fn energy_beyond_noise(evidence: &Evidence) -> f64 {
    let beyond: f64 = evidence.maps().values().iter().map(|&power| f64::from(power - 1.0).max(0.0)).sum();
    beyond * evidence.total_noise()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::radar::Radar;

    #[test]
    fn clutter_that_turns_from_frame_to_frame_is_unsteady_by_its_power() {
        let radar = Radar { samples_per_chirp: 32, loops_per_frame: 8, ..Radar::small(12) };
        let of = |turn: f64| {
            let evidence = Evidence::in_noise(radar.clone(), 1, |[frame, _, _, n]| {
                Complex64::from_polar(3.0, TAU * 0.1 * n as f64 + turn * (frame as f64 - 5.5))
            });
            unsteadiness(&evidence.cube, &vec![2.0; evidence.cube.channels()])
        };
        // 11 frames' worth of noise by sample, of each channel, and of a turn its square times the power of the clutter.
        let cells = (radar.tx_m.len() * radar.rx_m.len() * 32) as f64;
        let still = of(0.0);
        assert!((still / (11.0 * cells) - 1.0).abs() < 0.2, "{still} of {}", 11.0 * cells);
        let squares: f64 = (0..12).map(|frame| (0.02 * (f64::from(frame) - 5.5)).powi(2)).sum();
        // Nine of power over noise of two, in eight loops.
        let (turning, expected) = (of(0.02) - still, squares * 4.5 * 8.0 * cells);
        assert!((turning / expected - 1.0).abs() < 0.2, "{turning} of {expected}");
    }
}
