//! A recording once more, with other samples and everything else as it is.

use std::fs;
use std::path::{Path, PathBuf};

use super::samples::{IfFrame, IfLayout};
use super::settings::RecordingSettings;
use super::write::{write_samples, write_settings};
use super::{Recording, SETTINGS_FILE};
use crate::data::atomic::AtomicFolder;
use crate::data::files;
use crate::error::{Error, Result};

impl Recording {
    /// Whether all samples are whole numbers that an ADC could have sent.
    pub fn holds_codes(&self) -> bool {
        matches!(self.layout(), IfLayout::Codes | IfLayout::RealCodes)
    }

    /// Writes some of its frames, changed, into a folder of their own: room, body and motion go along byte for byte, a `truth.json` does
    /// not. `frame` gives the samples of a frame of this recording. `layout`: how they are stored.
    ///
    /// The folder appears when it is complete. It must not exist before, or be empty.
    ///
    /// # Errors
    /// Files that cannot be read or written, and samples that are not finite.
    pub fn write_altered(
        &self,
        folder: &Path,
        frames: &[usize],
        layout: IfLayout,
        frame: &mut dyn FnMut(usize) -> Result<IfFrame>,
    ) -> Result<()> {
        let target = AtomicFolder::create(folder)?;
        let mut settings = RecordingSettings::read(&self.folder.join(SETTINGS_FILE))?;
        let kept = &mut settings.files;
        for (name, file) in [
            ("body", &mut kept.body),
            ("motion", &mut kept.motion),
            ("vertices", &mut kept.vertices),
            ("faces", &mut kept.faces),
            ("pose_times", &mut kept.pose_times),
        ] {
            let Some(file) = file else { continue };
            let (source, own) = (self.folder.join(&*file), named(name, file));
            let (mut opened, _) = files::open(&source)?;
            let own_path = target.path().join(&own);
            fs::File::create(&own_path)
                .and_then(|mut copy| std::io::copy(&mut opened, &mut copy))
                .map_err(|error| Error::write(&own_path, error))?;
            *file = own;
        }
        settings.radar.frames = frames.len();
        settings.files.samples = "if.npy".into();
        settings.files.valid = self.valid.as_ref().map(|_| PathBuf::from("valid.npy"));
        if let Some(valid) = &self.valid {
            valid.of_frames(frames).write(&target.path().join("valid.npy"))?;
        }
        write_settings(&target.path().join(SETTINGS_FILE), &settings)?;
        let samples = target.path().join("if.npy");
        write_samples(&samples, &settings.radar, layout, &mut |index| frame(frames[index]))?;
        target.finish()
    }
}

/// A name of its own in a flat folder, with the ending that says what it is.
fn named(name: &str, file: &Path) -> PathBuf {
    let ending = file.extension().unwrap_or_default();
    PathBuf::from(name).with_extension(ending)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::{RecordingContents, Valid, stage_recording};
    use crate::radar::Radar;

    #[test]
    fn samples_change_and_the_rest_goes_along() {
        let folder = tempfile::tempdir().unwrap();
        let (whole, part) = (folder.path().join("whole"), folder.path().join("part"));
        let radar = Radar::small(4);
        let [_, tx, rx, loops, samples] = radar.dims();
        let count = tx * rx * loops * samples;
        let contents = RecordingContents {
            radar: &radar,
            room: Some(&crate::room::Room { front_m: Some(4.0), ..Default::default() }),
            person: None,
            body_file: None,
            labels: [("action".to_string(), "sit".to_string())].into(),
            layout: IfLayout::Codes,
            truth: Some(&serde_json::json!({})),
        };
        let frame = |value: usize| IfFrame::new([tx, rx, loops, samples], vec![value as f32; count], Some(vec![0.0; count]));
        let target = AtomicFolder::create(&whole).unwrap();
        let mut staged = stage_recording(target, &contents, &mut |index| Ok(frame(index))).unwrap();
        staged.set_valid(&Valid::without(&radar, [[3, 0, 0, 0]])).unwrap();
        let recording = staged.publish().unwrap();
        let mut doubled = |index: usize| Ok(frame(2 * index));
        recording.write_altered(&part, &[0, 2, 3], IfLayout::Codes, &mut doubled).unwrap();
        let altered = Recording::open(&part).unwrap();
        assert_eq!((altered.frames(), &altered.room, &altered.labels), (3, &recording.room, &recording.labels));
        assert_eq!((altered.frame(1).unwrap(), altered.frame(2).unwrap()), (frame(4), frame(6)));
        assert_eq!([0, 1, 2].map(|frame| altered.is_whole(frame)), [true, true, false]);
        assert!(!part.join("truth.json").exists());
    }
}
