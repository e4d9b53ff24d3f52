//! Scores as text for people and as JSON for programs.

use std::{fmt::Write, path::PathBuf};

use clap::{Args, ValueEnum};
use serde_json::json;

use crate::{
    evaluation::{Evaluation, ScoreSummary, SequenceSummary, over_sequences},
    lpips::{LpipsConfig, Network},
};

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

/// One recording's scores.
pub(super) fn of_frames(found: &Evaluation) -> String {
    let Evaluation { frames, span_db, .. } = found;
    let title =
        format!("{frames} frames, decibels from {span_db:.0} dB below the strongest cell, mean ± standard deviation over frames");
    table(&title, [&found.global, &found.moving, &found.person], found.lpips)
}

/// The scores of several recordings.
pub(super) fn of_sequences(found: &SequenceSummary) -> String {
    let SequenceSummary { sequences, frames, .. } = found;
    let title = match sequences {
        1 => format!("1 sequence of {frames} frames: too few for an interval"),
        _ => format!("{sequences} sequences, {frames} frames, mean ± half of its 95 % interval over sequences (Student's t)"),
    };
    table(&title, [&found.global, &found.moving, &found.person], found.lpips)
}

fn table(title: &str, regions: [&Option<ScoreSummary>; 3], network: Option<Network>) -> String {
    let mut text = format!("  {title}\n");
    for (name, scores) in ["all cells", "static removed", "person's cells"].into_iter().zip(regions) {
        let line = match scores {
            Some(ScoreSummary { psnr_db, ssim, mean_absolute_error_db, lpips }) => {
                let lpips = lpips.map(|lpips| format!("   LPIPS {lpips:.3}")).unwrap_or_default();
                format!("PSNR {psnr_db:.2} dB   SSIM {ssim:.3}   mean error {mean_absolute_error_db:.2} dB{lpips}")
            }
            None => "not available".into(),
        };
        writeln!(text, "  {name:<15} {line}").expect("text grows");
    }
    match network {
        Some(network) => {
            writeln!(text, "  LPIPS           as seen by {}; the person's is of the box around the cells", network.name())
        }
        None => writeln!(text, "  LPIPS           not available: it needs a network's weights (--lpips)"),
    }
    .expect("text grows");
    text
}

/// All recordings by name, and the means over them.
pub(super) fn json(evaluations: &[(String, Evaluation)]) -> String {
    let recordings: serde_json::Map<String, serde_json::Value> = evaluations
        .iter()
        .map(|(name, evaluation)| (name.clone(), serde_json::to_value(evaluation).expect("plain data")))
        .collect();
    let together = summary(evaluations);
    let found = json!({ "recordings": recordings, "over_sequences": together });
    serde_json::to_string_pretty(&found).expect("plain data")
}

pub(super) fn summary(evaluations: &[(String, Evaluation)]) -> Option<SequenceSummary> {
    let evaluations: Vec<Evaluation> = evaluations.iter().map(|(_, evaluation)| evaluation.clone()).collect();
    over_sequences(&evaluations)
}
