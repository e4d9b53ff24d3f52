//! Static clutter, and what moves, against the noise.

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

/// Energy of what moves over all samples: what the maps' cells hold beyond the noise.
pub fn energy_beyond_noise(evidence: &Evidence) -> f64 {
    let beyond: f64 = evidence.maps().values().iter().map(|&power| f64::from(power - 1.0).max(0.0)).sum();
    beyond * evidence.total_noise()
}
