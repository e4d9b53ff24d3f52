//! Writing a recording, frame by frame, whole or not at all.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::samples::{IfFrame, IfLayout, not_finite};
use super::settings::{FORMAT, Files, RecordingSettings};
use super::{Recording, SETTINGS_FILE, Valid};
use crate::data::arrays::{Values, header_bytes, write_npy};
use crate::data::atomic::{AtomicFile, AtomicFolder, write_text};
use crate::data::{files, write_body, write_motion};
use crate::error::{Error, Result};
use crate::person::Person;
use crate::radar::Radar;
use crate::room::Room;

/// What goes into a recording besides its samples.
#[derive(Clone, Debug)]
pub struct RecordingContents<'a> {
    pub radar: &'a Radar,
    pub room: Option<&'a Room>,
    pub person: Option<&'a Person>,
    /// Where the person's body lies already, relative to the recording's folder; absent: it is written into it.
    pub body_file: Option<&'a Path>,
    pub labels: BTreeMap<String, String>,
    pub layout: IfLayout,
    /// What was planted, for scoring.
    pub truth: Option<&'a serde_json::Value>,
}

/// Writes a recording folder, asking `frame` for the samples of one frame after the other, and opens it.
///
/// The folder appears when it is complete; an error, a full disk or a killed process leaves none. It must not exist
/// before, or be empty. Codes are rounded; those that an int16 cannot hold are brought to its limits and counted in
/// the recording's notes.
pub fn write_recording(
    folder: impl AsRef<Path>,
    contents: &RecordingContents,
    frame: &mut dyn FnMut(usize) -> Result<IfFrame>,
) -> Result<Recording> {
    write_recording_into(AtomicFolder::create(folder)?, contents, frame)
}

/// The same into a folder that was begun before.
pub fn write_recording_into(
    target: AtomicFolder,
    contents: &RecordingContents,
    frame: &mut dyn FnMut(usize) -> Result<IfFrame>,
) -> Result<Recording> {
    stage_recording(target, contents, frame)?.publish()
}

/// A recording that is written and can be read, but has not appeared yet: dropped, it leaves nothing.
pub struct StagedRecording {
    target: AtomicFolder,
    /// Read from where it lies for now; its folder is the one that it will have.
    pub recording: Recording,
    clipped: Option<String>,
}

impl StagedRecording {
    /// States which chirps were recorded.
    pub fn set_valid(&mut self, valid: &Valid) -> Result<()> {
        let file = PathBuf::from("valid.npy");
        valid.write(&self.target.path().join(&file))?;
        let path = self.target.path().join(SETTINGS_FILE);
        let mut settings = RecordingSettings::read(&path)?;
        settings.files.valid = Some(file);
        write_settings(&path, &settings)?;
        self.recording = reopened(&self.target)?;
        Ok(())
    }

    /// Gives the folder its name.
    pub fn publish(self) -> Result<Recording> {
        let folder = self.target.target().to_path_buf();
        self.target.finish()?;
        let mut recording = Recording::open(&folder)?;
        recording.notes.extend(self.clipped);
        Ok(recording)
    }
}

/// Reads what is staged, under the name that it will have.
fn reopened(target: &AtomicFolder) -> Result<Recording> {
    Ok(Recording { folder: target.target().to_path_buf(), ..Recording::open(target.path())? })
}

pub(super) fn write_settings(path: &Path, settings: &RecordingSettings) -> Result<()> {
    write_text(path, &toml::to_string(settings).expect("settings of plain numbers and texts are TOML"))
}

/// Writes a recording that somebody looks at before it appears.
///
/// # Errors
/// As [`write_recording`].
pub fn stage_recording(
    target: AtomicFolder,
    contents: &RecordingContents,
    frame: &mut dyn FnMut(usize) -> Result<IfFrame>,
) -> Result<StagedRecording> {
    let (radar, layout) = (contents.radar, contents.layout);
    radar.check("radar")?;
    if layout.sampling() != radar.sampling {
        let expected = format!("{:?} for samples stored as {layout:?}", layout.sampling()).to_lowercase();
        return Err(Error::setting("radar.sampling", format!("{:?}", radar.sampling).to_lowercase(), expected));
    }
    let files = write_person(&target, contents)?;
    let settings = RecordingSettings {
        format: FORMAT,
        radar: radar.clone(),
        room: contents.room.cloned(),
        motion: match contents.person {
            Some(Person::Skinned { placement, .. }) => Some(placement.clone()),
            _ => None,
        },
        files,
        labels: contents.labels.clone(),
    };
    write_settings(&target.path().join(SETTINGS_FILE), &settings)?;
    if let Some(truth) = contents.truth {
        write_text(target.path().join("truth.json"), &format!("{truth:#}\n"))?;
    }
    let clipped = write_samples(&target.path().join(&settings.files.samples), radar, layout, frame)?;
    let clipped = (clipped > 0).then(|| format!("{clipped} samples were beyond int16 and brought to its limits"));
    let recording = reopened(&target)?;
    Ok(StagedRecording { target, recording, clipped })
}

