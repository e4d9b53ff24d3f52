//! The `.cfg` of the mmWave SDK: commands for the radar's serial port, one a line.
//!
//! Source: TI, "mmWave SDK user guide", section "Configuration (.cfg) file format". Read are channelCfg, adcCfg,
//! adcbufCfg, profileCfg, chirpCfg, frameCfg, advFrameCfg, subFrameCfg and lvdsStreamCfg; other lines say nothing of
//! the samples.

use std::io::ErrorKind;
use std::path::Path;

use super::lanes::Lanes;
use super::schedule::{Burst, Chirp, DIVIDED, Profile, SHIFTED, SWITCHED, TiRadar, check_ramp, sampling_of};
use crate::data::files;
use crate::error::{Error, Result};
use crate::radar::Sampling;

/// What the radar's program writes before it waits for a command (`mmwDemo:/>`) ends so.
const PROMPT: &str = ":/>";

/// One line: its number, its command, its arguments.
struct Line<'a> {
    file: &'a Path,
    number: usize,
    command: &'a str,
    arguments: Vec<&'a str>,
}

impl Line<'_> {
    fn wrong(&self, found: impl Into<String>, expected: &str) -> Error {
        Error::field(self.file, format!("line {}: {}", self.number, self.command), found, expected)
    }

    fn number_at(&self, index: usize) -> Result<f64> {
        let text = self
            .arguments
            .get(index)
            .ok_or_else(|| self.wrong(format!("{} arguments", self.arguments.len()), &format!("at least {}", index + 1)))?;
        text.parse()
            .ok()
            .filter(|number: &f64| number.is_finite())
            .ok_or_else(|| self.wrong(format!("`{text}` at place {}", index + 1), "a number"))
    }

    /// A time or a period.
    fn amount_at(&self, index: usize) -> Result<f64> {
        let number = self.number_at(index)?;
        if number >= 0.0 {
            Ok(number)
        } else {
            Err(self.wrong(format!("{number} at place {}", index + 1), "a number of at least 0"))
        }
    }

    fn count_at(&self, index: usize) -> Result<usize> {
        let number = self.number_at(index)?;
        if number >= 0.0 && number.fract() == 0.0 && number < 1e9 {
            return Ok(number as usize);
        }
        Err(self.wrong(format!("{number} at place {}", index + 1), "a whole number"))
    }
}

/// Reads the radar. A later line of the same command and number takes the earlier one's place, as on the radar.
pub fn read_radar(file: &Path) -> Result<TiRadar> {
    let text = read_text(file)?;
    let lines = lines(file, &text);
    refuse_unread(&lines)?;
    let all = |command: &str| lines.iter().filter(|line| line.command == command).collect::<Vec<_>>();
    let last = |command: &str| {
        all(command).pop().ok_or_else(|| {
            Error::field(file, command, "missing", "a line of that command")
                .with_hint("is this the .cfg that was sent to the radar?")
        })
    };
    let mut profiles: Vec<Profile> = Vec::new();
    for line in all("profileCfg") {
        let profile = profile(line)?;
        profiles.retain(|other| other.id != profile.id);
        profiles.push(profile);
    }
    let chirps = chirps(&all("chirpCfg"))?;
    let (bursts, frame_period_s, frames) = match all("advFrameCfg").pop() {
        Some(advanced) => advanced_frame(advanced, &all("subFrameCfg"), &chirps)?,
        None => frame(last("frameCfg")?, &chirps)?,
    };
    let mut notes: Vec<String> = profiles.iter().filter_map(|profile| check_ramp(file, profile)).collect();
    last("adcbufCfg")?;
    // Without the subframe in SDK 1.
    let buffer = of_subframes(&all("adcbufCfg"), bursts.len(), |line| line.arguments.len() >= 5)?;
    let lanes = lanes(last("adcCfg")?, buffer, &mut notes)?;
    let streams = all("lvdsStreamCfg");
    if !streams.is_empty() {
        streamed(of_subframes(&streams, bursts.len(), |_| true)?)?;
    }
    let radar = TiRadar {
        file: file.into(),
        profiles,
        bursts,
        frame_period_s,
        frames,
        rx_mask: last("channelCfg")?.count_at(0)?,
        devices: 1,
        lanes,
        notes,
    };
    radar.checked()
}

/// The commands that hold: of a log, those after the last `flushCfg`, which leaves only what is set of the ADC's buffer and of the
/// stream. The prompt of a copied terminal is no command.
fn lines<'a>(file: &'a Path, text: &'a str) -> Vec<Line<'a>> {
    let line = |(index, line): (usize, &'a str)| {
        let written = line.split(['%', '#']).next()?;
        let mut words = written.rsplit_once(PROMPT).map_or(written, |(_, typed)| typed).split_whitespace();
        Some(Line { file, number: index + 1, command: words.next()?, arguments: words.collect() })
    };
    let mut lines: Vec<Line> = text.lines().enumerate().filter_map(line).collect();
    if let Some(flush) = lines.iter().rposition(|line| line.command == "flushCfg") {
        let stays = |line: &Line| ["adcbufCfg", "lvdsStreamCfg"].contains(&line.command);
        let mut place = 0..;
        lines.retain(|line| place.next().is_some_and(|place| place > flush) || stays(line));
    }
    lines
}

