//! Where a frame's points are shortly before and after the frame.

use std::sync::Arc;

/// How far points may be carried beyond the outermost known time, as a share of the time spanned.
const BEYOND: f64 = 0.15;

/// Displacements of a frame's points at a few times about the frame's middle, with polynomials through them.
#[derive(Clone, Debug)]
pub struct Track {
    /// Motion time of the middle of the frame in which the points were seen.
    centre_s: f64,
    /// Of the known times, where the frame stands now.
    origin_s: f64,
    /// Ascending, from the middle of the frame the points were seen in.
    times_s: Vec<f64>,
    /// `[time][point]`, from where the points were in that middle.
    displacement_m: Arc<Vec<Vec<[f32; 3]>>>,
}

impl Track {
    /// Displacements `[time][point]`, metres, at ascending times from `centre_s`, the middle of the frame in which the points
    /// were seen.
    pub fn new(centre_s: f64, times_s: Vec<f64>, displacement_m: Vec<Vec<[f32; 3]>>) -> Self {
        Self { centre_s, origin_s: 0.0, times_s, displacement_m: Arc::new(displacement_m) }
    }

    /// Motion time that was seen, and the one that is shown now.
    pub fn seen_and_shown_s(&self) -> (f64, f64) {
        (self.centre_s, self.centre_s + self.origin_s)
    }

    /// The same from another time on.
    pub fn from(&self, later_s: f64) -> Self {
        Self { origin_s: self.origin_s + later_s, ..self.clone() }
    }

    /// Whether the points are known so much later.
    pub fn knows(&self, later_s: f64) -> bool {
        let (Some(first), Some(last)) = (self.times_s.first(), self.times_s.last()) else { return false };
        let (time, margin) = (self.origin_s + later_s, BEYOND * (last - first));
        time >= first - margin && time <= last + margin
    }

    /// By how much each point's position and velocity differ so much later, `[point]`.
    pub fn steps(&self, later_s: f64) -> impl Fn(usize) -> ([f64; 3], [f64; 3]) + '_ {
        let (before, after) = (self.basis(self.origin_s), self.basis(self.origin_s + later_s));
        let change: Vec<(f64, f64)> =
            after.iter().zip(before).map(|(after, before)| (after.0 - before.0, after.1 - before.1)).collect();
        move |point| {
            let (mut position, mut velocity) = ([0.0; 3], [0.0; 3]);
            for (at, (weight, rate)) in self.displacement_m.iter().zip(&change) {
                for axis in 0..3 {
                    position[axis] += weight * f64::from(at[point][axis]);
                    velocity[axis] += rate * f64::from(at[point][axis]);
                }
            }
            (position, velocity)
        }
    }

    /// Lagrange's polynomials and their derivatives (1/s), `[time]`.
    fn basis(&self, time: f64) -> Vec<(f64, f64)> {
        let nodes = &self.times_s;
        let of = |node: usize| {
            let others = || nodes.iter().enumerate().filter(move |(other, _)| *other != node).map(|(_, &other)| other);
            let weight = others().map(|other| (time - other) / (nodes[node] - other)).product();
            // Product rule.
            let rate = others()
                .map(|left| {
                    let rest: f64 =
                        others().filter(|&other| other != left).map(|other| (time - other) / (nodes[node] - other)).product();
                    rest / (nodes[node] - left)
                })
                .sum();
            (weight, rate)
        };
        (0..nodes.len()).map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_followed_from_any_origin() {
        let place = |time: f64| 2.0 * time - 3.0 * time * time + 5.0 * time.powi(4);
        let speed = |time: f64| 2.0 - 6.0 * time + 20.0 * time.powi(3);
        let times = vec![-0.5, -0.25, 0.0, 0.25, 0.5];
        let nodes = times.iter().map(|&time| vec![[0.0, place(time) as f32, 0.0]]).collect();
        let track = Track::new(0.0, times, nodes);
        for (origin, later) in [(0.0, 0.3), (0.2, -0.4), (-0.1, 0.0)] {
            let (position, velocity) = track.from(origin).steps(later)(0);
            assert!((position[1] - (place(origin + later) - place(origin))).abs() < 1e-6);
            assert!((velocity[1] - (speed(origin + later) - speed(origin))).abs() < 1e-5);
        }
        assert!(track.knows(0.6) && !track.knows(0.7) && !track.from(0.3).knows(0.4));
    }
}
