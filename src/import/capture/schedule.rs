//! What a TI radar does within a frame, and which of its chirps make a recording.
//!
//! A recording has transmitters in time division at even steps: transmitter i of n sends i chirp periods after the
//! first. Whatever part of a frame is so can be taken: one profile of several, one subframe, one transmitter.

use std::path::{Path, PathBuf};

use super::boards::Board;
use super::lanes::Lanes;
use super::{Stated, inverted, stream::Words};
use crate::error::{Error, Result};
use crate::radar::{Radar, Sampling};

/// What to do where transmitters send with phases that are switched between 0 and a half turn (BPM), that run on by a step of each
/// transmitter's own (DDMA), or that are shifted by others.
pub const SWITCHED: &str =
    "separate the transmitters (sums and differences of the two chirps) and import the array with --layout";
pub const DIVIDED: &str = "separate the transmitters by their Doppler frequencies and import the array with --layout";
pub const SHIFTED: &str = "turn the samples of each chirp back by its phase and import the array with --layout; of a description whose phase \
                           shifters were off, set the field to 0";

/// A chirp's shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    pub id: usize,
    pub start_frequency_hz: f64,
    pub slope_hz_per_s: f64,
    pub sample_rate_hz: f64,
    pub samples: usize,
    pub idle_s: f64,
    pub adc_start_s: f64,
    pub ramp_end_s: f64,
}

/// One chirp of a loop: its profile, who sends, and how much longer it idles.
#[derive(Clone, Debug, PartialEq)]
pub struct Chirp {
    pub profile: usize,
    pub tx_mask: usize,
    pub extra_idle_s: f64,
}

/// Chirps that are repeated: a frame, or one subframe of an advanced frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Burst {
    pub chirps: Vec<Chirp>,
    /// In all, those of repeated bursts too.
    pub loops: usize,
    /// Where the loops come in several bursts: how.
    pub repeated: Option<Repeated>,
}

/// Bursts of equal loops, one after the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeated {
    pub loops_of_each: usize,
    /// From a burst's start to the next one's.
    pub period_s: f64,
}

/// The step in which a radar counts the period of bursts (rlSubFrameCfg_t.burstPeriodicity).
const BURST_STEP_S: f64 = 5e-9;

impl Burst {
    /// `number` bursts of so many loops each; `period_s`: from one to the next, where there are several.
    pub fn of(chirps: Vec<Chirp>, loops_of_each: usize, number: usize, period_s: f64) -> Self {
        let repeated = (number > 1).then_some(Repeated { loops_of_each, period_s });
        Self { chirps, loops: loops_of_each.saturating_mul(number), repeated }
    }

    /// The same with one profile for all chirps.
    pub fn forced(mut self, profile: usize) -> Self {
        self.chirps.iter_mut().for_each(|chirp| chirp.profile = profile);
        self
    }

    /// The profiles of its chirps, each once.
    fn profiles(&self) -> Vec<usize> {
        let mut used: Vec<usize> = self.chirps.iter().map(|chirp| chirp.profile).collect();
        used.sort_unstable();
        used.dedup();
        used
    }
}

/// All that a description says of a TI radar.
#[derive(Clone, Debug)]
pub struct TiRadar {
    /// The file that says so.
    pub file: PathBuf,
    pub profiles: Vec<Profile>,
    pub bursts: Vec<Burst>,
    pub frame_period_s: f64,
    /// `None`: until it is stopped.
    pub frames: Option<usize>,
    pub rx_mask: usize,
    /// Devices that share the receivers and write a stream of words each.
    pub devices: usize,
    pub lanes: Lanes,
    pub notes: Vec<String>,
}

/// The chirps that were chosen, and where their words begin within a frame.
pub struct Selection {
    pub radar: Radar,
    pub words_per_frame: u64,
    /// `[loop][tx]`.
    pub starts: Vec<Vec<u64>>,
    pub inverted_rx: Vec<usize>,
    pub notes: Vec<String>,
}

impl TiRadar {
    pub(super) fn profile(&self, id: usize) -> Result<&Profile> {
        self.profiles.iter().find(|profile| profile.id == id).ok_or_else(|| {
            let known: Vec<_> = self.profiles.iter().map(|profile| profile.id.to_string()).collect();
            let expected = if known.is_empty() {
                "a profile that is described: there is none".into()
            } else {
                format!("one of {}", known.join(", "))
            };
            Error::field(&self.file, "profile", format!("{id}, which nothing describes"), expected)
        })
    }

