//! Directions, and the samples that are looked at from them.

use num_complex::Complex32;

use super::Source;
use crate::error::{Error, Result};
use crate::evaluation::measured_frame;
use crate::heatmap::{Samples, StaticRemoval, remove_static};
use crate::radar::Radar;

/// Refuses what is no angle from straight ahead to the side.
pub fn angle(key: &str, degrees: f64) -> Result<()> {
    if (0.0..=90.0).contains(&degrees) { Ok(()) } else { Err(Error::setting(key, degrees, "0 to 90 degrees")) }
}

/// Refuses a range that is none.
pub fn nearest(key: &str, range_m: Option<f64>) -> Result<()> {
    match range_m.filter(|range| !(range.is_finite() && *range > 0.0)) {
        Some(range) => Err(Error::setting(key, range, "a distance above zero")),
        None => Ok(()),
    }
}

/// Angles, degrees, whose sines are evenly spaced from limit to limit; one alone is straight ahead.
pub fn directions_deg(count: usize, limit_deg: f64) -> Vec<f64> {
    if count == 1 {
        return vec![0.0];
    }
    let limit = limit_deg.to_radians().sin();
    (0..count).map(|index| (limit * (2.0 * index as f64 / (count - 1) as f64 - 1.0)).asin().to_degrees()).collect()
}

/// The unit vector of a direction in the radar frame: azimuth positive to the right, elevation upwards.
pub fn unit(azimuth_deg: f64, elevation_deg: f64) -> [f64; 3] {
    let ((east, ahead), (up, level)) = (azimuth_deg.to_radians().sin_cos(), elevation_deg.to_radians().sin_cos());
    [level * east, level * ahead, up]
}

/// The samples of a frame `[tx, rx, loop, sample]`, without static clutter in it where that is not wanted.
pub fn samples(source: &Source, frame: usize, without_static: bool) -> Result<Vec<Complex32>> {
    let samples = measured_frame(source.recording, frame)?;
    let [_, tx, rx, loops, length] = source.recording.radar.dims();
    Ok(match without_static {
        true => remove_static(Samples::new(&samples, [1, tx, rx, loops, length]), StaticRemoval::Loops),
        false => samples,
    })
}

/// Of positions along an axis of the virtual array, the whole extent, metres.
pub fn aperture_m(radar: &Radar, axis: usize) -> f64 {
    [&radar.tx_m, &radar.rx_m]
        .map(|antennas| {
            let along = || antennas.iter().map(|antenna| antenna[axis]);
            along().fold(f64::MIN, f64::max) - along().fold(f64::MAX, f64::min)
        })
        .iter()
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_even_in_the_sine_and_hold_straight_ahead() {
        let found = directions_deg(5, 90.0);
        for (found, wanted) in found.iter().zip([-90.0, -30.0, 0.0, 30.0, 90.0]) {
            assert!((found - wanted).abs() < 1e-9, "{found} against {wanted}");
        }
        assert_eq!(directions_deg(1, 45.0), [0.0]);
        let [x, y, z] = unit(90.0, 30.0);
        assert!((x - 0.75f64.sqrt()).abs() < 1e-12 && y.abs() < 1e-12 && (z - 0.5).abs() < 1e-12);
    }
}
