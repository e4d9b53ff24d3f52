//! Small statistics that several detectors need; distributions come from `statrs`.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Gamma, Normal, StudentsT};
use statrs::function::beta::inv_beta_reg;

/// Decibels of a natural logarithm of an amplitude.
pub const DECIBEL: f64 = 20.0 / std::f64::consts::LN_10;

/// Difference of two log-likelihoods, nats, that decides nothing between them: neither explains the data a hundred times as well (what is
/// less is no decisive evidence: H. Jeffreys, Theory of Probability, 1961, appendix B).
pub const UNDECIDED: f64 = 4.6;

/// Scale of an exponential distribution from its lower `quantile` (between 0 and 1): large values do not count.
pub fn exponential_scale(values: &mut [f64], quantile: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let index = ((values.len() - 1) as f64 * quantile) as usize;
    let (_, value, _) = values.select_nth_unstable_by(index, f64::total_cmp);
    *value / -(1.0 - quantile).ln()
}

/// Probability that a χ² of so many degrees of freedom exceeds a value.
pub fn chi2_tail(value: f64, freedom: f64) -> f64 {
    if says_nothing(value) { 1.0 } else { ChiSquared::new(freedom).map_or(1.0, |law| law.sf(value)) }
}

/// Whether every value exceeds this one; what is no number is exceeded, too: it is no evidence.
fn says_nothing(value: f64) -> bool {
    value.is_nan() || value <= 0.0
}

/// Probability that the mean of `count` independent powers of mean 1 (exponential) exceeds a value.
pub fn mean_power_tail(mean: f64, count: f64) -> f64 {
    if says_nothing(mean) { 1.0 } else { Gamma::new(count, count).map_or(1.0, |law| law.sf(mean)) }
}

/// Probability that a ratio of variances of so many degrees of freedom each exceeds this.
pub fn fisher_tail(ratio: f64, above: f64, below: f64) -> f64 {
    if says_nothing(ratio) {
        return 1.0;
    }
    // Whose ratio to itself the law would take.
    if (ratio * above).is_infinite() {
        return 0.0;
    }
    FisherSnedecor::new(above, below).map_or(1.0, |law| law.sf(ratio))
}

/// Probability that a standard normal deviates by more than this, both ways.
pub fn normal_tails(z: f64) -> f64 {
    2.0 * Normal::standard().sf(z.abs())
}

/// Probability that Student's law of so many degrees of freedom exceeds a value.
pub fn student_tail(t: f64, freedom: f64) -> f64 {
    if t.is_nan() { 1.0 } else { StudentsT::new(0.0, 1.0, freedom).map_or(1.0, |law| law.sf(t)) }
}

/// The ratio of the sums of values and their weights, and the probability that it is as much above zero where the values are independent
/// around zero, with variances in proportion to their weights (ratio estimator; Student's t).
pub fn ratio_tail(values: &[f64], weights: &[f64]) -> (f64, f64) {
    let informative: Vec<(f64, f64)> =
        values.iter().copied().zip(weights.iter().copied()).filter(|(_, weight)| *weight > 0.0).collect();
    let all: f64 = informative.iter().map(|(_, weight)| weight).sum();
    if informative.len() < 2 {
        return (0.0, 1.0);
    }
    let ratio = informative.iter().map(|(value, _)| value).sum::<f64>() / all;
    let freedom = informative.len() as f64 - 1.0;
    let variance = informative.iter().map(|(value, weight)| (value - ratio * weight).powi(2) / weight).sum::<f64>() / freedom;
    let deviation = (variance / all).sqrt();
    (ratio, student_tail(ratio / deviation.max(f64::MIN_POSITIVE), freedom))
}

/// Probability of so many events or more where a mean number is expected.
pub fn poisson_tail(count: usize, mean: f64) -> f64 {
    if count == 0 { 1.0 } else { Gamma::new(count as f64, 1.0).map_or(1.0, |law| law.cdf(mean)) }
}

/// The smallest of `tried` independent p-values, made a p-value again (Šidák); of less than one it is that one's.
pub fn corrected(p: f64, tried: f64) -> f64 {
    let tried = tried.max(1.0);
    // 1 − (1 − p)^n without cancellation.
    (-(tried * (-p.clamp(0.0, 1.0)).ln_1p()).exp_m1()).clamp(0.0, 1.0)
}

/// Smallest and largest of some values; infinite of none.
pub fn bounds(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
}

/// Logarithm of a sum of exponentials.
pub fn log_sum(logarithms: impl Iterator<Item = f64> + Clone) -> f64 {
    let top = logarithms.clone().fold(f64::NEG_INFINITY, f64::max);
    top + logarithms.map(|value| (value - top).exp()).sum::<f64>().ln()
}

