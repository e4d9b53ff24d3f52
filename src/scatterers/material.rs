//! What a surface is made of, in the ranges that physics allows.

use burn::tensor::Tensor;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::features::RowIndex;
use crate::features::mlp::sigmoid;

/// An open interval that a learned number stays in, and where it starts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    pub low: f64,
    pub high: f64,
    pub initial: f64,
}

impl Range {
    /// From `low` to `high`, where learning starts at `initial`; [`Self::check`] tests whether that is so.
    pub const fn new(low: f64, high: f64, initial: f64) -> Self {
        Self { low, high, initial }
    }

    /// `low + (high − low) σ(raw)`: the quantity that an unbounded parameter stands for.
    pub fn real<const D: usize>(&self, raw: Tensor<D>) -> Tensor<D> {
        sigmoid(raw) * (self.high - self.low) + self.low
    }

    /// `low (high / low)^σ(raw)`: the same for quantities that are compared by their ratio. Needs `low` above zero.
    pub fn real_by_ratio<const D: usize>(&self, raw: Tensor<D>) -> Tensor<D> {
        (sigmoid(raw) * (self.high / self.low).ln() + self.low.ln()).exp()
    }

    /// The parameter at which `real` is `initial`.
    pub fn raw_initial(&self) -> f64 {
        logit((self.initial - self.low) / (self.high - self.low))
    }

    /// The parameter at which `real_by_ratio` is `initial`.
    pub fn raw_initial_by_ratio(&self) -> f64 {
        logit((self.initial / self.low).ln() / (self.high / self.low).ln())
    }

    /// Refuses an empty interval, one outside `allowed`, or a start outside it. `key` names it in messages.
    pub fn check(&self, key: &str, allowed: std::ops::RangeInclusive<f64>) -> Result<()> {
        let (least, most) = allowed.into_inner();
        if !(self.low >= least && self.high <= most && self.low < self.high) {
            return Err(Error::setting(
                key,
                format!("{} to {}", self.low, self.high),
                format!("a range within {least} to {most}"),
            ));
        }
        if !(self.initial > self.low && self.initial < self.high) {
            return Err(Error::setting(
                format!("{key}.initial"),
                self.initial,
                format!("a value between {} and {}", self.low, self.high),
            ));
        }
        Ok(())
    }
}

fn logit(fraction: f64) -> f64 {
    (fraction / (1.0 - fraction)).ln()
}

/// Ranges of the material's parameters; the defaults start at dry skin at 77 GHz (Gabriel et al. 1996: ε = 6.57 − 8.92j, thus
/// ñ = 2.97 − 1.50j; the law is in `docs/paper.md`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MaterialConfig {
    /// α of Trowbridge-Reitz.
    pub roughness: Range,
    /// Share that reflects like a perfect conductor.
    pub metallic: Range,
    /// η, real part of the refractive index.
    pub refraction: Range,
    /// k, imaginary part.
    pub extinction: Range,
    /// w, weight of the s polarisation.
    pub polarisation: Range,
}

impl Default for MaterialConfig {
    fn default() -> Self {
        Self {
            roughness: Range::new(0.02, 1.0, 0.4),
            metallic: Range::new(0.0, 1.0, 0.05),
            refraction: Range::new(1.05, 8.0, 2.97),
            extinction: Range::new(0.0, 6.0, 1.50),
            polarisation: Range::new(0.0, 1.0, 0.5),
        }
    }
}

impl MaterialConfig {
    /// The same ranges, starting at plasterboard or concrete (ε ≈ 3 to 5, little loss).
    pub fn wall() -> Self {
        Self {
            roughness: Range::new(0.02, 1.0, 0.3),
            refraction: Range::new(1.05, 8.0, 2.0),
            extinction: Range::new(0.0, 6.0, 0.1),
            ..Self::default()
        }
    }

    /// Refuses ranges that reach beyond what physics allows; `key` names these settings in messages.
    pub fn check(&self, key: &str) -> Result<()> {
        self.roughness.check(&format!("{key}.roughness"), 1e-3..=1.0)?;
        self.metallic.check(&format!("{key}.metallic"), 0.0..=1.0)?;
        self.refraction.check(&format!("{key}.refraction"), 1.0..=100.0)?;
        self.extinction.check(&format!("{key}.extinction"), 0.0..=100.0)?;
        self.polarisation.check(&format!("{key}.polarisation"), 0.0..=1.0)
    }

    /// Raw outputs at which the material is the initial one, in the order that `real` reads.
    pub fn raw_initial(&self) -> [f64; 5] {
        self.ranges().map(|range| range.raw_initial())
    }

    /// # Shapes
    /// - `raw`: `[point, 5]`, unbounded
    ///
    /// # Gradient
    /// Flows to `raw`, and vanishes towards the ends of the ranges.
    pub fn real(&self, raw: Tensor<2>) -> Material {
        let [point, _] = raw.dims();
        let mut quantities = self.ranges().into_iter().enumerate().map(|(index, range)| {
            let raw: Tensor<1> = raw.clone().narrow(1, index, 1).reshape([point]);
            range.real(raw)
        });
        let mut next = || quantities.next().expect("five quantities");
        Material { roughness: next(), metallic: next(), refraction: next(), extinction: next(), polarisation: next() }
    }

