//! Where the parts of the body should be at one time.

use nalgebra::{Vector3, vector};

/// One foot; 0 in every field is flat on the floor at the origin, pointing to +z.
#[derive(Clone, Copy, Default)]
pub struct FootPlan {
    /// Point below the ankle if the foot were flat; y is its height above the floor. Metres.
    pub place: Vector3<f64>,
    /// About y, positive to the person's left. Radians.
    pub heading: f64,
    /// Positive: the heel is up and the foot stands on its ball; negative: on its heel.
    pub pitch: f64,
}

/// One arm, angles in radians relative to the chest.
#[derive(Clone, Copy, Default)]
pub struct ArmPlan {
    /// Forwards of the hanging arm.
    pub swing: f64,
    /// Sideways; 0 hangs, π/2 is a T-pose.
    pub raise: f64,
    pub elbow: f64,
    /// Of the upper arm about its own axis, which turns a bent forearm outwards (up where the arm is in a T-pose).
    pub twist: f64,
}

/// The whole body. All numbers may be averaged, headings are not wrapped.
#[derive(Clone, Default)]
pub struct Plan {
    /// x and z on the floor; y is added to the height that the legs allow. Metres.
    pub pelvis: Vector3<f64>,
    pub heading: f64,
    /// Of the pelvis relative to the heading: x leans forward, y turns left, z lifts the left side.
    pub pelvis_turn: Vector3<f64>,
    /// Rotation vectors of the chest relative to the pelvis and of the head relative to the chest.
    pub trunk: Vector3<f64>,
    pub head: Vector3<f64>,
    /// Left, right.
    pub feet: [FootPlan; 2],
    pub arms: [ArmPlan; 2],
}

impl Plan {
    fn add(&mut self, other: &Self, weight: f64) {
        self.pelvis += other.pelvis * weight;
        self.heading += other.heading * weight;
        self.pelvis_turn += other.pelvis_turn * weight;
        self.trunk += other.trunk * weight;
        self.head += other.head * weight;
        for (foot, more) in self.feet.iter_mut().zip(&other.feet) {
            foot.place += more.place * weight;
            foot.heading += more.heading * weight;
            foot.pitch += more.pitch * weight;
        }
        for (arm, more) in self.arms.iter_mut().zip(&other.arms) {
            arm.swing += more.swing * weight;
            arm.raise += more.raise * weight;
            arm.elbow += more.elbow * weight;
            arm.twist += more.twist * weight;
        }
    }

    /// Average of the plans around `time` with a bell of 22 ms, which rounds off what starts or stops abruptly.
    pub fn smoothed(time: f64, plan: impl Fn(f64) -> Self) -> Self {
        let (width, step, reach) = (0.022_f64, 0.011, 5);
        let weight = |offset: f64| (-0.5 * (offset / width).powi(2)).exp();
        let total: f64 = (-reach..=reach).map(|n| weight(n as f64 * step)).sum();
        let mut sum = Self::default();
        for n in -reach..=reach {
            let offset = n as f64 * step;
            sum.add(&plan(time + offset), weight(offset) / total);
        }
        sum
    }
}

/// The rise from 0 to 1 over 0 to 1 with level ends, and 0 or 1 beyond.
pub fn ease(fraction: f64) -> f64 {
    let fraction = fraction.clamp(0.0, 1.0);
    fraction * fraction * (3.0 - 2.0 * fraction)
}

/// The rise from 0 to 1 and the fall back to 0 between `from` and `from + length`, with level ends, and 0 beyond.
pub fn bump(at: f64, from: f64, length: f64) -> f64 {
    (std::f64::consts::PI * ((at - from) / length).clamp(0.0, 1.0)).sin().powi(2)
}

pub fn mix(from: f64, to: f64, share: f64) -> f64 {
    from + (to - from) * share
}

/// The direction ahead of someone with this heading, on the floor.
pub fn ahead(heading: f64) -> Vector3<f64> {
    vector![heading.sin(), 0.0, heading.cos()]
}

/// The direction to their left.
pub fn leftwards(heading: f64) -> Vector3<f64> {
    vector![heading.cos(), 0.0, -heading.sin()]
}