/// Refuses commands of another SDK, and of transmitters that send at once.
fn refuse_unread(lines: &[Line]) -> Result<()> {
    for line in lines {
        let together = |found: &str, hint: &str| Err(line.wrong(found, "time division").with_hint(hint));
        match line.command {
            "chirpComnCfg" | "chirpTimingCfg" => {
                let expected = "commands of the mmWave SDK 1 to 3 or of the MCU+ SDK: profileCfg, chirpCfg, frameCfg";
                return Err(line
                    .wrong("a command of the MMWAVE-L SDK (xWRL6432, xWRL1432), which is not read", expected)
                    .with_hint(
                        "describe the samples with --layout, and the radar with --config FILE.toml or --set radar.KEY=VALUE",
                    ));
            }
            // bpmCfg <subframe> <enabled> <first chirp> <second chirp>
            "bpmCfg" if line.count_at(1)? != 0 => {
                return together("transmitters that send together with switched phases", SWITCHED);
            }
            "ddmPhaseShiftAntOrder" => return together("transmitters that send together, told apart by Doppler (DDMA)", DIVIDED),
            _ => {}
        }
    }
    Ok(())
}

/// The text of a file whose commands are ASCII: comments may be of another encoding.
fn read_text(file: &Path) -> Result<String> {
    let text = match files::read_text(file) {
        Err(Error::Read { source, .. }) if source.kind() == ErrorKind::InvalidData => {
            let bytes = files::read(file)?;
            if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
                return Err(Error::field(file, "encoding", "UTF-16", "ASCII or UTF-8")
                    .with_hint("save it as UTF-8; PowerShell: Get-Content OLD.cfg | Set-Content -Encoding ascii NEW.cfg"));
            }
            String::from_utf8_lossy(&bytes).into_owned()
        }
        text => text?,
    };
    Ok(text.trim_start_matches('\u{feff}').to_string())
}

/// lvdsStreamCfg <subframe> <header> <format> <software>
fn streamed(stream: &Line) -> Result<()> {
    if stream.count_at(1)? == 1 {
        return Err(stream.wrong("a header before the samples", "0: headers between the samples are not read"));
    }
    if stream.count_at(2)? != 1 {
        return Err(stream.wrong(format!("data format {}", stream.count_at(2)?), "1: samples only"));
    }
    Ok(())
}

/// The line that holds for every subframe, of lines of one command whose first argument is a subframe (where it `is_named`), or -1 for
/// all: the last one of each counts.
///
/// # Errors
/// A subframe without a line; subframes whose lines differ: the samples of all are read alike.
fn of_subframes<'a>(lines: &[&'a Line<'a>], subframes: usize, is_named: impl Fn(&Line) -> bool) -> Result<&'a Line<'a>> {
    let settings = |line: &Line<'a>| line.arguments[usize::from(is_named(line)).min(line.arguments.len())..].to_vec();
    // Last lines first.
    let mut of_each = vec![None; subframes];
    for &line in lines.iter().rev() {
        let number = if is_named(line) { line.number_at(0)? } else { -1.0 };
        for (_, own) in of_each.iter_mut().enumerate().filter(|(at, own)| own.is_none() && [-1.0, *at as f64].contains(&number)) {
            *own = Some(line);
        }
    }
    let missing = || {
        let found = format!("lines that leave out some of {subframes} subframes");
        lines[0].wrong(found, "a line of every subframe, or one of -1 for all")
    };
    let of_each = of_each.into_iter().collect::<Option<Vec<&Line>>>().ok_or_else(missing)?;
    let Some((first, others)) = of_each.split_first() else { return Err(missing()) };
    match others.iter().position(|line| settings(line) != settings(first)) {
        None => Ok(first),
        Some(at) => {
            let found = format!("{} for subframe {}", settings(others[at]).join(" "), at + 1);
            let expected = format!("those of line {}: one format of samples for all subframes", first.number);
            Err(others[at].wrong(found, &expected))
        }
    }
}

/// profileCfg id start_GHz idle_us adc_start_us ramp_end_us power phase slope_MHz/us tx_start samples rate_ksps …
fn profile(line: &Line) -> Result<Profile> {
    if line.number_at(6)? != 0.0 {
        let found = format!("phase shifters of {} at place 7", line.arguments[6]);
        return Err(line.wrong(found, "0: transmitters in phase").with_hint(SHIFTED));
    }
    Ok(Profile {
        id: line.count_at(0)?,
        start_frequency_hz: line.number_at(1)? * 1e9,
        idle_s: line.amount_at(2)? * 1e-6,
        adc_start_s: line.amount_at(3)? * 1e-6,
        ramp_end_s: line.amount_at(4)? * 1e-6,
        slope_hz_per_s: line.number_at(7)? * 1e12,
        samples: line.count_at(9)?,
        sample_rate_hz: line.number_at(10)? * 1e3,
    })
}

