//! From a plan to the rotations of the 24 joints.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3, vector};

use super::plan::{ArmPlan, FootPlan, Plan, ahead, ease};
use crate::person::BodyModel;

type Point = Vector3<f64>;

/// A leg is never straighter than this share of its length, so that the knee knows where to bend.
const STRAIGHT: f64 = 0.998;
/// What the pelvis's height leaves of it.
const RELAXED: f64 = 0.996;

/// The measures of a body that an action needs.
pub struct Figure {
    joints: Vec<Point>,
    /// Height of the lowest vertex.
    sole: f64,
}

fn about(axis: usize, angle: f64) -> Rotation3<f64> {
    let mut vector = Point::zeros();
    vector[axis] = angle;
    Rotation3::new(vector)
}

/// The rotation whose y axis is `along` and whose z axis is as near to `front` as it can be.
fn frame(along: Point, front: Point) -> Rotation3<f64> {
    let y = along.normalize();
    let z = (front - y * front.dot(&y)).normalize();
    Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[y.cross(&z), y, z]))
}

impl Figure {
    pub fn new(model: &BodyModel, betas: &[f64]) -> Self {
        let joints = model.rest_joints(betas).into_iter().map(Point::from).collect();
        let sole = model.shaped(betas).iter().map(|vertex| vertex[1]).fold(f64::INFINITY, f64::min);
        Self { joints, sole }
    }

    /// Half the distance between the hips.
    pub fn hip_m(&self) -> f64 {
        0.5 * (self.joints[1].x - self.joints[2].x)
    }

    /// From hip to ankle.
    pub fn leg_m(&self) -> f64 {
        self.thigh_m(0) + self.shank_m(0)
    }

    /// How far an ankle rises when its foot stands on the ball with this pitch.
    pub fn heel_rise_m(&self, pitch: f64) -> f64 {
        let (ankle, ball) = (self.joints[7], self.joints[10]);
        let (forward, height) = (ball.z - ankle.z, ankle.y - self.sole);
        forward * pitch.sin() - height * (1.0 - pitch.cos())
    }

    fn thigh_m(&self, side: usize) -> f64 {
        (self.joints[4 + side] - self.joints[1 + side]).norm()
    }

    fn shank_m(&self, side: usize) -> f64 {
        (self.joints[7 + side] - self.joints[4 + side]).norm()
    }

    /// Axis-angle per joint and the translation of the body.
    pub fn pose(&self, plan: &Plan) -> (Vec<[f64; 3]>, [f64; 3]) {
        let mut local = vec![Rotation3::identity(); 24];
        let turn = plan.pelvis_turn;
        let pelvis = about(1, plan.heading + turn.y) * about(0, turn.x) * about(2, turn.z);
        local[0] = pelvis;
        let place = self.pelvis_place(plan, &pelvis);
        for side in 0..2 {
            self.bend_leg(side, plan, &pelvis, place, &mut local);
        }
        for joint in [3, 6, 9] {
            local[joint] = Rotation3::new(plan.trunk / 3.0);
        }
        for joint in [12, 15] {
            local[joint] = Rotation3::new(plan.head / 2.0);
        }
        for (side, arm) in plan.arms.iter().enumerate() {
            bend_arm(side, arm, &mut local);
        }
        // Through quaternions: the arc cosine of a matrix's trace is inexact, or no number, near no turn.
        let poses = local.iter().map(|turn| UnitQuaternion::from_rotation_matrix(turn).scaled_axis().into()).collect();
        (poses, (place - self.joints[0]).into())
    }

