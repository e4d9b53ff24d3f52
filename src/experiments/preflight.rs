//! What would be refused hours later is refused before anything is recorded.

use std::path::Path;

use super::config::ReproduceConfig;
use super::takes::Take;
use crate::data::Recording;
use crate::error::{Error, Result};
use crate::lpips::Lpips;
use crate::radar::Radar;
use crate::room::Room;
use crate::site::SiteConfig;
use crate::training::{FrameSplit, Split};

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

    /// Of recordings that a user made.
    ///
    /// # Errors
    /// Recordings that cannot be read, or of different radars or rooms.
    pub fn of_recordings(folder: &Path, takes: &[Take]) -> Result<Self> {
        let mut known: Option<Self> = None;
        for take in takes {
            let recording = Recording::open(folder.join(&take.name))?;
            let Some(board) = &mut known else {
                known = Some(Self { radar: recording.radar, room: recording.room });
                continue;
            };
            let path = folder.join(&take.name).join("recording.toml");
            if !recording.radar.is_same_board(&board.radar) {
                let expected = format!("that of {}", takes[0].name);
                return Err(Error::field(path, "radar", "another radar", expected).with_hint("a site has one radar"));
            }
            if recording.room != board.room {
                let expected = format!("that of {}", takes[0].name);
                return Err(Error::field(path, "room", "another room", expected)
                    .with_hint("one simulator learns one room: the other is for `second_room`"));
            }
            board.radar.frames = board.radar.frames.min(recording.radar.frames);
        }
        known.ok_or_else(|| Error::Usage { message: format!("{}: holds no recordings", folder.display()), hint: None })
    }
}

/// Holds the settings against where they are to work; `key` names the place.
///
/// # Errors
/// A room beyond the radar's unambiguous range, maps too small for LPIPS.
pub fn check(config: &ReproduceConfig, key: &str, board: &Board) -> Result<()> {
    let Board { radar, room } = board;
    if let Some(farthest) = room.as_ref().and_then(Room::farthest_wall_m)
        && farthest > radar.max_range_m()
    {
        let expected = format!("within the radar's unambiguous range of {:.2} m", radar.max_range_m());
        return Err(Error::setting(key, format!("a room up to {farthest:.2} m away"), expected)
            .with_hint("a higher sample rate or a lower slope reaches farther; `hybridsim check` shows the limits"));
    }
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

/// What only the second room is asked for. `takes`: recordings of the training subject there.
///
/// # Errors
/// More frames to adapt to than training keeps; another radar than the first site's.
pub fn check_adaptation(config: &ReproduceConfig, first: &Board, second: &Board, takes: usize) -> Result<()> {
    if !second.radar.is_same_board(&first.radar) {
        return Err(Error::setting("second_room", "another radar", "that of `site`")
            .with_hint("a trained simulator speaks for one radar"));
    }
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
        let config = |more: &str| -> ReproduceConfig { toml::from_str(&format!("site = \"x\"\n{more}")).unwrap() };
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
