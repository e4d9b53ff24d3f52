//! What is random from chirp to chirp, yet common to all static returns.

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;

use super::field::{Field, Part, Series};
use crate::diagnosis::statistics;

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

/// Chirps that take one of two values at random.
fn two_valued(series: &Series, training: &[usize], held_out: &[usize], deviation: f64) -> Option<Two> {
    let gain = |distance: f64, share: f64, frames: &[usize]| -> f64 {
        let levels = [-share * distance, (1.0 - share) * distance];
        frames
            .iter()
            .flat_map(|&f| chirps(series, f).iter().map(move |s| (s, series.weight[f])))
            .map(|(s, w)| {
                let [low, high] = levels.map(|level| w * level * (s - 0.5 * level));
                let top = low.max(high);
                top + ((1.0 - share) * (low - top).exp() + share * (high - top).exp()).ln()
            })
            .sum()
    };
    let mut best = (0.0, 0.0, f64::NEG_INFINITY);
    for share in [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9f64] {
        let typical = deviation / (share * (1.0 - share)).sqrt();
        for step in 0..=12 {
            let distance = typical * (0.7 + 0.05 * f64::from(step));
            let found = gain(distance, share, training);
            if found > best.2 {
                best = (distance, share, found);
            }
        }
    }
    let (mut distance, mut share, mut top) = best;
    let (mut wide, mut much) = (0.03 * distance, 0.05);
    while wide > 1e-4 * distance {
        let near = [(distance + wide, share), (distance - wide, share), (distance, share + much), (distance, share - much)];
        let better = near
            .into_iter()
            .filter(|(d, s)| *d > 0.0 && (0.02..=0.98).contains(s))
            .map(|(d, s)| (d, s, gain(d, s, training)))
            .max_by(|a, b| a.2.total_cmp(&b.2))
            .filter(|b| b.2 > top);
        match better {
            Some(b) => (distance, share, top) = b,
            None => (wide, much) = (0.5 * wide, 0.5 * much),
        }
    }
    let h = 0.02 * distance;
    let curvature = (2.0 * top - gain(distance + h, share, training) - gain(distance - h, share, training)) / (h * h);
    Some(Two {
        distance,
        distance_error: if curvature > 0.0 { curvature.sqrt().recip() } else { distance },
        share,
        held_out_nats: gain(distance, share, held_out),
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
