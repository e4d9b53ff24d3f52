//! Maximum likelihood of speckle: weights of templates, and how likely measured powers are.

use super::Template;

/// More steps change nothing that matters.
const STEPS: usize = 60;

/// Weight of every template that makes measured powers `[doppler, range]` most likely, on the usable cells of all frames:
/// multiplicative steps of the Itakura-Saito divergence, which never lower the likelihood.
pub fn fit_weights(frames: &[(&[f32], &[Template])], usable: &[bool]) -> Vec<f64> {
    let parts = frames.iter().map(|(_, templates)| templates.len()).max().unwrap_or(0);
    let mut weights = initial(frames, usable, parts);
    let mut expected: Vec<Vec<f32>> = frames.iter().map(|(measured, _)| vec![1.0; measured.len()]).collect();
    for _ in 0..STEPS {
        let (mut above, mut below) = (vec![0.0; parts], vec![0.0; parts]);
        for ((measured, templates), expected) in frames.iter().zip(&mut expected) {
            // Only cells that a template touches are ever read.
            for template in *templates {
                template.cells.iter().for_each(|&cell| expected[cell as usize] = 1.0);
            }
            for (template, &weight) in templates.iter().zip(&weights) {
                super::add(expected, template, weight);
            }
            for (part, template) in templates.iter().enumerate() {
                for (&cell, &power) in template.cells.iter().zip(&template.power) {
                    let cell = cell as usize;
                    if usable[cell] {
                        let share = f64::from(power) / f64::from(expected[cell]);
                        above[part] += share * f64::from(measured[cell]) / f64::from(expected[cell]);
                        below[part] += share;
                    }
                }
            }
        }
        for (weight, (above, below)) in weights.iter_mut().zip(above.iter().zip(&below)) {
            if *below > 0.0 {
                // The square root makes every step safe.
                *weight *= (above / below).sqrt();
            }
        }
    }
    weights
}

/// A common weight: measured over template energy; none for a part that is never seen in a usable cell.
fn initial(frames: &[(&[f32], &[Template])], usable: &[bool], parts: usize) -> Vec<f64> {
    let (mut power, mut energy) = (vec![0.0; parts], vec![0.0; parts]);
    for (measured, templates) in frames {
        for (part, template) in templates.iter().enumerate() {
            for (&cell, &value) in template.cells.iter().zip(&template.power).filter(|(cell, _)| usable[**cell as usize]) {
                power[part] += f64::from((measured[cell as usize] - 1.0).max(0.0));
                energy[part] += f64::from(value);
            }
        }
    }
    let all: f64 = energy.iter().sum();
    let common = if all > 0.0 { power.iter().sum::<f64>() / all } else { 0.0 };
    energy.iter().map(|&energy| if energy > 0.0 { common.max(f64::MIN_POSITIVE) } else { 0.0 }).collect()
}

/// Of exponential powers (Whittle): Σ −ln V − P/V over the usable cells.
pub fn log_likelihood(measured: &[f32], expected: &[f32], usable: &[bool]) -> f64 {
    measured
        .iter()
        .zip(expected)
        .zip(usable)
        .filter(|(_, usable)| **usable)
        .map(|((&power, &expected), _)| -f64::from(expected).ln() - f64::from(power) / f64::from(expected))
        .sum()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn weights_of_overlapping_templates_are_found_in_speckle() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let templates = [
            Template { cells: (0..40).collect(), power: vec![1.0; 40] },
            Template { cells: (20..60).collect(), power: (0..40).map(|i| i as f32 / 40.0).collect() },
            Template::default(),
        ];
        let truth = [30.0, 200.0, 0.0];
        let expected = crate::diagnosis::power::sum(&templates, &truth, 80);
        let frames: Vec<Vec<f32>> =
            (0..200).map(|_| expected.iter().map(|mean| -mean * (1.0 - random.random::<f32>()).ln()).collect()).collect();
        let pairs: Vec<(&[f32], &[Template])> = frames.iter().map(|map| (map.as_slice(), templates.as_slice())).collect();
        let usable = vec![true; 80];
        let weights = fit_weights(&pairs, &usable);
        assert!((weights[0] / 30.0 - 1.0).abs() < 0.05 && (weights[1] / 200.0 - 1.0).abs() < 0.05, "{weights:?}");
        assert!(weights[2] == 0.0);
        let likelihood = |weights: &[f64]| {
            let map = crate::diagnosis::power::sum(&templates, weights, 80);
            frames.iter().map(|frame| log_likelihood(frame, &map, &usable)).sum::<f64>()
        };
        assert!(likelihood(&weights) >= likelihood(&truth) - 1e-3);
        assert!(likelihood(&weights) < likelihood(&truth) + 10.0);
    }
}
