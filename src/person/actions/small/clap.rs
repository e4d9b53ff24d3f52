//! The hands meet in front of the belly and part.

use super::{Moment, Plan, SmallAction};

pub const ACTION: SmallAction = SmallAction { rate_hz: 1.3, shape };

fn shape(plan: &mut Plan, moment: &Moment) {
    let together = moment.reach * moment.cycle;
    for arm in &mut plan.arms {
        (arm.swing, arm.elbow) = (0.35, 1.45);
        arm.twist = 0.30 - 0.80 * together;
    }
}
