//! The weight is on the left leg, and the toes of the right foot tap.

use super::{Moment, Plan, SmallAction};

pub const ACTION: SmallAction = SmallAction { rate_hz: 1.1, shape };

fn shape(plan: &mut Plan, moment: &Moment) {
    plan.pelvis.x = 0.03;
    plan.feet[1].pitch = -0.16 * moment.reach * moment.cycle;
}
