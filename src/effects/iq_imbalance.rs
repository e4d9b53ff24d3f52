//! An imbalance of the I and Q channels (card R3).

use burn::tensor::Tensor;

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude_of_receivers,
    values::{Values, repeated},
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "iq_imbalance";

/// What reports and docs say of `iq_imbalance`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "R3",
    stage: Stage::Receiver,
    needs_person: false,
    title: "an imbalance of the I and Q channels",
    explanation: "The two receiver branches differ in gain and angle: a faint mirror image of the scene at negative ranges and speeds.",
    equation: "s → (1 + x*) s / 2 + (1 − x) s* / 2, x = 10^{gain_db/20} e^{−j phase_deg π/180}",
    parameters: &[
        amplitude_of_receivers("gain_db", "dB", 0.0, -6.0, 6.0),
        amplitude_of_receivers("phase_deg", "deg", 0.0, -30.0, 30.0),
    ],
    choice: Choice::None,
    look_alikes: &["second_harmonic", "range_alias"],
    separate_by: "a single strong moving reflector: the image moves against it",
    operator: Operator::Signal(apply),
};

/// The widely linear form of Q' = g (Q cos φ + I sin φ).
///
/// `[tx, rx, loop, sample]` → the same; one value for all receivers, or one for each.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let [_, rx] = context.channels();
    let receivers = |list: Tensor<1>| repeated(list, rx).reshape([1, rx, 1, 1]);
    let gain = receivers((values.get("gain_db") * (std::f64::consts::LN_10 / 20.0)).exp());
    let angle = receivers(values.get("phase_deg") * (std::f64::consts::PI / 180.0));
    // (x* − 1) / 2, of which x is the conjugate: s + (x* − 1) / 2 s − (x − 1) / 2 s*.
    let half = Complex::new((gain.clone() * angle.clone().cos() - 1.0) * 0.5, gain * angle.sin() * 0.5);
    let image = signal.clone().conj().mul(half.clone().conj());
    signal.clone().add(signal.mul(half)).sub(image)
}
