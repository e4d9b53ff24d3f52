//! Noise with rare strong samples (card V3).

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{shaping, spread},
    points::host_value,
    values::Values,
};
use crate::{complex::Complex, radar::Radar};

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "impulsive_noise";

/// What reports and docs say of `impulsive_noise`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "V3",
    stage: Stage::Noise,
    needs_person: false,
    title: "noise with rare strong samples",
    explanation: "Now and then a single sample is far off: noise with heavier tails than a Gaussian's.",
    equation: "noise × (1 + excess) on a share `probability` of the samples",
    parameters: &[spread("probability", "1", 0.0, 0.0, 0.2), shaping("excess", "1", 10.0, 0.0, 1000.0)],
    choice: Choice::None,
    look_alikes: &[],
    separate_by: "a recording without transmission; bursts last several samples, impulses one",
    operator: Operator::Noise(shape),
};

/// Samples are hit alike in both components. Broken: `probability` decides by lot and carries no gradient.
///
/// Standard normal noise `[tx, rx, loop, sample]` → noise with this effect.
///
/// # Gradient
/// Flows to the values.
pub fn shape(normals: Complex<4>, values: &Values, radar: &Radar, seed: u64) -> Complex<4> {
    let _ = radar;
    let probability = host_value(&values.first("probability")).clamp(0.0, 1.0);
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x1397);
    let dims = normals.dims();
    let hit = (0..dims.iter().product()).map(|_| f64::from(u8::from(random.random_bool(probability)))).collect();
    let factor = values.tensor::<4>(hit, dims) * values.scalar::<4>("excess") + 1.0;
    normals.scale(factor)
}
