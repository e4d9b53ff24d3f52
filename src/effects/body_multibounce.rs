//! Echoes between parts of the body (card T9).

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, angle, shaping},
    points::host_value,
    values::Values,
};
use crate::{
    complex::Complex,
    radar::{Radar, SPEED_OF_LIGHT},
};

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "body_multibounce";

/// What reports and docs say of `body_multibounce`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "T9",
    stage: Stage::Propagation,
    needs_person: true,
    title: "echoes between parts of the body",
    explanation: "The wave goes from one part of the body to another before it returns: a faint second body, a little behind the first.",
    equation: "+ coefficient s_body(τ + 2 extra_m / c)",
    parameters: &[
        shaping("extra_m", "m", 0.3, 0.0, 1.5),
        amplitude("coefficient", "1", 0.0, -1.0, 1.0),
        angle("phase_rad", "rad", 0.0, -6.3, 6.3),
    ],
    choice: Choice::None,
    look_alikes: &[],
    separate_by: "arms held away from the body, legs apart",
    operator: Operator::Paths(|of, values| Some(echo(of.direct.clone(), values, of.chirps.radar))),
};

/// The late echo of the body's signal, `[rx, chirp, sample]` → the same.
///
/// The crudest form: the whole body once more at a fixed extra range, for paths between its parts that lengthen by about as
/// much; Doppler and direction stay those of the body.
///
/// # Gradient
/// Flows to the signal and the values.
pub fn echo(signal: Complex<3>, values: &Values, radar: &Radar) -> Complex<3> {
    let extra_m = values.first("extra_m");
    let start_m = host_value(&extra_m);
    let turns = |metres: f64, sample: usize| {
        let frequency_hz = radar.carrier_hz() + radar.slope_hz_per_s * sample as f64 / radar.sample_rate_hz;
        2.0 * metres / SPEED_OF_LIGHT * frequency_hz
    };
    let count = radar.samples_per_chirp;
    let at_start = values.constant(&(0..count).map(|sample| turns(start_m, sample).fract()).collect::<Vec<_>>());
    let per_metre = values.constant(&(0..count).map(|sample| turns(1.0, sample)).collect::<Vec<_>>());
    let turns = at_start + per_metre * (extra_m.clone() - extra_m.detach());
    let coefficient = values.phase::<3>().scale(values.scalar("coefficient"));
    signal.mul(Complex::unit(turns.reshape([1, 1, count]))).mul(coefficient)
}
