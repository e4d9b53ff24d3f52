//! Whether a cell of a range-Doppler map stands out of its range's floor over velocities: order-statistic CFAR by the median (Rohling 1983).
//!
//! A floor above the noise is a strong return that is modulated at random. All channels hold the same modulation, so its power is
//! independent between frames only, where that of the noise is between channels, too: a mean over F frames and C channels of |a + n|²,
//! with a mean 1 + s over the noise, has a variance of ((1 + 2 s) / C + s²) / F. It is taken for a Gamma law of that mean and variance, or
//! for a constant and a Gamma law of F where that has the longer tail, and its ratio to the median, which has a variance as well, for one
//! of Fisher and Snedecor.

use statrs::distribution::{Continuous, Gamma};

use crate::diagnosis::statistics::fisher_tail;

/// Of a Hann window: bins that share one independent value (equivalent noise bandwidth, Harris 1978, table 1).
pub const BINS_PER_VALUE: f64 = 1.5;
/// Steps by which the floor's law closes in on its median.
const STEPS: usize = 4;

/// What a floor is the median of.
#[derive(Clone, Copy, Debug)]
pub struct Cells {
    pub frames: f64,
    pub channels: f64,
    /// Independent values that the median is taken over.
    pub values: f64,
}

impl Cells {
    /// Independent exponential values that a cell of this mean over the noise varies like.
    fn looks(self, level: f64) -> f64 {
        let modulated = (level - 1.0).max(0.0);
        self.frames * (1.0 + modulated).powi(2) / ((1.0 + 2.0 * modulated) / self.channels + modulated.powi(2))
    }

    /// Probability that a cell whose mean is that of a floor, of which the median is known, exceeds a power.
    pub fn tail(self, power: f64, median: f64) -> f64 {
        let level = (0..STEPS).fold(median, |level, _| median / share(self.looks(level)));
        let of_both = self.over(power, median, self.looks(level));
        // Noise whose power hardly varies beside a return that does has the longer tail.
        if median > 1.0 { of_both.max(self.over(power - 1.0, median - 1.0, self.frames)) } else { of_both }
    }

    /// Of a mean of so many exponential values, over the median of others.
    fn over(self, power: f64, median: f64, looks: f64) -> f64 {
        let level = (median / share(looks)).max(f64::MIN_POSITIVE);
        let density = Gamma::new(looks, looks).map_or(0.0, |law| law.pdf(share(looks)));
        // A median of n values varies by 1 / (4 n f²), f their density there.
        let of_median = 4.0 * self.values * (density * share(looks)).powi(2);
        fisher_tail(power / level, 2.0 * looks, 2.0 * of_median)
    }
}

/// Median over mean of a Gamma law (Wilson and Hilferty 1931).
fn share(looks: f64) -> f64 {
    (1.0 - 1.0 / (9.0 * looks)).powi(3)
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::diagnosis::statistics::median;
    use crate::support;

    /// Of all cells, the share whose tail is below a level, where a return of `power` over the noise is drawn anew in each cell and frame.
    fn alarms(power: f64, level: f64) -> f64 {
        let cells = Cells { frames: 3.0, channels: 8.0, values: 48.0 };
        let mut normal = support::normal(5);
        let mut complex = |power: f64| Complex64::new(normal(), normal()) * (0.5 * power).sqrt();
        let (mut alarms, mut all) = (0, 0);
        for _ in 0..800 {
            let mut cell = || -> f64 {
                let of_frame = |_| {
                    let shared = complex(power);
                    (0..8).map(|_| (shared + complex(1.0)).norm_sqr()).sum::<f64>()
                };
                (0..3).map(of_frame).sum::<f64>() / 24.0
            };
            let powers: Vec<f64> = (0..48).map(|_| cell()).collect();
            let floor = median(&mut powers.clone());
            alarms += powers.iter().filter(|power| cells.tail(**power, floor) < level).count();
            all += powers.len();
        }
        f64::from(u32::try_from(alarms).unwrap()) / f64::from(u32::try_from(all).unwrap())
    }

    #[test]
    fn as_many_cells_of_noise_and_of_a_modulated_return_exceed_a_level_as_it_says() {
        for power in [0.0, 1.0, 1e4] {
            for level in [0.05, 1e-3] {
                let share = alarms(power, level);
                println!("{power} over the noise, {level}: {share}");
                // A floor as strong as the noise is neither law: 2.2 times as many at one in a thousand.
                assert!((0.4 * level..2.5 * level).contains(&share), "{power}, {level}: {share}");
            }
        }
    }
}
