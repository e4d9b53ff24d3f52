//! Leakage from transmitters to receivers (card R1).

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, fixed, level, shaping},
    values::Values,
};
use crate::{complex::Complex, radar::SPEED_OF_LIGHT};

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "tx_leakage";

/// What reports and docs say of `tx_leakage`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "R1",
    stage: Stage::Receiver,
    needs_person: false,
    title: "leakage from transmitters to receivers",
    explanation: "Part of the transmitted wave goes straight to the receivers: a strong echo at rest in the first range bins, different in every channel.",
    equation: "+ L_{t,r} exp(j2π S τ_L t), τ_L = 2 range_m / c, L = reference (10^{level_db/20} + re + j im)",
    parameters: &[
        shaping("range_m", "m", 0.08, 0.0, 0.5),
        level("level_db", "dB of the reference", -200.0, -120.0, 20.0),
        amplitude("re", "of the reference", 0.0, -10.0, 10.0),
        amplitude("im", "of the reference", 0.0, -10.0, 10.0),
        fixed("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    choice: Choice::None,
    look_alikes: &["dc_offset"],
    separate_by: "turn the radar: leakage stays, the room moves; a cover of absorber on the radar takes the room away",
    operator: Operator::Added(apply),
};

/// The same in every chirp. `re` and `im` are for each channel, each receiver, or all; the carrier's phase is in them.
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
