//! Which scores are asked for.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

pub(super) use crate::verbs::scores::{json, of_frames, of_sequences, summary};

use crate::lpips::{LpipsConfig, Network};

/// Where LPIPS has its network from.
#[derive(Args)]
pub(super) struct LpipsArguments {
    /// Report LPIPS too, as seen by this network; you must have its two files
    #[arg(long, value_enum, value_name = "NETWORK", requires_all = ["lpips_weights", "lpips_heads"])]
    lpips: Option<NetworkName>,
    /// The network's backbone: torchvision's weights, as torch (.pth) or safetensors
    #[arg(long, value_name = "FILE", requires = "lpips")]
    lpips_weights: Option<PathBuf>,
    /// LPIPS' linear heads for this network: npz, torch or safetensors
    #[arg(long, value_name = "FILE", requires = "lpips")]
    lpips_heads: Option<PathBuf>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum NetworkName {
    Alex,
    Squeeze,
    Vgg,
}

impl LpipsArguments {
    /// As it was typed, with a space before it; empty without.
    pub fn typed(&self) -> String {
        let (Some(network), Some(weights), Some(heads)) = (self.lpips, &self.lpips_weights, &self.lpips_heads) else {
            return String::new();
        };
        let network = network.to_possible_value().expect("none is hidden");
        format!(" --lpips {} --lpips-weights {} --lpips-heads {}", network.get_name(), weights.display(), heads.display())
    }

    pub fn config(&self) -> Option<LpipsConfig> {
        let network = match self.lpips? {
            NetworkName::Alex => Network::Alex,
            NetworkName::Squeeze => Network::Squeeze,
            NetworkName::Vgg => Network::Vgg,
        };
        Some(LpipsConfig { network, weights: self.lpips_weights.clone()?, heads: self.lpips_heads.clone()? })
    }
}
