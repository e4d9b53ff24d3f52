//! The room as its boundaries: scalar distances from the radar's reference point (paper, section 3.1).

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// Distances (> 0, metres) from the radar's origin to the boundaries; absent: there is no such boundary.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Room {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_m: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub right_m: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub front_m: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub back_m: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub floor_m: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ceiling_m: Option<f64>,
}

/// One of the six sides, as named in `[room]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Boundary {
    Left,
    Right,
    Front,
    Back,
    Floor,
    Ceiling,
}

impl Boundary {
    /// All six, in the order in which lists by boundary have them.
    pub const ALL: [Self; 6] = [Self::Left, Self::Right, Self::Front, Self::Back, Self::Floor, Self::Ceiling];

    /// The word of settings and reports, such as `left`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
            Self::Front => "front",
            Self::Back => "back",
            Self::Floor => "floor",
            Self::Ceiling => "ceiling",
        }
    }

    /// The axis (0 x, 1 y, 2 z) that the boundary is perpendicular to, and the sign of its side.
    pub fn axis(self) -> (usize, f64) {
        match self {
            Self::Left => (0, -1.0),
            Self::Right => (0, 1.0),
            Self::Front => (1, 1.0),
            Self::Back => (1, -1.0),
            Self::Floor => (2, -1.0),
            Self::Ceiling => (2, 1.0),
        }
    }

    /// Unit normal, into the room.
    pub fn normal(self) -> [f64; 3] {
        let (axis, sign) = self.axis();
        std::array::from_fn(|i| if i == axis { -sign } else { 0.0 })
    }
}

impl Room {
    /// Distance of a boundary from the radar's reference point; none where the room has no such boundary.
    pub fn distance_m(&self, boundary: Boundary) -> Option<f64> {
        match boundary {
            Boundary::Left => self.left_m,
            Boundary::Right => self.right_m,
            Boundary::Front => self.front_m,
            Boundary::Back => self.back_m,
            Boundary::Floor => self.floor_m,
            Boundary::Ceiling => self.ceiling_m,
        }
    }

    /// The boundaries that exist, in the order of `Boundary::ALL`.
    pub fn boundaries(&self) -> Vec<Boundary> {
        Boundary::ALL.into_iter().filter(|&boundary| self.distance_m(boundary).is_some()).collect()
    }

    /// Lowest and highest coordinate of the room along each axis; `open_m` stands in for a boundary that is absent.
    pub fn extent_m(&self, open_m: f64) -> ([f64; 3], [f64; 3]) {
        let or = |distance: Option<f64>| distance.unwrap_or(open_m);
        ([-or(self.left_m), -or(self.back_m), -or(self.floor_m)], [or(self.right_m), or(self.front_m), or(self.ceiling_m)])
    }

    /// Range of the farthest corner that has walls, metres; `None` without any boundary.
    pub fn farthest_m(&self) -> Option<f64> {
        if self.boundaries().is_empty() {
            return None;
        }
        let (low, high) = self.extent_m(0.0);
        Some((0..3).map(|axis| low[axis].abs().max(high[axis].abs()).powi(2)).sum::<f64>().sqrt())
    }

    /// Distance of the farthest boundary, metres; `None` without any.
    pub fn farthest_wall_m(&self) -> Option<f64> {
        self.boundaries().into_iter().filter_map(|boundary| self.distance_m(boundary)).max_by(f64::total_cmp)
    }

    /// Refuses distances that no room can have. `key` names this room in messages.
    pub fn check(&self, key: &str) -> Result<()> {
        for boundary in Boundary::ALL {
            if let Some(distance) = self.distance_m(boundary)
                && !(distance.is_finite() && distance > 0.0)
            {
                return Err(Error::setting(format!("{key}.{}_m", boundary.name()), distance, "a distance above zero in metres")
                    .with_hint("leave the key out if there is no such boundary"));
            }
        }
        Ok(())
    }
}
