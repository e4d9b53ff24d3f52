//! The person as an implicit surface: rounded cones along the skeleton, smoothly united, cut flat at the sole.

use nalgebra::{Vector3, vector};

use super::{PersonConfig, skeleton::Skeleton};

/// A cone with round ends whose cross-section may be wider or narrower along one axis.
struct Cone {
    from: Vector3<f64>,
    to: Vector3<f64>,
    /// At both ends.
    radius_m: [f64; 2],
    /// Inverse of the stretch along each axis.
    squeeze: Vector3<f64>,
}

impl Cone {
    /// About the signed distance from the surface, metres: exact without stretch.
    fn value(&self, point: &Vector3<f64>) -> f64 {
        let along = self.to - self.from;
        let fraction = ((point - self.from).dot(&along) / along.norm_squared().max(1e-12)).clamp(0.0, 1.0);
        let offset = point - self.from - along * fraction;
        offset.component_mul(&self.squeeze).norm() - self.radius_m[0] - (self.radius_m[1] - self.radius_m[0]) * fraction
    }
}

/// A body's cones, and the lengths of which their radii are shares.
struct Built<'a> {
    skeleton: &'a Skeleton,
    height: f64,
    girth: f64,
    extremity: f64,
    cones: Vec<Cone>,
}

impl<'a> Built<'a> {
    fn new(config: &PersonConfig, skeleton: &'a Skeleton) -> Self {
        let height = config.height_m;
        let (girth, extremity) = (height * config.build, height * config.build.powf(0.35));
        Self { skeleton, height, girth, extremity, cones: Vec::new() }
    }

    fn add(&mut self, from: Vector3<f64>, to: Vector3<f64>, radii: [f64; 2], scale: f64, stretch: [f64; 3]) {
        let squeeze = Vector3::from(stretch.map(|factor| 1.0 / factor));
        self.cones.push(Cone { from, to, radius_m: radii.map(|radius| radius * scale), squeeze });
    }

    /// Pelvis, belly, chest, neck, head.
    fn trunk(&mut self, belly: f64) {
        let (joints, height, girth, extremity) = (&self.skeleton.joints, self.height, self.girth, self.extremity);
        let middle = |joint: usize, forward: f64| joints[joint] + vector![0.0, 0.0, forward * height];
        let pelvis = joints[1].x * 0.70;
        self.add(
            vector![-pelvis, -0.012 * height, -0.006 * height],
            vector![pelvis, -0.012 * height, -0.006 * height],
            [0.053; 2],
            girth,
            [1.0, 1.05, 1.12],
        );
        self.add(middle(3, 0.008), middle(6, 0.012), [0.078, 0.077], girth, [1.0, 1.0, 0.72 * belly]);
        self.add(middle(6, 0.010), middle(9, 0.016) + vector![0.0, 0.028 * height, 0.0], [0.083, 0.093], girth, [1.0, 1.0, 0.68]);
        self.add(middle(12, 0.0) - vector![0.0, 0.035 * height, 0.0], middle(15, 0.0), [0.034, 0.031], extremity, [1.0; 3]);
        let skull = self.skeleton.head_top - vector![0.0, 0.0455 * height, 0.0];
        self.add(joints[15] + vector![0.0, 0.018, 0.012] * height, skull, [0.034, 0.0455], height, [0.95, 1.0, 1.14]);
        self.add(
            joints[15] + vector![0.0, 0.030, 0.042] * height,
            joints[15] + vector![0.0, 0.042, 0.052] * height,
            [0.012, 0.009],
            height,
            [1.0; 3],
        );
    }

    /// To the side, the body's height.
    fn out(&self, side: usize) -> f64 {
        self.skeleton.joints[1 + side].x.signum() * self.height
    }

    fn arm(&mut self, side: usize) {
        let (height, girth, extremity, out) = (self.height, self.girth, self.extremity, self.out(side));
        let [collar, shoulder, elbow, wrist] = [13, 16, 18, 20].map(|joint| self.skeleton.joints[joint + side]);
        // Shoulder girdle and arm.
        self.add(collar + vector![0.018 * out, -0.012 * height, 0.0], shoulder, [0.044, 0.038], girth, [1.0, 1.0, 1.05]);
        self.add(collar + vector![0.0, 0.012 * height, -0.004 * height], shoulder, [0.026, 0.030], girth, [1.0; 3]);
        self.add(shoulder, elbow, [0.0335, 0.0245], girth, [1.0; 3]);
        self.add(elbow, elbow + (wrist - elbow) * 0.35, [0.0245, 0.0255], girth, [1.0; 3]);
        self.add(elbow + (wrist - elbow) * 0.35, wrist, [0.0255, 0.0165], girth, [1.0; 3]);
        let tip = self.skeleton.fingertips[side] - vector![0.018 * out, 0.0, 0.0];
        let palm = wrist + vector![0.025 * out, 0.0, 0.002 * height];
        self.add(wrist, palm, [0.0170, 0.0230], extremity, [1.0, 0.68, 1.0]);
        self.add(palm, tip, [0.0230, 0.0185], extremity, [1.0, 0.58, 1.0]);
    }