/// Standard deviation of a number by the curvature of its log-likelihood (second difference over `step`) about the `top`, which it has
/// `at`; none where it does not fall to both sides.
pub fn deviation_at_top(nats: impl Fn(f64) -> f64, at: f64, top: f64, step: f64) -> Option<f64> {
    let curvature = (2.0 * top - nats(at + step) - nats(at - step)) / (step * step);
    (curvature.is_finite() && curvature > 0.0).then(|| curvature.sqrt().recip())
}

/// Decibels of a ratio of powers.
pub fn decibels(ratio: f64) -> f64 {
    10.0 * ratio.max(1e-30).log10()
}

/// Chance that a value of the Gumbel law through some draws exceeds one; the law has their first two L-moments (Hosking 1990).
pub fn gumbel_tail(value: f64, mut drawn: Vec<f64>) -> f64 {
    const EULER: f64 = 0.577_215_664_901_532_9;
    drawn.sort_by(f64::total_cmp);
    let count = drawn.len() as f64;
    let mean = drawn.iter().sum::<f64>() / count;
    let apart = drawn.iter().enumerate().map(|(rank, drawn)| drawn * (2.0 * rank as f64 + 1.0 - count)).sum::<f64>();
    let scale = apart / (count * (count - 1.0)) / std::f64::consts::LN_2;
    // No draw, one, or all alike.
    if scale.is_nan() || scale <= 0.0 {
        return 1.0;
    }
    -(-(-(value - mean) / scale - EULER).exp()).exp_m1()
}

/// Chance that uniform numbers lie as far from their law as some: Kolmogorov and Smirnov's, with Stephens' correction for few numbers
/// (Journal of the American Statistical Association 69, 1974). 1 of none.
pub fn uniform_chance(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    let count = values.len() as f64;
    let apart = |(rank, value): (usize, &f64)| ((rank + 1) as f64 / count - value).max(value - rank as f64 / count);
    let distance = values.iter().enumerate().map(apart).fold(0.0, f64::max);
    let scaled = (count.sqrt() + 0.12 + 0.11 / count.sqrt()) * distance;
    if values.is_empty() || scaled < 0.2 {
        return 1.0;
    }
    let term = |k: i32| 2.0 * f64::from(1 - 2 * ((k + 1) % 2)) * (-2.0 * f64::from(k * k) * scaled * scaled).exp();
    (1..=20).map(term).sum::<f64>().clamp(0.0, 1.0)
}

/// Chance that a white series has such a periodogram (powers in the order of their frequencies, independent of one another): the smaller
/// one of two tests (Bonferroni). Bartlett's asks for a broad band: the cumulated shares of the whole power are ordered uniform numbers
/// (An Introduction to Stochastic Processes, 1955). Fisher's asks for one line: the largest share g has a chance of at most n (1 − g)ⁿ⁻¹
/// (Proceedings of the Royal Society A 125, 1929). 1 of fewer than two.
pub fn white_chance(powers: &[f64]) -> f64 {
    let (count, all) = (powers.len(), powers.iter().sum::<f64>().max(f64::MIN_POSITIVE));
    if count < 2 {
        return 1.0;
    }
    let mut sum = 0.0;
    let shares = powers[..count - 1].iter().map(|power| {
        sum += power;
        sum / all
    });
    let band = uniform_chance(&shares.collect::<Vec<f64>>());
    let largest = powers.iter().fold(0.0, |largest: f64, power| largest.max(power / all));
    let line = count as f64 * (1.0 - largest).powi(count as i32 - 1);
    (2.0 * band.min(line)).min(1.0)
}

/// Share of a measured number that is kept where its prior has so many times the variance of its noise.
pub fn kept(prior: f64) -> f64 {
    prior / (1.0 + prior)
}

/// What is learned of such a number, nats: mean over some of them.
pub fn learned(priors: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = priors.len().max(1) as f64;
    priors.map(|prior| 0.5 * prior.ln_1p()).sum::<f64>() / count
}

/// Exact (Clopper–Pearson) interval of a share.
pub fn binomial_interval(hits: usize, of: usize, confidence: f64) -> [f64; 2] {
    if of == 0 {
        return [0.0, 1.0];
    }
    let (k, n, tail) = (hits as f64, of as f64, 0.5 * (1.0 - confidence));
    let low = if hits == 0 { 0.0 } else { inv_beta_reg(k, n - k + 1.0, tail) };
    let high = if hits == of { 1.0 } else { inv_beta_reg(k + 1.0, n - k, 1.0 - tail) };
    [low, high]
}

