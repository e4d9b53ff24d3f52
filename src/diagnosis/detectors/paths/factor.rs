//! What one complex factor of a template of the signal explains, in cells where nothing else can be.

use num_complex::Complex64;
use rayon::prelude::*;

use super::scene::Scene;
use crate::diagnosis::locate::CELLS_PER_VALUE;

/// What one complex factor of a template gains.
pub struct Fit {
    pub factor: Complex64,
    pub training: f64,
    pub held_out: f64,
    /// Standard deviation of the factor's real and imaginary part.
    pub deviation: f64,
}

/// Sums of conj(template) · measured and |template|², over the noise, of one frame.
#[derive(Clone, Copy, Default)]
pub struct Match {
    pub product: Complex64,
    pub energy: f64,
}

pub fn fit(scene: &Scene, matches: &[Match]) -> Fit {
    let split = &scene.evidence.split;
    let sum = |frames: &[usize]| {
        frames.iter().fold(Match::default(), |sum, &frame| Match {
            product: sum.product + matches[frame].product,
            energy: sum.energy + matches[frame].energy,
        })
    };
    let (training, held_out) = (sum(&split.training), sum(&split.held_out));
    let factor = training.product / training.energy.max(f64::MIN_POSITIVE);
    // |z|² − |z − κ q|², over the noise.
    let gain = |m: Match| (2.0 * (factor.conj() * m.product).re - factor.norm_sqr() * m.energy) / CELLS_PER_VALUE;
    Fit {
        factor,
        training: gain(training),
        held_out: gain(held_out),
        deviation: (CELLS_PER_VALUE / (2.0 * training.energy.max(f64::MIN_POSITIVE))).sqrt(),
    }
}

/// Per frame, templates `[doppler, range]` of every channel against what is measured, in free cells.
pub fn matches(scene: &Scene, template: impl Fn(usize, usize) -> Vec<Complex64> + Sync) -> Vec<Match> {
    let noise = scene.evidence.noise();
    (0..scene.frames())
        .into_par_iter()
        .map(|frame| {
            let (taken, base) = (scene.reached(frame), scene.base(frame));
            let mut sum = Match::default();
            for (channel, noise) in noise.iter().enumerate() {
                let measured = scene.evidence.range_doppler(frame, channel);
                let map = template(frame, channel);
                for cell in (0..taken.len()).filter(|&cell| !taken[cell]) {
                    let weight = 1.0 / (noise.max(f64::MIN_POSITIVE) * scene.shape[cell % scene.samples] * f64::from(base[cell]));
                    sum.product += map[cell].conj() * measured[cell] * weight;
                    sum.energy += map[cell].norm_sqr() * weight;
                }
            }
            sum
        })
        .collect()
}
