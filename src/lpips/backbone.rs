//! A backbone with its weights.

use burn::tensor::{
    Device, Tensor, TensorData,
    activation::relu,
    module::{conv2d, max_pool2d},
    ops::{ConvOptions, MaxPoolOptions},
};

use super::{
    network::{Layer, Network},
    weights::WeightFile,
};
use crate::error::Result;

/// A convolution and the ReLU after it.
pub(super) struct Convolution {
    weight: Tensor<4>,
    bias: Tensor<1>,
    stride: usize,
    padding: usize,
}

impl Convolution {
    /// `[batch, channel, row, column]`
    fn forward(&self, input: Tensor<4>) -> Tensor<4> {
        let options = ConvOptions::new([self.stride; 2], [self.padding; 2], [1, 1], 1);
        relu(conv2d(input, self.weight.clone(), Some(self.bias.clone()), options))
    }
}

/// A layer that can be run.
pub(super) enum Stage {
    Convolution(Box<Convolution>),
    /// Squeeze, then both expansions.
    Fire(Box<[Convolution; 3]>),
    MaxPool(MaxPoolOptions<2>),
    Tap,
}

/// The layers of a network with the weights of a file.
///
/// # Errors
/// The first tensor that the file lacks, or holds in another shape.
pub(super) fn stages(network: Network, file: &WeightFile, device: &Device) -> Result<Vec<Stage>> {
    let tensors = file.backbone(network)?;
    // in the order of the layers
    let mut tensors = tensors.into_iter();
    let mut next = || tensors.next().expect("the network's own list");
    let mut convolution = |stride: usize, padding: usize| {
        let (shape, weight) = next();
        let [output, input, kernel, _] = shape[..] else { unreachable!("a weight has four axes") };
        let (_, bias) = next();
        Convolution {
            weight: Tensor::from_data(TensorData::new(weight, [output, input, kernel, kernel]), device),
            bias: Tensor::from_data(TensorData::new(bias, [output]), device),
            stride,
            padding,
        }
    };
    let stage = |layer: Layer| match layer {
        Layer::Convolution { stride, padding, .. } => Stage::Convolution(Box::new(convolution(stride, padding))),
        Layer::Fire { .. } => Stage::Fire(Box::new([convolution(1, 0), convolution(1, 0), convolution(1, 1)])),
        Layer::MaxPool { kernel, ceil } => {
            Stage::MaxPool(MaxPoolOptions::new([kernel; 2]).with_stride([2, 2]).with_ceil_mode(ceil))
        }
        Layer::Tap { .. } => Stage::Tap,
    };
    Ok(network.layers().into_iter().map(stage).collect())
}

/// The features at every depth that is compared, `[batch, channel, row, column]`, of images `[batch, 3, row, column]`.
pub(super) fn features(stages: &[Stage], images: Tensor<4>) -> Vec<Tensor<4>> {
    let mut found = Vec::new();
    let mut at = images;
    for stage in stages {
        at = match stage {
            Stage::Convolution(convolution) => convolution.forward(at),
            Stage::Fire(convolutions) => {
                let [squeeze, pixels, neighbours] = &**convolutions;
                let squeezed = squeeze.forward(at);
                Tensor::cat(vec![pixels.forward(squeezed.clone()), neighbours.forward(squeezed)], 1)
            }
            Stage::MaxPool(options) => max_pool2d(at, options.clone()),
            Stage::Tap => {
                found.push(at.clone());
                at
            }
        };
    }
    found
}
