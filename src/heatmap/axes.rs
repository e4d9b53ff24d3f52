//! What the bins of a transform mean.

use super::Axis;
use crate::radar::{Radar, SPEED_OF_LIGHT, Sampling};

/// Range bins of a chirp: all of them with a quadrature receiver, the positive half of a real-sampled spectrum.
pub fn range_bins(samples: usize, sampling: Sampling) -> usize {
    match sampling {
        Sampling::Complex => samples,
        Sampling::Real => samples.div_ceil(2),
    }
}

/// Range of every bin, metres, from 0.
pub fn range_axis(radar: &Radar) -> Axis {
    let bin_m = radar.sample_rate_hz * SPEED_OF_LIGHT / (2.0 * radar.slope_hz_per_s.abs() * radar.samples_per_chirp as f64);
    let bins = range_bins(radar.samples_per_chirp, radar.sampling);
    Axis::new("range", "m", (0..bins).map(|bin| bin as f64 * bin_m).collect())
}

/// Doppler bin `doppler` of `loops`, in turns per loop, −½ … ½; zero is at `loops / 2`.
pub fn doppler_turns_per_loop(doppler: usize, loops: usize) -> f64 {
    (doppler as f64 - (loops / 2) as f64) / loops as f64
}

/// Radial velocity of every Doppler bin, m/s, positive when receding.
pub fn velocity_axis(radar: &Radar) -> Axis {
    let loops = radar.loops_per_frame;
    let per_turn = radar.wavelength_m() / (2.0 * radar.loop_period_s());
    Axis::new("velocity", "m/s", (0..loops).map(|doppler| doppler_turns_per_loop(doppler, loops) * per_turn).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::heatmap::synthetic;

    #[test]
    fn bins_are_one_range_resolution_apart() {
        let radar = synthetic::radar();
        let axis = range_axis(&radar);
        assert_eq!(axis.len(), radar.samples_per_chirp);
        assert!((axis.values[1] - radar.range_resolution_m()).abs() < 1e-12);
        let real = Radar { sampling: Sampling::Real, samples_per_chirp: 65, ..radar };
        assert_eq!(range_axis(&real).len(), 33);
    }

    #[test]
    fn velocities_are_one_resolution_apart_with_zero_in_the_middle_for_odd_and_even_lengths() {
        for loops in [85, 128] {
            let radar = Radar { loops_per_frame: loops, ..synthetic::radar() };
            let axis = velocity_axis(&radar);
            assert_eq!(axis.values[loops / 2], 0.0);
            assert!((axis.values[loops / 2 + 1] - radar.velocity_resolution_mps()).abs() < 1e-12);
            assert!(axis.values[0] >= -radar.max_velocity_mps() - 1e-12);
        }
    }
}
