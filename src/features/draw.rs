//! Initial parameters, drawn on the host so that one seed gives the same network on every backend.

use burn::module::Param;
use burn::tensor::{Device, Tensor, TensorData};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A parameter drawn evenly from ±`bound`.
pub fn uniform<const D: usize>(shape: [usize; D], bound: f64, rng: &mut ChaCha8Rng, device: &Device) -> Param<Tensor<D>> {
    let values: Vec<f32> = (0..shape.iter().product()).map(|_| ((2.0 * rng.random::<f64>() - 1.0) * bound) as f32).collect();
    Param::from_data(TensorData::new(values, shape), device)
}

/// A parameter with given values.
pub fn values<const D: usize>(values: &[f64], shape: [usize; D], device: &Device) -> Param<Tensor<D>> {
    let values: Vec<f32> = values.iter().map(|&value| value as f32).collect();
    Param::from_data(TensorData::new(values, shape), device)
}

/// Rows to hide: `[row]`, 1 where hidden, each row with probability `rate`. Carries no gradient.
pub fn mask(rows: usize, rate: f64, rng: &mut ChaCha8Rng, device: &Device) -> Tensor<1> {
    let values: Vec<f32> = (0..rows).map(|_| if rng.random::<f64>() < rate { 1.0 } else { 0.0 }).collect();
    Tensor::from_data(TensorData::new(values, [rows]), device)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::support::values as read;
    use rand::SeedableRng;

    #[test]
    fn equal_seeds_give_equal_parameters_and_others_do_not() {
        let draw = |seed| read(&uniform([4, 3], 0.5, &mut ChaCha8Rng::seed_from_u64(seed), &Device::flex()).val());
        assert_eq!(draw(1), draw(1));
        assert_ne!(draw(1), draw(2));
        assert!(draw(1).iter().all(|value| value.abs() <= 0.5));
    }

    #[test]
    fn a_mask_hides_the_asked_share_of_rows() {
        let mask = read(&mask(10_000, 0.3, &mut ChaCha8Rng::seed_from_u64(3), &Device::flex()));
        let hidden = mask.iter().sum::<f64>() / 10_000.0;
        assert!((hidden - 0.3).abs() < 0.02, "{hidden}");
        assert!(mask.iter().all(|&value| value == 0.0 || value == 1.0));
    }
}
