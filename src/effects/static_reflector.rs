//! An object at rest that the scene does not know (card P1).

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, angle, shaping},
    points::place,
    values::Values,
};
use crate::{
    complex::Complex,
    if_signal::{SumForm, direct_signal},
    paths::{Amplitude, Dechirp, Points},
    radar::Radar,
};

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "static_reflector";

/// What reports and docs say of `static_reflector`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "P1",
    stage: Stage::Scene,
    needs_person: false,
    title: "an object at rest that the scene does not know",
    explanation: "Something at rest, such as furniture, sends an echo that no wall or body explains.",
    equation: "+ amplitude e^{jφ} exp j2π(f_c τ + S t τ) / (d_tx d_rx), τ from position_m",
    parameters: &[
        shaping("position_m", "m", 0.0, -20.0, 20.0),
        amplitude("amplitude", "recording's unit·m²", 0.0, -1000000000.0, 1000000000.0),
        angle("phase_rad", "rad", 0.0, -6.3, 6.3),
    ],
    choice: Choice::None,
    look_alikes: &["tx_leakage", "range_alias", "wall_ghost"],
    separate_by: "turn the radar: leakage stays in place, the object turns with the room; or change the sample rate, which moves an alias",
    operator: Operator::Reflector(|values, _, of| signal(values, of.radar, of.tx, of.dechirp, of.form)),
};

/// One transmitter's signal of the object, `[rx, 1, sample]`.
///
/// # Gradient
/// Flows to place, amplitude and phase.
pub fn signal(values: &Values, radar: &Radar, tx: usize, dechirp: Dechirp, form: SumForm) -> Complex<3> {
    let (reference_m, displacement) = place(values.vector("position_m"));
    let strength = values.phase::<2>().scale(values.scalar("amplitude"));
    let amplitude = Amplitude { re: strength.re, im: Some(strength.im) };
    let points = Points { reference_m: &[reference_m], displacement: &displacement, amplitude: &amplitude };
    direct_signal(points, radar, tx, dechirp, form)
}
