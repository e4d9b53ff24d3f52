//! A sinusoidal radial motion through sightings: mean range, excursion and rate.

use nalgebra::{Cholesky, Matrix3, U3, Vector3};

use super::track::Sighting;

/// Highest rate that is tried; faster ones blur within a frame.
const FASTEST_HZ: f64 = 8.0;
/// Least pivot of normal equations over the first: what has less is not determined.
const LEAST_PIVOT: f64 = 1e-12;

/// range(t) = mean + sine · sin(ω t) + cosine · cos(ω t).
#[derive(Clone, Copy, Debug)]
pub struct Oscillation {
    pub mean_m: f64,
    pub sine_m: f64,
    pub cosine_m: f64,
    pub rate_hz: f64,
    /// Share of the velocities' variance that the motion leaves.
    pub left: f64,
    /// Standard deviations of mean, excursion and rate.
    pub deviations: [f64; 3],
}

/// Mean, sine, cosine (metres), rate (Hz).
pub type Law = [f64; 4];

/// Range and velocity.
pub fn at([mean_m, sine_m, cosine_m, rate_hz]: Law, time_s: f64) -> (f64, f64) {
    let omega = std::f64::consts::TAU * rate_hz;
    let (sine, cosine) = (omega * time_s).sin_cos();
    (mean_m + sine_m * sine + cosine_m * cosine, omega * (sine_m * cosine - cosine_m * sine))
}

impl Oscillation {
    pub fn excursion_m(&self) -> f64 {
        self.sine_m.hypot(self.cosine_m)
    }

    /// Range and velocity.
    pub fn at(&self, time_s: f64) -> (f64, f64) {
        at([self.mean_m, self.sine_m, self.cosine_m, self.rate_hz], time_s)
    }

    /// Least squares on ranges and velocities with their errors; velocities wrap around `span_mps` (twice the greatest
    /// unambiguous one). None with too few sightings, or where the motion is not sinusoidal.
    pub fn fit(sightings: &[Sighting], times_s: &[f64], errors: [f64; 2], span_mps: f64) -> Option<Self> {
        if sightings.len() < 8 {
            return None;
        }
        let length_s = times_s.last()? - times_s.first()?;
        let step = 0.1 / length_s.max(1e-3);
        let tried = (FASTEST_HZ / step) as usize;
        let slowest = (0.4 / length_s / step) as usize;
        let (mut rate, _) = (slowest.max(1)..tried)
            .map(|i| i as f64 * step)
            .map(|rate| (rate, misfit(sightings, times_s, errors, span_mps, rate).1))
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        for fine in [step * 0.1, step * 0.01] {
            let around = rate;
            rate = (-10..=10).map(|i| around + f64::from(i) * fine).filter(|rate| *rate > 0.0).min_by(|&a, &b| {
                let of = |rate| misfit(sightings, times_s, errors, span_mps, rate).1;
                of(a).total_cmp(&of(b))
            })?;
        }
        let ([mean_m, sine_m, cosine_m], chi2) = misfit(sightings, times_s, errors, span_mps, rate);
        let without_motion = sightings.iter().map(|s| (s.velocity_mps / errors[1]).powi(2)).sum::<f64>();
        let freedom = (2 * sightings.len()).saturating_sub(4).max(1) as f64;
        // Errors as large as they turn out to be.
        let scale = (chi2 / freedom).max(1.0).sqrt();
        let count = sightings.len() as f64;
        let excursion = sine_m.hypot(cosine_m).max(1e-6);
        let omega = std::f64::consts::TAU * rate;
        let excursion_error = scale / (0.5 * count * (errors[0].powi(-2) + (omega / errors[1]).powi(2))).sqrt();
        // The phase at both ends is as uncertain as the excursion is in proportion.
        let rate_error = excursion_error / excursion * 12f64.sqrt() / (std::f64::consts::TAU * length_s);
        Some(Self {
            mean_m,
            sine_m,
            cosine_m,
            rate_hz: rate,
            left: chi2 / without_motion.max(1e-12),
            deviations: [scale * errors[0] / count.sqrt(), excursion_error, rate_error],
        })
    }
}

