//! Recordings made ready to train on: each with its scene.

use std::path::{Path, PathBuf};

use burn::tensor::{Device, Tensor, TensorData};

use super::checkpoint::{Site, read_state};
use crate::{
    complex::Complex,
    data::{IfFrame, Recording},
    error::{Error, Result},
    features::Extent,
    person::{Person, Placement},
    radar::Radar,
    room::Room,
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
            let refusal = |found, expected| Error::field(folder.join("recording.toml"), "room", found, expected);
            refuse_ambiguous_ranges(&recording.radar, recording.room.as_ref(), refusal)?;
        }
        let scene = Scene::new(&recording.radar, recording.room.as_ref(), recording.person(), config)?;
        let loaded = Self { folder: folder.into(), recording, scene };
        loaded.refuse_frames_outside_the_motion()?;
        Ok(loaded)
    }

    /// The same recording read again, with a scene of its own.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn again(&self, config: &SimulatorConfig) -> Result<Self> {
        Self::open(&self.folder, config, false)
    }

    /// Where the person's motion stands, if a motion is what moves the person.
    pub fn placement(&self) -> Option<Placement> {
        match self.recording.person() {
            Some(Person::Skinned { placement, .. }) => Some(placement.clone()),
            _ => None,
        }
    }

    /// Before hours are spent: every frame must lie within the motion.
    fn refuse_frames_outside_the_motion(&self) -> Result<()> {
        let Some(body) = &self.scene.body else { return Ok(()) };
        let (start, end) = body.span_s();
        let last = self.scene.radar.frames - 1;
        let times = [self.scene.chirp_times_s(0), self.scene.chirp_times_s(last)].concat();
        let first_s = times.iter().copied().fold(f64::INFINITY, f64::min);
        let last_s = times.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if first_s >= start - 1e-9 && last_s <= end + 1e-9 {
            return Ok(());
        }
        Err(Error::field(
            self.folder.join("recording.toml"),
            "motion",
            format!("from {start:.3} s to {end:.3} s"),
            format!("a motion over all frames, from {first_s:.3} s to {last_s:.3} s"),
        )
        .with_hint("give a longer motion, or shift it with motion.start_s (no sequence of meshes has one), which `hybridsim align` finds"))
    }

    /// The measured samples of a frame, `[tx, rx, loop, sample]`.
    pub fn target(&self, frame: usize, device: &Device) -> Result<Complex<4>> {
        Ok(signal_tensor(&self.recording.frame(frame)?, device))
    }
}

/// What a simulator trained on these recordings must remember of them: the first radar, room and placement, and the
/// box around all of their bodies; or the box of the checkpoint that training starts from, whose planes fill it.
///
/// # Errors
/// A checkpoint that cannot be read.
pub fn site_from(recordings: &[LoadedRecording], config: &SimulatorConfig, start_from: Option<&Path>) -> Result<Site> {
    let found = site(recordings, config);
    Ok(match start_from {
        Some(checkpoint) => Site { body_extent: read_state(checkpoint)?.site.body_extent, ..found },
        None => found,
    })
}

/// What a simulator trained from the beginning on these recordings must remember of them, as [`site_from`] has it.
pub fn site(recordings: &[LoadedRecording], config: &SimulatorConfig) -> Site {
    let first = &recordings[0];
    let bodies = recordings.iter().filter_map(|recording| recording.scene.body.as_ref());
    let canonical: Vec<[f64; 3]> = bodies.flat_map(|body| body.canonical_vertices().iter().copied()).collect();
    Site {
        radar: first.recording.radar.clone(),
        room: first.recording.room.clone(),
        placement: recordings.iter().find_map(LoadedRecording::placement),
        body_extent: Extent::around(&canonical, config.triplane.margin),
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
/// As `LoadedRecording::open`; also recordings without a signal, of different radars or rooms, or without anything to simulate.
pub fn load_recordings(folders: &[PathBuf], config: &SimulatorConfig) -> Result<Vec<LoadedRecording>> {
    of_one_site(folders, config, true)
}

/// The same, with rooms as they are stated: one may end beyond the unambiguous range, whose far echoes are then learned as near ones.
///
/// # Errors
/// As [`load_recordings`], but for that.
pub fn load_recordings_as_stated(folders: &[PathBuf], config: &SimulatorConfig) -> Result<Vec<LoadedRecording>> {
    of_one_site(folders, config, false)
}

fn of_one_site(folders: &[PathBuf], config: &SimulatorConfig, strict: bool) -> Result<Vec<LoadedRecording>> {
    let loaded = folders.iter().map(|folder| LoadedRecording::open(folder, config, strict)).collect::<Result<Vec<_>>>()?;
    let Some(first) = loaded.first() else {
        return Err(Error::setting("data.recordings", "empty", "at least one recording folder"));
    };
    for other in &loaded {
        other.recording.whole_stretch()?;
        other.recording.refuse_dead(other.recording.whole_frames())?;
        let file = other.folder.join("recording.toml");
        if other.recording.person().is_none() && other.recording.room.is_none() {
            return Err(Error::field(file, "room", "missing", "a room, or a body with its motion")
                .with_hint("without either there is nothing to simulate"));
        }
        let first_radar = &first.scene.radar;
        let same_radar =
            Radar { frames: first_radar.frames, full_scale_codes: first_radar.full_scale_codes, ..other.scene.radar.clone() };
        if same_radar != first.scene.radar {
            return Err(Error::field(file, "radar", "another radar", format!("that of {}", first.folder.display()))
                .with_hint("one simulator learns one site: train other radars on their own"));
        }
        let is_mesh = |loaded: &LoadedRecording| matches!(loaded.recording.person(), Some(Person::Meshes { .. }));
        if is_mesh(other) && loaded.len() > 1 {
            return Err(Error::field(file, "files.vertices", "a sequence of meshes", "a skinned body")
                .with_hint("meshes have no common rest pose: a simulator can learn one such recording only"));
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
///
/// # Errors
/// Such a radar: `refusal` gets what was found and what was expected.
pub fn refuse_ambiguous_ranges(radar: &Radar, room: Option<&Room>, refusal: impl Fn(String, String) -> Error) -> Result<()> {
    let Some(farthest) = room.and_then(Room::farthest_wall_m) else { return Ok(()) };
    let limit = radar.max_range_m();
    if farthest > limit {
        let expected = format!("within the radar's unambiguous range of {limit:.2} m");
        return Err(refusal(format!("up to {farthest:.2} m away"), expected)
            .with_hint("a higher sample rate or a lower slope reaches farther; `hybridsim check` shows the limits; --as-stated takes it as it is"));
    }
    Ok(())
}
