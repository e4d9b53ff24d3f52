//! The paper's figures of range-Doppler maps: which maps stand side by side.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::simulator::Part;

/// One picture: a row for each recording, a column for each way to get it.
#[derive(Clone, Debug, Serialize)]
pub struct FigureTask {
    /// The picture's file name, without its ending.
    pub figure: String,
    pub title: String,
    /// Show what moves alone.
    pub static_removed: bool,
    pub columns: Vec<FigureColumn>,
    /// Measured recordings, one for each row.
    #[serde(skip)]
    pub measured: Vec<PathBuf>,
    pub names: Vec<String>,
    /// The rows' titles.
    pub actions: Vec<String>,
    /// For what a column simulates anew.
    #[serde(skip)]
    pub checkpoint: PathBuf,
    pub seed: u64,
}

/// A column of a picture.
#[derive(Clone, Debug, Serialize)]
pub struct FigureColumn {
    pub title: String,
    pub panel: Panel,
}

/// Where a column's maps come from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Panel {
    Measured,
    /// Measured, in amplitudes of the strongest cell in place of decibels.
    MeasuredLinear,
    /// A part of what the checkpoint simulates.
    Part(Part),
    /// All of it.
    Whole,
    /// Recordings that were simulated before, one for each row.
    Simulated(#[serde(skip)] Vec<PathBuf>),
}

/// `figure.json`: how strong the maps are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Levels {
    pub columns: Vec<String>,
    pub rows: Vec<String>,
    /// `[row][column]`: mean power of a frame over that of the measured one, dB; none where there is none.
    pub all_db: Vec<Vec<Option<f64>>>,
    /// The same with the static part removed, over the measured one with the static part removed.
    pub moving_db: Vec<Vec<Option<f64>>>,
}
