//! An object that moves by itself (card P2).

use std::f64::consts::TAU;

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, angle, shaping},
    points::place,
    values::Values,
};
use crate::{
    body::Displacement,
    complex::Complex,
    if_signal::{SumForm, direct_signal},
    paths::{Amplitude, Dechirp, Points},
    radar::Radar,
};

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "moving_reflector";

/// What reports and docs say of `moving_reflector`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "P2",
    stage: Stage::Scene,
    needs_person: false,
    title: "an object that moves by itself",
    explanation: "Something else moves, such as a fan, a curtain or a second person: an echo with a Doppler of its own.",
    equation: "+ amplitude e^{jφ} exp j2π(f_c τ + S t τ) / (d_tx d_rx), τ from position_m + axis · swing_m sin(2π rate_hz T + motion_rad)",
    parameters: &[
        shaping("position_m", "m", 0.0, -20.0, 20.0),
        shaping("rate_hz", "Hz", 0.0, 0.0, 20.0),
        shaping("swing_m", "m", 0.0, 0.0, 1.0),
        shaping("axis", "1", 0.0, -1.0, 1.0),
        shaping("motion_rad", "rad", 0.0, -6.3, 6.3),
        amplitude("amplitude", "recording's unit·m²", 0.0, -1000000000.0, 1000000000.0),
        angle("phase_rad", "rad", 0.0, -6.3, 6.3),
    ],
    choice: Choice::None,
    look_alikes: &["wall_ghost", "second_harmonic", "object_radar_object", "range_alias", "breathing", "heartbeat"],
    separate_by: "a recording of the room without the person: the object still moves, a ghost of the person does not",
    operator: Operator::Reflector(|values, times_s, of| signal(values, times_s, of.radar, of.tx, of.dechirp, of.form)),
};

/// One transmitter's signal of the object, `[rx, chirp, sample]`; `times_s` are those of the transmitter's chirps.
///
/// # Gradient
/// Flows to all values.
pub fn signal(values: &Values, times_s: &[f64], radar: &Radar, tx: usize, dechirp: Dechirp, form: SumForm) -> Complex<3> {
    let (reference_m, still) = place(values.vector("position_m"));
    let angle = values.tensor(times_s.to_vec(), [1, times_s.len()]) * values.scalar::<2>("rate_hz") * TAU;
    let swing = (angle + values.scalar::<2>("motion_rad")).sin() * values.scalar::<2>("swing_m");
    // Without an axis, to and from the radar.
    let [x, y, z] = if values.has("axis") {
        values.vector("axis").map(|part| part.reshape([1, 1]))
    } else {
        [0.0, 1.0, 0.0].map(|part| values.tensor(vec![part], [1, 1]))
    };
    let displacement = Displacement { x: still.x + x * swing.clone(), y: still.y + y * swing.clone(), z: still.z + z * swing };
    let strength = values.phase::<2>().scale(values.scalar("amplitude"));
    let amplitude = Amplitude { re: strength.re, im: Some(strength.im) };
    let points = Points { reference_m: &[reference_m], displacement: &displacement, amplitude: &amplitude };
    direct_signal(points, radar, tx, dechirp, form)
}
