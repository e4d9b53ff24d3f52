//! What would be refused hours later is refused before anything is recorded.

use std::path::PathBuf;

use super::config::ReproduceConfig;
use crate::data::Recording;
use crate::error::{Error, Result};
use crate::lpips::Lpips;
use crate::radar::Radar;
use crate::room::Room;
use crate::site::SiteConfig;
use crate::training::{FrameSplit, Split, refuse_ambiguous_ranges};

/// What all recordings of a place have in common.
#[derive(Clone, Debug, PartialEq)]
pub struct Board {
    /// `frames`: the fewest of any recording.
    pub radar: Radar,
    pub room: Option<Room>,
}

impl Board {
    /// Of a site that is to be recorded.
    ///
    /// # Errors
    /// A radar that cannot be.
    pub fn of_site(config: &SiteConfig) -> Result<Self> {
        let mut radar = config.record.radar.radar()?;
        radar.frames = config.record.frames.unwrap_or(radar.frames);
        Ok(Self { radar, room: Some(config.record.room.clone()) })
    }

    /// That of a user's recordings, one after the other; `known`: the first one's folder, and what they had in common so far.
    ///
    /// # Errors
    /// A recording of another radar or room than those before.
    pub fn join(known: &mut Option<(PathBuf, Self)>, recording: &Recording) -> Result<()> {
        let Some((first, board)) = known else {
            let board = Self { radar: recording.radar.clone(), room: recording.room.clone() };
            *known = Some((recording.folder.clone(), board));
            return Ok(());
        };
        let other = |key: &str, found: &str, hint: &str| {
            let path = recording.folder.join("recording.toml");
            Err(Error::field(path, key, found, format!("that of {}", first.display())).with_hint(hint))
        };
        if !recording.radar.is_same_board(&board.radar) {
            return other("radar", "another radar", "a site has one radar");
        }
        if recording.room != board.room {
            return other("room", "another room", "one simulator learns one room: the other is for `second_room`");
        }
        board.radar.frames = board.radar.frames.min(recording.radar.frames);
        Ok(())
    }
}

/// Holds the settings against where they are to work; `key` names the place.
///
/// # Errors
/// A room beyond the radar's unambiguous range, maps too small for LPIPS.
pub fn check(config: &ReproduceConfig, key: &str, board: &Board) -> Result<()> {
    let Board { radar, room } = board;
    refuse_ambiguous_ranges(radar, room.as_ref(), |found, expected| Error::setting(key, format!("a room {found}"), expected))?;
    if config.comparison.lpips.is_some() {
        Lpips::check_dims([radar.loops_per_frame, radar.samples_per_chirp])?;
    }
    Ok(())
}

/// What only the first site is asked for.
///
/// # Errors
/// Recordings that are shorter than a classifier's window.
pub fn check_recognition(config: &ReproduceConfig, board: &Board) -> Result<()> {
    let (window, frames) = (config.recognition.window_frames, board.radar.frames);
    if !config.protocols.is_empty() && window > frames {
        let expected = format!("at most {frames}, the frames of the shortest recording");
        return Err(Error::setting("recognition.window_frames", window, expected).with_hint("set it lower, or record longer"));
    }
    Ok(())
}

/// # Errors
/// Another radar than the first site's.
pub fn check_same_board(key: &str, first: &Board, other: &Board) -> Result<()> {
    if other.radar.is_same_board(&first.radar) {
        return Ok(());
    }
    Err(Error::setting(key, "another radar", "that of `site`").with_hint("a trained simulator speaks for one radar"))
}

/// What only the second room is asked for. `takes`: recordings of the training subject there.
///
/// # Errors
/// More frames to adapt to than training keeps; another radar than the first site's.
pub fn check_adaptation(config: &ReproduceConfig, first: &Board, second: &Board, takes: usize) -> Result<()> {
    check_same_board("second_room", first, second)?;
    let frames = vec![second.radar.frames; takes];
    let all = FrameSplit::new(&frames, config.training.validation_fraction, Split::Last, 0).training.len();
    match config.adaptation.frames.iter().find(|&&frames| frames > all) {
        Some(frames) => {
            Err(Error::setting("adaptation.frames", frames, format!("at most {all}, the second room's training frames")))
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_fail_after_hours_is_refused_at_once() {
        let config =
            |more: &str| -> ReproduceConfig { crate::data::settings::read_text(&format!("site = \"x\"\n{more}")).unwrap() };
        let board = Board { radar: Radar::small(8), room: Some(Room { front_m: Some(3.0), ..Room::default() }) };
        check(&config(""), "site", &board).unwrap();
        let far = Board { room: Some(Room { front_m: Some(500.0), ..Room::default() }), ..board.clone() };
        assert!(check(&config(""), "site", &far).unwrap_err().to_string().contains("unambiguous range"));
        let error = check_recognition(&config("recognition.window_frames = 20"), &board).unwrap_err().to_string();
        assert!(error.contains("window_frames") && error.contains("at most 8"), "{error}");
        check_recognition(&config("recognition.window_frames = 8"), &board).unwrap();
        let adaptation = |frames: usize| config(&format!("adaptation.frames = [0, {frames}]"));
        // Two recordings of eight frames each, two of which are held out.
        check_adaptation(&adaptation(12), &board, &board, 2).unwrap();
        assert!(check_adaptation(&adaptation(13), &board, &board, 2).unwrap_err().to_string().contains("at most 12"));
        let other = Board { radar: Radar { slope_hz_per_s: 1e12, ..board.radar.clone() }, ..board.clone() };
        assert!(check_adaptation(&adaptation(1), &board, &other, 2).unwrap_err().to_string().contains("another radar"));
    }
}
