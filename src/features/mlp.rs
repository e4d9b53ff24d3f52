//! A small fully connected network, initialised on the host.

use burn::module::{Module, Param};
use burn::tensor::module::linear;
use burn::tensor::{Device, Tensor};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::draw;
use crate::bounds;
use crate::error::{Error, Result};

/// Together at most a quarter of [`bounds::MOST_NUMBERS`]: 16 matrices of 2048 x 2048. NeRF's network has 8 layers of 256.
const MOST_LAYERS: usize = 16;
const MOST_WIDTH: usize = 2048;

/// Settings of a network.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MlpConfig {
    /// Width of each hidden layer.
    pub hidden: Vec<usize>,
}

impl Default for MlpConfig {
    fn default() -> Self {
        Self { hidden: vec![64, 64] }
    }
}

impl MlpConfig {
    /// Refuses too many layers, and a width of zero or beyond the most; `key` names these settings in messages.
    pub fn check(&self, key: &str) -> Result<()> {
        if self.hidden.len() > MOST_LAYERS {
            return Err(Error::setting(
                format!("{key}.hidden"),
                format!("{} layers", self.hidden.len()),
                format!("at most {MOST_LAYERS}"),
            ));
        }
        let width = |(layer, &width): (usize, &usize)| bounds::count(format!("{key}.hidden[{layer}]"), width, MOST_WIDTH);
        self.hidden.iter().enumerate().try_for_each(width)
    }

    /// Weights are drawn evenly from ±√(6 / inputs) (Kaiming), those of the last layer from a twentieth of it, so that
    /// the network starts close to `initial`, the wanted output, with enough variation to tell points apart.
    pub fn init(&self, inputs: usize, initial: &[f64], rng: &mut ChaCha8Rng, device: &Device) -> Mlp {
        let widths: Vec<usize> = [inputs].into_iter().chain(self.hidden.iter().copied()).chain([initial.len()]).collect();
        let layers = widths
            .windows(2)
            .enumerate()
            .map(|(index, width)| {
                let last = index + 2 == widths.len();
                let bound = (6.0 / width[0] as f64).sqrt() * if last { 0.05 } else { 1.0 };
                let bias = if last { initial.to_vec() } else { vec![0.0; width[1]] };
                Layer {
                    weight: draw::uniform([width[0], width[1]], bound, rng, device),
                    bias: draw::values(&bias, [width[1]], device),
                }
            })
            .collect();
        Mlp { layers }
    }
}

/// Learned: all weights and biases.
#[derive(Module, Debug)]
pub struct Mlp {
    pub layers: Vec<Layer>,
}

/// y = x · weight + bias.
#[derive(Module, Debug)]
pub struct Layer {
    /// `[feature in, feature out]`
    pub weight: Param<Tensor<2>>,
    /// `[feature out]`
    pub bias: Param<Tensor<1>>,
}

impl Layer {
    /// `[point, feature in]` to `[point, feature out]`.
    pub fn forward(&self, input: Tensor<2>) -> Tensor<2> {
        linear(input, self.weight.val(), Some(self.bias.val()))
    }
}

impl Mlp {
    /// # Shapes
    /// - `input`: `[point, feature]`
    /// - result: `[point, feature]`, as many as the initial outputs given to `init`
    ///
    /// # Gradient
    /// Flows to `input` and all parameters; smooth everywhere.
    pub fn forward(&self, input: Tensor<2>) -> Tensor<2> {
        let last = self.layers.len() - 1;
        self.layers.iter().enumerate().fold(input, |value, (index, layer)| {
            let value = layer.forward(value);
            if index == last { value } else { activation(value) }
        })
    }
}

