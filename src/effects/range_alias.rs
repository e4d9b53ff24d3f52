//! An echo from beyond the unambiguous range (card P8).

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, fixed, level, shaping},
    values::Values,
};
use crate::{complex::Complex, radar::SPEED_OF_LIGHT};

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "range_alias";

/// What reports and docs say of `range_alias`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "P8",
    stage: Stage::Propagation,
    needs_person: false,
    title: "an echo from beyond the unambiguous range",
    explanation: "Something farther away than the radar can measure appears folded back to a near range.",
    equation: "+ (re + j im) exp j2π(f_c τ + S t τ), τ = 2 range_m / c, S τ beyond the sample rate",
    parameters: &[
        shaping("range_m", "m", 0.0, 0.0, 200.0),
        level("level_db", "dB of the reference", -200.0, -120.0, 20.0),
        amplitude("re", "of the reference", 0.0, -10.0, 10.0),
        amplitude("im", "of the reference", 0.0, -10.0, 10.0),
        fixed("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    choice: Choice::None,
    look_alikes: &["spur"],
    separate_by: "change the sample rate by 5 %: the alias moves, a near object does not",
    operator: Operator::Added(apply),
};

/// A tone at the true range's beat frequency; that it is folded is the sampling's doing. An echo at rest: the simplest
/// form, which a static reflector beyond the unambiguous range would give too. The carrier's phase is in `re` and `im`.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let radar = context.radar;
    let strength = values.amplitude();
    let reference = values.reference(&signal).reshape([1, 1, 1, 1]);
    let re = values.channels(strength.re, context.channels()) * reference.clone();
    let im = values.channels(strength.im, context.channels()) * reference;
    let times: Vec<f64> = (0..radar.samples_per_chirp).map(|sample| sample as f64 / radar.sample_rate_hz).collect();
    let count = times.len();
    let turns = values.constant(&times) * values.first("range_m") * (2.0 * radar.slope_hz_per_s / SPEED_OF_LIGHT);
    signal.add(Complex::unit(turns.reshape([1, 1, 1, count])).mul(Complex::new(re, im)))
}
