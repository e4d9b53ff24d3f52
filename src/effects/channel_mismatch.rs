//! Different gains and phases of the channels (card C1).

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "channel_mismatch";

/// What reports and docs say of `channel_mismatch`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "C1",
    stage: Stage::Antenna,
    needs_person: false,
    title: "different gains and phases of the channels",
    explanation: "The channels differ in gain and phase, the same for all echoes, which turns and blurs directions.",
    equation: "s_{t,r} → s_{t,r} 10^{gain_db/20} e^{j phase_deg}",
    parameters: &[amplitude("gain_db", "dB", 0.0, -20.0, 20.0), amplitude("phase_deg", "deg", 0.0, -180.0, 180.0)],
    choice: Choice::None,
    look_alikes: &["antenna_position", "mutual_coupling"],
    separate_by: "a strong reflector at several directions: gains and phases stay, an antenna's misplacement changes with direction",
    operator: Operator::Signal(apply),
};

/// `gain_db` and `phase_deg` are for each channel (tx by tx), for each receiver, or for all.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let per_db = std::f64::consts::LN_10 / 20.0;
    let gain = values.channels((values.get("gain_db") * per_db).exp(), context.channels());
    let angle = values.channels(values.get("phase_deg") * (std::f64::consts::PI / 180.0), context.channels());
    let re = angle.clone().cos() * gain.clone();
    signal.mul(Complex::new(re, angle.sin() * gain))
}