    fn receivers(&self) -> Vec<usize> {
        (0..16).filter(|rx| self.rx_mask >> rx & 1 == 1).collect()
    }

    /// Words of one chirp in a stream.
    fn words_per_chirp(&self, samples: usize) -> usize {
        self.lanes.words_per_chirp(self.receivers().len() / self.devices, samples)
    }

    /// Words of one whole frame in a stream, all profiles and subframes.
    pub fn words_per_frame(&self) -> Result<u64> {
        self.words_of(&self.bursts)
    }

    fn words_of(&self, bursts: &[Burst]) -> Result<u64> {
        let mut words = 0;
        for burst in bursts {
            for chirp in &burst.chirps {
                words += (burst.loops * self.words_per_chirp(self.profile(chirp.profile)?.samples)) as u64;
            }
        }
        Ok(words)
    }

    /// Chooses the chirps that make a recording. `present` says how many whole frames of so many words there are.
    ///
    /// # Errors
    /// Several subframes or profiles and none chosen; chirps at uneven steps; a transmitter that never sends.
    pub fn select(&self, stated: &Stated, present: &dyn Fn(u64, &mut Vec<String>) -> Result<usize>) -> Result<Selection> {
        let burst_index = self.chosen_burst(stated)?;
        let burst = &self.bursts[burst_index];
        let profile = self.profile(self.chosen_profile(burst, stated)?)?;
        let before = self.words_of(&self.bursts[..burst_index])?;
        // (start in time, start in words, transmitters) of the chirps that are kept, and the loop's length.
        let (mut time_s, mut offset, mut kept) = (0.0, 0, Vec::new());
        for chirp in &burst.chirps {
            let shape = self.profile(chirp.profile)?;
            let wanted = stated.tx.is_none_or(|tx| chirp.tx_mask == 1 << tx);
            if chirp.profile == profile.id && wanted {
                kept.push((time_s, offset, chirp.tx_mask));
            }
            time_s += shape.idle_s + chirp.extra_idle_s + shape.ramp_end_s;
            offset += self.words_per_chirp(shape.samples);
        }
        if kept.is_empty() {
            let found = format!("none of the {} chirps of a loop", burst.chirps.len());
            return Err(Error::field(&self.file, "chirps", found, "at least one chirp that was asked for")
                .with_hint("leave out --tx or --profile, or name another"));
        }
        let loop_s = self.loop_s(burst, time_s)?;
        self.even(&kept, loop_s)?;
        // Before anything of a frame's size is made: a description may ask for more than there is.
        let words_per_frame = self.words_per_frame()?;
        let mut notes = self.notes.clone();
        let frames = present(words_per_frame, &mut notes)?;
        self.hold_against_ordered(frames, &mut notes);
        let masks: Vec<usize> = kept.iter().map(|&(_, _, mask)| mask).collect();
        // A loop that repeats itself (128 chirps of one transmitter) is as many loops.
        let period = (1..=masks.len())
            .find(|&period| {
                masks.len().is_multiple_of(period) && (period..masks.len()).all(|index| masks[index] == masks[index - period])
            })
            .expect("the whole loop repeats itself");
        let starts = (0..burst.loops)
            .flat_map(|index| kept.chunks(period).map(move |chirps| (index, chirps)))
            .map(|(index, chirps)| chirps.iter().map(|&(_, words, _)| before + (index * offset + words) as u64).collect())
            .collect::<Vec<Vec<u64>>>();
        let (tx_m, rx_m, inverted_rx) = self.antennas(&masks[..period], stated, profile, &mut notes)?;
        let radar = Radar {
            start_frequency_hz: profile.start_frequency_hz,
            slope_hz_per_s: profile.slope_hz_per_s,
            sample_rate_hz: profile.sample_rate_hz,
            sampling: self.lanes.sampling,
            samples_per_chirp: profile.samples,
            loops_per_frame: starts.len(),
            adc_start_s: profile.adc_start_s,
            chirp_period_s: loop_s / kept.len() as f64,
            frame_period_s: self.frame_period_s,
            frames,
            position_m: [0.0; 3],
            tx_m,
            rx_m,
            full_scale_codes: Some(f64::from(i16::MAX)),
        };
        Ok(Selection { radar, words_per_frame, starts, inverted_rx, notes })
    }

