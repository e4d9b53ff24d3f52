//! Where a moving point appears in a range-Doppler map, and how the windows spread it.

use crate::radar::{Radar, SPEED_OF_LIGHT, Sampling};

/// Cells on either side of a point that its power reaches; beyond, a Hann window is below −48 dB.
const REACH: i64 = 4;
/// Steps within a cell.
const STEPS: usize = 32;

/// The law from range and radial velocity to cells.
#[derive(Clone, Debug)]
pub struct Cells {
    pub loops: usize,
    pub samples: usize,
    /// Beat frequencies that exist: a receiver without quadrature has half of them.
    pub bins: usize,
    /// Range bins per metre of range.
    pub bins_per_m: f64,
    /// Range bins per m/s: the Doppler frequency adds to the beat frequency.
    pub bins_per_mps: f64,
    /// Doppler bins per m/s.
    pub doppler_per_mps: f64,
    /// Power of a tone by its distance in cells, `[step, tap]`, 1 at the centre.
    spread: Vec<[f32; 2 * REACH as usize + 1]>,
}

impl Cells {
    /// The law for a radar's chirps and frames.
    pub fn new(radar: &Radar) -> Self {
        let (loops, samples) = (radar.loops_per_frame, radar.samples_per_chirp);
        let window_s = samples as f64 / radar.sample_rate_hz;
        let doppler_hz_per_mps = 2.0 / radar.wavelength_m();
        let spread = (0..STEPS)
            .map(|step| {
                let centre = step as f64 / STEPS as f64;
                std::array::from_fn(|tap| hann_power((tap as i64 - REACH) as f64 - centre) as f32)
            })
            .collect();
        Self {
            loops,
            samples,
            bins: if radar.sampling == Sampling::Real { samples / 2 } else { samples },
            bins_per_m: radar.slope_hz_per_s * 2.0 / SPEED_OF_LIGHT * window_s,
            bins_per_mps: doppler_hz_per_mps * window_s,
            doppler_per_mps: doppler_hz_per_mps * radar.loop_period_s() * loops as f64,
            spread,
        }
    }

    /// Doppler and range, in cells, not wrapped.
    pub fn place(&self, range_m: f64, velocity_mps: f64) -> (f64, f64) {
        (velocity_mps * self.doppler_per_mps, range_m * self.bins_per_m + velocity_mps * self.bins_per_mps)
    }

    /// Adds a point's power to a map `[doppler, range]`; what lies beyond the unambiguous ends wraps around (in
    /// range only with a quadrature receiver).
    pub fn deposit(&self, map: &mut [f32], range_m: f64, velocity_mps: f64, power: f64) {
        if power.is_finite() {
            self.each(range_m, velocity_mps, |cell, share| map[cell] += power as f32 * share);
        }
    }

    /// The cells that a point reaches, and the share of its power in the peak that it has there.
    pub fn each(&self, range_m: f64, velocity_mps: f64, mut at: impl FnMut(usize, f32)) {
        let (_, range) = self.place(range_m, velocity_mps);
        if !range.is_finite() {
            return;
        }
        let (range, fast) = self.taps(range);
        self.each_doppler(velocity_mps, |doppler, slow| {
            for (j, fast) in fast.iter().enumerate() {
                let cell = (range + j as i64 - REACH).rem_euclid(self.samples as i64) as usize;
                if cell < self.bins {
                    at(doppler * self.samples + cell, slow * fast);
                }
            }
        });
    }

    /// The Doppler cells that a velocity reaches, and the share of the power in the peak that it has there.
    pub fn each_doppler(&self, velocity_mps: f64, mut at: impl FnMut(usize, f32)) {
        let (doppler, _) = self.place(0.0, velocity_mps);
        if doppler.is_finite() {
            let (doppler, slow) = self.taps(doppler);
            slow.iter().enumerate().for_each(|(i, share)| {
                at((doppler + i as i64 - REACH).rem_euclid(self.loops as i64) as usize, *share);
            });
        }
    }

    fn taps(&self, place: f64) -> (i64, &[f32; 2 * REACH as usize + 1]) {
        let step = (place * STEPS as f64).round() as i64;
        (step.div_euclid(STEPS as i64), &self.spread[step.rem_euclid(STEPS as i64) as usize])
    }
}

/// Power of a Hann window's transform so many cells beside its peak, 1 at the peak.
pub fn hann_power(cells: f64) -> f64 {
    let dirichlet = |x: f64| {
        let angle = std::f64::consts::PI * x;
        if angle.abs() < 1e-9 { 1.0 } else { angle.sin() / angle }
    };
    (dirichlet(cells) + 0.5 * (dirichlet(cells - 1.0) + dirichlet(cells + 1.0))).powi(2)
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::diagnosis::evidence::transform;

    #[test]
    fn a_moving_point_appears_where_and_as_wide_as_said() {
        let radar = Radar { samples_per_chirp: 64, loops_per_frame: 32, ..Radar::mmmesh(1) };
        let (range_m, velocity) = (3.21, -1.37);
        let signal: Vec<Complex64> = (0..32 * 64)
            .map(|i| {
                let (time, ramp) = ((i / 64) as f64 * radar.loop_period_s(), (i % 64) as f64 / radar.sample_rate_hz);
                let delay = 2.0 * (range_m + velocity * (time + ramp)) / SPEED_OF_LIGHT;
                Complex64::cis(std::f64::consts::TAU * (radar.carrier_hz() + radar.slope_hz_per_s * ramp) * delay)
            })
            .collect();
        let measured = transform(&signal, 64);
        let cells = Cells::new(&radar);
        // The range at the middle of the frame.
        let middle = range_m + velocity * 0.5 * 32.0 * radar.loop_period_s();
        let mut map = vec![0.0; 32 * 64];
        // The peak of a unit tone: the windows' coherent gains, two thirds of the lengths.
        cells.deposit(&mut map, middle, velocity, 32.0 * 64.0 / 2.25);
        let peak = map.iter().copied().fold(0.0f32, f32::max);
        for (expected, value) in map.iter().zip(&measured).filter(|(expected, _)| **expected > 0.05 * peak) {
            let ratio = f64::from(*expected) / value.norm_sqr();
            assert!((0.75..1.33).contains(&ratio), "{expected} against {}", value.norm_sqr());
        }
        let energy: f64 = measured.iter().map(|value| value.norm_sqr()).sum();
        assert!((f64::from(map.iter().sum::<f32>()) / energy - 1.0).abs() < 0.02);
    }

    #[test]
    fn a_hann_window_is_four_cells_wide() {
        assert!((hann_power(0.0) - 1.0).abs() < 1e-12);
        assert!((hann_power(1.0) - 0.25).abs() < 1e-12);
        assert!(hann_power(2.0) < 1e-20);
        assert!(hann_power(2.4) < 10f64.powf(-3.1) && hann_power(4.5) < 2e-5);
    }
}
