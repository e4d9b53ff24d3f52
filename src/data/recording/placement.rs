//! Another placement of the motion in a `recording.toml` that exists.

use std::path::Path;

use super::settings::RecordingSettings;
use crate::data::{atomic, files, settings};
use crate::error::{Error, Result};
use crate::person::Placement;

/// Writes a placement into a recording's settings; all else of the file, comments too, stays as it is.
///
/// # Errors
/// Settings that cannot be read or written, or that hold their `[motion]` in another way than as a table of its own.
pub fn write_placement(path: &Path, placement: &Placement) -> Result<()> {
    let text = files::read_text(path)?;
    let written = with_placement(&text, placement);
    let parsed = |text: &str| settings::read_text::<RecordingSettings>(text).ok();
    let wanted = parsed(&text).map(|settings| RecordingSettings { motion: Some(placement.clone()), ..settings });
    if wanted.is_none() || parsed(&written) != wanted {
        return Err(Error::field(path, "motion", "no table of its own", "[motion] on a line of its own, its keys below")
            .with_hint("copy motion.toml by hand"));
    }
    atomic::write_text(path, &written)
}

/// The text with the table `[motion]` replaced, or added at the end.
fn with_placement(text: &str, placement: &Placement) -> String {
    let table = format!("[motion]\n{}", toml::to_string(placement).expect("plain data"));
    let mut kept = String::new();
    let (mut inside, mut done) = (false, false);
    for line in text.split_inclusive('\n') {
        let header = line.trim_start().starts_with('[') && line.split('#').next().is_some_and(is_header);
        if header {
            inside = line.split('#').next().is_some_and(|line| line.trim() == "[motion]");
            if inside {
                kept += &table;
                done = true;
            } else if done && !kept.ends_with("\n\n") {
                kept += "\n";
            }
        }
        if !inside {
            kept += line;
        }
    }
    if !done {
        kept = format!("{}\n\n{table}", kept.trim_end());
    }
    kept
}

/// `[name]`, and no row of a matrix.
fn is_header(line: &str) -> bool {
    let name = line.trim().strip_prefix('[').and_then(|line| line.strip_suffix(']'));
    name.is_some_and(|name| {
        name.chars().next().is_some_and(char::is_alphabetic)
            && name.chars().all(|letter| letter.is_alphanumeric() || "_-.".contains(letter))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "format = 1 # one\n[radar] # the board\nstart_frequency_hz = 77e9\nslope_hz_per_s = 60e12\n\
        sample_rate_hz = 4.4e6\nsamples_per_chirp = 64\nloops_per_frame = 32\nadc_start_s = 6e-6\nchirp_period_s = 7e-5\n\
        frame_period_s = 0.1\nframes = 8\ntx_m = [[0, 0, 0]]\nrx_m = [[0, 0, 0]]\n\n[motion]\nstart_s = 1.0\nradar_from_motion = [\n\
        [1, 0, 0],\n[0, 0, -1],\n[0, 1, 0],\n]\norigin_m = [0.1, 3.6, -1.0]\n\n[files] # beside\nif = \"if.npy\"\n";

    #[test]
    fn the_motion_is_replaced_and_all_else_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("recording.toml");
        std::fs::write(&path, TEXT).unwrap();
        let placement = Placement { start_s: -0.25, origin_m: [0.5, 2.0, -1.1], ..Placement::default() };
        write_placement(&path, &placement).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let settings: RecordingSettings = settings::read_text(&text).unwrap();
        assert_eq!(settings.motion.as_ref(), Some(&placement));
        assert!(text.contains("[radar] # the board") && text.contains("\n[files] # beside\n"), "{text}");
        // Where there was none, it is added.
        std::fs::write(&path, TEXT.split_once("[motion]").unwrap().0.to_string() + "[files]\nif = \"if.npy\"\n").unwrap();
        write_placement(&path, &placement).unwrap();
        let settings: RecordingSettings = settings::read_text(&std::fs::read_to_string(&path).unwrap()).unwrap();
        assert_eq!(settings.motion, Some(placement));
    }

    #[test]
    fn settings_of_another_form_are_refused_and_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("recording.toml");
        let inline = TEXT.replace("[motion]\nstart_s = 1.0\n", "[motion.x]\ny = 1\n");
        std::fs::write(&path, &inline).unwrap();
        assert!(write_placement(&path, &Placement::default()).is_err());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), inline);
    }
}
