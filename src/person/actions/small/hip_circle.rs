//! The hips go around; the chest stays where it is.

use super::{Moment, Plan, SmallAction};

pub const ACTION: SmallAction = SmallAction { rate_hz: 0.5, shape };

fn shape(plan: &mut Plan, moment: &Moment) {
    let (ahead, aside) = (moment.phase.cos(), moment.phase.sin());
    plan.pelvis.x = 0.06 * moment.size * aside;
    plan.pelvis.z = 0.06 * moment.size * ahead;
    plan.pelvis_turn.x = -0.10 * moment.size * ahead;
    plan.pelvis_turn.z = 0.08 * moment.size * aside;
    plan.trunk.x = 0.10 * moment.size * ahead;
    plan.trunk.z = -0.08 * moment.size * aside;
}
