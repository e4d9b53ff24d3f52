//! Recordings in the layouts of others, so that what was simulated runs through their pipelines.
//!
//! A target is one file here and one line of [`TARGETS`]. Every target reads a recording frame by frame and holds no more
//! than a frame of it, and says in notes what its layout has no place for. Several recordings are a data set: each is a
//! shard, beside a table of labels and a card.

mod beams;
mod body;
pub mod capture_files;
mod card;
mod codes;
pub mod config;
mod contents;
mod dataset;
mod dca1000;
mod hdf5;
pub mod maps;
mod mmwave_json;
mod npz;
pub mod points;
mod rover;
mod shards;
mod sink;
pub mod split;
mod wiring;

pub use config::ExportConfig;
pub use dataset::Dataset;
pub use shards::write_dataset;

use std::path::Path;
use std::str::FromStr;

use crate::data::Recording;
use crate::error::{Error, Result};
use crate::import::capture::boards::Board;

/// A recording on its way out.
pub struct Source<'a> {
    pub recording: &'a Recording,
    /// What the files are named after.
    pub name: String,
    /// The board that is imitated, where one was named.
    pub board: Option<&'static Board>,
    pub config: &'a ExportConfig,
    /// Receives how many frames are done.
    pub progress: &'a mut dyn FnMut(usize),
}

impl Source<'_> {
    fn done(&mut self, frames: usize) {
        (self.progress)(frames);
    }
}

/// A layout of others.
#[derive(Clone, Copy)]
pub struct Target {
    pub name: &'static str,
    /// What it writes, for people.
    pub writes: &'static str,
    write: fn(&mut Source, &Path) -> Result<Vec<String>>,
}

/// All of them.
pub const TARGETS: [Target; 7] = [
    Target { name: "npz", writes: "IF samples with their axes, radar and body (NumPy)", write: npz::write },
    Target { name: "hdf5", writes: "the same (HDF5)", write: hdf5::write },
    Target { name: "dca1000", writes: "_Raw_0.bin with .mmwave.json (TI mmWave Studio)", write: dca1000::write },
    Target { name: "rover", writes: "a trace with the sensor radar (roverd, xwr)", write: rover::write },
    Target { name: "maps", writes: "range-Doppler-angle power with its axes (NumPy)", write: maps::write },
    Target { name: "points", writes: "a CFAR point cloud (NumPy, and PLY for each frame)", write: points::write },
    Target { name: "body", writes: "the body at every frame, and the room (NumPy)", write: body::write },
];

impl Target {
    /// Writes the files of a recording into a folder that is there. The notes say, a line each, what was assumed and what
    /// the layout has no place for.
    ///
    /// # Errors
    /// Samples that cannot be read, files that cannot be written, a radar that the layout cannot hold.
    pub fn write(&self, source: &mut Source, folder: &Path) -> Result<Vec<String>> {
        (self.write)(source, folder)
    }
}

impl std::fmt::Debug for Target {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        formatter.write_str(self.name)
    }
}

impl FromStr for Target {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        TARGETS.into_iter().find(|target| target.name == name).ok_or_else(|| match name {
            // Its crate brings two hundred others.
            "rerun" => Error::Usage {
                message: "the target `rerun` is written from Python alone".into(),
                hint: Some("pip install \"./python[rerun]\"; hybridsim.export(RECORDING, \"rerun\", OUT) in Python".into()),
            },
            _ => Error::Usage {
                message: format!("no target `{name}`, known are {}", TARGETS.map(|target| target.name).join(", ")),
                hint: Some("`rerun` is written from Python".into()),
            },
        })
    }
}

/// A note of what a layout leaves behind, of the parts that the recording has.
fn not_carried(recording: &Recording, parts: &[&str]) -> Option<String> {
    let has = |part: &str| match part {
        "room" => recording.room.is_some(),
        "body and motion" => recording.person().is_some(),
        "labels" => !recording.labels.is_empty(),
        "which chirps were lost" => recording.valid().is_some(),
        _ => true,
    };
    let left: Vec<&str> = parts.iter().copied().filter(|part| has(part)).collect();
    (!left.is_empty()).then(|| format!("not carried: {}", left.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_is_found_by_its_name_and_rerun_says_where_it_is() {
        assert!(TARGETS.iter().all(|target| target.name.parse::<Target>().unwrap().writes == target.writes));
        let error = "rerun".parse::<Target>().unwrap_err();
        assert!(error.to_string().contains("from Python") && error.hint().unwrap().contains("hybridsim.export("), "{error}");
        assert!("mat".parse::<Target>().unwrap_err().to_string().starts_with("no target `mat`, known are npz, "));
    }
}