/// Writes the person's files and says how they are called.
fn write_person(target: &AtomicFolder, contents: &RecordingContents) -> Result<Files> {
    let folder = target.path();
    let mut files =
        Files { samples: "if.npy".into(), valid: None, body: None, motion: None, vertices: None, faces: None, pose_times: None };
    match contents.person {
        None => {}
        Some(Person::Skinned { model, motion, .. }) => {
            let body = contents.body_file.map_or_else(|| PathBuf::from("body.npz"), Path::to_path_buf);
            match contents.body_file {
                Some(body) => {
                    files::regular(target.seen_from().join(body)).map(drop).map_err(|source| Error::read(body, source))?
                }
                None => write_body(folder.join(&body), model)?,
            }
            write_motion(folder.join("motion.npz"), motion)?;
            files.body = Some(body);
            files.motion = Some("motion.npz".into());
        }
        Some(Person::Meshes { vertices, faces, pose_times_s }) => {
            let count = vertices.first().map_or(0, Vec::len);
            let positions: Vec<f32> = vertices.iter().flatten().flatten().map(|&coordinate| coordinate as f32).collect();
            let corners: Vec<i32> = faces.iter().flatten().map(|&corner| corner as i32).collect();
            write_npy(folder.join("vertices.npy"), &[vertices.len(), count, 3], Values::F32(&positions))?;
            write_npy(folder.join("faces.npy"), &[faces.len(), 3], Values::I32(&corners))?;
            write_npy(folder.join("pose_times.npy"), &[pose_times_s.len()], Values::F64(pose_times_s))?;
            files.vertices = Some("vertices.npy".into());
            files.faces = Some("faces.npy".into());
            files.pose_times = Some("pose_times.npy".into());
        }
    }
    Ok(files)
}

/// Streams the samples and counts those that were clipped.
pub(super) fn write_samples(
    path: &Path,
    radar: &Radar,
    layout: IfLayout,
    frame: &mut dyn FnMut(usize) -> Result<IfFrame>,
) -> Result<usize> {
    let write_error = |source| Error::write(path, source);
    let [frames, tx, rx, loops, samples] = radar.dims();
    let mut file = AtomicFile::create(path)?;
    file.write_all(&header_bytes(layout.descr(), &layout.shape(radar))).map_err(write_error)?;
    let mut clipped = 0;
    for index in 0..frames {
        let frame = frame(index)?;
        assert_eq!(frame.dims, [tx, rx, loops, samples], "[tx, rx, loop, sample] of frame {index} against the radar's");
        if let Some(place) = frame.first_non_finite() {
            return Err(not_finite(path, index, &place));
        }
        let values = interleaved(&frame, layout);
        if matches!(layout, IfLayout::Codes | IfLayout::RealCodes) {
            clipped += values.iter().filter(|value| i16::try_from(value.round() as i32).is_err()).count();
            // The cast saturates.
            let codes: Vec<i16> = values.iter().map(|value| value.round() as i16).collect();
            Values::I16(&codes).write_to(&mut file).map_err(write_error)?;
        } else {
            Values::F32(&values).write_to(&mut file).map_err(write_error)?;
        }
    }
    file.finish()?;
    Ok(clipped)
}

/// The numbers of a frame in the order of the file.
fn interleaved(frame: &IfFrame, layout: IfLayout) -> Vec<f32> {
    assert_eq!(frame.im.is_some(), layout.sampling() == crate::radar::Sampling::Complex, "a quadrature part for {layout:?}");
    match &frame.im {
        Some(im) => frame.re.iter().zip(im).flat_map(|(&re, &im)| [re, im]).collect(),
        None => frame.re.clone(),
    }
}
