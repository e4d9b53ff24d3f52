//! The fists are before the chest and punch in turn, the left one first.

use super::{Moment, Plan, SmallAction, bump};

pub const ACTION: SmallAction = SmallAction { rate_hz: 0.8, shape };

fn shape(plan: &mut Plan, moment: &Moment) {
    let punches = [0.0, 0.5].map(|from| bump(moment.within, from, 0.5));
    for (arm, punch) in plan.arms.iter_mut().zip(punches) {
        (arm.swing, arm.raise) = (0.35 + 0.85 * moment.size * punch, 0.25);
        arm.elbow = 1.95 - 1.25 * moment.size * punch;
    }
    // The shoulder goes with its fist.
    plan.trunk.y = -0.14 * moment.size * (punches[0] - punches[1]);
}
