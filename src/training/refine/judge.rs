//! Whether frames that were not fitted prefer a correction.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Chance of keeping a correction that is worth nothing: that below which `align` takes one placement as worse than another.
const LEVEL: f64 = 0.01;

/// A correction compared with a coarser one on frames that neither was fitted to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Judgement {
    /// What is corrected.
    pub correction: String,
    /// The coarser correction.
    pub over: String,
    pub kept: bool,
    /// Log-likelihood of the held-out frames above that of the coarser correction, nats.
    pub gain_nats: f64,
    /// One-sided, of the gain; 1 where it cannot be estimated.
    pub p_value: f64,
    /// How far the body lies apart by both in range, root mean square over its points and the held-out frames.
    pub apart_m: f64,
    pub frames: usize,
    /// Stretches of frames that count as independent.
    pub blocks: usize,
}

impl Judgement {
    /// `finer`, `coarser`: nats lost in every held-out frame; `times_s`: their times, ascending.
    ///
    /// Frames near each other share errors of the law of power, so that what is taken as independent are the means of blocks of
    /// `block_s` (batch means; Law & Kelton, Simulation Modeling and Analysis). The paired differences' mean over its standard error
    /// follows Student's t with one degree of freedom less than there are blocks, where the corrections are worth the same. Both were
    /// fitted to other frames, so that degrees of freedom need no penalty (Giacomini & White, Econometrica 74, 2006).
    pub fn new(names: [&str; 2], finer: &[f64], coarser: &[f64], times_s: &[f64], block_s: f64) -> Self {
        let gains: Vec<f64> = finer.iter().zip(coarser).map(|(finer, coarser)| coarser - finer).collect();
        let block = |time_s: f64| ((time_s - times_s[0]) / block_s).floor();
        let mut means: Vec<f64> = Vec::new();
        let mut start = 0;
        for end in 1..=gains.len() {
            if end == gains.len() || block(times_s[end]) > block(times_s[start]) {
                means.push(gains[start..end].iter().sum::<f64>() / (end - start) as f64);
                start = end;
            }
        }
        let p_value = chance(&means);
        let [correction, over] = names.map(String::from);
        let (frames, blocks) = (gains.len(), means.len());
        let gain_nats = gains.iter().sum();
        Self { correction, over, kept: p_value < LEVEL, gain_nats, p_value, apart_m: 0.0, frames, blocks }
    }

    /// Kept only where it moves the body by so much: held-out frames share the errors of the law of power that are the same in all
    /// frames, and prefer what makes up for them (smallest effect of interest; Lakens et al., Adv. Methods Pract. Psychol. Sci. 1, 2018).
    pub fn of_least(self, least_m: f64) -> Self {
        Self { kept: self.kept && self.apart_m >= least_m, ..self }
    }

    /// A clause for people.
    pub fn clause(&self) -> String {
        let Self { correction, over, gain_nats, p_value, apart_m, frames, blocks, .. } = self;
        if *blocks < 2 {
            return format!("{correction} over {over}: not judged, the held-out frames ({frames}) are too few");
        }
        let verdict = if self.kept { "kept" } else { "not kept" };
        format!(
            "{correction} over {over}: {verdict}, {gain_nats:+.1} nats in {frames} held-out frames (p = {p_value:.1e}), {:.0} mm apart in range",
            1e3 * apart_m
        )
    }
}

/// Chance of a mean as large as this, were the expectation zero.
fn chance(means: &[f64]) -> f64 {
    let count = means.len() as f64;
    let mean = means.iter().sum::<f64>() / count;
    let squares: f64 = means.iter().map(|value| (value - mean).powi(2)).sum();
    let error = (squares / (count - 1.0) / count).sqrt();
    match StudentsT::new(0.0, 1.0, count - 1.0) {
        Ok(law) if error > 0.0 && (mean / error).is_finite() => law.cdf(-mean / error),
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn judged(gains: &[f64]) -> Judgement {
        let times_s: Vec<f64> = (0..gains.len()).map(|frame| 0.2 * frame as f64).collect();
        let lost: Vec<f64> = gains.iter().map(|gain| -gain).collect();
        Judgement::new(["finer", "coarser"], &lost, &vec![0.0; gains.len()], &times_s, 0.5)
    }

    #[test]
    fn the_chance_is_that_of_student_s_t() {
        // Mean 2, standard error 1/√3: t = 3.464 with 2 degrees of freedom.
        assert!((chance(&[1.0, 2.0, 3.0]) - 0.037_09).abs() < 1e-4);
        assert_eq!(chance(&[]), 1.0);
        assert_eq!(chance(&[1.0]), 1.0);
        assert_eq!(chance(&[0.0, 0.0]), 1.0);
    }

    #[test]
    fn frames_within_a_block_count_once() {
        // Frames at 0, 0.2 and 0.4 s share a block of half a second, those at 0.6 and 0.8 s the next.
        let found = judged(&[1.0, 1.0, 1.0, 3.0, 3.0]);
        assert_eq!((found.frames, found.blocks), (5, 2));
        assert!((found.gain_nats - 9.0).abs() < 1e-12);
        // Mean 2, standard error 1: t = 2 with one degree of freedom (Cauchy).
        assert!((found.p_value - 0.147_58).abs() < 1e-4);
        assert!(!found.kept);
    }

    #[test]
    fn what_is_preferred_and_moves_nothing_is_not_kept() {
        let found = judged(&[3.0, 3.1, 2.9, 3.0, 3.1, 2.9, 3.0, 3.1, 2.9, 3.0]);
        assert!(found.kept);
        let of = |apart_m: f64, judged: &Judgement| Judgement { apart_m, ..judged.clone() }.of_least(0.02).kept;
        assert!(!of(0.01, &found) && of(0.03, &found) && !of(0.03, &judged(&[0.0; 10])));
    }

    #[test]
    fn what_is_worth_nothing_is_kept_as_rarely_as_stated() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let draws = 5000;
        let kept = (0..draws)
            .filter(|_| {
                let gains: Vec<f64> = (0..24).map(|_| rng.random::<f64>() - 0.5).collect();
                judged(&gains).kept
            })
            .count();
        // Three standard errors of 1 % in 5000 are 0.42 %; uniform draws have not quite Student's tails.
        assert!((kept as f64 / f64::from(draws) - LEVEL).abs() < 0.005, "{kept} of {draws}");
    }
}
