//! The body's reflection in the floor (card P6).

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
pub const ID: &str = "floor_bounce";

/// What reports and docs say of `floor_bounce`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "P6",
    stage: Stage::Propagation,
    needs_person: true,
    title: "the body's reflection in the floor",
    explanation: "The wave also reaches the body by way of the floor, once or twice; the sum with the direct wave makes the echo interfere with itself, stronger and weaker with range.",
    equation: "+ Σ_p A_p [Γ (e^{j…τ_1} + e^{j…τ_2}) + Γ² e^{j…τ_12}], Γ = coefficient, the mirror being the floor",
    parameters: &[amplitude("coefficient", "1", 0.0, -1.0, 1.0), angle("phase_rad", "rad", 0.0, -6.3, 6.3)],
    choice: Choice::None,
    look_alikes: &["part_reflectivity", "body_multibounce"],
    separate_by: "a carpet or absorber on the floor between radar and person",
    operator: Operator::Paths(|of, values| {
        let Chirps { radar, tx, dechirp, form, .. } = of.chirps;
        signal(of.points, values, of.room?, radar, tx, dechirp, form)
    }),
};

/// What one transmitter receives of these points by way of the floor, once or both ways, `[rx, chirp, sample]`; nothing
/// in a room without a floor.
///
/// By image theory, the floor flat and its reflection the same for all angles; the points' amplitudes and who is seen are
/// those of the direct path.
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
    let distance_m = room.distance_m(Boundary::Floor)?;
    let rx = mirrored_rx(radar, Boundary::Floor, distance_m);
    let once = direct_signal(points, &rx, tx, dechirp, form).add(direct_signal(
        points,
        &mirrored_tx(radar, Boundary::Floor, distance_m),
        tx,
        dechirp,
        form,
    ));
    let twice = direct_signal(points, &mirrored_tx(&rx, Boundary::Floor, distance_m), tx, dechirp, form);
    let coefficient = values.phase::<3>().scale(values.scalar("coefficient"));
    let square = coefficient.clone().mul(coefficient.clone());
    Some(once.mul(coefficient).add(twice.mul(square)))
}