    fn ranges(&self) -> [Range; 5] {
        [self.roughness, self.metallic, self.refraction, self.extinction, self.polarisation]
    }
}

/// Decoded material, each `[point]`, without unit.
#[derive(Clone, Debug)]
pub struct Material {
    /// α, above 0 to 1.
    pub roughness: Tensor<1>,
    /// 0 … 1.
    pub metallic: Tensor<1>,
    /// η ≥ 1.
    pub refraction: Tensor<1>,
    /// k ≥ 0.
    pub extinction: Tensor<1>,
    /// w, 0 (p only) … 1 (s only).
    pub polarisation: Tensor<1>,
}

impl Material {
    /// Body and room together: the unified set of scatterers.
    pub fn cat(parts: Vec<Self>) -> Self {
        let cat = |field: fn(&Self) -> &Tensor<1>| Tensor::cat(parts.iter().map(|part| field(part).clone()).collect(), 0);
        Self {
            roughness: cat(|part| &part.roughness),
            metallic: cat(|part| &part.metallic),
            refraction: cat(|part| &part.refraction),
            extinction: cat(|part| &part.extinction),
            polarisation: cat(|part| &part.polarisation),
        }
    }

    /// Only some points: those that are seen.
    pub fn pick(&self, points: &RowIndex) -> Self {
        Self {
            roughness: points.pick_one(self.roughness.clone()),
            metallic: points.pick_one(self.metallic.clone()),
            refraction: points.pick_one(self.refraction.clone()),
            extinction: points.pick_one(self.extinction.clone()),
            polarisation: points.pick_one(self.polarisation.clone()),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::support::{assert_close, check_finite, check_gradient, input, numbers, tensor, values};
    use burn::tensor::Device;

    #[test]
    fn the_initial_value_comes_back_from_its_raw_parameter() {
        let one = |raw: f64| tensor(&[raw], [1], &Device::flex());
        let range = Range::new(0.02, 1.0, 0.4);
        assert_close("real", &values(&range.real(one(range.raw_initial()))), &[0.4], 1e-12);
        let range = Range::new(1e-4, 5e-3, 5e-4);
        assert_close("by ratio", &values(&range.real_by_ratio(one(range.raw_initial_by_ratio()))), &[5e-4], 1e-12);
        let material = MaterialConfig::default();
        let raw = tensor(&material.raw_initial(), [1, 5], &Device::flex());
        let skin = material.real(raw);
        let found = [&skin.roughness, &skin.metallic, &skin.refraction, &skin.extinction, &skin.polarisation];
        assert_close("skin", &found.map(|q| values(q)[0]), &[0.4, 0.05, 2.97, 1.5, 0.5], 1e-12);
    }

    #[test]
    fn no_raw_parameter_leaves_the_range() {
        let raw = tensor(&[-1e3, -5.0, 5.0, 1e3], [4], &Device::flex());
        for range in [Range::new(0.02, 1.0, 0.4), Range::new(1e-4, 5e-3, 5e-4)] {
            for found in [values(&range.real(raw.clone())), values(&range.real_by_ratio(raw.clone()))] {
                assert!(found.iter().all(|v| (range.low * 0.999_999..=range.high * 1.000_001).contains(v)), "{found:?}");
                assert!(found[1] < found[2]);
            }
        }
    }

    #[test]
    fn picking_and_joining_keep_the_points_order() {
        let device = Device::flex();
        let config = MaterialConfig::default();
        let decode = |seed| config.real(tensor(&numbers(seed, 15, -2.0, 2.0), [3, 5], &device));
        let both = Material::cat(vec![decode(1), decode(2)]);
        let picked = both.pick(&RowIndex::new(&[4, 0], 6, &device));
        assert_eq!(values(&picked.extinction), [values(&decode(2).extinction)[1], values(&decode(1).extinction)[0]]);
    }

    pub(crate) fn gradients_agree_with_central_differences() {
        let decode = |x: &[Tensor<1>]| {
            let material = MaterialConfig::default().real(x[0].clone().reshape([2, 5]));
            let Material { roughness, metallic, refraction, extinction, polarisation } = material;
            let scale = Range::new(1e-4, 5e-3, 5e-4).real_by_ratio(x[0].clone()) * 1e3;
            Tensor::cat(vec![roughness, metallic, refraction, extinction, polarisation, scale], 0)
        };
        check_gradient(&[input("raw", numbers(5, 10, -2.0, 2.0))], 1e-5, 1e-7, decode);
        check_finite(&[input("raw", [-1e4, 1e4, 0.0, 50.0, -50.0, 1.0, 2.0, 3.0, 4.0, 5.0])], decode);
    }

    #[test]
    fn impossible_ranges_are_refused() {
        assert!(MaterialConfig::default().check("body.material").is_ok());
        assert!(MaterialConfig::wall().check("room.material").is_ok());
        let metal = MaterialConfig { metallic: Range::new(0.0, 1.5, 0.5), ..Default::default() };
        let error = metal.check("body.material").unwrap_err();
        assert_eq!(error.to_string(), "`body.material.metallic` is 0 to 1.5, expected a range within 0 to 1");
        let start = MaterialConfig { metallic: Range::new(0.0, 1.0, 1.0), ..Default::default() };
        assert!(start.check("m").unwrap_err().to_string().contains("m.metallic.initial"));
    }
}
