//! Both forearms come up and go down together.

use super::{Moment, Plan, SmallAction};

pub const ACTION: SmallAction = SmallAction { rate_hz: 0.7, shape };

fn shape(plan: &mut Plan, moment: &Moment) {
    for arm in &mut plan.arms {
        arm.elbow += 1.55 * moment.reach * moment.cycle;
        arm.swing += 0.10 * moment.reach * moment.cycle;
    }
}
