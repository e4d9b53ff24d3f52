//! Straight legs between scatterers and antennas, as a reference length and a small change.

use burn::tensor::Tensor;

use super::{column, distance};
use crate::body::Displacement;

/// Added to lengths in quadrature so that a point on an antenna has a finite gradient, metres.
/// At 0.1 m it changes a length by 5·10⁻⁸ m.
pub(crate) const SOFTENING_M: f64 = 1e-4;

/// One straight leg between every scatterer and an antenna (or a wall's receiver).
#[derive(Clone, Debug)]
pub struct Leg {
    /// Length at the reference positions `[point]`, metres, on the host.
    pub reference_m: Vec<f64>,
    /// By how much it is longer `[point, chirp]`, metres. Gradient to the displacement.
    pub change_m: Tensor<2>,
}

impl Leg {
    /// Whole length `[point, chirp]`, metres.
    pub fn length_m(&self) -> Tensor<2> {
        let (device, dtype) = (self.change_m.device(), self.change_m.dtype());
        self.change_m.clone() + column(self.reference_m.iter().copied(), &device, dtype)
    }
}

/// Moving points with what all of their legs share.
pub struct Motion<'a> {
    reference_m: &'a [[f64; 3]],
    displacement: &'a Displacement,
    /// 2 x0·u + |u|², which is |x0+u|² − |x0|² without its cancellation, m².
    growth: Tensor<2>,
}

impl<'a> Motion<'a> {
    /// # Shapes
    /// `reference_m`: `[point]`; `displacement`: each `[point, chirp]`.
    pub fn new(reference_m: &'a [[f64; 3]], displacement: &'a Displacement) -> Self {
        let [points, _] = displacement.dims();
        assert_eq!(reference_m.len(), points, "motion: {} reference positions, displacement of {points}", reference_m.len());
        let along = |u: &Tensor<2>, axis: usize| {
            let twice = column(reference_m.iter().map(|x| 2.0 * x[axis]), &u.device(), u.dtype());
            u.clone() * (u.clone() + twice)
        };
        let growth = along(&displacement.x, 0) + along(&displacement.y, 1) + along(&displacement.z, 2);
        Self { reference_m, displacement, growth }
    }

    /// The leg from every point to an antenna, Δ = (2 v·u + |u|²)/(|v+u| + |v|) with v = x0 − antenna.
    pub fn leg(&self, antenna_m: [f64; 3]) -> Leg {
        let reference_m: Vec<f64> = self.reference_m.iter().map(|&x| distance(x, antenna_m)).collect();
        let (device, dtype) = (self.growth.device(), self.growth.dtype());
        let Displacement { x, y, z } = self.displacement;
        let mut growth = self.growth.clone();
        for (u, r) in [x, y, z].into_iter().zip(antenna_m) {
            if r != 0.0 {
                growth = growth - u.clone() * (2.0 * r);
            }
        }
        let squared = column(reference_m.iter().map(|l| l * l + SOFTENING_M * SOFTENING_M), &device, dtype);
        let length = (growth.clone() + squared).sqrt();
        let change_m = growth / (length + column(reference_m.iter().copied(), &device, dtype));
        Leg { reference_m, change_m }
    }
}

/// One leg alone; [`Motion`] shares work between several.
pub fn leg(reference_m: &[[f64; 3]], displacement: &Displacement, antenna_m: [f64; 3]) -> Leg {
    Motion::new(reference_m, displacement).leg(antenna_m)
}
