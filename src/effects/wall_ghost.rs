//! The body's reflection in a wall (card P4, P5).

use super::{
    info::{Choice, EffectInfo, Stage},
    mirror::{mirrored_rx, mirrored_tx},
    operator::{Chirps, Operator},
    parameter::{amplitude, angle},
    values::Values,
};
use crate::{
    complex::Complex,
    if_signal::{SumForm, direct_signal},
    paths::{Dechirp, Points},
    radar::Radar,
    room::{Boundary, Room},
};

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "wall_ghost";

/// What reports and docs say of `wall_ghost`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "P4, P5",
    stage: Stage::Propagation,
    needs_person: true,
    title: "the body's reflection in a wall",
    explanation: "A wall mirrors the body: the wave goes out directly and comes back by way of the wall, and the other way round, which shows a ghost behind the person.",
    equation: "+ coefficient Σ_p A_p [exp j2π(f_c τ_1 + S t τ_1) + exp j2π(f_c τ_2 + S t τ_2)], τ_1 by way of the mirrored receiver, τ_2 of the mirrored transmitter",
    parameters: &[amplitude("coefficient", "1", 0.0, -1.0, 1.0), angle("phase_rad", "rad", 0.0, -6.3, 6.3)],
    choice: Choice::Boundary,
    look_alikes: &["body_multibounce", "floor_bounce"],
    separate_by: "stand at another distance from the wall: the ghost's delay follows the mirror law, a second person's does not",
    operator: Operator::Paths(|of, values| {
        let Chirps { radar, tx, dechirp, form, .. } = of.chirps;
        signal(of.points, values, of.room?, radar, tx, dechirp, form)
    }),
};

/// What one transmitter receives of these points by way of the wall, `[rx, chirp, sample]`; nothing where the room has no
/// such wall.
///
/// First order by image theory, the wall flat and its reflection the same for all angles; the points' amplitudes and who
/// is seen are those of the direct path. The second order (out and back by the wall) is left out.
///
/// # Gradient
/// Flows to the points and the values.
pub fn signal(
    points: Points,
    values: &Values,
    room: &Room,
    radar: &Radar,
    tx: usize,
    dechirp: Dechirp,
    form: SumForm,
) -> Option<Complex<3>> {
    let boundary = Boundary::ALL.into_iter().find(|boundary| Some(boundary.name()) == values.choice.as_deref())?;
    let distance_m = room.distance_m(boundary)?;
    let back = direct_signal(points, &mirrored_rx(radar, boundary, distance_m), tx, dechirp, form);
    let out = direct_signal(points, &mirrored_tx(radar, boundary, distance_m), tx, dechirp, form);
    let coefficient = values.phase::<3>().scale(values.scalar("coefficient"));
    Some(back.add(out).mul(coefficient))
}
