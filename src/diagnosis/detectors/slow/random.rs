//! What is random from chirp to chirp, yet common to all static returns.

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;

use super::field::{Field, Part, Series};
use crate::diagnosis::statistics;

/// Two values are two where they are so many standard deviations of either apart: a threshold midway takes 2.3 % of one for the other.
const SPREADS_APART: f64 = 4.0;

/// Chirps that deviate independently, with one variance.
#[derive(Clone, Debug)]
pub struct Random {
    /// Standard deviation of the chirps.
    pub deviation: f64,
    pub deviation_error: f64,
    pub p_value: f64,
    pub held_out_nats: f64,
    /// Of that, what chirps show beside a straight line through their frame: what is random from chirp to chirp loses nothing by it, and
    /// what fluctuates slowly nearly all.
    pub nats_within: f64,
    /// Two values instead of a bell: their distance, its error, the share of the upper one, and the held-out gain.
    pub two: Option<Two>,
}

impl Random {
    /// What a chirp's value says of it: as much less than it shows as it may be noise.
    pub fn value(&self, series: &Series, frame: usize, index: usize) -> f64 {
        statistics::kept(self.deviation.powi(2) * series.weight[frame]) * chirps(series, frame)[index]
    }
}

/// Two values between which chirps change at random.
#[derive(Clone, Debug)]
pub struct Two {
    pub distance: f64,
    pub distance_error: f64,
    pub share: f64,
    pub held_out_nats: f64,
}

/// The variance that training frames make most likely; none where the series is too short, or where no two halves of the ranges
/// can be compared.
pub fn best(field: &Field, part: Part, training: &[usize], held_out: &[usize]) -> Option<Random> {
    let series = field.series(part, |_| true);
    let training: Vec<usize> = training.iter().copied().filter(|&f| series.weight[f] > 0.0).collect();
    if training.len() * series.loops < 64 {
        return None;
    }
    let p_value = common_to_halves(field, part, &training)?;
    let all = |series: &Series, variance: f64, frames: &[usize]| -> f64 {
        frames
            .iter()
            .map(|&f| series.weight[f])
            .zip(frames)
            .map(|(w, &f)| {
                if w <= 0.0 {
                    return 0.0;
                }
                let ratio = 1.0 + variance * w;
                chirps(series, f).iter().map(|s| 0.5 * (s * s * w * (1.0 - 1.0 / ratio) - ratio.ln())).sum::<f64>()
            })
            .sum()
    };
    // The likelihood has one top; golden section in the logarithm of the variance.
    let noise = training.iter().map(|&f| 1.0 / series.weight[f]).sum::<f64>() / training.len() as f64;
    let [mut low, mut high] = [(1e-4 * noise).ln(), (1e6 * noise).ln()];
    for _ in 0..80 {
        let (a, b) = (high - 0.618_034 * (high - low), low + 0.618_034 * (high - low));
        if all(&series, a.exp(), &training) > all(&series, b.exp(), &training) { high = b } else { low = a }
    }
    let variance = (0.5 * (low + high)).exp();
    let information: f64 =
        training.iter().map(|&f| 0.5 * series.loops as f64 * (variance + 1.0 / series.weight[f]).powi(-2)).sum();
    let deviation = variance.sqrt();
    Some(Random {
        deviation,
        deviation_error: 0.5 / (information.sqrt() * deviation),
        p_value,
        held_out_nats: all(&series, variance, held_out),
        nats_within: all(&within_frames(&series), variance, held_out),
        two: two_valued(&series, &training, held_out, deviation),
    })
}

/// Without the straight line through every frame, and as large as before where chirps are independent.
fn within_frames(series: &Series) -> Series {
    let loops = series.loops;
    let middle = 0.5 * (loops - 1) as f64;
    let square: f64 = (0..loops).map(|i| (i as f64 - middle).powi(2)).sum();
    let scale = (loops as f64 / (loops as f64 - 2.0).max(1.0)).sqrt();
    let value = series.value.chunks_exact(loops).flat_map(|chirps| {
        let mean = chirps.iter().sum::<f64>() / loops as f64;
        let slope = chirps.iter().enumerate().map(|(i, value)| (i as f64 - middle) * value).sum::<f64>() / square.max(1.0);
        chirps.iter().enumerate().map(move |(i, value)| scale * (value - mean - slope * (i as f64 - middle)))
    });
    Series { value: value.collect(), weight: series.weight.clone(), loops }
}

fn chirps(series: &Series, frame: usize) -> &[f64] {
    &series.value[frame * series.loops..(frame + 1) * series.loops]
}

