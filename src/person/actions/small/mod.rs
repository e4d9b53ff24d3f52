//! The smaller actions, on the spot, one file each: how often it repeats, and where the body is within a repetition.

pub mod bow;
pub mod clap;
pub mod drink;
pub mod foot_tap;
pub mod forearm_curl;
pub mod hand_wave;
pub mod heel_raise;
pub mod hip_circle;
pub mod jab;
pub mod knee_bend;
pub mod side_bend;
pub mod weight_shift;

use std::f64::consts::TAU;

use super::{
    StyleConfig,
    in_place::standing,
    plan::{ArmPlan, Plan, bump, ease},
    posing::Figure,
    variety::Variety,
};

/// An action that repeats itself on the spot.
pub struct SmallAction {
    /// Repetitions per second at a usual tempo.
    pub rate_hz: f64,
    /// Changes the plan of somebody who stands.
    pub shape: fn(&mut Plan, &Moment),
}

/// Where in its repetition an action is.
pub struct Moment<'a> {
    /// 0 to 1.
    pub within: f64,
    /// 0 to 2π.
    pub phase: f64,
    /// Rises from 0 at the start to 1 halfway, and falls again.
    pub cycle: f64,
    /// Relative size of the style; the same in all repetitions, for what does not stand still between two of them.
    pub size: f64,
    /// Relative size of this repetition, for what stands still at its ends.
    pub reach: f64,
    pub figure: &'a Figure,
}

impl SmallAction {
    pub fn plan(&self, style: &StyleConfig, figure: &Figure, variety: &Variety, time: f64) -> Plan {
        let repetitions = self.rate_hz * style.tempo * time;
        let within = repetitions - repetitions.floor();
        // Larger than this, a small action is none.
        let size = style.amplitude.min(1.25);
        let moment = Moment {
            within,
            phase: TAU * within,
            cycle: 0.5 - 0.5 * (TAU * within).cos(),
            size,
            reach: size * variety.repetition(repetitions.floor() as i64),
            figure,
        };
        let mut plan = standing(figure);
        (self.shape)(&mut plan, &moment);
        plan
    }
}
