//! Walking along a path: feet planted on the floor, the body between them, the arms opposite to the legs.

use std::f64::consts::{PI, TAU};

use nalgebra::{Vector3, vector};

use super::{
    StyleConfig,
    plan::{ArmPlan, FootPlan, Plan, ahead, ease, leftwards, mix},
    posing::Figure,
    variety::Variety,
};

/// Where the pelvis is on the floor.
pub struct Waypoint {
    pub place: Vector3<f64>,
    pub heading: f64,
    /// Speed along the path relative to cruising, 0 to 1.
    pub pace: f64,
}

/// A cyclic gait over a path.
pub struct Gait<'a, Path: Fn(f64) -> Waypoint> {
    pub path: Path,
    pub strides_per_s: f64,
    /// Share of the stride that a foot is on the floor.
    pub stance: f64,
    /// Height of the swinging foot at full pace and when stepping on the spot, metres.
    pub lift_m: [f64; 2],
    /// Largest swing of the arms, radians.
    pub arm_swing: f64,
    pub elbow: f64,
    /// Share of the stride, from the left foot's strike, at which the right arm is in front.
    pub arm_phase: f64,
    pub variety: &'a Variety,
    pub figure: &'a Figure,
}

/// Share of the stride after which the pelvis passes over the foot.
const PASSING: f64 = 0.26;

impl<Path: Fn(f64) -> Waypoint> Gait<'_, Path> {
    pub fn plan(&self, time: f64) -> Plan {
        let here = (self.path)(time);
        let phase = self.strides_per_s * time;
        // Largest when the left foot strikes, and when the left foot carries all weight.
        let (striking, carrying) = ((TAU * phase).cos(), (TAU * (phase - 0.31)).cos());
        let turn = -0.11 * striking * here.pace;
        let reaching = (TAU * (phase - self.arm_phase)).cos();
        let arm = |sign: f64| {
            let forward = sign * reaching * self.arm_swing * mix(0.35, 1.0, here.pace);
            ArmPlan { swing: 0.04 + forward, raise: 0.15, elbow: self.elbow + 0.35 * (forward + self.arm_swing), twist: 0.0 }
        };
        Plan {
            pelvis: here.place + leftwards(here.heading) * (0.018 * carrying),
            heading: here.heading,
            pelvis_turn: vector![0.05 * here.pace, turn, 0.045 * carrying],
            trunk: vector![0.02, -2.0 * turn, -0.06 * carrying],
            head: vector![-0.04, 0.9 * turn, 0.0],
            feet: [self.foot(0, time), self.foot(1, time)],
            arms: [arm(-1.0), arm(1.0)],
        }
    }

    fn foot(&self, side: usize, time: f64) -> FootPlan {
        let phase = self.strides_per_s * time + 0.5 * side as f64;
        let (number, within) = (phase.floor() as i64, phase - phase.floor());
        if within < self.stance {
            return self.planted(side, number, within);
        }
        let (from, to) = (self.planted(side, number, self.stance), self.planted(side, number + 1, 0.0));
        let fraction = (within - self.stance) / (1.0 - self.stance);
        let share = ease(fraction);
        let [walking, stepping] = self.lift_m;
        let pace = mix(self.pace(side, number), self.pace(side, number + 1), share);
        let lift = mix(stepping, walking, pace) * (PI * fraction).sin().powi(2);
        FootPlan {
            place: from.place.lerp(&to.place, share) + vector![0.0, lift, 0.0],
            heading: mix(from.heading, to.heading, share),
            pitch: mix(from.pitch, to.pitch, ease(fraction / 0.9)),
        }
    }

    /// When the pelvis passes over the n-th step of a foot.
    fn passing(&self, side: usize, number: i64) -> f64 {
        (number as f64 + PASSING - 0.5 * side as f64) / self.strides_per_s
    }

    fn pace(&self, side: usize, number: i64) -> f64 {
        (self.path)(self.passing(side, number)).pace
    }

    /// The foot during its n-th stance: it stays, rolls from heel to toe, and pivots with a turning body.
    fn planted(&self, side: usize, number: i64, within: f64) -> FootPlan {
        let at = self.passing(side, number);
        let over = (self.path)(at);
        let now = (self.path)(at + (within - PASSING) / self.strides_per_s);
        let (jitter, turn) = self.variety.step(side, number);
        let out = if side == 0 { 1.0 } else { -1.0 };
        let width = 0.62 * self.figure.hip_m();
        let roll = mix(0.3, 1.0, over.pace);
        let strike = -0.32 * (1.0 - ease(within / 0.10));
        let push = 0.80 * ease((within - 0.34) / (self.stance - 0.34));
        FootPlan {
            place: over.place + leftwards(over.heading) * (out * width + jitter.x) + ahead(over.heading) * jitter.z * over.pace,
            heading: mix(over.heading, now.heading, 0.45) + 0.10 * out + turn,
            pitch: roll * (over.pace * strike + push),
        }
    }
}

/// Strides per second and cruising speed (m/s) of somebody with these legs.
fn cruise(style: &StyleConfig, figure: &Figure) -> (f64, f64) {
    let legs = figure.leg_m() / 0.87;
    let strides_per_s = 0.88 * style.tempo / legs.sqrt();
    (strides_per_s, strides_per_s * 1.28 * legs * style.amplitude)
}