/// chirpCfg first last profile start_Hz slope_kHz/us idle_us adc_us tx_mask
fn chirps(lines: &[&Line]) -> Result<Vec<(usize, Chirp)>> {
    let mut all: Vec<(usize, Chirp)> = Vec::new();
    for line in lines {
        for (place, what) in [(3, "another start frequency"), (4, "another slope"), (6, "another ADC start")] {
            if line.number_at(place)? != 0.0 {
                return Err(line.wrong(what, "the profile's: chirps that differ from their profile are not read"));
            }
        }
        let chirp = Chirp { profile: line.count_at(2)?, tx_mask: line.count_at(7)?, extra_idle_s: line.amount_at(5)? * 1e-6 };
        for index in line.count_at(0)?..=line.count_at(1)?.min(511) {
            all.retain(|(other, _)| *other != index);
            all.push((index, chirp.clone()));
        }
    }
    Ok(all)
}

/// The chirps from `first` on.
fn chosen(line: &Line, chirps: &[(usize, Chirp)], first: usize, count: usize) -> Result<Vec<Chirp>> {
    let chirp = |index| chirps.iter().find(|(own, _)| *own == index).map(|(_, chirp)| chirp.clone());
    (first..first + count)
        .map(|index| chirp(index).ok_or_else(|| line.wrong(format!("chirp {index}"), "a chirp of a chirpCfg line")))
        .collect()
}

/// frameCfg first last loops frames [samples] period_ms trigger delay
fn frame(line: &Line, chirps: &[(usize, Chirp)]) -> Result<(Vec<Burst>, f64, Option<usize>)> {
    let (first, last) = (line.count_at(0)?, line.count_at(1)?);
    let count =
        (last + 1).checked_sub(first).ok_or_else(|| line.wrong(format!("chirps {first} to {last}"), "an ascending range"))?;
    let frames = line.count_at(3)?;
    let burst = Burst::of(chosen(line, chirps, first, count)?, line.count_at(2)?, 1, 0.0);
    // The MCU+ SDK (AWR294x, AWR2544) has numAdcSamples before the period.
    let period_at = if line.arguments.len() >= 8 { 5 } else { 4 };
    Ok((vec![burst], line.amount_at(period_at)? * 1e-3, (frames > 0).then_some(frames)))
}

/// advFrameCfg subframes forces_profile frames …; subFrameCfg index profile first chirps loops burst_ms offset bursts burst_loops period_ms
fn advanced_frame(line: &Line, subframes: &[&Line], chirps: &[(usize, Chirp)]) -> Result<(Vec<Burst>, f64, Option<usize>)> {
    let count = line.count_at(0)?;
    let is_forced = match line.count_at(1)? {
        0 => false,
        1 => true,
        other => {
            return Err(line.wrong(format!("{other} at place 2"), "1: a profile for each subframe, or 0: those of the chirps"));
        }
    };
    let (mut bursts, mut period_s) = (Vec::new(), 0.0);
    for index in 0..count {
        let subframe = subframes
            .iter()
            .rev()
            .find(|subframe| subframe.count_at(0).ok() == Some(index))
            .ok_or_else(|| line.wrong(format!("{count} subframes"), &format!("a subFrameCfg line for subframe {index}")))?;
        if subframe.count_at(7)? > 1 {
            return Err(subframe.wrong("several bursts", "one burst a subframe"));
        }
        let chirps = chosen(subframe, chirps, subframe.count_at(2)?, subframe.count_at(3)?)?;
        let burst = Burst::of(chirps, subframe.count_at(4)?, subframe.count_at(8)?.max(1), subframe.amount_at(5)? * 1e-3);
        bursts.push(if is_forced { burst.forced(subframe.count_at(1)?) } else { burst });
        period_s += subframe.amount_at(9)? * 1e-3;
    }
    let frames = line.count_at(2)?;
    Ok((bursts, period_s, (frames > 0).then_some(frames)))
}

/// adcCfg bits format; adcbufCfg [subframe] format swap interleave threshold (without the subframe in SDK 1)
fn lanes(adc: &Line, buffer: &Line, notes: &mut Vec<String>) -> Result<Lanes> {
    if adc.count_at(0)? != 2 {
        return Err(adc.wrong(format!("{} for the bits", adc.count_at(0)?), "2 (16 bits)"));
    }
    let sampling = sampling_of(adc.count_at(1)?).ok_or_else(|| adc.wrong("an unknown output format", "0 to 3"))?;
    let shift = usize::from(buffer.arguments.len() >= 5);
    let real = buffer.count_at(shift)? == 1;
    if real != (sampling == Sampling::Real) {
        return Err(buffer.wrong("another output format than adcCfg's", "the same: complex (0) or real (1)"));
    }
    // SampleSwap: 0 puts I into the lower half word, 1 puts Q there; the lower half word goes out first.
    let (q_first, interleaved) = (buffer.count_at(shift + 1)? == 1, buffer.count_at(shift + 2)? == 0);
    let count = if interleaved { 4 } else { 2 };
    notes.push(format!(
        "a .cfg does not say how many LVDS lanes there are: {count}, as for channels that are {}interleaved",
        if interleaved { "" } else { "not " }
    ));
    Ok(Lanes { count, interleaved, q_first, sampling })
}
