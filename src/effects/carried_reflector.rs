//! An object that the person carries.

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, angle},
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
pub const ID: &str = "carried_reflector";

/// What reports and docs say of `carried_reflector`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "",
    stage: Stage::Scene,
    needs_person: true,
    title: "an object that the person carries",
    explanation: "The person carries something that reflects, such as a telephone or keys: an echo that moves with one part of the body.",
    equation: "+ amplitude e^{jφ} exp j2π(f_c τ + S t τ) / (d_tx d_rx), τ from the point in the middle of the body part",
    parameters: &[
        amplitude("amplitude", "recording's unit·m²", 0.0, -1000000000.0, 1000000000.0),
        angle("phase_rad", "rad", 0.0, -6.3, 6.3),
    ],
    choice: Choice::Part,
    look_alikes: &["part_reflectivity", "clothing_delay"],
    separate_by: "the same motion with empty hands and pockets",
    operator: Operator::Carried(|values, place_m, moved, of| {
        signal(values, place_m, moved, of.radar, of.tx, of.dechirp, of.form)
    }),
};

/// One transmitter's signal of the object, `[rx, chirp, sample]`, from where the body's point is that carries it.
///
/// # Gradient
/// Flows to amplitude, phase and displacement.
pub fn signal(
    values: &Values,
    reference_m: [f64; 3],
    displacement: &Displacement,
    radar: &Radar,
    tx: usize,
    dechirp: Dechirp,
    form: SumForm,
) -> Complex<3> {
    let strength = values.phase::<2>().scale(values.scalar("amplitude"));
    let amplitude = Amplitude { re: strength.re, im: Some(strength.im) };
    direct_signal(Points { reference_m: &[reference_m], displacement, amplitude: &amplitude }, radar, tx, dechirp, form)
}
