//! Noise that the receivers have in common (card V4).

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::spread,
    values::Values,
};
use crate::{complex::Complex, if_signal::noise, radar::Radar};

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "correlated_noise";

/// What reports and docs say of `correlated_noise`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "V4",
    stage: Stage::Noise,
    needs_person: false,
    title: "noise that the receivers have in common",
    explanation: "Supply or oscillator noise reaches all receivers at once: a faint echo from one direction in every cell.",
    equation: "n_r → n_r + coefficient n_common",
    parameters: &[spread("coefficient", "1", 0.0, 0.0, 2.0)],
    choice: Choice::None,
    look_alikes: &["mutual_coupling"],
    separate_by: "a recording without transmission",
    operator: Operator::Noise(shape),
};

/// Standard normal noise `[tx, rx, loop, sample]` → noise with this effect.
///
/// # Gradient
/// Flows to the values.
pub fn shape(normals: Complex<4>, values: &Values, radar: &Radar, seed: u64) -> Complex<4> {
    let _ = radar;
    let [tx, rx, loops, samples] = normals.dims();
    let common = noise::normals(seed ^ 0xC033, [tx, 1, loops, samples], &values.device, values.dtype);
    let common = common.scale(values.scalar::<4>("coefficient"));
    let all = |part: burn::tensor::Tensor<4>| part.expand([tx, rx, loops, samples]);
    normals.add(Complex::new(all(common.re), all(common.im)))
}