/// x σ(x) with the algebraic sigmoid σ(x) = ½ (1 + x / √(1 + x²)): the shape of SiLU, smooth, zero at zero, and without
/// the exponential, which CPU backends compute one number at a time (that alone took two thirds of a decoder's time).
pub fn activation<const D: usize>(value: Tensor<D>) -> Tensor<D> {
    let length = (value.clone() * value.clone() + 1.0).sqrt();
    value.clone() * (value / length + 1.0) * 0.5
}

/// 1 / (1 + exp(−x)), written with tanh: it cannot overflow, and keeps f64 (Burn's own computes in f32 on some backends).
pub fn sigmoid<const D: usize>(value: Tensor<D>) -> Tensor<D> {
    (value * 0.5).tanh() * 0.5 + 0.5
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::support::{assert_close, check_finite, check_gradient, in_f64, input, numbers, tensor, values};
    use rand::SeedableRng;

    fn network(initial: &[f64]) -> Mlp {
        MlpConfig { hidden: vec![8, 8] }.init(3, initial, &mut ChaCha8Rng::seed_from_u64(1), &Device::flex())
    }

    #[test]
    fn a_new_network_starts_near_the_wanted_output_but_tells_inputs_apart() {
        let network = in_f64(network(&[2.0, -1.0]));
        let output = values(&network.forward(tensor(&numbers(1, 30, -1.0, 1.0), [10, 3], &Device::flex())));
        assert!(output.chunks(2).all(|row| (row[0] - 2.0).abs() < 0.3 && (row[1] + 1.0).abs() < 0.3), "{output:?}");
        assert!((output[0] - output[2]).abs() > 1e-4);
    }

    pub(crate) fn gradients_to_the_input_and_every_parameter_agree_with_central_differences() {
        let network = in_f64(network(&[0.5, 0.5]));
        let mut inputs = vec![input("input", numbers(2, 12, -1.0, 1.0))];
        for (layer, name) in network.layers.iter().zip([("w0", "b0"), ("w1", "b1"), ("w2", "b2")]) {
            inputs.push(input(name.0, values(&layer.weight.val())));
            inputs.push(input(name.1, values(&layer.bias.val())));
        }
        check_gradient(&inputs, 1e-5, 1e-7, |x| {
            let mut network = network.clone();
            for (layer, parameters) in network.layers.iter_mut().zip(x[1..].chunks(2)) {
                layer.weight = layer.weight.clone().map(|old| parameters[0].clone().reshape(old.dims()));
                layer.bias = layer.bias.clone().map(|_| parameters[1].clone());
            }
            network.forward(x[0].clone().reshape([4, 3])).reshape([8])
        });
    }

    #[test]
    fn the_sigmoid_is_right_and_never_overflows() {
        let found = values(&sigmoid(tensor(&[-800.0, -1.0, 0.0, 1.0, 800.0], [5], &Device::flex())));
        let one = 1.0 / (1.0 + (-1.0_f64).exp());
        assert_close("sigmoid", &found, &[0.0, 1.0 - one, 0.5, one, 1.0], 1e-15);
        check_finite(&[input("x", [-1e4, 0.0, 1e4])], |x| activation(x[0].clone()) + sigmoid(x[0].clone()));
    }

    #[test]
    fn the_activation_is_zero_at_zero_passes_what_is_large_and_stops_what_is_negative() {
        let found = values(&activation(tensor(&[-100.0, -1.0, 0.0, 1.0, 100.0], [5], &Device::flex())));
        let one = 0.5 + 0.5 / 2.0_f64.sqrt();
        assert_close("activation", &found, &[-0.0025, one - 1.0, 0.0, one, 99.9975], 1e-6);
        check_gradient(&[input("x", numbers(7, 6, -3.0, 3.0))], 1e-6, 1e-7, |x| activation(x[0].clone()));
    }

    #[test]
    fn a_layer_without_width_is_refused() {
        let error = MlpConfig { hidden: vec![64, 0] }.check("decoder").unwrap_err();
        assert_eq!(error.to_string(), "`decoder.hidden[1]` is 0, expected 1 to 2048");
    }
}
