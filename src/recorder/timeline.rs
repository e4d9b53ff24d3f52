//! Where a moving point is at any time: weights on the poses before and after.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// How positions run between two poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Interpolation {
    /// Straight lines: velocity jumps at every pose.
    Linear,
    /// Cubic Hermite with central differences: the velocity is continuous.
    #[default]
    Cubic,
}

/// The times of the poses of a motion.
#[derive(Clone, Debug)]
pub struct Timeline {
    /// Ascending, seconds, radar time.
    times_s: Vec<f64>,
    interpolation: Interpolation,
}

/// (pose, weight) pairs; a position is Σ weight · pose.
pub type Weights = Vec<(usize, f64)>;

impl Timeline {
    /// Poses at ascending times.
    ///
    /// # Errors
    /// No time, or one that is not later than the one before.
    pub fn new(times_s: Vec<f64>, interpolation: Interpolation) -> Result<Self> {
        if times_s.is_empty() || times_s.windows(2).any(|pair| pair[1].partial_cmp(&pair[0]) != Some(std::cmp::Ordering::Greater))
        {
            return Err(Error::setting(
                "person.pose_times_s",
                format!("{} times", times_s.len()),
                "at least one, each later than the one before",
            ));
        }
        Ok(Self { times_s, interpolation })
    }

    /// When a pose happens.
    pub fn time_s(&self, pose: usize) -> f64 {
        self.times_s[pose]
    }

    /// Weights at one time, which must lie within the motion.
    pub fn weights(&self, time_s: f64) -> Result<Weights> {
        let times = &self.times_s;
        let (first, last) = (times[0], times[times.len() - 1]);
        if times.len() == 1 {
            return Ok(vec![(0, 1.0)]);
        }
        // A nanosecond of slack: a motion may end exactly where the recording does.
        if time_s < first - 1e-9 || time_s > last + 1e-9 {
            return Err(Error::setting(
                "radar.frames",
                format!("a sample at {time_s:.4} s"),
                format!("within the motion, {first:.4} s to {last:.4} s"),
            )
            .with_hint("record fewer frames, or change person.placement.start_s"));
        }
        let left = times.partition_point(|&time| time <= time_s).saturating_sub(1).min(times.len() - 2);
        let span = times[left + 1] - times[left];
        let u = ((time_s - times[left]) / span).clamp(0.0, 1.0);
        Ok(match self.interpolation {
            Interpolation::Linear => vec![(left, 1.0 - u), (left + 1, u)],
            Interpolation::Cubic => self.hermite(left, u, span),
        })
    }

    fn hermite(&self, left: usize, u: f64, span: f64) -> Weights {
        let mut weights = vec![(left, (1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u)), (left + 1, u * u * (3.0 - 2.0 * u))];
        for (pose, blend) in [(left, u * (1.0 - u) * (1.0 - u)), (left + 1, u * u * (u - 1.0))] {
            let (before, after) = (pose.saturating_sub(1), (pose + 1).min(self.times_s.len() - 1));
            let slope = span * blend / (self.times_s[after] - self.times_s[before]);
            weights.extend([(after, slope), (before, -slope)]);
        }
        weights.sort_by_key(|&(pose, _)| pose);
        weights.dedup_by(|later, earlier| {
            let same = later.0 == earlier.0;
            if same {
                earlier.1 += later.1;
            }
            same
        });
        weights
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn position(timeline: &Timeline, values: &[f64], time_s: f64) -> f64 {
        timeline.weights(time_s).unwrap().iter().map(|&(pose, weight)| weight * values[pose]).sum()
    }

    #[test]
    fn both_interpolations_pass_through_the_poses_and_keep_straight_motion_straight() {
        let times = vec![0.0, 0.1, 0.25, 0.3];
        let values: Vec<f64> = times.iter().map(|t| 2.0 - 3.0 * t).collect();
        for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
            let timeline = Timeline::new(times.clone(), interpolation).unwrap();
            for step in 0..=30 {
                let time = 0.01 * step as f64;
                assert!((position(&timeline, &values, time) - (2.0 - 3.0 * time)).abs() < 1e-12, "{interpolation:?} at {time}");
            }
        }
    }

    #[test]
    fn only_the_cubic_has_a_continuous_velocity() {
        let values = [0.0, 1.0, 0.5, 2.0];
        let jump = |interpolation| {
            let timeline = Timeline::new(vec![0.0, 1.0, 2.0, 3.0], interpolation).unwrap();
            let velocity =
                |time: f64| (position(&timeline, &values, time + 1e-6) - position(&timeline, &values, time - 1e-6)) / 2e-6;
            (velocity(1.0 + 1e-5) - velocity(1.0 - 1e-5)).abs()
        };
        assert!(jump(Interpolation::Linear) > 1.0);
        assert!(jump(Interpolation::Cubic) < 1e-3);
    }

    #[test]
    fn a_time_outside_the_motion_is_refused_with_the_span() {
        let timeline = Timeline::new(vec![0.0, 1.0], Interpolation::Linear).unwrap();
        let message = timeline.weights(1.5).unwrap_err().to_string();
        assert!(message.contains("1.5000 s") && message.contains("0.0000 s to 1.0000 s"), "{message}");
        assert!(Timeline::new(vec![0.0, 0.0], Interpolation::Linear).is_err());
    }
}
