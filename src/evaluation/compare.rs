//! One recording folder against another.

use burn::tensor::Device;
use serde::{Deserialize, Serialize};

use super::{
    Evaluation,
    frames::{compare_with, measured_frame},
};
use crate::{
    data::{Recording, recording::SETTINGS_FILE},
    error::{Error, Result},
    heatmap::HeatmapConfig,
    lpips::{Lpips, LpipsConfig},
    metrics::MetricsConfig,
    radar::Radar,
};

/// How recordings are compared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ComparisonConfig {
    pub heatmap: HeatmapConfig,
    pub metrics: MetricsConfig,
    /// Absent: LPIPS is not available.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lpips: Option<LpipsConfig>,
}

impl ComparisonConfig {
    /// As [`MetricsConfig::check`].
    pub fn check(&self) -> Result<()> {
        self.metrics.check()
    }

    /// The network, if one is asked for.
    ///
    /// # Errors
    /// As [`Lpips::open`].
    pub fn open_lpips(&self, device: &Device) -> Result<Option<Lpips>> {
        self.lpips.as_ref().map(|config| Lpips::open(config, device)).transpose()
    }
}

/// Scores all frames of a simulated recording, or of one that was measured again, against the measured one.
///
/// # Errors
/// Recordings of different radars, frames or labels; measured samples without a signal, or that cannot be read; maps too small for `lpips`.
pub fn compare(
    measured: &Recording,
    simulated: &Recording,
    heatmap: &HeatmapConfig,
    metrics: &MetricsConfig,
    lpips: Option<&Lpips>,
) -> Result<Evaluation> {
    let frames: Vec<usize> = (0..measured.frames()).collect();
    compare_frames(measured, simulated, &frames, heatmap, metrics, lpips)
}

/// The same for some frames of both, such as those that training held out.
pub fn compare_frames(
    measured: &Recording,
    simulated: &Recording,
    frames: &[usize],
    heatmap: &HeatmapConfig,
    metrics: &MetricsConfig,
    lpips: Option<&Lpips>,
) -> Result<Evaluation> {
    refuse_different(measured, simulated)?;
    compare_with(measured, &|frame| measured_frame(simulated, frame), frames, heatmap, metrics, lpips, &mut |_, _, _| {})
}

/// Whether two recordings can show the same: the same radar and number of frames, and no label that contradicts. How the
/// samples are stored is free, and so is a label that only one of them has.
///
/// # Errors
/// The first setting that differs, in the simulated recording's file.
pub fn refuse_different(measured: &Recording, simulated: &Recording) -> Result<()> {
    let file = simulated.folder.join(SETTINGS_FILE);
    let expected = |value: &dyn std::fmt::Display| format!("{value} as in {}", measured.folder.display());
    if let Some((key, found, wanted)) = different_setting(&simulated.radar, &measured.radar) {
        let error = Error::field(file, format!("radar.{key}"), found.to_string(), expected(&wanted));
        return Err(error.with_hint(match key.as_str() {
            "frames" => "compare whole recordings: simulate all frames of the measured one",
            _ => "simulate the radar that measured",
        }));
    }
    for (key, wanted) in &measured.labels {
        if let Some(found) = simulated.labels.get(key).filter(|found| *found != wanted) {
            return Err(Error::field(file, format!("labels.{key}"), found, expected(wanted))
                .with_hint("the two folders show different recordings"));
        }
    }
    Ok(())
}

/// (key, found, wanted) of the first setting in which two radars differ. The rail is one of storing, not of measuring.
fn different_setting(found: &Radar, wanted: &Radar) -> Option<(String, serde_json::Value, serde_json::Value)> {
    let settings = |radar: &Radar| serde_json::to_value(Radar { full_scale_codes: None, ..radar.clone() }).expect("plain data");
    let (found, wanted) = (settings(found), settings(wanted));
    let mut keys = wanted.as_object().expect("a struct").iter();
    keys.find(|(key, value)| found[key.as_str()] != **value)
        .map(|(key, value)| (key.clone(), found[key.as_str()].clone(), value.clone()))
}