/// The upper of the two middle numbers where there are two, zero without any; reorders `values`.
pub fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        assert!((chi2_tail(3.841, 1.0) - 0.05).abs() < 1e-4);
        assert!((normal_tails(1.96) - 0.05).abs() < 1e-4);
        assert!([f64::INFINITY, f64::MAX].map(|ratio| fisher_tail(ratio, 6.0, 20.0)) == [0.0; 2]);
        // What is no number is no evidence.
        let of_none = [chi2_tail(f64::NAN, 2.0), mean_power_tail(f64::NAN, 2.0), fisher_tail(f64::NAN, 2.0, 9.0)];
        assert_eq!((of_none, student_tail(f64::NAN, 9.0)), ([1.0; 3], 1.0));
        assert!((mean_power_tail(2.0, 1.0) - (-2.0f64).exp()).abs() < 1e-9);
        assert!((poisson_tail(1, 0.1) - (1.0 - (-0.1f64).exp())).abs() < 1e-9);
        assert!((poisson_tail(2, 0.1) - (1.0 - 1.1 * (-0.1f64).exp())).abs() < 1e-9);
        assert!((corrected(1e-12, 10.0) - 1e-11).abs() < 1e-16);
        // A part of a test, or none, makes nothing more significant.
        assert_eq!(
            [(0.3, 0.5), (1.0, 0.0), (0.3, 0.0)].map(|(p, tried)| corrected(p, tried)),
            [corrected(0.3, 1.0), 1.0, corrected(0.3, 1.0)]
        );
        let line: Vec<f64> = (0..40).map(|k| if k == 7 { 50.0 } else { 1.0 }).collect();
        assert!(white_chance(&[1.0; 40]) > 0.9 && white_chance(&line) < 1e-3 && white_chance(&[]) == 1.0);
        // Critical distances of Stephens' table for ten numbers: 0.409 at 5 %, 0.489 at 1 %.
        let shifted = |distance: f64| (0..10).map(|i| f64::from(i) / 10.0 + distance).collect::<Vec<f64>>();
        assert!((uniform_chance(&shifted(0.409)) - 0.05).abs() < 3e-3 && (uniform_chance(&shifted(0.489)) - 0.01).abs() < 1e-3);
        assert!(uniform_chance(&shifted(0.05)) == 1.0 && uniform_chance(&[]) == 1.0 && uniform_chance(&[0.5; 300]) < 1e-9);
        // Quantiles of the standard law.
        let gumbel = (0..999).map(|i| -(-((f64::from(i) + 0.5) / 999.0).ln()).ln()).collect::<Vec<f64>>();
        assert!((gumbel_tail(3.0, gumbel.clone()) - 0.0486).abs() < 1e-3 && (gumbel_tail(-0.5, gumbel) - 0.8077).abs() < 2e-3);
        assert!(gumbel_tail(3.0, vec![1.0; 9]) == 1.0 && gumbel_tail(3.0, vec![]) == 1.0);
        let [low, high] = binomial_interval(0, 300, 0.95);
        assert!(low == 0.0 && (high - 0.01222).abs() < 1e-4, "{high}");
        // Student's table: 2.776 at 2.5 % with four degrees of freedom. The mean of these is one, the deviation of it is that below.
        let five = |step: f64| [1.0 - 2.0 * step, 1.0 - step, 1.0, 1.0 + step, 1.0 + 2.0 * step];
        let deviation_of_mean = (2.5f64 / 5.0).sqrt();
        let (ratio, tail) = ratio_tail(&five(1.0 / (2.776 * deviation_of_mean)), &[1.0; 5]);
        // The table has three decimals.
        assert!((tail - 0.025).abs() < 2e-5 && (ratio - 1.0).abs() < 1e-12, "{tail} {ratio}");
        // Twice the weight is the same as two values that are alike, but for the freedom; none is nothing.
        let (ratio, _) = ratio_tail(&[1.0, 4.0, 9.0], &[1.0, 2.0, 0.0]);
        assert!((ratio - 5.0 / 3.0).abs() < 1e-12);
        assert!(
            ratio_tail(&[], &[]).1 == 1.0 && ratio_tail(&[3.0], &[1.0]).1 == 1.0 && ratio_tail(&[0.0; 9], &[1.0; 9]).1 == 0.5
        );
        let mut values: Vec<f64> = (1..=1000).map(|i| -(1.0 - (i as f64 - 0.5) / 1000.0f64).ln() * 3.0).collect();
        assert!((exponential_scale(&mut values, 0.35) - 3.0).abs() < 0.05);
    }
}
