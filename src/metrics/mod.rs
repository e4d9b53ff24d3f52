//! How alike two heatmaps are: PSNR and SSIM as images, mean absolute error in decibels. (LPIPS: [`crate::lpips`].)
//!
//! Images are decibels mapped from a stated [`DbWindow`] to 0 … 1. Because most cells of a map hold no person, the same
//! numbers are reported globally (as in the paper), on static-removed maps, and on the cells that the person occupies.

mod region;
mod spread;
mod ssim;

pub use region::{bounding_box, crop, person_cells};
pub use spread::Spread;
pub use ssim::{ssim, ssim_map};

use serde::{Deserialize, Serialize};

use crate::{
    error::{Error, Result},
    heatmap::Map,
};

/// The decibels that are black and white in an image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DbWindow {
    pub low_db: f64,
    pub high_db: f64,
}

impl DbWindow {
    /// From the strongest cell downwards.
    pub fn below(peak_db: f64, span_db: f64) -> Self {
        Self { low_db: peak_db - span_db, high_db: peak_db }
    }

    /// 0 at and below `low_db`, 1 at and above `high_db`.
    pub fn normalise(&self, db: f64) -> f64 {
        ((db - self.low_db) / (self.high_db - self.low_db)).clamp(0.0, 1.0)
    }

    /// A map's decibels, row-major, as brightness from 0 to 1.
    pub fn image(&self, map_db: &Map) -> Vec<f64> {
        map_db.values.iter().map(|&db| self.normalise(db)).collect()
    }
}

/// Settings of an evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MetricsConfig {
    /// Decibels below the recording's strongest cell that an image shows.
    pub span_db: f64,
    /// Cells of the person: down to this far below the strongest cell of the person's own map.
    pub person_db: f64,
}

impl Default for MetricsConfig {
    fn default() -> Self {
        Self { span_db: 80.0, person_db: 20.0 }
    }
}

impl MetricsConfig {
    /// Refuses a span or a threshold that is no positive number of decibels.
    pub fn check(&self) -> Result<()> {
        let settings = [("span_db", self.span_db), ("person_db", self.person_db)];
        match settings.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0)) {
            Some((key, value)) => Err(Error::setting(format!("metrics.{key}"), value, "a positive number of decibels")),
            None => Ok(()),
        }
    }
}

/// What one pair of maps scores.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    pub psnr_db: f64,
    pub ssim: f64,
    pub mean_absolute_error_db: f64,
}

/// Compare two maps of decibels; with a mask, over its cells only.
///
/// Returns `None` when the mask holds no cell, or none that a whole SSIM window fits around.
///
/// # Panics
/// When the shapes differ.
pub fn scores(measured_db: &Map, simulated_db: &Map, window: &DbWindow, mask: Option<&[bool]>) -> Option<Scores> {
    let dims = measured_db.dims();
    assert_eq!(dims, simulated_db.dims(), "scores: measured {dims:?}, simulated {:?}", simulated_db.dims());
    let (measured, simulated) = (window.image(measured_db), window.image(simulated_db));
    let chosen = |index: &usize| mask.is_none_or(|mask| mask[*index]);
    let mean = |value: &dyn Fn(usize) -> f64| {
        let cells: Vec<f64> = (0..measured.len()).filter(chosen).map(value).collect();
        (!cells.is_empty()).then(|| cells.iter().sum::<f64>() / cells.len() as f64)
    };
    let squared = mean(&|index| (measured[index] - simulated[index]).powi(2))?;
    Some(Scores {
        psnr_db: psnr_of(squared),
        ssim: match mask {
            None => ssim(&measured, &simulated, dims)?,
            Some(mask) => ssim_map(&measured, &simulated, dims)?.mean_over(mask)?,
        },
        mean_absolute_error_db: mean(&|index| (measured_db.values[index] - simulated_db.values[index]).abs())?,
    })
}

/// Largest PSNR that is said, dB: that of equal images, so that means over frames stay numbers.
pub const MOST_PSNR_DB: f64 = 100.0;

/// Peak signal-to-noise ratio of two images with values in 0 … 1, dB; at most [`MOST_PSNR_DB`].
pub fn psnr(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len(), "psnr: {} and {} pixels", a.len(), b.len());
    psnr_of(a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / a.len() as f64)
}

fn psnr_of(mean_squared: f64) -> f64 {
    (-10.0 * mean_squared.log10()).min(MOST_PSNR_DB)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::heatmap::Axis;

    fn map(values: Vec<f64>) -> Map {
        let axis = |length: usize| (0..length).map(|index| index as f64).collect();
        Map::new(Axis::new("velocity", "m/s", axis(16)), Axis::new("range", "m", axis(20)), values)
    }

    fn ramp() -> Vec<f64> {
        (0..320).map(|index| -60.0 + (index % 37) as f64).collect()
    }

    #[test]
    fn a_window_maps_its_ends_to_black_and_white() {
        let window = DbWindow::below(10.0, 80.0);
        assert_eq!([-90.0, -70.0, -30.0, 10.0, 20.0].map(|db| window.normalise(db)), [0.0, 0.0, 0.5, 1.0, 1.0]);
    }

    #[test]
    fn equal_maps_score_best_and_a_constant_offset_costs_what_it_must() {
        let window = DbWindow { low_db: -80.0, high_db: 0.0 };
        let best = scores(&map(ramp()), &map(ramp()), &window, None).unwrap();
        assert_eq!((best.psnr_db, best.mean_absolute_error_db), (100.0, 0.0));
        assert!((best.ssim - 1.0).abs() < 1e-12);
        // 8 dB of 80 are a tenth: 20 dB
        let louder = map(ramp().iter().map(|db| db + 8.0).collect());
        let found = scores(&map(ramp()), &louder, &window, None).unwrap();
        assert!((found.psnr_db - 20.0).abs() < 1e-9 && (found.mean_absolute_error_db - 8.0).abs() < 1e-12);
        assert!(found.ssim < 1.0);
    }

    #[test]
    fn a_mask_restricts_every_score_to_its_cells() {
        let window = DbWindow { low_db: -80.0, high_db: 0.0 };
        // wrong in the left half only
        let wrong = map(ramp().iter().enumerate().map(|(index, db)| if index % 20 < 4 { db + 20.0 } else { *db }).collect());
        let right: Vec<bool> = (0..320).map(|index| index % 20 > 12).collect();
        let found = scores(&map(ramp()), &wrong, &window, Some(&right)).unwrap();
        assert_eq!((found.psnr_db, found.mean_absolute_error_db), (100.0, 0.0));
        assert!((found.ssim - 1.0).abs() < 1e-12);
        let left: Vec<bool> = right.iter().map(|cell| !cell).collect();
        assert!(scores(&map(ramp()), &wrong, &window, Some(&left)).unwrap().mean_absolute_error_db > 1.0);
        assert_eq!(scores(&map(ramp()), &wrong, &window, Some(&[false; 320])), None);
    }
}
