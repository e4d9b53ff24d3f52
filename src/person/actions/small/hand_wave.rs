//! The right hand is up beside the shoulder and waves.

use super::{ArmPlan, Moment, Plan, SmallAction};

pub const ACTION: SmallAction = SmallAction { rate_hz: 1.2, shape };

fn shape(plan: &mut Plan, moment: &Moment) {
    plan.arms[1] = ArmPlan { swing: 0.25, raise: 0.75, elbow: 1.75 + 0.40 * moment.size * moment.phase.sin(), twist: 1.35 };
}
