//! A recording: a folder with the radar, its samples, and where it is known the room and the person.
//!
//! `truth.json`, which practice recordings carry, is written here when a recorder asks for it and never read.

mod altered;
mod dead;
mod placement;
mod samples;
mod settings;
mod valid;
mod write;

pub use placement::write_placement;
pub use samples::{IfFrame, IfLayout};
pub use settings::{FORMAT, Files, RecordingSettings};
pub use valid::Valid;
pub use write::{RecordingContents, StagedRecording, stage_recording, write_recording, write_recording_into};

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use samples::IfFile;

use crate::data::arrays::{Array, read_npy};
use crate::data::bodies::read_body;
pub use crate::data::entries::SETTINGS_FILE;
use crate::data::meshes::{read_triangles, read_vertices};
use crate::data::motions::read_motion;
use crate::error::{Error, Result};
use crate::person::{Person, Placement};
use crate::radar::Radar;
use crate::room::Room;

/// An open recording. Its samples stay on the disk until a frame is asked for.
#[derive(Debug)]
pub struct Recording {
    pub folder: PathBuf,
    pub radar: Radar,
    /// Absent: a room of unknown size.
    pub room: Option<Room>,
    pub labels: BTreeMap<String, String>,
    /// What had to be fitted or could not be used, for people to read.
    pub notes: Vec<String>,
    /// Which files hold what, relative to the folder.
    pub files: Files,
    person: Option<Person>,
    valid: Option<Valid>,
    samples: IfFile,
}

impl Recording {
    /// Reads everything but the samples, and checks the samples' header against the radar.
    pub fn open(folder: impl AsRef<Path>) -> Result<Self> {
        let folder = folder.as_ref();
        // The settings themselves are a good name for the folder, too; no other file of it is.
        let folder = if !folder.is_file() {
            folder
        } else if folder.file_name().is_some_and(|name| name == SETTINGS_FILE) {
            folder.parent().unwrap_or(Path::new(""))
        } else {
            let hint = "`hybridsim check FILE` says what a file is; `hybridsim import` makes recordings of raw captures";
            let expected = format!("a recording's folder, or its {SETTINGS_FILE}");
            return Err(Error::field(folder, "type", "a file", expected).with_hint(hint));
        };
        let path = folder.join(SETTINGS_FILE);
        let settings = RecordingSettings::read(&path)?;
        let samples = IfFile::open(folder.join(&settings.files.samples), &settings.radar)?;
        let mut notes = vec![];
        let person = read_person(folder, &path, &settings, &mut notes)?;
        notes.extend(person.as_ref().and_then(|person| frames_outside(&settings.radar, person)));
        let valid = settings.files.valid.as_ref().map(|file| Valid::read(&folder.join(file), &settings.radar)).transpose()?;
        notes.extend(valid.iter().zip(&settings.files.valid).filter_map(|(valid, file)| valid.note(file)));
        Ok(Self {
            folder: folder.into(),
            radar: settings.radar,
            room: settings.room,
            labels: settings.labels,
            notes,
            files: settings.files,
            person,
            valid,
            samples,
        })
    }

    /// The person, where the recording knows one.
    pub fn person(&self) -> Option<&Person> {
        self.person.as_ref()
    }

    /// How the samples are stored.
    pub fn layout(&self) -> IfLayout {
        self.samples.layout()
    }

    /// NumPy's name of the stored numbers, such as `int16`.
    pub fn number_type(&self) -> String {
        self.samples.number_type()
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.radar.frames
    }

    /// Reads the samples of one frame; memory is needed for that one only. Panics beyond the last frame.
    pub fn frame(&self, index: usize) -> Result<IfFrame> {
        self.samples.frame(index)
    }
}