/// Probability that two halves of the ranges deviate together as much by chance. Judged at low and at high Doppler
/// frequencies, of which the worse counts: what leaks from a mover is not white.
fn common_to_halves(field: &Field, part: Part, training: &[usize]) -> Option<f64> {
    let count = field.groups.len();
    let lever = |g: usize| part.lever(&field.groups[g]);
    let information = |g: usize| training.iter().map(|&f| field.weights(f)[g]).sum::<f64>() * lever(g) * lever(g);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| information(b).total_cmp(&information(a)));
    let (mut sums, mut half) = ([0.0; 2], vec![0; count]);
    for g in order {
        let side = usize::from(sums[1] < sums[0]);
        half[g] = side;
        sums[side] += information(g);
    }
    if sums.iter().any(|s| *s <= 0.0) {
        return None;
    }
    let sides = [0, 1].map(|side| field.series(part, |g| half[g] == side));
    let loops = field.loops;
    let fft = FftPlanner::new().plan_fft_forward(loops);
    let mut moments = [[0.0; 4]; 2];
    for &frame in training {
        if sides.iter().any(|s| s.weight[frame] <= 0.0) {
            continue;
        }
        let spectra = sides.each_ref().map(|series| {
            let mut spectrum: Vec<Complex64> =
                chirps(series, frame).iter().map(|s| Complex64::from(s * series.weight[frame].sqrt())).collect();
            fft.process(&mut spectrum);
            spectrum
        });
        // Each frequency once; the mean of a frame is a drift.
        for bin in 1..loops.div_ceil(2) {
            let band = &mut moments[usize::from(4 * bin > loops)];
            band[0] += (spectra[0][bin] * spectra[1][bin].conj()).re;
            band[1] += spectra[0][bin].norm_sqr();
            band[2] += spectra[1][bin].norm_sqr();
            band[3] += 2.0;
        }
    }
    let tails = moments.map(|[product, a, b, count]| {
        let correlation = (product / (a * b).sqrt().max(f64::MIN_POSITIVE)).clamp(-0.999_999, 0.999_999);
        if count < 20.0 || correlation <= 0.0 {
            1.0
        } else {
            0.5 * statistics::normal_tails(correlation.atanh() * (count - 3.0).sqrt())
        }
    });
    Some(tails[0].max(tails[1]))
}

/// Two levels about their mean, each with a normal law of the same spread.
#[derive(Clone, Copy)]
struct Levels {
    distance: f64,
    /// Of the upper one.
    share: f64,
    spread: f64,
}

impl Levels {
    /// Nine shares, and distances and spreads beside those that have the deviation seen.
    fn grid(deviation: f64) -> impl Iterator<Item = Self> {
        (1..=9).map(|tenth| 0.1 * f64::from(tenth)).flat_map(move |share| {
            let typical = deviation / (share * (1.0 - share)).sqrt();
            (0..=12)
                .map(move |step| typical * (0.7 + 0.05 * f64::from(step)))
                .flat_map(move |distance| [0.0, 0.04, 0.12, 0.25].map(|part| Self { distance, share, spread: part * distance }))
        })
    }

    /// Whether a chirp belongs to one of the two.
    fn are_apart(&self) -> bool {
        self.distance > 0.0 && self.spread >= 0.0 && SPREADS_APART * self.spread <= self.distance
    }

    /// Steps to every side.
    fn near(self, wide: f64, much: f64) -> [Self; 6] {
        let Self { distance, share, spread } = self;
        [
            Self { distance: distance + wide, ..self },
            Self { distance: distance - wide, ..self },
            Self { share: share + much, ..self },
            Self { share: share - much, ..self },
            Self { spread: spread + wide, ..self },
            Self { spread: (spread - wide).max(0.0), ..self },
        ]
    }

    /// Log-likelihood that a value with an inverse variance of its noise gains over the noise alone.
    fn gain(&self, value: f64, weight: f64) -> f64 {
        let ratio = 1.0 + self.spread.powi(2) * weight;
        let of_level = |level: f64| 0.5 * weight * (value * value - (value - level).powi(2) / ratio);
        let (low, high) = (of_level(-self.share * self.distance), of_level((1.0 - self.share) * self.distance));
        let top = low.max(high);
        top + ((1.0 - self.share) * (low - top).exp() + self.share * (high - top).exp()).ln() - 0.5 * ratio.ln()
    }
}

/// Chirps that take one of two values at random.
fn two_valued(series: &Series, training: &[usize], held_out: &[usize], deviation: f64) -> Option<Two> {
    let gain = |levels: &Levels, frames: &[usize]| -> f64 {
        let of_frame = |&f: &usize| chirps(series, f).iter().map(move |value| levels.gain(*value, series.weight[f])).sum::<f64>();
        frames.iter().map(of_frame).sum()
    };
    let with_gain = |levels: Levels| (levels, gain(&levels, training));
    let better = |a: &(Levels, f64), b: &(Levels, f64)| a.1.total_cmp(&b.1);
    let (mut levels, mut top) = Levels::grid(deviation).map(with_gain).max_by(better)?;
    let (mut wide, mut much) = (0.03 * levels.distance, 0.05);
    while wide > 1e-4 * levels.distance {
        let near = levels.near(wide, much).into_iter();
        let near = near.filter(|levels| levels.are_apart() && (0.02..=0.98).contains(&levels.share));
        match near.map(with_gain).max_by(better).filter(|found| found.1 > top) {
            Some(found) => (levels, top) = found,
            None => (wide, much) = (0.5 * wide, 0.5 * much),
        }
    }
    let Levels { distance, share, .. } = levels;
    let at = |distance: f64| gain(&Levels { distance, ..levels }, training);
    Some(Two {
        distance,
        distance_error: statistics::deviation_at_top(at, distance, top, 0.02 * distance).unwrap_or(distance),
        share,
        held_out_nats: gain(&levels, held_out),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::support;

    #[test]
    fn what_is_random_from_chirp_to_chirp_keeps_its_power_beside_a_line_and_what_fluctuates_slowly_does_not() {
        let mut normal = support::normal(3);
        let mut left = |amplitude: f64, noise: f64| {
            let chirp = |i: usize| (0.03 * i as f64).sin() * amplitude + noise * normal();
            let series = Series { value: (0..64 * 32).map(chirp).collect(), weight: vec![1.0; 64], loops: 32 };
            let power = |series: &Series| series.value.iter().map(|value| value * value).sum::<f64>();
            power(&within_frames(&series)) / power(&series)
        };
        assert!((left(0.0, 1.0) - 1.0).abs() < 0.05);
        assert!(left(1.0, 0.0) < 0.01);
    }
}