    fn chosen_burst(&self, stated: &Stated) -> Result<usize> {
        match (stated.subframe, self.bursts.len()) {
            (None, 1) => Ok(0),
            (Some(index), count) if index < count => Ok(index),
            (found, count) => Err(Error::Usage {
                message: match found {
                    Some(index) => format!("--subframe {index}, but {} has {count}", self.file.display()),
                    None => format!("{}: {count} subframes in a frame, expected one", self.file.display()),
                },
                hint: Some(format!("choose one with --subframe 0 to {}; import each by itself", count - 1)),
            }),
        }
    }

    /// The profiles of the chosen subframe's chirps.
    pub fn profiles_in_frame(&self, stated: &Stated) -> Result<Vec<usize>> {
        Ok(self.bursts[self.chosen_burst(stated)?].profiles())
    }

    fn chosen_profile(&self, burst: &Burst, stated: &Stated) -> Result<usize> {
        let used = burst.profiles();
        match (stated.profile, &used[..]) {
            (None, &[only]) => Ok(only),
            (Some(id), _) if used.contains(&id) => Ok(id),
            (found, _) => Err(Error::Usage {
                message: match found {
                    Some(id) => format!("--profile {id}: no chirp of the frame has it"),
                    None => format!("{}: {} profiles in a frame, expected one", self.file.display(), used.len()),
                },
                hint: Some(format!("choose one with --profile, of {used:?}, or --profile all: a recording of each")),
            }),
        }
    }

    /// From a loop's start to the next one's, of loops whose chirps take `chirps_s`.
    ///
    /// # Errors
    /// Bursts of several loops with a pause between them; a burst that begins before the last one ends.
    fn loop_s(&self, burst: &Burst, chirps_s: f64) -> Result<f64> {
        let Some(Repeated { loops_of_each, period_s }) = burst.repeated else { return Ok(chirps_s) };
        let burst_s = loops_of_each as f64 * chirps_s;
        let pause_s = period_s - burst_s;
        match loops_of_each {
            _ if pause_s.abs() <= BURST_STEP_S => Ok(chirps_s),
            1 if pause_s > 0.0 => Ok(period_s),
            _ => {
                let (lasts, step) = (format!("{:.3} us", 1e6 * burst_s), format!("{:.3} us", 1e6 * period_s));
                let expected = format!("{lasts}, as long as its {loops_of_each} loops last, or one burst a subframe");
                Err(Error::field(&self.file, "burst period", step, expected)
                    .with_hint("a recording's loops are evenly spaced: loops that pause between bursts are not read"))
            }
        }
    }

    /// Refuses chirps that a recording's even steps cannot express.
    fn even(&self, kept: &[(f64, usize, usize)], loop_s: f64) -> Result<()> {
        let step_s = loop_s / kept.len() as f64;
        let uneven = kept.iter().enumerate().find(|(index, chirp)| {
            // A nanosecond: a hundredth of a turn of a 5 kHz Doppler shift takes two thousand.
            (chirp.0 - kept[0].0 - *index as f64 * step_s).abs() > 1e-9
        });
        let Some((index, chirp)) = uneven else { return Ok(()) };
        let found = format!("chirp {index} {:.3} us after the first", (chirp.0 - kept[0].0) * 1e6);
        Err(Error::field(
            &self.file,
            "chirps",
            found,
            format!("{:.3} us: even steps through the loop", index as f64 * step_s * 1e6),
        )
        .with_hint("import each transmitter by itself with --tx 0, --tx 1, …: the chirps of one are evenly spaced"))
    }

    /// Whole frames in the files of one stream, which may be fewer than were ordered.
    pub fn frames_present(&self, words: &Words, words_per_frame: u64, notes: &mut Vec<String>) -> Result<usize> {
        let (frames, rest) = (words.len() / words_per_frame, words.bytes() % (2 * words_per_frame));
        if frames == 0 {
            let found = format!("{} bytes", words.bytes());
            let expected = format!("at least {} bytes, one frame of {}", 2 * words_per_frame, self.file.display());
            return Err(Error::field(words.first(), "samples", found, expected)
                .with_hint("the description belongs to another capture, or the capture was cut off"));
        }
        if rest > 0 {
            notes.push(format!(
                "{rest} bytes after the last whole frame are left out: {frames} frames of {} bytes each",
                2 * words_per_frame
            ));
        }
        Ok(frames as usize)
    }

    fn hold_against_ordered(&self, frames: usize, notes: &mut Vec<String>) {
        match self.frames {
            Some(ordered) if ordered > frames => notes.push(format!("{ordered} frames were ordered, {frames} are there")),
            Some(ordered) if ordered < frames => notes
                .push(format!("{ordered} frames were ordered, {frames} fit into the files: is the description this capture's?")),
            _ => {}
        }
    }

