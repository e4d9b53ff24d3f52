//! The actions that stay on one spot.

use std::f64::consts::TAU;

use nalgebra::{Vector3, vector};

use super::{
    StyleConfig,
    plan::{ArmPlan, FootPlan, Plan, bump, ease},
    posing::Figure,
    variety::Variety,
    walking::{Gait, Waypoint},
};

pub(super) fn standing(figure: &Figure) -> Plan {
    let foot = |out: f64| FootPlan { place: vector![1.15 * out * figure.hip_m(), 0.0, 0.0], heading: 0.12 * out, pitch: 0.0 };
    let arm = ArmPlan { swing: 0.04, raise: 0.15, elbow: 0.22, twist: 0.0 };
    Plan { feet: [foot(1.0), foot(-1.0)], arms: [arm; 2], ..Plan::default() }
}

/// The trunk turns from side to side with bent arms in front of the chest.
pub fn torso_rotation(style: &StyleConfig, figure: &Figure, time: f64) -> Plan {
    let mut plan = standing(figure);
    let phase = TAU * 0.42 * style.tempo * time;
    let reach = 0.80 * style.amplitude;
    plan.trunk.y = reach * phase.sin();
    plan.pelvis_turn.y = 0.16 * reach * (phase - 0.25).sin();
    plan.head.y = -0.25 * reach * phase.sin();
    plan.arms = [1.0, -1.0].map(|out| ArmPlan {
        // The arms lag a little behind the chest.
        swing: 0.25 - 0.10 * out * style.amplitude * phase.cos(),
        raise: 0.70,
        elbow: 1.75,
        ..ArmPlan::default()
    });
    plan
}

/// Each arm swings again and again horizontally, upward or downward, drawn at random for every swing (paper, supplement 11).
pub fn arm_swing(style: &StyleConfig, figure: &Figure, variety: &Variety, time: f64) -> Plan {
    let mut plan = standing(figure);
    let phase = 0.55 * style.tempo * time;
    let (number, within) = (phase.floor() as i64, phase - phase.floor());
    let size = style.amplitude.min(1.15);
    plan.arms = [0, 1].map(|side| {
        let rest = plan.arms[side];
        match variety.choice(side, number, 3) {
            0 => horizontal(rest, size, within),
            1 => upward(rest, size, within),
            _ => downward(rest, size, within),
        }
    });
    // The left shoulder follows the left arm forwards.
    plan.trunk.y = -0.06 * (plan.arms[0].swing - plan.arms[1].swing);
    plan
}

/// Forwards to the height of the shoulder, out to the side, in again and down.
fn horizontal(rest: ArmPlan, size: f64, within: f64) -> ArmPlan {
    let lifted = ease(within / 0.28) - ease((within - 0.72) / 0.28);
    ArmPlan { swing: rest.swing + 1.40 * lifted, raise: rest.raise + 1.10 * size * bump(within, 0.18, 0.64), ..rest }
}

/// Forwards and up beside the head.
fn upward(rest: ArmPlan, size: f64, within: f64) -> ArmPlan {
    let up = bump(within, 0.0, 1.0);
    ArmPlan { swing: rest.swing + 2.40 * size * up, raise: rest.raise + 0.10 * up, ..rest }
}

/// From in front down and behind the back.
fn downward(rest: ArmPlan, size: f64, within: f64) -> ArmPlan {
    let (before, behind) = (bump(within, 0.0, 0.60), bump(within, 0.42, 0.58));
    ArmPlan { swing: rest.swing + size * (1.30 * before - 0.65 * behind), elbow: rest.elbow + 0.20 * before, ..rest }
}

/// Steps on the spot with high knees.
pub fn march(style: &StyleConfig, figure: &Figure, variety: &Variety, time: f64) -> Plan {
    let lift = 0.34 * figure.leg_m() * style.amplitude.min(1.3);
    let gait = Gait {
        path: |_| Waypoint { place: Vector3::zeros(), heading: 0.0, pace: 0.0 },
        strides_per_s: 0.85 * style.tempo,
        stance: 0.54,
        lift_m: [lift; 2],
        arm_swing: 1.4 * style.amplitude,
        elbow: 0.55,
        // With the left knee, not with the left foot's step.
        arm_phase: 0.77,
        variety,
        figure,
    };
    let mut plan = gait.plan(time);
    // A high knee needs the shank to hang below it, so the lifted foot comes forward.
    for foot in &mut plan.feet {
        foot.place.z += 0.35 * foot.place.y;
    }
    plan
}

/// A long step forward, down, and back, with alternating legs.
pub fn lunge(style: &StyleConfig, figure: &Figure, variety: &Variety, time: f64) -> Plan {
    let mut plan = standing(figure);
    let phase = 0.30 * style.tempo * time;
    let (number, within) = (phase.floor() as i64, phase - phase.floor());
    let size = variety.repetition(number) * style.amplitude.min(1.25);
    // Foot out, body down; body up, foot back.
    let stepped = ease((within - 0.04) / 0.26) - ease((within - 0.64) / 0.28);
    let lowered = ease((within - 0.12) / 0.30) - ease((within - 0.52) / 0.34);
    let moving = |from: f64, length: f64| bump(within, from, length);
    let lift = 0.09 * (moving(0.04, 0.26) + moving(0.64, 0.28));

    let front = number.rem_euclid(2) as usize;
    let step = 0.86 * figure.leg_m() * size;
    plan.feet[front].place += vector![0.0, lift, step * stepped];
    plan.feet[front].pitch = -0.25 * (moving(0.16, 0.18) + moving(0.60, 0.16));
    plan.feet[1 - front].pitch = 0.85 * size * lowered;
    plan.pelvis = vector![0.0, -0.22 * figure.leg_m() * size * lowered, step * (0.15 * stepped + 0.42 * lowered)];
    plan.pelvis_turn.x = 0.10 * lowered;
    plan.arms = [0, 1].map(|side| {
        let forward = if side == front { -0.25 } else { 0.35 };
        ArmPlan { swing: 0.1 + forward * stepped, raise: 0.25, elbow: 0.3 + 0.8 * lowered, twist: 0.0 }
    });
    plan
}
