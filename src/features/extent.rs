//! The box that positions are normalised to.

use serde::{Deserialize, Serialize};

/// An axis-aligned box, metres. It belongs to a trained model: other bodies are looked up in the same box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Extent {
    /// x, y, z of the lower corner, in the canonical body's axes.
    pub low_m: [f64; 3],
    /// x, y, z of the upper corner.
    pub high_m: [f64; 3],
}

impl Extent {
    /// The smallest box around the points, each side moved out by `margin` of the box's length along that axis.
    pub fn around(points: &[[f64; 3]], margin: f64) -> Self {
        let bound = |axis: usize, pick: fn(f64, f64) -> f64, start: f64| {
            points.iter().fold(start, |bound, point| pick(bound, point[axis]))
        };
        let mut extent = Self { low_m: [0.0; 3], high_m: [1.0; 3] };
        if points.is_empty() {
            return extent;
        }
        for axis in 0..3 {
            let (low, high) = (bound(axis, f64::min, f64::INFINITY), bound(axis, f64::max, f64::NEG_INFINITY));
            extent.low_m[axis] = low - margin * (high - low);
            extent.high_m[axis] = high + margin * (high - low);
        }
        extent
    }

    /// Each coordinate as a fraction of the box, 0 … 1; positions outside are moved to its border. An axis without
    /// length gives ½.
    pub fn fraction(&self, point: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| {
            let length = self.high_m[axis] - self.low_m[axis];
            if length > 0.0 { ((point[axis] - self.low_m[axis]) / length).clamp(0.0, 1.0) } else { 0.5 }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_of_the_box_are_zero_and_one() {
        let extent = Extent::around(&[[0.0, 1.0, 5.0], [2.0, 3.0, 5.0]], 0.0);
        assert_eq!(extent.fraction([0.0, 3.0, 5.0]), [0.0, 1.0, 0.5]);
        assert_eq!(extent.fraction([-1.0, 9.0, 7.0]), [0.0, 1.0, 0.5]);
        assert_eq!(extent.fraction([0.5, 2.0, 5.0])[0], 0.25);
    }

    #[test]
    fn a_margin_keeps_points_off_the_border() {
        let extent = Extent::around(&[[0.0; 3], [1.0; 3]], 0.1);
        assert!(extent.fraction([0.0; 3]).iter().all(|&fraction| fraction > 0.08));
    }
}
