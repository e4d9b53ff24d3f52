//! Which cells of a map count.

/// The cells that count. Both ends belong; `None` takes all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gate {
    /// Nearest and farthest.
    pub range_m: Option<[f64; 2]>,
    /// Slowest and fastest, positive when receding.
    pub velocity_mps: Option<[f64; 2]>,
}

impl Gate {
    /// All velocities between two ranges.
    pub fn range(nearest_m: f64, farthest_m: f64) -> Self {
        Self { range_m: Some([nearest_m, farthest_m]), velocity_mps: None }
    }

    /// Whether cells at this range count.
    pub fn holds_range(&self, range_m: f64) -> bool {
        self.range_m.is_none_or(|[nearest, farthest]| (nearest..=farthest).contains(&range_m))
    }

    /// Whether cells at this radial velocity count.
    pub fn holds_velocity(&self, velocity_mps: f64) -> bool {
        self.velocity_mps.is_none_or(|[slowest, fastest]| (slowest..=fastest).contains(&velocity_mps))
    }
}
