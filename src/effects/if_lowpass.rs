//! The receiver's IF low-pass filter (card R8).

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::shaping,
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "if_lowpass";

/// What reports and docs say of `if_lowpass`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "R8",
    stage: Stage::Receiver,
    needs_person: false,
    title: "the receiver's IF low-pass filter",
    explanation: "The anti-alias filter delays all echoes a little and weakens far ones.",
    equation: "× 1 / (1 + j f_b/corner_hz), f_b = S τ; corner_hz = 0 stands for no filter",
    parameters: &[shaping("corner_hz", "Hz", 0.0, 0.0, 100000000.0)],
    choice: Choice::None,
    look_alikes: &[],
    separate_by: "the shape of the noise floor over range in an empty room",
    operator: Operator::Signal(apply),
};

/// The filter's steady answer to every tone.
///
/// Broken: a corner of zero stands for no filter and carries no gradient.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let tones = context.tones(values);
    let beat_hz = tones.cycles() * context.radar.sample_rate_hz;
    let corner_hz = values.first("corner_hz");
    // 1/f_c, which is zero for the neutral corner: no filter.
    let open = corner_hz.clone().detach().equal_elem(0.0);
    let inverse = (corner_hz.mask_fill(open.clone(), 1.0)).recip().mask_fill(open, 0.0);
    let ratio = beat_hz * inverse;
    let below = ratio.clone() * ratio.clone() + 1.0;
    let response = Complex::new(below.clone().recip(), -ratio / below);
    let [count] = response.dims();
    tones.filter(signal, response.reshape([1, 1, 1, count]))
}
