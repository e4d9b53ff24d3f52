//! LPIPS: how alike two images look to a trained network (Zhang et al. 2018, version 0.1).
//!
//! Both images go through a backbone; at several depths its features are scaled to unit length at every pixel, their
//! squared differences weighted by a trained head, and the mean over pixels is summed over the depths.
//!
//! Backbones and heads are third-party files that the user gives: torchvision's weights of AlexNet, SqueezeNet 1.1 or
//! VGG-16, and the heads of the `lpips` package. Without them there is no LPIPS, and no number stands in for it.

mod backbone;
mod network;
mod weights;

pub use network::Network;

use std::path::PathBuf;

use burn::tensor::{Device, Tensor, TensorData};
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use backbone::Stage;
use weights::WeightFile;

/// Which network looks at the images, and the files it comes in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LpipsConfig {
    pub network: Network,
    /// The backbone's state dict, as torch (.pth, .pt) or safetensors.
    pub weights: PathBuf,
    /// The linear heads: npz (`lin0`, …), torch or safetensors (`lin0.model.1.weight`, …).
    pub heads: PathBuf,
}

/// A network that is ready to compare images, f32. It is a yardstick: no gradients flow.
pub struct Lpips {
    network: Network,
    stages: Vec<Stage>,
    /// `[1, channel, 1, 1]` of every depth.
    heads: Vec<Tensor<4>>,
    device: Device,
}

impl Lpips {
    /// Images must have this many rows and columns at least: below, the networks' poolings leave nothing.
    pub const SMALLEST: usize = 32;

    /// Reads both files onto a device.
    ///
    /// # Errors
    /// A file that cannot be read, holds another network, or a number that is not finite: with the first tensor at fault.
    pub fn open(config: &LpipsConfig, device: &Device) -> Result<Self> {
        let network = config.network;
        let stages = backbone::stages(network, &WeightFile::open(&config.weights)?, device)?;
        let file = WeightFile::open(&config.heads)?;
        let heads = network
            .heads()
            .into_iter()
            .map(|(name, channels)| {
                let values = file.head(network, &name, channels)?;
                Ok(Tensor::from_data(TensorData::new(values, [1, channels, 1, 1]), device))
            })
            .collect::<Result<_>>()?;
        Ok(Self { network, stages, heads, device: device.clone() })
    }

    /// The backbone that it sees with.
    pub fn network(&self) -> Network {
        self.network
    }

    /// # Errors
    /// An image `[row, column]` that is too small for the networks.
    pub fn check_dims(dims: [usize; 2]) -> Result<()> {
        if dims.into_iter().all(|length| length >= Self::SMALLEST) {
            return Ok(());
        }
        let smallest = Self::SMALLEST;
        Err(Error::Usage {
            message: format!("LPIPS: maps of {} × {} cells, expected at least {smallest} × {smallest}", dims[0], dims[1]),
            hint: Some("leave LPIPS out for this radar".into()),
        })
    }

    /// Distance of two grey images `[row, column]` with values in 0 … 1; 0 for equal ones.
    ///
    /// # Panics
    /// When the pixels do not fill `dims`, or these are too small.
    pub fn distance(&self, a: &[f64], b: &[f64], dims: [usize; 2]) -> f64 {
        self.by_depth(a, b, dims).iter().sum()
    }

    /// What each depth contributes to [`Lpips::distance`], shallowest first.
    pub fn by_depth(&self, a: &[f64], b: &[f64], dims: [usize; 2]) -> Vec<f64> {
        let [rows, columns] = dims;
        assert!(a.len() == rows * columns && b.len() == a.len(), "lpips: {} and {} pixels for {dims:?}", a.len(), b.len());
        assert!(rows.min(columns) >= Self::SMALLEST, "lpips: images of {dims:?}");
        let images: Vec<f32> = [a, b].into_iter().flat_map(network_input).collect();
        let images = Tensor::from_data(TensorData::new(images, [2, 3, rows, columns]), &self.device);
        let features = backbone::features(&self.stages, images);
        features.into_iter().zip(&self.heads).map(|(features, head)| head_distance(features, head)).collect()
    }
}

/// Subtracted from, then divided by, the three channels of an image in −1 … 1 (ImageNet's statistics).
const SHIFT: [f64; 3] = [-0.030, -0.088, -0.188];
const SCALE: [f64; 3] = [0.458, 0.448, 0.450];

/// `[channel, row, column]`: a grey image as the networks were trained to see it.
fn network_input(image: &[f64]) -> impl Iterator<Item = f32> + '_ {
    let channels = SHIFT.into_iter().zip(SCALE);
    channels.flat_map(|(shift, scale)| image.iter().map(move |value| ((2.0 * value - 1.0 - shift) / scale) as f32))
}

/// Mean over pixels of the weighted squared difference between unit features.
///
/// `features`: `[2, channel, row, column]`, both images'.
fn head_distance(features: Tensor<4>, head: &Tensor<4>) -> f64 {
    // as in the original, small enough to leave any real feature alone
    let length = features.clone().square().sum_dim(1).sqrt() + 1e-10;
    let unit = features / length;
    let difference = (unit.clone().narrow(0, 0, 1) - unit.narrow(0, 1, 1)).square();
    let [_, _, rows, columns] = difference.dims();
    let per_pixel = (difference * head.clone()).sum_dim(1).into_data_as::<f32>().try_into_vec::<f32>().expect("f32");
    per_pixel.iter().map(|value| f64::from(*value)).sum::<f64>() / (rows * columns) as f64
}

#[cfg(test)]
pub(crate) mod tests;
