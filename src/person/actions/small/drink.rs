//! The right hand goes to the mouth, stays there for a moment, and comes down.

use super::{Moment, Plan, SmallAction, ease};

pub const ACTION: SmallAction = SmallAction { rate_hz: 0.25, shape };

fn shape(plan: &mut Plan, moment: &Moment) {
    let up = ease((moment.within - 0.05) / 0.25) - ease((moment.within - 0.65) / 0.25);
    let right = &mut plan.arms[1];
    right.swing += 0.75 * up;
    right.elbow += 1.85 * up;
    right.twist = -0.45 * up;
    plan.head.x = -0.15 * moment.reach * up;
}