    /// Positions of the transmitters in firing order and of the receivers that are on.
    #[allow(clippy::type_complexity)]
    fn antennas(
        &self,
        masks: &[usize],
        stated: &Stated,
        profile: &Profile,
        notes: &mut Vec<String>,
    ) -> Result<(Vec<[f64; 3]>, Vec<[f64; 3]>, Vec<usize>)> {
        let receivers = self.receivers();
        if receivers.is_empty() {
            return Err(Error::field(&self.file, "receivers", "none is on", "at least one receiver"));
        }
        let sent = |mask: usize| (0..16).filter(move |tx| mask >> tx & 1 == 1).collect::<Vec<usize>>();
        if masks.contains(&0) {
            return Err(Error::field(&self.file, "transmitters", "a chirp that nobody sends", "a transmitter for every chirp"));
        }
        if masks.iter().any(|mask| mask.count_ones() > 1) {
            notes.push("several transmitters send together: they are taken as one in their middle".into());
        }
        let Some(name) = &stated.board else {
            // A line of half wavelengths is no board's array, but ranges and velocities need no array.
            let half = crate::radar::SPEED_OF_LIGHT / profile.start_frequency_hz / 2.0;
            let open: Vec<&str> = ["radar.tx_m", "radar.rx_m"].into_iter().filter(|key| !stated.has_set(key)).collect();
            notes.push(match open.is_empty() {
                true => "no board was named: antennas are those of --set radar.tx_m and radar.rx_m, and no receiver is taken to be fed \
                         from the opposite side"
                    .into(),
                false => format!(
                    "no board was named: antennas are assumed on a line, half a wavelength apart; angles mean nothing until --board \
                     NAME, or --set {}, says where they are",
                    open.join(" and ")
                ),
            });
            let line = |index: usize, step: f64| [index as f64 * step * half, 0.0, 0.0];
            let tx = (0..masks.len()).map(|index| line(index, receivers.len() as f64)).collect();
            return Ok((tx, (0..receivers.len()).map(|index| line(index, 1.0)).collect(), Vec::new()));
        };
        let board = Board::named(name)?;
        let missing = |what: &str, index: usize| {
            let of_board = if what == "receivers" { board.rx_half_wavelengths.len() } else { board.tx_half_wavelengths.len() };
            let expected = format!("numbers below {of_board}: the {} has {of_board} {what}", board.name);
            Error::field(&self.file, what, format!("number {index} (from 0) is on"), expected)
                .with_hint("the capture is of another board: name it with --board")
        };
        let middle = |mask: usize| -> Result<[f64; 3]> {
            let places = sent(mask).into_iter().map(|tx| board.tx_m(tx).ok_or_else(|| missing("transmitters", tx)));
            let places = places.collect::<Result<Vec<_>>>()?;
            Ok(std::array::from_fn(|axis| places.iter().map(|place| place[axis]).sum::<f64>() / places.len() as f64))
        };
        let tx_m = masks.iter().map(|&mask| middle(mask)).collect::<Result<Vec<_>>>()?;
        let rx_m =
            receivers.iter().map(|&rx| board.rx_m(rx).ok_or_else(|| missing("receivers", rx))).collect::<Result<Vec<_>>>()?;
        let inverted = inverted::places(board, receivers);
        notes.push(format!("antennas of the {} ({})", board.name, board.source));
        notes.extend(inverted::note(&inverted));
        Ok((tx_m, rx_m, inverted))
    }
}

/// The sampled part of a ramp must lie on it.
pub fn check_ramp(file: &Path, profile: &Profile) -> Option<String> {
    let end_s = profile.adc_start_s + profile.samples as f64 / profile.sample_rate_hz;
    (end_s > profile.ramp_end_s * (1.0 + 1e-9)).then(|| {
        format!(
            "{}: profile {} samples until {:.2} us, but its ramp ends at {:.2} us: the last samples are not of the ramp",
            file.display(),
            profile.id,
            end_s * 1e6,
            profile.ramp_end_s * 1e6
        )
    })
}

/// Complex or real samples from TI's output formats: 0 real, 1 complex 1x, 2 complex 2x, 3 pseudo real.
pub fn sampling_of(format: usize) -> Option<Sampling> {
    match format {
        0 | 3 => Some(Sampling::Real),
        1 | 2 => Some(Sampling::Complex),
        _ => None,
    }
}