    /// As high as both legs and a standing body allow, and the plan's lowering.
    fn pelvis_place(&self, plan: &Plan, pelvis: &Rotation3<f64>) -> Point {
        let limit = |side: usize| {
            let hip = pelvis * (self.joints[1 + side] - self.joints[0]);
            let to_ankle = self.ankle(side, &plan.feet[side]) - plan.pelvis - hip;
            let reach = RELAXED * (self.thigh_m(side) + self.shank_m(side));
            let aside = to_ankle.x.powi(2) + to_ankle.z.powi(2);
            to_ankle.y + plan.pelvis.y + (reach * reach - aside).max(0.25 * reach * reach).sqrt()
        };
        let standing = self.joints[0].y - self.sole;
        // A smooth minimum: nothing jumps when the weight moves from one leg to the other.
        let softness = 0.008;
        let limits = [limit(0), limit(1), standing];
        let lowest = limits.into_iter().fold(f64::INFINITY, f64::min);
        let sum: f64 = limits.iter().map(|limit| ((lowest - limit) / softness).exp()).sum();
        vector![plan.pelvis.x, lowest - softness * sum.ln() + plan.pelvis.y, plan.pelvis.z]
    }

    /// Where the ankle is when the foot rolls over its heel or its ball.
    fn ankle(&self, side: usize, foot: &FootPlan) -> Point {
        let (ankle, ball) = (self.joints[7 + side], self.joints[10 + side]);
        let forward = ball.z - ankle.z;
        // The point that touches the floor moves from behind the ankle to the ball as the foot tips over.
        let contact = vector![0.0, 0.0, forward * (-0.55 + 1.55 * ease((foot.pitch + 0.1) / 0.2))];
        let above = vector![0.0, ankle.y - self.sole, 0.0] - contact;
        foot.place + about(1, foot.heading) * (contact + about(0, foot.pitch) * above)
    }

    fn bend_leg(&self, side: usize, plan: &Plan, pelvis: &Rotation3<f64>, place: Point, local: &mut [Rotation3<f64>]) {
        let [hip_rest, knee_rest, ankle_rest] = [1, 4, 7].map(|joint| self.joints[joint + side]);
        let foot = &plan.feet[side];
        let hip = place + pelvis * (hip_rest - self.joints[0]);
        let to_ankle = self.ankle(side, foot) - hip;
        let (thigh, shank) = (self.thigh_m(side), self.shank_m(side));
        // What is out of reach is approached smoothly, never met with a straight leg.
        let (most, softness) = (STRAIGHT * (thigh + shank), 0.004 * (thigh + shank));
        let missing = (most - to_ankle.norm()) / softness;
        let distance = most - softness * (missing.max(0.0) + (-missing.abs()).exp().ln_1p());

        // The law of cosines gives the knee; it bends ahead, between where pelvis and foot point.
        let down = to_ankle.normalize();
        let front = ahead(0.5 * (plan.heading + plan.pelvis_turn.y + foot.heading));
        let knee_front = (front - down * front.dot(&down)).normalize();
        let along = (thigh * thigh - shank * shank + distance * distance) / (2.0 * distance);
        let knee = down * along + knee_front * (thigh * thigh - along * along).max(0.0).sqrt();

        let thigh_turn = frame(knee, knee_front) * frame(knee_rest - hip_rest, Point::z()).inverse();
        let shank_turn = frame(down * distance - knee, knee_front) * frame(ankle_rest - knee_rest, Point::z()).inverse();
        let foot_turn = about(1, foot.heading) * about(0, foot.pitch);
        local[1 + side] = pelvis.inverse() * thigh_turn;
        local[4 + side] = thigh_turn.inverse() * shank_turn;
        local[7 + side] = shank_turn.inverse() * foot_turn;
        // The toes stay on the floor while the heel rises.
        local[10 + side] = about(0, -foot.pitch * ease((foot.pitch + 0.1) / 0.2));
    }
}

/// From the T-pose down to the side, then forwards; the collar bone takes a part of it.
fn bend_arm(side: usize, arm: &ArmPlan, local: &mut [Rotation3<f64>]) {
    let out = if side == 0 { 1.0 } else { -1.0 };
    let lowering = FRAC_PI_2 - arm.raise;
    let collar = about(1, -0.08 * out * arm.swing) * about(2, -0.09 * out * lowering);
    local[13 + side] = collar;
    local[16 + side] = collar.inverse() * about(0, -arm.swing) * about(2, -out * lowering) * about(0, -arm.twist);
    local[18 + side] = about(1, -out * arm.elbow);
    // Relaxed hands.
    local[20 + side] = about(2, -0.06 * out);
}
