//! Recordings made ready to train on: each with its scene.

use std::path::{Path, PathBuf};

use burn::tensor::{Device, Tensor, TensorData};

use super::checkpoint::Site;
use crate::{
    complex::Complex,
    data::{IfFrame, Recording},
    error::{Error, Result},
    features::Extent,
    person::{Person, Placement},
    radar::Radar,
    simulator::{Scene, SimulatorConfig},
};

/// A recording and the scene that it shows.
pub struct LoadedRecording {
    pub folder: PathBuf,
    pub recording: Recording,
    pub scene: Scene,
}

impl LoadedRecording {
    /// # Errors
    /// A recording that cannot be read or sampled; with `strict`, one whose room ends beyond the unambiguous range.
    pub fn open(folder: &Path, config: &SimulatorConfig, strict: bool) -> Result<Self> {
        let recording = Recording::open(folder)?;
        if strict {
            refuse_ambiguous_ranges(folder, &recording)?;
        }
        let scene = Scene::new(&recording.radar, recording.room.as_ref(), recording.person(), config)?;
        Ok(Self { folder: folder.into(), recording, scene })
    }

    /// Where the person's motion stands, if a motion is what moves the person.
    pub fn placement(&self) -> Option<Placement> {
        match self.recording.person() {
            Some(Person::Skinned { placement, .. }) => Some(placement.clone()),
            _ => None,
        }
    }

    /// What a simulator trained on this recording must remember of it.
    pub fn site(&self, config: &SimulatorConfig) -> Site {
        let canonical = self.scene.body.as_ref().map(|body| body.canonical_vertices()).unwrap_or_default();
        Site {
            radar: self.recording.radar.clone(),
            room: self.recording.room.clone(),
            placement: self.placement(),
            body_extent: Extent::around(canonical, config.triplane.margin),
        }
    }

    /// The measured samples of a frame, `[tx, rx, loop, sample]`.
    pub fn target(&self, frame: usize, device: &Device) -> Result<Complex<4>> {
        Ok(signal_tensor(&self.recording.frame(frame)?, device))
    }
}

/// IF samples as tensors, `[tx, rx, loop, sample]`; real samples have a zero imaginary part.
pub fn signal_tensor(frame: &IfFrame, device: &Device) -> Complex<4> {
    let tensor = |values: &[f32]| Tensor::<4>::from_data(TensorData::new(values.to_vec(), frame.dims), device);
    let re = tensor(&frame.re);
    let im = frame.im.as_deref().map_or_else(|| re.zeros_like(), tensor);
    Complex::new(re, im)
}

/// Opens all recordings of one site.
///
/// # Errors
/// As `LoadedRecording::open`; also recordings of different radars or rooms, or without anything to simulate.
pub fn load_recordings(folders: &[PathBuf], config: &SimulatorConfig) -> Result<Vec<LoadedRecording>> {
    let loaded = folders.iter().map(|folder| LoadedRecording::open(folder, config, true)).collect::<Result<Vec<_>>>()?;
    let Some(first) = loaded.first() else {
        return Err(Error::setting("data.recordings", "empty", "at least one recording folder"));
    };
    for other in &loaded {
        let file = other.folder.join("recording.toml");
        if other.recording.person().is_none() && other.recording.room.is_none() {
            return Err(Error::field(file, "room", "missing", "a room, or a body with its motion")
                .with_hint("without either there is nothing to simulate"));
        }
        let same_radar = Radar { frames: first.scene.radar.frames, ..other.scene.radar.clone() };
        if same_radar != first.scene.radar {
            return Err(Error::field(file, "radar", "another radar", format!("that of {}", first.folder.display()))
                .with_hint("one simulator learns one site: train other radars on their own"));
        }
        if other.recording.room != first.recording.room {
            return Err(Error::field(file, "room", "another room", format!("that of {}", first.folder.display()))
                .with_hint("one simulator learns one site: train other rooms on their own"));
        }
    }
    Ok(loaded)
}

/// A radar whose unambiguous range ends inside the room folds far echoes onto near ones: training would teach
/// the near surfaces to imitate them.
fn refuse_ambiguous_ranges(folder: &Path, recording: &Recording) -> Result<()> {
    let Some(farthest) = recording.room.as_ref().and_then(|room| room.farthest_wall_m()) else { return Ok(()) };
    let limit = recording.radar.max_range_m();
    if farthest > limit {
        return Err(Error::field(
            folder.join("recording.toml"),
            "room",
            format!("up to {farthest:.2} m away"),
            format!("within the radar's unambiguous range of {limit:.2} m"),
        )
        .with_hint("a higher sample rate or a lower slope reaches farther; `hybridsim check` shows the limits"));
    }
    Ok(())
}
