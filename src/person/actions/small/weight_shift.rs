//! The weight goes from one leg to the other.

use super::{Moment, Plan, SmallAction};

pub const ACTION: SmallAction = SmallAction { rate_hz: 0.45, shape };

fn shape(plan: &mut Plan, moment: &Moment) {
    let aside = moment.size * moment.phase.sin();
    plan.pelvis.x = 0.075 * aside;
    plan.pelvis_turn.z = 0.05 * aside;
    plan.trunk.z = -0.07 * aside;
}
