//! Three learned planes, looked up at the body's canonical points (paper, section 3.1).
//!
//! A canonical point is projected onto the xy, yz and zx plane, each plane is sampled bilinearly, and the three
//! samples are concatenated or summed. Canonical points do not move with the pose, so what is learned stays with the
//! body; the corners and weights are computed once on the host, in f64.

use burn::module::{Module, Param};
use burn::tensor::{Device, Tensor};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::draw;
use super::extent::Extent;
use super::rows::WeightedRows;
use crate::bounds;
use crate::error::{Error, Result};

/// What becomes of the three planes' samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Combination {
    /// One after the other: 3 × `features` numbers.
    #[default]
    Concatenate,
    /// Added: `features` numbers.
    Sum,
}

/// Eight times what published tri-planes have (EG3D, Chan et al. 2022: 32): the networks behind are as wide.
const MOST_FEATURES: usize = 256;

/// Settings of the planes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TriPlaneConfig {
    /// Texels along each side of a plane. 64 over a body of 1.8 m is one texel every 3 cm.
    pub resolution: usize,
    /// Learned numbers per texel.
    pub features: usize,
    pub combination: Combination,
    /// Texels start evenly distributed in ± this.
    pub initial_bound: f64,
    /// Free space around the body, as a fraction of its size.
    pub margin: f64,
}

impl Default for TriPlaneConfig {
    fn default() -> Self {
        Self { resolution: 64, features: 16, combination: Combination::Concatenate, initial_bound: 0.1, margin: 0.05 }
    }
}

impl TriPlaneConfig {
    /// Refuses what cannot be sampled. `key` names these settings in messages.
    pub fn check(&self, key: &str) -> Result<()> {
        if self.resolution < 2 {
            return Err(Error::setting(format!("{key}.resolution"), self.resolution, "at least 2 texels a side"));
        }
        bounds::count(format!("{key}.features"), self.features, MOST_FEATURES)?;
        let texels = [3, self.resolution, self.resolution, self.features];
        bounds::numbers(format!("{key}.resolution"), "planes x side x side x features", &texels)?;
        if !(self.initial_bound.is_finite() && self.initial_bound >= 0.0) {
            return Err(Error::setting(format!("{key}.initial_bound"), self.initial_bound, "zero or more"));
        }
        if !(self.margin.is_finite() && self.margin >= 0.0) {
            return Err(Error::setting(format!("{key}.margin"), self.margin, "zero or more"));
        }
        Ok(())
    }

    /// Length of a point's feature vector.
    pub fn features_out(&self) -> usize {
        match self.combination {
            Combination::Concatenate => 3 * self.features,
            Combination::Sum => self.features,
        }
    }

    /// Planes whose texels are drawn uniformly between ± `initial_bound`; they learn.
    pub fn init(&self, rng: &mut ChaCha8Rng, device: &Device) -> TriPlane {
        let texels = 3 * self.resolution * self.resolution;
        TriPlane {
            texels: draw::uniform([texels, self.features], self.initial_bound, rng, device),
            resolution: self.resolution,
            combination: self.combination,
        }
    }
}

/// The planes. Learned: all texels.
#[derive(Module, Debug)]
pub struct TriPlane {
    /// `[texel, feature]`; texel = (plane · resolution + row) · resolution + column.
    pub texels: Param<Tensor<2>>,
    resolution: usize,
    #[module(skip)]
    combination: Combination,
}

impl TriPlane {
    /// Features of the sampler's points.
    ///
    /// # Shapes
    /// - result: `[point, feature]`
    ///
    /// # Gradient
    /// Flows to the texels around each point, with the bilinear weights.
    pub fn forward(&self, sampler: &TriPlaneSampler) -> Tensor<2> {
        assert_eq!(
            sampler.resolution, self.resolution,
            "tri-plane: sampler made for {} texels a side, planes have {}",
            sampler.resolution, self.resolution
        );
        let samples = sampler.planes.iter().map(|plane| plane.apply(self.texels.val()));
        match self.combination {
            Combination::Concatenate => Tensor::cat(samples.collect(), 1),
            Combination::Sum => samples.reduce(|sum, sample| sum + sample).expect("three planes"),
        }
    }
}

/// Texels and weights of fixed points; made once for a body.
#[derive(Clone, Debug)]
pub struct TriPlaneSampler {
    planes: [WeightedRows; 3],
    resolution: usize,
}

