//! Where in beat frequency the room and the body can be.

use num_complex::Complex64;

use super::{Evidence, spectrum};
use crate::radar::SPEED_OF_LIGHT;

/// Clearance before the nearest and behind the farthest surface: antennas off the reference point, surfaces that are
/// not quite where they are said to be.
const CLEARANCE_M: f64 = 0.3;
/// The same behind the farthest, for a slope that is not quite as stated.
const CLEARANCE_SHARE: f64 = 0.05;
/// The window's main lobe, cells to each side.
const LOBE: usize = 3;
/// Power over that of the noise, from which on there is a static return at a beat frequency: 10 dB, a factor of e^10 in likelihood.
const STATIC_RETURN: f64 = 10.0;

/// Round-trip beat frequency of a range.
pub fn beat_hz(evidence: &Evidence, range_m: f64) -> f64 {
    2.0 * range_m * evidence.radar.slope_hz_per_s / SPEED_OF_LIGHT
}

/// Range, m, of a round-trip beat frequency; [`beat_hz`] the other way round.
pub fn range_m(evidence: &Evidence, beat_hz: f64) -> f64 {
    beat_hz * SPEED_OF_LIGHT / (2.0 * evidence.radar.slope_hz_per_s)
}

/// Ranges of static surfaces: none unless the room is closed in front, on both sides, below and above. A floor that nobody states may be
/// nearer than any wall.
pub fn ranges_m(evidence: &Evidence) -> Option<[f64; 2]> {
    let room = evidence.room.as_ref()?;
    room.front_m.and(room.left_m).and(room.right_m).and(room.floor_m).and(room.ceiling_m)?;
    let nearest = room.boundaries().into_iter().filter_map(|boundary| room.distance_m(boundary)).fold(f64::INFINITY, f64::min);
    let farthest = room.farthest_m()?;
    Some(with_clearance([nearest, farthest]))
}

/// Ranges that static surfaces of some ranges may have.
pub fn with_clearance([nearest, farthest]: [f64; 2]) -> [f64; 2] {
    [(nearest - CLEARANCE_M).max(0.5 * nearest), farthest * (1.0 + CLEARANCE_SHARE) + CLEARANCE_M]
}

/// Beat frequencies, as bins, that hold neither room nor body, of those in which the noise is as it is elsewhere.
pub fn empty_bins(evidence: &Evidence) -> Vec<bool> {
    let (samples, noise_bins) = (evidence.cube.dims[4], evidence.noise_bins());
    match ranges_m(evidence) {
        Some([low, high]) => {
            let bin = |range: f64| beat_hz(evidence, range) / evidence.radar.sample_rate_hz * samples as f64;
            let (low, high) = (bin(low) - LOBE as f64, bin(high) + LOBE as f64);
            (0..samples)
                .map(|bin| {
                    let inside = |bin: f64| (low..=high).contains(&bin);
                    let wrapped = [0.0, samples as f64, -(samples as f64)];
                    noise_bins.contains(&bin) && !wrapped.into_iter().any(|by| inside(bin as f64 + by))
                })
                .collect()
        }
        // Without a room, the negative half and its edges stay clear of near parents only.
        None => (0..samples).map(|_| false).collect(),
    }
}

/// Beat frequencies without static clutter, where nobody says how large the room is: what is there is below the noise of a chirp
/// by as much as all chirps together have less of it.
pub fn quiet_bins(evidence: &Evidence) -> Vec<bool> {
    let [.., loops, samples] = evidence.cube.dims;
    let spectra: Vec<Vec<Complex64>> = evidence.clutter().chunks_exact(samples).map(spectrum).collect();
    let chirps = (loops * evidence.split.training.len()).max(1) as f64;
    let is_quiet = |bin: usize| {
        let power = |(spectrum, noise): (&Vec<Complex64>, &f64)| spectrum[bin].norm_sqr() * chirps / noise.max(f64::MIN_POSITIVE);
        spectra.iter().zip(evidence.noise()).map(power).sum::<f64>() < STATIC_RETURN * spectra.len() as f64
    };
    let quiet: Vec<bool> = (0..samples).map(is_quiet).collect();
    let beside = |bin: usize| (0..=2 * LOBE).all(|step| quiet[(bin + samples + step - LOBE) % samples]);
    let noise_bins = evidence.noise_bins();
    (0..samples).map(|bin| noise_bins.contains(&bin) && beside(bin)).collect()
}
