//! Maximum likelihood of speckle: weights of templates, and how likely measured powers are.

use rayon::prelude::*;

use super::Template;

/// From nothing, more steps change nothing that matters.
const STEPS: usize = 180;

/// One frame's measured powers where its templates reach, and the templates there.
pub struct Reach {
    /// Cells of the map, usable ones only.
    pub cells: Vec<u32>,
    /// Of each of `cells`.
    pub measured: Vec<f32>,
    /// Positions in `cells`, and power.
    templates: Vec<(Vec<u32>, Vec<f32>)>,
}

impl Reach {
    /// `measured` and `usable`: `[doppler, range]`.
    pub fn new(measured: &[f32], templates: &[Template], usable: &[bool]) -> Self {
        const NOWHERE: u32 = u32::MAX;
        let mut place = vec![NOWHERE; measured.len()];
        let mut cells = vec![];
        let templates = templates
            .iter()
            .map(|template| {
                let inside = template.cells.iter().zip(&template.power).filter(|(cell, _)| usable[**cell as usize]);
                inside
                    .map(|(&cell, &power)| {
                        let place = &mut place[cell as usize];
                        if *place == NOWHERE {
                            *place = cells.len() as u32;
                            cells.push(cell);
                        }
                        (*place, power)
                    })
                    .unzip()
            })
            .collect();
        let measured = cells.iter().map(|&cell| measured[cell as usize]).collect();
        Self { cells, measured, templates }
    }

    /// Expected power in its cells.
    pub fn expected(&self, weights: &[f64]) -> Vec<f32> {
        let mut expected = vec![1.0; self.cells.len()];
        for ((places, powers), &weight) in self.templates.iter().zip(weights) {
            let weight = weight as f32;
            places.iter().zip(powers).for_each(|(&place, power)| expected[place as usize] += weight * power);
        }
        expected
    }

    /// Numerators and denominators of a step, by template.
    fn step(&self, weights: &[f64]) -> Vec<[f64; 2]> {
        let expected = self.expected(weights);
        let shares: Vec<[f32; 2]> = expected
            .iter()
            .zip(&self.measured)
            .map(|(expected, measured)| [measured / (expected * expected), 1.0 / expected])
            .collect();
        let sums = |(places, powers): &(Vec<u32>, Vec<f32>)| {
            places.iter().zip(powers).fold([0.0; 2], |[above, below], (&place, power)| {
                let share = shares[place as usize];
                [above + f64::from(power * share[0]), below + f64::from(power * share[1])]
            })
        };
        self.templates.iter().map(sums).collect()
    }
}

/// Weight of every template that makes measured powers `[doppler, range]` most likely, on the usable cells of all frames.
pub fn fit_weights(frames: &[(&[f32], &[Template])], usable: &[bool]) -> Vec<f64> {
    let reaches: Vec<Reach> = frames.par_iter().map(|(measured, templates)| Reach::new(measured, templates, usable)).collect();
    let reaches: Vec<&Reach> = reaches.iter().collect();
    let mut weights = initial(&reaches);
    improve(&reaches, &mut weights, STEPS);
    weights
}

/// Multiplicative steps of the Itakura-Saito divergence, which never lower the likelihood.
pub fn improve(frames: &[&Reach], weights: &mut [f64], steps: usize) {
    for _ in 0..steps {
        let add = |mut a: Vec<[f64; 2]>, b: Vec<[f64; 2]>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a = [a[0] + b[0], a[1] + b[1]]);
            a
        };
        let Some(sums) = frames.par_iter().map(|frame| frame.step(weights)).reduce_with(add) else { return };
        for (weight, [above, below]) in weights.iter_mut().zip(sums) {
            if below > 0.0 {
                // The square root makes every step safe.
                *weight *= (above / below).sqrt();
            }
        }
    }
}

/// A common weight: measured over template energy; none for a template that reaches no usable cell.
fn initial(frames: &[&Reach]) -> Vec<f64> {
    let count = frames.iter().map(|frame| frame.templates.len()).max().unwrap_or(0);
    let (mut power, mut energy) = (0.0, vec![0.0; count]);
    for frame in frames {
        for ((places, powers), energy) in frame.templates.iter().zip(&mut energy) {
            power += places.iter().map(|&place| f64::from((frame.measured[place as usize] - 1.0).max(0.0))).sum::<f64>();
            *energy += powers.iter().map(|&power| f64::from(power)).sum::<f64>();
        }
    }
    let all: f64 = energy.iter().sum();
    let common = if all > 0.0 { (power / all).max(f64::MIN_POSITIVE) } else { 0.0 };
    energy.iter().map(|&energy| if energy > 0.0 { common } else { 0.0 }).collect()
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