impl TriPlaneSampler {
    /// `points`: canonical positions `[point]`, metres. Points outside the extent get its border's features.
    pub fn new(points: &[[f64; 3]], extent: &Extent, resolution: usize, device: &Device) -> Self {
        let last = (resolution - 1) as f64;
        let rows = 3 * resolution * resolution;
        let planes = [(0, 1), (1, 2), (2, 0)];
        let planes = std::array::from_fn(|plane| {
            let (column_axis, row_axis) = planes[plane];
            let (corners, weights): (Vec<_>, Vec<_>) = points
                .iter()
                .map(|&point| {
                    let fraction = extent.fraction(point);
                    let cell = |axis: usize| {
                        let at = fraction[axis] * last;
                        // The last texel is reached from the cell before it.
                        let cell = at.floor().min(last - 1.0);
                        (cell as usize, at - cell)
                    };
                    let ((column, right), (row, down)) = (cell(column_axis), cell(row_axis));
                    let texel = |row: usize, column: usize| (plane * resolution + row) * resolution + column;
                    (
                        [texel(row, column), texel(row, column + 1), texel(row + 1, column), texel(row + 1, column + 1)],
                        [(1.0 - down) * (1.0 - right), (1.0 - down) * right, down * (1.0 - right), down * right],
                    )
                })
                .unzip();
            WeightedRows::new(&corners, &weights, rows, device)
        });
        Self { planes, resolution }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::support::{assert_close, check_gradient, in_f64, input, numbers, tensor, values};
    use rand::SeedableRng;

    fn unit_box() -> Extent {
        Extent { low_m: [0.0; 3], high_m: [1.0; 3] }
    }

    fn planes(config: &TriPlaneConfig) -> TriPlane {
        config.init(&mut ChaCha8Rng::seed_from_u64(5), &Device::flex())
    }

    fn points(count: usize) -> Vec<[f64; 3]> {
        numbers(9, 3 * count, 0.0, 1.0).chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect()
    }

    #[test]
    fn a_linear_field_is_reproduced_exactly() {
        // Each plane holds 2·column + 3·row in fractions of the box: bilinear interpolation must return it everywhere.
        let config = TriPlaneConfig { resolution: 5, features: 1, ..Default::default() };
        let mut plane = planes(&config);
        let texels: Vec<f64> = (0..75).map(|texel| (2.0 * (texel % 5) as f64 + 3.0 * (texel / 5 % 5) as f64) / 4.0).collect();
        plane.texels = Param::from_tensor(tensor(&texels, [75, 1], &Device::flex()));
        let points = points(20);
        let sampler = TriPlaneSampler::new(&points, &unit_box(), 5, &Device::flex());
        let wanted: Vec<f64> =
            points.iter().flat_map(|[x, y, z]| [2.0 * x + 3.0 * y, 2.0 * y + 3.0 * z, 2.0 * z + 3.0 * x]).collect();
        assert_close("features", &values(&plane.forward(&sampler)), &wanted, 1e-6);
    }

    #[test]
    fn a_point_on_a_texel_gets_that_texel_also_at_the_far_border() {
        let config = TriPlaneConfig { resolution: 3, features: 2, ..Default::default() };
        let plane = planes(&config);
        let sampler = TriPlaneSampler::new(&[[1.0, 1.0, 1.0], [0.5, 0.0, 1.0]], &unit_box(), 3, &Device::flex());
        let (found, texels) = (values(&plane.forward(&sampler)), values(&plane.texels.val()));
        let texel = |plane: usize, row: usize, column: usize| &texels[2 * ((plane * 3 + row) * 3 + column)..][..2];
        assert_eq!(found[0..2], *texel(0, 2, 2));
        assert_eq!(found[4..6], *texel(2, 2, 2));
        assert_eq!(found[6..8], *texel(0, 0, 1), "xy: column x = 1, row y = 0");
        assert_eq!(found[8..10], *texel(1, 2, 0), "yz: column y = 0, row z = 2");
        assert_eq!(found[10..12], *texel(2, 1, 2), "zx: column z = 2, row x = 1");
    }

    #[test]
    fn summing_adds_what_concatenating_puts_side_by_side() {
        let config = TriPlaneConfig { resolution: 4, features: 3, ..Default::default() };
        let sum = TriPlaneConfig { combination: Combination::Sum, ..config.clone() };
        let sampler = TriPlaneSampler::new(&points(6), &unit_box(), 4, &Device::flex());
        let (side, sums) = (planes(&config).forward(&sampler), planes(&sum).forward(&sampler));
        assert_eq!(side.dims(), [6, config.features_out()]);
        assert_eq!(sums.dims(), [6, sum.features_out()]);
        let side = values(&side);
        let wanted: Vec<f64> = (0..6)
            .flat_map(|p| (0..3).map(move |f| (p, f)))
            .map(|(p, f)| (0..3).map(|k| side[9 * p + 3 * k + f]).sum())
            .collect();
        assert_close("sum", &values(&sums), &wanted, 1e-6);
    }

    pub(crate) fn gradients_to_the_texels_agree_with_central_differences() {
        let plane = in_f64(planes(&TriPlaneConfig { resolution: 3, features: 2, ..Default::default() }));
        let texels = values(&plane.texels.val());
        check_gradient(&[input("texels", texels)], 1e-5, 1e-8, |x| {
            let mut plane = plane.clone();
            // Parameters are leaves of the graph; this one is part of it.
            plane.texels = plane.texels.map(|_| x[0].clone().reshape([27, 2]));
            let sampler = TriPlaneSampler::new(&points(7), &unit_box(), 3, &x[0].device());
            plane.forward(&sampler).powi_scalar(2).reshape([42])
        });
    }

    #[test]
    fn unusable_settings_are_refused() {
        let error = TriPlaneConfig { resolution: 1, ..Default::default() }.check("body.features").unwrap_err();
        assert_eq!(error.to_string(), "`body.features.resolution` is 1, expected at least 2 texels a side");
        assert!(TriPlaneConfig::default().check("x").is_ok());
        assert!(TriPlaneConfig { margin: f64::NAN, ..Default::default() }.check("x").is_err());
    }
}
