//! What makes one repetition differ from the next: seeded, smooth in time.

use std::f64::consts::TAU;

use nalgebra::{Vector3, vector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{StyleConfig, plan::Plan};

const CHANNELS: usize = 12;
const STEPS: usize = 128;

pub struct Variety {
    scale: f64,
    /// `[channel][wave]`: cycles per second and phase.
    waves: Vec<[(f64, f64); 3]>,
    /// Repeats after many steps: sideways, ahead, turn; each −1 to 1.
    steps: Vec<[f64; 3]>,
}

impl Variety {
    pub fn new(style: &StyleConfig) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(style.seed);
        let mut wave = |low: f64, high: f64| (random.random_range(low..high), random.random_range(0.0..TAU));
        let waves = (0..CHANNELS).map(|_| [wave(0.07, 0.14), wave(0.15, 0.27), wave(0.28, 0.45)]).collect();
        let steps = (0..STEPS).map(|_| std::array::from_fn(|_| random.random_range(-1.0..1.0))).collect();
        Self { scale: style.variation, waves, steps }
    }

    /// A slow wander between −1 and 1, times the style's variation.
    fn wander(&self, channel: usize, time: f64) -> f64 {
        let sum: f64 = self.waves[channel].iter().map(|&(rate, phase)| (TAU * rate * time + phase).sin()).sum();
        self.scale * sum / 3.0
    }

    /// How much the n-th step of a foot differs: sideways and ahead in metres, turn in radians.
    pub fn step(&self, foot: usize, number: i64) -> (Vector3<f64>, f64) {
        let [side, ahead, turn] = self.steps[(2 * number + foot as i64).rem_euclid(STEPS as i64) as usize];
        (vector![0.012 * side, 0.0, 0.020 * ahead] * self.scale, 0.05 * turn * self.scale)
    }

    /// Relative size of the n-th repetition, around 1.
    pub fn repetition(&self, number: i64) -> f64 {
        1.0 + 0.06 * self.scale * self.steps[number.rem_euclid(STEPS as i64) as usize][0]
    }

    /// Which of `count` ways the n-th repetition of a side takes: at random, however regular the style.
    pub fn choice(&self, side: usize, number: i64, count: usize) -> usize {
        let [_, _, drawn] = self.steps[(2 * number + side as i64).rem_euclid(STEPS as i64) as usize];
        ((0.5 * (drawn + 1.0) * count as f64) as usize).min(count - 1)
    }

    /// Adds the sway of a living body.
    pub fn sway(&self, plan: &mut Plan, time: f64) {
        let wander = |channel: usize| self.wander(channel, time);
        plan.pelvis += vector![0.008 * wander(0), 0.0, 0.008 * wander(1)];
        plan.trunk += vector![0.030 * wander(2), 0.035 * wander(3), 0.020 * wander(4)];
        plan.head += vector![0.05 * wander(5), 0.08 * wander(6), 0.0];
        for (side, arm) in plan.arms.iter_mut().enumerate() {
            arm.swing += 0.05 * wander(7 + side);
            arm.elbow *= 1.0 + 0.15 * wander(9 + side);
        }
        let broad = 1.0 + 0.06 * wander(11);
        plan.arms.iter_mut().for_each(|arm| arm.swing *= broad);
    }
}
