//! Positions between the poses of a motion, at the time of every chirp, as a small matrix of weights.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// How positions move from one pose to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Interpolation {
    /// Straight lines: velocity jumps at each pose, which a radar sees as sidebands.
    Linear,
    /// Cubic Hermite with Catmull-Rom tangents: continuous velocity.
    #[default]
    Cubic,
}

/// Weights of poses: the position at a time is `Σ_pose weight[time, pose] · position[pose]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Basis {
    /// The poses that any of the times needs.
    pub poses: Range<usize>,
    /// `[time, pose]`; each row sums to 1.
    pub weights: Vec<f64>,
    /// `[time, pose]`, 1/s: the weights' derivatives, which give velocities; each row sums to 0.
    pub rates: Vec<f64>,
}

impl Basis {
    /// Weights at one time, `[pose]` over [`Self::poses`].
    pub fn row(&self, time: usize) -> &[f64] {
        &self.weights[time * self.poses.len()..][..self.poses.len()]
    }

    /// Derivatives of the weights at one time, 1/s, `[pose]` over [`Self::poses`].
    pub fn rate_row(&self, time: usize) -> &[f64] {
        &self.rates[time * self.poses.len()..][..self.poses.len()]
    }
}

/// Times this close to the motion's ends (seconds) still count as inside: sums of periods are rounded.
const ROUNDING_S: f64 = 1e-9;

/// Weights for all `times_s`.
///
/// `pose_times_s`: ascending, at least two.
///
/// # Errors
/// When a time lies outside the motion; the message names the frame's times and the motion's.
pub fn basis(pose_times_s: &[f64], times_s: &[f64], interpolation: Interpolation) -> Result<Basis> {
    let first = times_s.iter().copied().fold(f64::INFINITY, f64::min);
    let last = times_s.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    inside(pose_times_s, first, last)?;
    let segment = |time: f64| pose_times_s.partition_point(|&pose| pose <= time).clamp(1, pose_times_s.len() - 1) - 1;
    let reach = if interpolation == Interpolation::Cubic { 1 } else { 0 };
    let poses = if times_s.is_empty() {
        0..0
    } else {
        segment(first).saturating_sub(reach)..(segment(last) + 2 + reach).min(pose_times_s.len())
    };
    let mut basis =
        Basis { weights: vec![0.0; times_s.len() * poses.len()], rates: vec![0.0; times_s.len() * poses.len()], poses };
    let width = basis.poses.len();
    for (row, &time) in times_s.iter().enumerate() {
        let from = segment(time);
        let weights = &mut basis.weights[row * width..][..width];
        let rates = &mut basis.rates[row * width..][..width];
        let mut add = |pose: usize, weight: f64, rate: f64| {
            weights[pose - basis.poses.start] += weight;
            rates[pose - basis.poses.start] += rate;
        };
        let step = pose_times_s[from + 1] - pose_times_s[from];
        let s = ((time - pose_times_s[from]) / step).clamp(0.0, 1.0);
        match interpolation {
            Interpolation::Linear => {
                add(from, 1.0 - s, -1.0 / step);
                add(from + 1, s, 1.0 / step);
            }
            Interpolation::Cubic => {
                add(from, (1.0 + 2.0 * s) * (1.0 - s) * (1.0 - s), 6.0 * s * (s - 1.0) / step);
                add(from + 1, s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s) / step);
                let tangents = [
                    (from, s * (1.0 - s) * (1.0 - s), (1.0 - s) * (1.0 - 3.0 * s)),
                    (from + 1, s * s * (s - 1.0), s * (3.0 * s - 2.0)),
                ];
                for (at, weight, rate) in tangents {
                    for (pose, slope) in tangent(pose_times_s, at) {
                        add(pose, weight * step * slope, rate * slope);
                    }
                }
            }
        }
    }
    Ok(basis)
}

/// Refuses times that the motion does not reach.
fn inside(pose_times_s: &[f64], first: f64, last: f64) -> Result<()> {
    let (start, end) = match pose_times_s {
        [start, .., end] => (*start, *end),
        _ => {
            return Err(Error::Usage {
                message: format!("the motion has {} pose(s), expected at least two to move between", pose_times_s.len()),
                hint: Some("repeat the pose at a later time for a person who stands still".into()),
            });
        }
    };
    if first < start - ROUNDING_S || last > end + ROUNDING_S {
        return Err(Error::Usage {
            message: format!(
                "the frame from {first:.4} s to {last:.4} s lies outside the motion, which lasts from {start:.4} s to {end:.4} s"
            ),
            hint: Some("record fewer frames, give a longer motion, or shift it with motion.start_s".into()),
        });
    }
    Ok(())
}