fn read_person(folder: &Path, path: &Path, settings: &RecordingSettings, notes: &mut Vec<String>) -> Result<Option<Person>> {
    let files = &settings.files;
    let meshes = [("vertices", &files.vertices), ("faces", &files.faces), ("pose_times", &files.pose_times)];
    if meshes.iter().any(|(_, file)| file.is_some()) {
        if files.body.is_some() || files.motion.is_some() {
            return Err(Error::field(
                path,
                "files",
                "both a body and meshes",
                "body and motion, or vertices, faces and pose_times",
            ));
        }
        if let Some((key, _)) = meshes.iter().find(|(_, file)| file.is_none()) {
            return Err(Error::field(path, format!("files.{key}"), "missing", "vertices, faces and pose_times together"));
        }
    }
    if let (Some(vertices), Some(faces), Some(times)) = (&files.vertices, &files.faces, &files.pose_times) {
        return read_meshes(&folder.join(vertices), &folder.join(faces), &folder.join(times)).map(Some);
    }
    match (&files.body, &files.motion) {
        (Some(body), Some(motion)) => {
            let model = read_body(folder.join(body))?;
            let (motion, fitted) = read_motion(folder.join(motion), model.parents.len(), model.shape_directions.len())?;
            notes.extend(fitted);
            let placement = settings.motion.clone().unwrap_or_default();
            Ok(Some(Person::Skinned { model, motion, placement }))
        }
        (Some(_), None) => {
            notes.push("a body without a motion: nobody is placed".into());
            Ok(None)
        }
        (None, Some(_)) => {
            notes.push("a motion without a body: nobody is placed".into());
            Ok(None)
        }
        (None, None) => Ok(None),
    }
}

fn read_meshes(vertices: &Path, faces: &Path, times: &Path) -> Result<Person> {
    let positions = read_vertices(vertices)?;
    let (poses, faces) = (positions.len(), read_triangles(faces, positions[0].len())?);
    let pose_times: Array<f64> = read_npy(times, &[("pose", Some(poses))])?;
    if let Some(pose) = (1..poses).find(|&pose| pose_times.values[pose] <= pose_times.values[pose - 1]) {
        let found = format!("{} s at pose {pose} after {} s", pose_times.values[pose], pose_times.values[pose - 1]);
        return Err(Error::field(times, "pose_times", found, "times that ascend"));
    }
    Ok(Person::Meshes { vertices: positions, faces, pose_times_s: pose_times.values })
}

/// A note for frames that no pose covers: using them will be an error.
fn frames_outside(radar: &Radar, person: &Person) -> Option<String> {
    let times = person.pose_times_s();
    let (first, last) = (*times.first()?, *times.last()?);
    let outside: Vec<usize> = (0..radar.frames)
        .filter(|&frame| {
            let start = frame as f64 * radar.frame_period_s;
            start < first - 1e-9 || start + radar.frame_duration_s() > last + 1e-9
        })
        .collect();
    let (low, high) = (outside.first()?, outside.last()?);
    let span = format!("the motion, which lasts from {first:.3} s to {last:.3} s");
    Some(match outside.len() {
        1 => format!("frame {low} lies outside {span}"),
        count => format!("{count} frames of {low} to {high} lie outside {span}"),
    })
}

/// Refuses a placement that is no rigid motion; `path` is the file that holds it.
pub fn check_placement(path: &Path, placement: &Placement) -> Result<()> {
    let rows = placement.radar_from_motion;
    let all = rows.as_flattened().iter().chain(&placement.origin_m).chain([&placement.start_s]);
    if all.into_iter().any(|value| !value.is_finite()) {
        return Err(Error::field(path, "motion", "not finite", "finite numbers"));
    }
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let orthonormal = (0..3).all(|i| (0..3).all(|j| (dot(rows[i], rows[j]) - f64::from(u8::from(i == j))).abs() < 1e-3));
    let [[a, b, c], [d, e, f], [g, h, i]] = rows;
    let determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
    if orthonormal && determinant > 0.0 {
        return Ok(());
    }
    let found = if orthonormal { "a mirror image".to_string() } else { format!("{rows:?}") };
    Err(Error::field(path, "motion.radar_from_motion", found, "a rotation")
        .with_hint("its rows are the radar's x, y and z axes in the motion's frame: unit vectors, right-handed"))
}

#[cfg(test)]
mod samples_tests;
#[cfg(test)]
mod tests;
