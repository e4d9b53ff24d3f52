//! The three backbones as lists of layers, as torchvision numbers them.

use serde::{Deserialize, Serialize};

/// Which trained network looks at the images.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Network {
    /// AlexNet.
    Alex,
    /// SqueezeNet 1.1, the smallest.
    Squeeze,
    /// VGG-16.
    Vgg,
}

/// One step of a backbone. Convolutions are square, and followed by a ReLU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Layer {
    Convolution {
        index: usize,
        input: usize,
        output: usize,
        kernel: usize,
        stride: usize,
        padding: usize,
    },
    /// SqueezeNet's fire module: 1 × 1 to `squeeze` channels, then 1 × 1 and 3 × 3 to `expand` channels each, side by side.
    Fire {
        index: usize,
        input: usize,
        squeeze: usize,
        expand: usize,
    },
    /// Stride 2; `ceil`: a last window that is cut off counts too.
    MaxPool {
        kernel: usize,
        ceil: bool,
    },
    /// The features at this depth are compared.
    Tap {
        channels: usize,
    },
}

use Layer::{Convolution, Fire, MaxPool, Tap};

impl Network {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Alex, Self::Squeeze, Self::Vgg];

    /// The word of settings and reports, such as `alex`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Alex => "alex",
            Self::Squeeze => "squeeze",
            Self::Vgg => "vgg",
        }
    }

    pub(super) fn layers(self) -> Vec<Layer> {
        match self {
            Self::Alex => alex(),
            Self::Squeeze => squeeze(),
            Self::Vgg => vgg(),
        }
    }

    /// Name in torchvision's state dict, and shape, of every tensor of the backbone.
    pub(super) fn tensors(self) -> Vec<(String, Vec<usize>)> {
        let convolution = |name: String, output: usize, input: usize, kernel: usize| {
            [(format!("{name}.weight"), vec![output, input, kernel, kernel]), (format!("{name}.bias"), vec![output])]
        };
        let of_layer = |layer: Layer| match layer {
            Convolution { index, input, output, kernel, .. } => {
                convolution(format!("features.{index}"), output, input, kernel).to_vec()
            }
            Fire { index, input, squeeze, expand } => [
                convolution(format!("features.{index}.squeeze"), squeeze, input, 1),
                convolution(format!("features.{index}.expand1x1"), expand, squeeze, 1),
                convolution(format!("features.{index}.expand3x3"), expand, squeeze, 3),
            ]
            .concat(),
            MaxPool { .. } | Tap { .. } => Vec::new(),
        };
        self.layers().into_iter().flat_map(of_layer).collect()
    }

    /// Name and channels of every head.
    pub(super) fn heads(self) -> Vec<(String, usize)> {
        let taps = self.layers().into_iter().filter_map(|layer| match layer {
            Tap { channels } => Some(channels),
            _ => None,
        });
        taps.enumerate().map(|(depth, channels)| (format!("lin{depth}"), channels)).collect()
    }
}

fn alex() -> Vec<Layer> {
    let pool = MaxPool { kernel: 3, ceil: false };
    let convolution = |index, input, output, kernel| {
        [Convolution { index, input, output, kernel, stride: 1, padding: kernel / 2 }, Tap { channels: output }]
    };
    let mut layers =
        vec![Convolution { index: 0, input: 3, output: 64, kernel: 11, stride: 4, padding: 2 }, Tap { channels: 64 }, pool];
    layers.extend(convolution(3, 64, 192, 5));
    layers.push(pool);
    layers.extend(convolution(6, 192, 384, 3));
    layers.extend(convolution(8, 384, 256, 3));
    layers.extend(convolution(10, 256, 256, 3));
    layers
}

fn squeeze() -> Vec<Layer> {
    let pool = MaxPool { kernel: 3, ceil: true };
    let fire = |index, input, squeeze| Fire { index, input, squeeze, expand: 4 * squeeze };
    vec![
        Convolution { index: 0, input: 3, output: 64, kernel: 3, stride: 2, padding: 0 },
        Tap { channels: 64 },
        pool,
        fire(3, 64, 16),
        fire(4, 128, 16),
        Tap { channels: 128 },
        pool,
        fire(6, 128, 32),
        fire(7, 256, 32),
        Tap { channels: 256 },
        pool,
        fire(9, 256, 48),
        Tap { channels: 384 },
        fire(10, 384, 48),
        Tap { channels: 384 },
        fire(11, 384, 64),
        Tap { channels: 512 },
        fire(12, 512, 64),
        Tap { channels: 512 },
    ]
}

fn vgg() -> Vec<Layer> {
    let mut layers = Vec::new();
    let (mut index, mut input) = (0, 3);
    for (block, (output, count)) in [(64, 2), (128, 2), (256, 3), (512, 3), (512, 3)].into_iter().enumerate() {
        if block > 0 {
            layers.push(MaxPool { kernel: 2, ceil: false });
            index += 1;
        }
        for _ in 0..count {
            layers.push(Convolution { index, input, output, kernel: 3, stride: 1, padding: 1 });
            input = output;
            // its ReLU has a number of its own
            index += 2;
        }
        layers.push(Tap { channels: output });
    }
    layers
}
