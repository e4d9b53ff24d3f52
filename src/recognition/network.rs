//! Three convolutional branches, one per map, and a judge of what they found.

use burn::module::{Module, Param};
use burn::tensor::activation::relu;
use burn::tensor::module::{adaptive_avg_pool2d, conv2d, linear};
use burn::tensor::ops::ConvOptions;
use burn::tensor::{Device, Tensor};
use rand_chacha::ChaCha8Rng;

use crate::features::draw;

/// Parts into which the rows of a map are pooled: where on the velocity, range or angle axis something is matters,
/// when does not.
const PARTS: usize = 4;
/// Width of the layer that joins the branches.
const JOINT: usize = 48;

/// Three 3 × 3 convolutions of stride 2 in both axes (the first only along the rows), then the mean over time.
#[derive(Module, Debug)]
pub struct Branch {
    /// `[layer]`, each `[channel out, channel in, 3, 3]`
    weights: Vec<Param<Tensor<4>>>,
    /// `[layer]`, each `[channel out]`
    biases: Vec<Param<Tensor<1>>>,
}

impl Branch {
    fn init(channels: [usize; 3], rng: &mut ChaCha8Rng, device: &Device) -> Self {
        let ends = [(1, channels[0]), (channels[0], channels[1]), (channels[1], channels[2])];
        let weight = |(from, to): (usize, usize)| draw::uniform([to, from, 3, 3], (6.0 / (9 * from) as f64).sqrt(), rng, device);
        let weights = ends.into_iter().map(weight).collect();
        let biases = ends.into_iter().map(|(_, to)| draw::values(&vec![0.0; to], [to], device)).collect();
        Self { weights, biases }
    }

    /// `[window, row, frame]` to `[window, feature]`.
    fn forward(&self, map: Tensor<3>) -> Tensor<2> {
        let mut value: Tensor<4> = map.unsqueeze_dim(1);
        for (layer, (weight, bias)) in self.weights.iter().zip(&self.biases).enumerate() {
            let stride = if layer == 0 { [2, 1] } else { [2, 2] };
            let options = ConvOptions::new(stride, [1, 1], [1, 1], 1);
            value = relu(conv2d(value, weight.val(), Some(bias.val()), options));
        }
        adaptive_avg_pool2d(value, [PARTS, 1]).flatten(1, 3)
    }
}

/// The classifier.
#[derive(Module, Debug)]
pub struct Network {
    branches: Vec<Branch>,
    joint_weight: Param<Tensor<2>>,
    joint_bias: Param<Tensor<1>>,
    class_weight: Param<Tensor<2>>,
    class_bias: Param<Tensor<1>>,
}

impl Network {
    /// Weights are drawn evenly from ±√(6 / inputs) (Kaiming).
    pub fn init(channels: [usize; 3], classes: usize, rng: &mut ChaCha8Rng, device: &Device) -> Self {
        let branches = (0..3).map(|_| Branch::init(channels, rng, device)).collect();
        let features = 3 * PARTS * channels[2];
        Self {
            branches,
            joint_weight: draw::uniform([features, JOINT], (6.0 / features as f64).sqrt(), rng, device),
            joint_bias: draw::values(&[0.0; JOINT], [JOINT], device),
            class_weight: draw::uniform([JOINT, classes], (6.0 / JOINT as f64).sqrt() * 0.3, rng, device),
            class_bias: draw::values(&vec![0.0; classes], [classes], device),
        }
    }

    /// # Shapes
    /// - `maps`: `[window, row, frame]` each, in the order of [`super::maps::MAPS`]
    /// - result: `[window, class]`, unnormalised logarithms of probabilities
    ///
    /// # Gradient
    /// Flows to the maps and all parameters; kinks of the rectifiers excepted, it is smooth.
    pub fn forward(&self, maps: [Tensor<3>; 3]) -> Tensor<2> {
        let features = self.branches.iter().zip(maps).map(|(branch, map)| branch.forward(map)).collect();
        let joint = relu(linear(Tensor::cat(features, 1), self.joint_weight.val(), Some(self.joint_bias.val())));
        linear(joint, self.class_weight.val(), Some(self.class_bias.val()))
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn any_sizes_of_maps_give_one_value_per_window_and_class_from_few_parameters() {
        let device = Device::flex();
        let network = Network::init([8, 16, 32], 8, &mut ChaCha8Rng::seed_from_u64(1), &device);
        assert!(network.num_params() < 100_000, "{}", network.num_params());
        let output = network.forward([[5, 64, 16], [5, 33, 16], [5, 7, 16]].map(|shape| Tensor::ones(shape, &device)));
        assert_eq!(output.dims(), [5, 8]);
    }
}