fn gait<'a, Path: Fn(f64) -> Waypoint>(
    path: Path,
    style: &StyleConfig,
    figure: &'a Figure,
    variety: &'a Variety,
    arms: f64,
) -> Gait<'a, Path> {
    Gait {
        path,
        strides_per_s: cruise(style, figure).0,
        stance: 0.60,
        lift_m: [0.045, 0.07],
        arm_swing: 0.42 * arms * style.amplitude,
        elbow: 0.22,
        arm_phase: 0.0,
        variety,
        figure,
    }
}

/// Around the origin; `sense` 1 is counter-clockwise seen from above.
pub fn circle(style: &StyleConfig, figure: &Figure, variety: &Variety, sense: f64, time: f64) -> Plan {
    let radius = style.path_scale;
    let speed = cruise(style, figure).1;
    let path = |time: f64| {
        let heading = sense * speed * time / radius;
        Waypoint { place: -leftwards(heading) * (sense * radius), heading, pace: 1.0 }
    };
    let mut plan = gait(path, style, figure, variety, 1.0).plan(time);
    // Leaning and looking into the bend.
    plan.pelvis_turn.z -= sense * 0.04;
    plan.head.y += sense * 0.15;
    plan
}

/// Along z through the origin, first towards +z, turning on the spot at both ends, or going backwards from the far one.
pub fn back_and_forth(style: &StyleConfig, figure: &Figure, variety: &Variety, arms: f64, time: f64) -> Plan {
    if style.backward {
        return forth_and_backward(style, figure, variety, arms, time);
    }
    let (length, speed) = (2.0 * style.path_scale, cruise(style, figure).1);
    // Starting takes this long, and so does stopping; a way shorter than both is walked slower.
    let (start_s, turn_s) = (0.7 / style.tempo, 1.6 / style.tempo);
    let speed = speed.min(length / start_s);
    let way_s = length / speed + start_s;
    let half = way_s + turn_s;
    let way = Way { speed, start_s, way_s };
    let path = |time: f64| {
        let number = (time / half).floor();
        let within = time - number * half;
        let returning = number.rem_euclid(2.0) == 1.0;
        let (gone, pace) = way.at(within);
        // Turns to the left at the near end and back to the right at the far end.
        let turned = PI * ease((within - way_s) / turn_s);
        let (sign, heading) = if returning { (-1.0, PI - turned) } else { (1.0, turned) };
        Waypoint { place: vector![0.0, 0.0, sign * (gone - 0.5 * length)], heading, pace }
    };
    gait(path, style, figure, variety, arms).plan(time)
}

/// A straight way from standing to standing.
struct Way {
    speed: f64,
    /// Starting takes this long, and so does stopping.
    start_s: f64,
    way_s: f64,
}

impl Way {
    /// Metres gone after this time, and the speed relative to cruising.
    fn at(&self, time: f64) -> (f64, f64) {
        let Self { speed, start_s, way_s } = *self;
        let travelled = |time: f64| {
            let begun = (time / start_s).clamp(0.0, 1.0);
            speed * (start_s * (begun.powi(3) - 0.5 * begun.powi(4)) + (time - start_s).max(0.0))
        };
        let length = speed * (way_s - start_s);
        let gone = if time < 0.5 * way_s { travelled(time) } else { length - travelled((way_s - time).max(0.0)) };
        (gone, ease(time / start_s) * ease((way_s - time) / start_s))
    }
}

/// Share of the stride at which both feet are on the floor.
const BOTH_FEET: f64 = 0.05;

/// Towards +z and backwards again, facing +z all the time (paper, supplement 11).
///
/// The joints of a backward walk move nearly as those of a forward one reversed in time (Winter, Pluck and Yang, "Backward
/// walking: a simple reversal of forward walking?", 1989). So the gait has a clock of its own, which slows down, stands and runs
/// backwards; it stands where both feet are on the floor.
fn forth_and_backward(style: &StyleConfig, figure: &Figure, variety: &Variety, arms: f64, time: f64) -> Plan {
    let (length, (strides_per_s, speed)) = (2.0 * style.path_scale, cruise(style, figure));
    let (start_s, turn_s) = (0.7 / style.tempo, 1.2 / style.tempo);
    let speed = speed.min(length / start_s);
    // Whole steps, so that the other end is one where both feet are on the floor, too.
    let steps = (2.0 * strides_per_s * (length / speed + start_s)).ceil();
    let way_s = 0.5 * steps / strides_per_s;
    let way = Way { speed: length / (way_s - start_s), start_s, way_s };
    // What the clock still runs while it slows down as a cosine.
    let slowing_s = turn_s / PI;
    let full_s = way_s - 2.0 * slowing_s;
    let half_s = full_s + turn_s;
    let number = (time / half_s).floor();
    let within = time - number * half_s;
    let run = if within < full_s {
        slowing_s + within
    } else {
        slowing_s + full_s + slowing_s * (PI * (within - full_s) / turn_s).sin()
    };
    let clock = if number.rem_euclid(2.0) == 0.0 { run } else { way_s - run };
    let first = BOTH_FEET / strides_per_s;
    let path = |time: f64| {
        let (gone, pace) = way.at(time - first);
        Waypoint { place: vector![0.0, 0.0, gone - 0.5 * length], heading: 0.0, pace }
    };
    gait(path, style, figure, variety, arms).plan(first + clock)
}
