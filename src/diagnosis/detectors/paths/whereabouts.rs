//! Where a mover was seen: its ranges, its velocities and, with several receivers, its direction.

use super::oscillation::Oscillation;
use super::scene::Scene;
use super::track::Sighting;
use crate::diagnosis::statistics::{bounds, median};
use crate::diagnosis::{Estimate, Place};
use crate::effects::Stage;
use crate::radar::Radar;

/// A line of receivers does not resolve the height: as far up or down as it may be off here shortens y, metres.
const HEIGHT_M: f64 = 0.5;

pub struct Whereabouts {
    pub ranges_m: [f64; 2],
    velocities_mps: [f64; 2],
    /// Middle of its way, with the standard deviation of its error.
    pub mean_m: f64,
    mean_error_m: f64,
    /// None with one receiver.
    direction: Option<Direction>,
    cell_m: f64,
}

/// x over range, with the standard deviation of its error.
struct Direction {
    sine: f64,
    error: f64,
}

impl Direction {
    /// `sine_error`: none: as the sightings scatter.
    fn of(sightings: &[Sighting], sine_error: Option<f64>) -> Option<Self> {
        let mut sines: Vec<f64> = sightings.iter().filter_map(|s| s.sine).collect();
        if sines.is_empty() {
            return None;
        }
        let sine = median(&mut sines);
        let spread = median(&mut sines.iter().map(|s| (s - sine).abs()).collect::<Vec<_>>()) * 1.48;
        Some(Self { sine, error: sine_error.unwrap_or(spread / (sines.len() as f64).sqrt() * 1.25) + 0.01 })
    }

    fn azimuth(&self) -> f64 {
        self.sine.clamp(-1.0, 1.0).asin()
    }

    fn azimuth_deg(&self) -> [f64; 2] {
        let degrees = self.azimuth().to_degrees();
        let error = (1.645 * self.error / self.azimuth().cos().max(0.1)).to_degrees().max(2.0);
        [degrees - error, degrees + error]
    }
}

impl Whereabouts {
    /// `sine_error`: standard deviation of the direction; none: as the sightings scatter.
    pub fn new(scene: &Scene, sightings: &[Sighting], oscillation: Option<&Oscillation>, sine_error: Option<f64>) -> Self {
        let ranges_m = bounds(sightings.iter().map(|s| s.range_m));
        let cell_m = scene.range_m(1.0);
        let (mean_m, mean_error_m) = match oscillation {
            Some(fit) => (fit.mean_m, fit.deviations[0].max(0.05 * cell_m)),
            None => (0.5 * (ranges_m[0] + ranges_m[1]), 0.3 * (ranges_m[1] - ranges_m[0]) + 0.2 * cell_m),
        };
        Self {
            ranges_m,
            velocities_mps: bounds(sightings.iter().map(|s| s.velocity_mps)),
            mean_m,
            mean_error_m,
            direction: Direction::of(sightings, sine_error),
            cell_m,
        }
    }

    pub fn place(&self, radar: &Radar, stage: Stage) -> Place {
        Place {
            range_m: Some([self.ranges_m[0] - 0.5 * self.cell_m, self.ranges_m[1] + 0.5 * self.cell_m]),
            velocity_mps: Some(self.velocities_mps),
            position_m: self.direction.as_ref().map(|direction| self.position_m(radar, direction)),
            azimuth_deg: self.direction.as_ref().map(Direction::azimuth_deg),
            ..Place::at(stage)
        }
    }

    /// Of the middle of its way.
    pub fn position(&self, radar: &Radar) -> Option<Estimate> {
        let direction = self.direction.as_ref()?;
        let (sine, sine_error) = (direction.sine, direction.error);
        let [x, y, z] = self.position_m(radar, direction);
        let ahead_m = self.mean_m * direction.azimuth().cos();
        let along = 1.645 * (self.mean_error_m + self.mean_m * sine_error * sine.abs());
        Some(Estimate {
            name: "position_m",
            values: vec![x, y, z],
            ci90: vec![
                around(x, 1.645 * (self.mean_m * sine_error).hypot(self.mean_error_m * sine.abs())),
                [y - along - 0.5 * HEIGHT_M * HEIGHT_M / ahead_m.max(0.5), y + along],
                around(z, 1.0),
            ],
        })
    }

    fn position_m(&self, radar: &Radar, direction: &Direction) -> [f64; 3] {
        let at = radar.centre_m();
        [at[0] + self.mean_m * direction.sine, at[1] + self.mean_m * direction.azimuth().cos(), at[2]]
    }

    /// Empty where the direction is not known.
    pub fn towards(&self) -> String {
        let Some(direction) = &self.direction else { return String::new() };
        format!(" at {:.0}° azimuth (its height is not seen)", direction.azimuth().to_degrees())
    }
}

fn around(value: f64, error: f64) -> [f64; 2] {
    [value - error, value + error]
}
