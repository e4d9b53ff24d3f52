//! The trunk bends forward and rises; the arms keep hanging.

use super::{Moment, Plan, SmallAction};

pub const ACTION: SmallAction = SmallAction { rate_hz: 0.35, shape };

fn shape(plan: &mut Plan, moment: &Moment) {
    let bent = moment.reach * moment.cycle;
    plan.trunk.x = 0.50 * bent;
    plan.pelvis_turn.x = 0.16 * bent;
    plan.pelvis.z = -0.05 * bent;
    for arm in &mut plan.arms {
        arm.swing += 0.60 * bent;
    }
}
