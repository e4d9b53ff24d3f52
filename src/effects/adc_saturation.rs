//! The converter's saturation (card R4).

use burn::tensor::Tensor;

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{fixed, shaping},
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "adc_saturation";

/// What reports and docs say of `adc_saturation`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "R4",
    stage: Stage::Receiver,
    needs_person: false,
    title: "the converter's saturation",
    explanation: "Samples beyond the converter's rail are cut off: products of the strong echoes fill the map in the affected chirps.",
    equation: "Re s, Im s → clamped to ± level · reference",
    parameters: &[
        shaping("level", "of the reference", 10.0, 0.01, 10.0),
        fixed("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    choice: Choice::None,
    look_alikes: &["interference"],
    separate_by: "a lower receiver gain; the samples' histogram shows a pile at the rail",
    operator: Operator::Nonlinear(apply),
};

/// Both components are clamped.
///
/// Broken: the gradient to the signal is passed straight through where samples are clamped, so that a strong echo can
/// still learn.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let _ = context;
    let rail = values.reference(&signal).reshape([1, 1, 1, 1]) * values.scalar::<4>("level");
    let clip = |part: Tensor<4>| {
        let rail = rail.clone().expand(part.dims());
        let above = part.clone().detach().greater(rail.clone().detach());
        let below = part.clone().detach().lower(-rail.clone().detach());
        // The value of the rail, and the gradient of both: that of the signal is passed straight through.
        let over = (rail.clone() - part.clone().detach()).mask_fill(above.bool_not(), 0.0);
        let under = (-rail - part.clone().detach()).mask_fill(below.bool_not(), 0.0);
        part + over + under
    };
    Complex::new(clip(signal.re), clip(signal.im))
}
