//! Coupling between neighbouring receivers (card C4).

use burn::tensor::Tensor;

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, level},
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "mutual_coupling";

/// What reports and docs say of `mutual_coupling`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "C4",
    stage: Stage::Antenna,
    needs_person: false,
    title: "coupling between neighbouring receivers",
    explanation: "Each receiver also picks up what its neighbours receive.",
    equation: "s_r → s_r + (z + re + j im)(s_{r−1} + s_{r+1}), |z| = 10^{level_db/20}",
    parameters: &[
        level("level_db", "dB of the neighbour", -200.0, -120.0, 0.0),
        amplitude("re", "1", 0.0, -1.0, 1.0),
        amplitude("im", "1", 0.0, -1.0, 1.0),
    ],
    choice: Choice::None,
    look_alikes: &[],
    separate_by: "a strong reflector at several directions",
    operator: Operator::Signal(apply),
};

/// Receivers next to each other in the list couple, all alike; transmitters do not.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let [_, rx] = context.channels();
    if rx < 2 {
        return signal;
    }
    let strength = values.amplitude();
    let one = |list: Tensor<1>| list.narrow(0, 0, 1).reshape([1, 1, 1, 1]);
    let silent = signal.clone().narrow(1, 0, 1).scale_by(0.0);
    let from_before = Complex::cat(vec![silent.clone(), signal.clone().narrow(1, 0, rx - 1)], 1);
    let from_after = Complex::cat(vec![signal.clone().narrow(1, 1, rx - 1), silent], 1);
    let coupled = from_before.add(from_after).mul(Complex::new(one(strength.re), one(strength.im)));
    signal.add(coupled)
}
