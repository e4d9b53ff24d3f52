//! Up on both balls, down, and a rest on the whole feet.

use super::{Moment, Plan, SmallAction, ease};

pub const ACTION: SmallAction = SmallAction { rate_hz: 0.6, shape };

fn shape(plan: &mut Plan, moment: &Moment) {
    let up = moment.reach * (ease((moment.within - 0.20) / 0.28) - ease((moment.within - 0.56) / 0.28));
    let pitch = 0.45 * up;
    plan.feet.iter_mut().for_each(|foot| foot.pitch = pitch);
    plan.pelvis.y = moment.figure.heel_rise_m(pitch);
    plan.pelvis.z = 0.03 * up;
}
