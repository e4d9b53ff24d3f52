//! The receiver's IF high-pass filter (card R7).

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{fixed, shaping},
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "if_highpass";

/// What reports and docs say of `if_highpass`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "R7",
    stage: Stage::Receiver,
    needs_person: false,
    title: "the receiver's IF high-pass filter",
    explanation: "A filter that keeps leakage out also weakens near echoes and turns their phase, the more the nearer they are.",
    equation: "× [(j f_b/corner_hz) / (1 + j f_b/corner_hz)]^order, f_b = S τ",
    parameters: &[shaping("corner_hz", "Hz", 0.0, 0.0, 2000000.0), fixed("order", "1", 1.0, 1.0, 4.0)],
    choice: Choice::None,
    look_alikes: &["if_lowpass", "start_frequency_error", "antenna_pattern"],
    separate_by: "a reflector at 0.3 to 1 m, or another filter setting of the chip; the noise floor has the filter's shape too",
    operator: Operator::Signal(apply),
};

/// The filter's steady answer to every tone; its settling at the ramp's start is left out. `order` sections of first
/// order with the same corner.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let order = values.host("order")[0].round().max(1.0) as usize;
    let tones = context.tones(values);
    let beat_hz = tones.cycles() * context.radar.sample_rate_hz;
    let corner_hz = values.first("corner_hz");
    // j x / (1 + j x) with x = f/f_c, written with f² + f_c² so that f_c = 0 gives exactly one.
    let floor_hz2 = 1e-6 * context.radar.sample_rate_hz;
    let power = beat_hz.clone() * beat_hz.clone();
    let below = power.clone() + corner_hz.clone() * corner_hz.clone() + floor_hz2;
    let section = Complex::new((power + floor_hz2) / below.clone(), beat_hz * corner_hz / below);
    let response = (1..order).fold(section.clone(), |response, _| response.mul(section.clone()));
    let [count] = response.dims();
    tones.filter(signal, response.reshape([1, 1, 1, count]))
}
