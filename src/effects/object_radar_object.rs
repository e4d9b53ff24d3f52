//! A second trip between the scene and the radar (card R6).

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, angle, fixed},
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "object_radar_object";

/// What reports and docs say of `object_radar_object`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "R6",
    stage: Stage::Propagation,
    needs_person: false,
    title: "a second trip between the scene and the radar",
    explanation: "Part of the echo is reflected by the radar itself and goes to the scene once more: everything appears again at twice the range and twice the speed, in every pair.",
    equation: "s_{t,r} → s_{t,r} + coefficient s_{t,0} s_{0,r} / reference",
    parameters: &[
        amplitude("coefficient", "1", 0.0, -1.0, 1.0),
        angle("phase_rad", "rad", 0.0, -6.3, 6.3),
        fixed("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    choice: Choice::None,
    look_alikes: &["second_harmonic", "wall_ghost"],
    separate_by: "step out of the boresight: a harmonic doubles the phases across the array, the second trip does not; or lower the transmit power by 6 dB",
    operator: Operator::Nonlinear(apply),
};

/// A product of two beams: the way out ends at the radar's board, where the first receiver stands for it, and the second
/// trip starts there, where the first transmitter stands for it. Exact for a board that is small against the range's
/// Fresnel zone, but for the cross term of the residual video phase.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let _ = context;
    let reference = values.reference(&signal).reshape([1, 1, 1, 1]);
    let strength = values.phase::<4>().scale(values.scalar::<4>("coefficient") / reference);
    let out = signal.clone().narrow(1, 0, 1);
    let back = signal.clone().narrow(0, 0, 1);
    signal.add(out.mul(back).mul(strength))
}
