//! The knees bend a little and straighten, the arms come forward meanwhile.

use super::{Moment, Plan, SmallAction};

pub const ACTION: SmallAction = SmallAction { rate_hz: 0.5, shape };

fn shape(plan: &mut Plan, moment: &Moment) {
    let down = moment.reach * moment.cycle;
    plan.pelvis.y = -0.05 * moment.figure.leg_m() * down;
    plan.pelvis.z = -0.02 * down;
    plan.trunk.x = 0.14 * down;
    for arm in &mut plan.arms {
        arm.swing += 0.50 * down;
    }
}