/// The velocity at a pose as (pose, weight in 1/s) pairs: the slope of the parabola through its neighbours, or the
/// slope towards the only neighbour at either end.
fn tangent(times: &[f64], at: usize) -> Vec<(usize, f64)> {
    if at == 0 || at + 1 == times.len() {
        let from = at.saturating_sub(1).min(times.len() - 2);
        let slope = 1.0 / (times[from + 1] - times[from]);
        return vec![(from, -slope), (from + 1, slope)];
    }
    let (before, after) = (times[at] - times[at - 1], times[at + 1] - times[at]);
    let both = before + after;
    vec![
        (at - 1, -after / (before * both)),
        (at, after / (before * both) - before / (after * both)),
        (at + 1, before / (after * both)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(basis: &Basis, row: usize, f: impl Fn(usize) -> f64) -> f64 {
        basis.poses.clone().zip(basis.row(row)).map(|(pose, weight)| weight * f(pose)).sum()
    }

    fn rate(basis: &Basis, row: usize, f: impl Fn(usize) -> f64) -> f64 {
        basis.poses.clone().zip(basis.rate_row(row)).map(|(pose, weight)| weight * f(pose)).sum()
    }

    const UNEVEN: [f64; 6] = [0.0, 0.1, 0.25, 0.3, 0.5, 0.6];

    #[test]
    fn both_pass_through_the_poses_and_reproduce_constant_velocity() {
        for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
            let at_poses = basis(&UNEVEN, &UNEVEN, interpolation).unwrap();
            for pose in 0..UNEVEN.len() {
                let kick = |k: usize| (k * k) as f64;
                assert!((value(&at_poses, pose, kick) - kick(pose)).abs() < 1e-12, "{interpolation:?} {pose}");
            }
            let times: Vec<f64> = (0..61).map(|i| i as f64 * 0.01).collect();
            let dense = basis(&UNEVEN, &times, interpolation).unwrap();
            for (row, &time) in times.iter().enumerate() {
                assert!((value(&dense, row, |pose| 3.0 * UNEVEN[pose] - 1.0) - (3.0 * time - 1.0)).abs() < 1e-12);
                assert!((rate(&dense, row, |pose| 3.0 * UNEVEN[pose] - 1.0) - 3.0).abs() < 1e-11);
                assert!((dense.row(row).iter().sum::<f64>() - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn the_cubic_follows_a_parabola_and_its_velocity_never_jumps() {
        let bend = |pose: usize| UNEVEN[pose] * UNEVEN[pose];
        let times: Vec<f64> = (0..400).map(|i| 0.1 + i as f64 * 0.001).collect();
        let cubic = basis(&UNEVEN, &times, Interpolation::Cubic).unwrap();
        for (row, &time) in times.iter().enumerate() {
            assert!((value(&cubic, row, bend) - time * time).abs() < 1e-12, "{time}");
        }
        let wild = |pose: usize| [0.0, 1.0, -1.0, 2.0, 0.5, 0.0][pose];
        for &time in &UNEVEN[1..5] {
            let around = [time - 1e-7, time + 1e-7];
            let near = basis(&UNEVEN, &around, Interpolation::Cubic).unwrap();
            assert!((rate(&near, 0, wild) - rate(&near, 1, wild)).abs() < 1e-3, "{time}");
            let straight = basis(&UNEVEN, &around, Interpolation::Linear).unwrap();
            assert!((rate(&straight, 0, wild) - rate(&straight, 1, wild)).abs() > 1.0, "a line does jump");
        }
    }

    #[test]
    fn rates_are_the_derivative_of_the_weights() {
        let wild = |pose: usize| [0.0, 1.0, -1.0, 2.0, 0.5, 0.0][pose];
        for time in [0.03, 0.17, 0.28, 0.41, 0.58] {
            let around = basis(&UNEVEN, &[time - 1e-6, time, time + 1e-6], Interpolation::Cubic).unwrap();
            let difference = (value(&around, 2, wild) - value(&around, 0, wild)) / 2e-6;
            assert!((rate(&around, 1, wild) - difference).abs() < 1e-5, "{time}: {difference}");
        }
    }

    #[test]
    fn a_short_window_asks_for_few_poses() {
        let times: Vec<f64> = (0..100).map(|pose| pose as f64 / 60.0).collect();
        let frame: Vec<f64> = (0..128).map(|chirp| 0.5 + chirp as f64 * 72e-6).collect();
        assert!(basis(&times, &frame, Interpolation::Cubic).unwrap().poses.len() <= 5);
        assert!(basis(&times, &frame, Interpolation::Linear).unwrap().poses.len() <= 3);
    }

    #[test]
    fn a_frame_outside_the_motion_says_when_and_what_to_do() {
        let error = basis(&UNEVEN, &[0.55, 0.7], Interpolation::Linear).unwrap_err();
        let text = error.to_string();
        assert!(text.contains("0.5500 s to 0.7000 s") && text.contains("0.0000 s to 0.6000 s"), "{text}");
        assert!(error.hint().unwrap().contains("motion.start_s"));
        assert!(basis(&UNEVEN, &[0.0, 0.6 + 1e-12], Interpolation::Cubic).is_ok(), "rounding is forgiven");
        assert!(basis(&[0.0], &[0.0], Interpolation::Cubic).unwrap_err().to_string().contains("at least two"));
    }
}