/// Mean, sine and cosine at a rate, and the weighted sum of squares that they leave.
fn misfit(sightings: &[Sighting], times_s: &[f64], errors: [f64; 2], span_mps: f64, rate_hz: f64) -> ([f64; 3], f64) {
    // From velocities as measured, and from ranges alone where velocities wrap.
    let starts = [errors, [errors[0], 1e3 * span_mps]];
    starts
        .map(|start| unwrapped(sightings, times_s, [start, errors], span_mps, std::f64::consts::TAU * rate_hz))
        .into_iter()
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or(([0.0; 3], f64::INFINITY))
}

/// Least squares with the first errors, then with the second and velocities unwrapped about the fit.
fn unwrapped(
    sightings: &[Sighting],
    times_s: &[f64],
    [first, errors]: [[f64; 2]; 2],
    span_mps: f64,
    omega: f64,
) -> ([f64; 3], f64) {
    let rows = |time: f64| {
        let (sine, cosine) = (omega * time).sin_cos();
        (Vector3::new(1.0, sine, cosine), Vector3::new(0.0, omega * cosine, -omega * sine))
    };
    let mut best = ([0.0; 3], f64::INFINITY);
    let mut velocities: Vec<f64> = sightings.iter().map(|s| s.velocity_mps).collect();
    for weights in [first, errors, errors, errors] {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for ((sighting, &time), &velocity) in sightings.iter().zip(times_s).zip(&velocities) {
            let (range, rate) = rows(time);
            for (row, value, error) in [(range, sighting.range_m, weights[0]), (rate, velocity, weights[1])] {
                let weighted = row * error.powi(-2);
                right += weighted * value;
                normal += weighted * row.transpose();
            }
        }
        let determined = |factor: &Cholesky<f64, U3>| {
            factor.l_dirty().diagonal().iter().all(|root| root * root >= LEAST_PIVOT * normal.m11.max(1.0))
        };
        let Some(factor) = normal.cholesky().filter(determined) else { break };
        let solution = factor.solve(&right);
        let mut chi2 = 0.0;
        for ((sighting, &time), velocity) in sightings.iter().zip(times_s).zip(&mut velocities) {
            let (range, rate) = rows(time);
            *velocity = sighting.velocity_mps + span_mps * ((rate.dot(&solution) - sighting.velocity_mps) / span_mps).round();
            chi2 += ((sighting.range_m - range.dot(&solution)) / errors[0]).powi(2)
                + ((*velocity - rate.dot(&solution)) / errors[1]).powi(2);
        }
        if chi2 < best.1 {
            best = (solution.into(), chi2);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sinusoidal_motion_is_found_though_its_velocity_wraps() {
        let (rate, excursion, mean) = (1.7, 0.3, 3.2);
        let times: Vec<f64> = (0..20).map(|i| 0.1 * f64::from(i)).collect();
        let sightings: Vec<Sighting> = times
            .iter()
            .enumerate()
            .map(|(frame, time)| {
                let angle = std::f64::consts::TAU * rate * time + 0.7;
                let velocity: f64 = std::f64::consts::TAU * rate * excursion * angle.cos();
                Sighting {
                    frame,
                    range_m: mean + excursion * angle.sin() + 0.003 * f64::from(frame as u32 % 3),
                    velocity_mps: velocity - 5.0 * (velocity / 5.0).round(),
                    power: 100.0,
                    sine: None,
                }
            })
            .collect();
        let fit = Oscillation::fit(&sightings, &times, [0.01, 0.02], 5.0).unwrap();
        assert!((fit.rate_hz - rate).abs() < 0.01 && (fit.excursion_m() - excursion).abs() < 0.01, "{fit:?}");
        assert!((fit.mean_m - mean).abs() < 0.01 && fit.left < 0.1);
        assert!(Oscillation::fit(&sightings[..5], &times, [0.01, 0.02], 5.0).is_none());
    }
}
