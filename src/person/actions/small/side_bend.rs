//! The trunk bends to one side and to the other.

use super::{Moment, Plan, SmallAction};

pub const ACTION: SmallAction = SmallAction { rate_hz: 0.4, shape };

fn shape(plan: &mut Plan, moment: &Moment) {
    let bend = moment.size * moment.phase.sin();
    plan.trunk.z = 0.32 * bend;
    plan.pelvis.x = 0.03 * bend;
}