    fn leg(&mut self, side: usize) {
        let (height, girth, extremity, out) = (self.height, self.girth, self.extremity, self.out(side));
        let [hip, knee, ankle, ball] = [1, 4, 7, 10].map(|joint| self.skeleton.joints[joint + side]);
        // Seat, thigh, shank with the calf behind it.
        self.add(
            hip + vector![-0.006 * out, -0.012 * height, -0.026 * height],
            hip + vector![-0.004 * out, -0.035 * height, -0.022 * height],
            [0.046, 0.044],
            girth,
            [1.0; 3],
        );
        self.add(hip + vector![0.004 * out, -0.02 * height, 0.004 * height], knee, [0.0485, 0.0325], girth, [1.0; 3]);
        self.add(knee, ankle, [0.0325, 0.0200], girth, [1.0; 3]);
        let calf = |fraction: f64, back: f64| knee + (ankle - knee) * fraction - vector![0.0, 0.0, back * height];
        self.add(calf(0.15, 0.008), calf(0.42, 0.009), [0.027, 0.027], girth, [1.0; 3]);
        // Foot: heel, instep, toes.
        self.add(self.skeleton.heels[side], ankle, [0.021, 0.020], extremity, [1.0; 3]);
        self.add(ankle - vector![0.0, 0.008 * height, 0.0], ball, [0.021, 0.021], extremity, [1.05, 0.9, 1.0]);
        self.add(self.skeleton.heels[side], ball, [0.021, 0.024], extremity, [1.0, 0.85, 1.0]);
        self.add(ball, self.skeleton.toes[side], [0.024, 0.0185], extremity, [1.0, 0.72, 1.0]);
    }
}

pub struct Flesh {
    cones: Vec<Cone>,
    /// Width over which neighbouring cones melt into each other.
    blend_m: f64,
    floor_m: f64,
    low: Vector3<f64>,
    high: Vector3<f64>,
}

impl Flesh {
    pub fn new(config: &PersonConfig, skeleton: &Skeleton) -> Self {
        let height = config.height_m;
        let mut built = Built::new(config, skeleton);
        built.trunk(1.0 + 0.5 * (config.build - 1.0).max(0.0));
        for side in 0..2 {
            built.arm(side);
            built.leg(side);
        }
        let cones = built.cones;

        let reach = vector![0.06, 0.06, 0.15] * height * config.build.max(1.0);
        let side = vector![skeleton.fingertips[0].x, 0.0, 0.0];
        let low = vector![0.0, -skeleton.floor_m, 0.0] - side - reach;
        let high = skeleton.head_top + side + reach;
        Self { cones, blend_m: 0.0075 * height, floor_m: skeleton.floor_m, low, high }
    }

    /// A box with the whole surface inside.
    pub fn extent(&self) -> (Vector3<f64>, Vector3<f64>) {
        (self.low, self.high)
    }

    /// Negative inside, positive outside, about metres, smooth.
    pub fn value(&self, point: &Vector3<f64>) -> f64 {
        let (nearest, sum) = self.cones.iter().fold((f64::INFINITY, 0.0), |(nearest, sum), cone| {
            let value = cone.value(point);
            // Running log-sum-exp: rescales when a nearer cone appears, so that nothing overflows.
            if value < nearest {
                (value, if sum > 0.0 { sum * ((value - nearest) / self.blend_m).exp() } else { 0.0 } + 1.0)
            } else {
                (nearest, sum + ((nearest - value) / self.blend_m).exp())
            }
        });
        let union = nearest - self.blend_m * sum.ln();
        // The flat sole: a smooth maximum with the half-space below the floor.
        let below = -self.floor_m - point.y;
        let softness = 0.004;
        union.max(below) + softness * (-(union - below).abs() / softness).exp().ln_1p()
    }

    /// Gradient of [`Flesh::value`] by central differences.
    pub fn gradient(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let step = 1e-5;
        Vector3::from_fn(|axis, _| {
            let mut shift = Vector3::zeros();
            shift[axis] = step;
            (self.value(&(point + shift)) - self.value(&(point - shift))) / (2.0 * step)
        })
    }

    /// Moves a point near the surface onto it by Newton steps of bounded length.
    pub fn project(&self, mut point: Vector3<f64>, steps: usize) -> Vector3<f64> {
        for _ in 0..steps {
            let value = self.value(&point);
            if value.abs() < 1e-9 {
                break;
            }
            let gradient = self.gradient(&point);
            let step = gradient * (value / gradient.norm_squared().max(1e-2));
            point -= step * (0.01 / step.norm().max(0.01));
        }
        point
    }
}
