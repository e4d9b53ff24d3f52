//! A constant delay of all paths (card D1').

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    points::host_value,
    values::Values,
};
use crate::{complex::Complex, radar::SPEED_OF_LIGHT};

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "range_bias";

/// What reports and docs say of `range_bias`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "D1'",
    stage: Stage::Scene,
    needs_person: false,
    title: "a constant delay of all paths",
    explanation: "Cables, boards and antennas delay every path alike, so that all is seen farther away by the same distance.",
    equation: "τ_p → τ_p + 2 offset_m / c",
    parameters: &[amplitude("offset_m", "m", 0.0, -0.5, 0.5)],
    choice: Choice::None,
    look_alikes: &["slope_error", "if_delay"],
    separate_by: "reflectors at known ranges of 1 m and 6 m: a bias shifts both alike, a slope error in proportion to the range",
    operator: Operator::Signal(apply),
};

/// All paths times one tone, the carrier's phase included. Left out: the cross term of the residual video phase.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let radar = context.radar;
    let offset_m = values.first("offset_m");
    // The carrier's turns on the host in f64, their change with the learned offset on the device.
    let start_m = host_value(&offset_m);
    let turns = |metres: f64, sample: usize| {
        let frequency_hz = radar.carrier_hz() + radar.slope_hz_per_s * sample as f64 / radar.sample_rate_hz;
        2.0 * metres / SPEED_OF_LIGHT * frequency_hz
    };
    let count = radar.samples_per_chirp;
    let at_start = values.constant(&(0..count).map(|sample| turns(start_m, sample).fract()).collect::<Vec<_>>());
    let per_metre = values.constant(&(0..count).map(|sample| turns(1.0, sample)).collect::<Vec<_>>());
    let turns = at_start + per_metre * (offset_m.clone() - offset_m.detach());
    signal.mul(Complex::unit(turns.reshape([1, 1, 1, count])))
}
