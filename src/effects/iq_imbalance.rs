//! An imbalance of the I and Q channels (card R3).

use burn::tensor::Tensor;

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::parameter,
    values::{Values, repeated},
};
use crate::complex::Complex;

pub const ID: &str = "iq_imbalance";

pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "R3",
    stage: Stage::Receiver,
    needs_person: false,
    title: "an imbalance of the I and Q channels",
    explanation: "The two receiver branches differ in gain and angle: a faint mirror image of the scene at negative ranges and speeds.",
    equation: "s → s + μ s*, μ = (10^{gain_db/20} − 1 + j phase_deg π/180) / 2",
    parameters: &[parameter("gain_db", "dB", 0.0, -6.0, 6.0), parameter("phase_deg", "deg", 0.0, -30.0, 30.0)],
    choice: Choice::None,
    look_alikes: &["second_harmonic", "range_alias"],
    separate_by: "a single strong moving reflector: the image moves against it",
    operator: Operator::Signal(apply),
};

/// The widely linear form, to first order in the imbalance.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let per_db = std::f64::consts::LN_10 / 20.0;
    let gain = ((values.get("gain_db") * per_db).exp() - 1.0) * 0.5;
    let angle = values.get("phase_deg") * (std::f64::consts::PI / 360.0);
    let [_, rx] = context.channels();
    let receivers = |list: Tensor<1>| {
        if list.dims()[0] == 1 { list.reshape([1, 1, 1, 1]) } else { repeated(list, rx).reshape([1, rx, 1, 1]) }
    };
    let image = Complex::new(receivers(gain), receivers(angle));
    let image = Complex::new(image.re.clone() + image.im.zeros_like(), image.im + image.re.zeros_like());
    signal.clone().add(signal.conj().mul(image))
}
