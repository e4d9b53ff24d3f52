//! Recording folders of Infineon's Radar SDK (`RadarIfxAvian_00`) and of ifxdaq.
//!
//! Source: Infineon Radar SDK, `config.json` of a recording; `radar.npy` is `[frame, rx, chirp, sample]`, unsigned
//! ADC codes around half scale; under time division `rx` counts the receivers of the first transmitter, then those of the second (`[Tx][Rx]`,
//! "Virtual Rx antenna ordering" of the SDK's guide). ifxdaq writes `radar_timestamp.csv` beside it: on each line when a frame came, in seconds since 1970.

use std::path::{Path, PathBuf};

use super::boards::Board;
use super::cube::{Cube, half_scale_note};
use super::infineon_shape::Shape;
use super::json::Json;
use super::time_stamps::Grid;
use super::{Capture, Layout, Stated, radar_table::apply};
use crate::data::{IfFrame, IfLayout, entries::entries, files};
use crate::error::{Error, Result};
use crate::radar::{Radar, Sampling};

const SAMPLES: &str = "radar.npy";

/// Whether a file is the samples of such a folder.
pub fn is_samples(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name == SAMPLES) && path.with_file_name("config.json").is_file()
}

pub fn open(folder: &Path, stated: &Stated) -> Result<Capture> {
    let folder = device_folder(folder)?;
    let mut notes = Vec::new();
    let config = Json::read(&stated.configs.first().cloned().unwrap_or_else(|| folder.join("config.json")))?;
    let mut shape = Shape::of(&config)?;
    if !shape.rx.is_sorted() {
        // The SDK makes a mask of the list.
        notes.push(format!("receivers {:?} of {} come in the order of their numbers", shape.rx, config.file().display()));
        shape.rx.sort_unstable();
    }
    let tx = chosen(&config, &shape, stated)?;
    let board = board(stated, description(&folder)?.as_deref(), &mut notes)?;
    let source = folder.join(SAMPLES);
    let cube = Cube::open(&source, None, Layout::parse("frame rx loop sample")?)?;
    hold_real(&cube)?;
    let radar = radar(&config, &shape, tx, board, cube.frames(), &mut notes)?;
    let (layout, radar) = stored_as(&cube, radar, &mut notes)?;
    let radar = apply(radar, &stated.sets)?;
    let of_all = radar.rx_m.repeat(shape.tx.len());
    cube.check(&Radar { frames: cube.frames(), rx_m: of_all, ..radar.clone() })?;
    let [_, _, receivers, loops, samples] = radar.dims();
    notes.extend(half_scale_note(&cube)?);
    let grid = grid(&folder, &source, cube.frames(), &mut notes)?;
    if let Some((stamps, grid)) = &grid {
        grid.hold(stamps, radar.frame_period_s, stated.has_set("radar.frame_period_s"), &mut notes)?;
    }
    let frame = move |index: usize| Ok(of_transmitter(cube.frame(index)?, tx, [1, receivers, loops, samples]));
    let capture = Capture { source, radar, layout, board, notes, lost: vec![], rest: 0.0, frame: Box::new(frame) };
    Ok(match grid {
        Some((stamps, grid)) => grid.place(&stamps, capture),
        None => capture,
    })
}

/// When frames came, by the folder's file of time stamps, and that file; none where there is none or it does not say.
fn grid(folder: &Path, samples: &Path, frames: usize, notes: &mut Vec<String>) -> Result<Option<(PathBuf, Grid)>> {
    let Some(stamps) = stamps(folder)? else {
        notes.push("no time stamps: frames are taken to be evenly spaced".into());
        return Ok(None);
    };
    let grid = Grid::read(&stamps, &times(&stamps, frames, samples)?, notes);
    Ok(grid.map(|grid| (stamps, grid)))
}

/// What the folder says of its device.
fn description(folder: &Path) -> Result<Option<String>> {
    let meta = folder.join("meta.json");
    if !meta.is_file() {
        return Ok(None);
    }
    Json::read(&meta)?.find("description").map(|text| text.text().map(str::to_string)).transpose()
}

/// The file of time stamps, where there is one.
fn stamps(folder: &Path) -> Result<Option<PathBuf>> {
    let is_stamps = |path: &Path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        name.contains("timestamp") && name.ends_with(".csv")
    };
    let mut found = entries(folder)?;
    found.retain(|path| is_stamps(path));
    match &found[..] {
        [] => Ok(None),
        [only] => Ok(Some(only.clone())),
        [_, second, ..] => {
            Err(Error::field(second, "time stamps", format!("one of {} files", found.len()), "one file of a radar")
                .with_hint("take the files of other sensors out of the folder"))
        }
    }
}

/// When every frame came, seconds.
fn times(stamps: &Path, frames: usize, samples: &Path) -> Result<Vec<f64>> {
    let text = files::read_text(stamps)?;
    let time = |(index, line): (usize, &str)| {
        let time = line.trim().parse().ok().filter(|time: &f64| time.is_finite());
        let found = line.chars().take(60).collect::<String>();
        time.ok_or_else(|| {
            Error::field(stamps, format!("line {}", index + 1), found, "seconds since 1970, a number on each line")
                .with_hint("without this file, frames are taken to be evenly spaced")
        })
    };
    let times = text.trim_end().lines().enumerate().map(time).collect::<Result<Vec<f64>>>()?;
    if times.len() != frames {
        let expected = format!("{frames}, as in {}", samples.display());
        return Err(Error::field(stamps, "lines", times.len().to_string(), expected)
            .with_hint("a file is cut off or of another capture: copy the whole folder again"));
    }
    Ok(times)
}

/// Refuses numbers with imaginary parts: the devices have one mixer for each receiver, and nothing in `config.json` states I and Q.
fn hold_real(cube: &Cube) -> Result<()> {
    match cube.sampling() {
        Sampling::Real => Ok(()),
        Sampling::Complex => Err(cube
            .wrong(cube.describe(), "real numbers: a receiver that config.json describes has no Q".into())
            .with_hint(
                "take the radar.npy that the SDK wrote: range spectra and analytic signals are no samples; I and Q of another radar are read \
                 with --layout \"frame rx loop sample\" and the radar's settings",
            )),
    }
}

/// Floats stay floats. Those that are no whole numbers are not codes, so that the converter's largest code says nothing of them.
fn stored_as(cube: &Cube, radar: Radar, notes: &mut Vec<String>) -> Result<(IfLayout, Radar)> {
    if !cube.holds_floats() {
        return Ok((IfLayout::RealCodes, radar));
    }
    let samples = cube.frame(0)?.re;
    if samples.iter().all(|sample| sample.fract() == 0.0) {
        notes.push("samples are floats that are whole numbers: they are taken for the converter's codes".into());
        return Ok((IfLayout::Real, radar));
    }
    let largest = samples.iter().fold(0.0f32, |largest, sample| largest.max(sample.abs()));
    notes.push(format!(
        "samples are floats up to {largest} (first frame), no codes: their scale, such as 1 for the converter's full range, is kept, and \
         radar.full_scale_codes is left out"
    ));
    Ok((IfLayout::Real, Radar { full_scale_codes: None, ..radar }))
}

/// The folder with the samples: this one, or the only one of its kind below.
fn device_folder(folder: &Path) -> Result<PathBuf> {
    if folder.join(SAMPLES).is_file() {
        return Ok(folder.into());
    }
    let mut below = entries(folder)?;
    below.retain(|path| path.join(SAMPLES).is_file());
    match &below[..] {
        [only] => Ok(only.clone()),
        [] => Err(Error::Usage {
            message: format!("{}: no {SAMPLES} here or one folder below", folder.display()),
            hint: Some("expected a recording of the Radar SDK: RadarIfxAvian_00/config.json and radar.npy".into()),
        }),
        several => Err(Error::Usage {
            message: format!("{}: {} devices", folder.display(), several.len()),
            hint: Some("import each device's folder by itself".into()),
        }),
    }
}

/// The board of the antennas; none where `--set` states them all.
fn board(stated: &Stated, description: Option<&str>, notes: &mut Vec<String>) -> Result<Option<&'static Board>> {
    if stated.has_set("radar.tx_m") && stated.has_set("radar.rx_m") {
        return Ok(None);
    }
    let named = description.and_then(|text| text.split_whitespace().find(|word| word.starts_with("BGT")));
    let board = match stated.board.as_deref().or(named) {
        Some(name) => Board::named(name)?,
        None => {
            notes.push("no board was named: taken for a BGT60TR13C; --board NAME says otherwise".into());
            Board::named("BGT60TR13C")?
        }
    };
    notes.push(format!("antennas of the {} ({})", board.name, board.source));
    Ok(Some(board))
}

/// Places of antennas by their numbers from 1; zeros without a board, for `--set` to state.
fn places(
    config: &Json,
    what: &str,
    antennas: &[usize],
    board: Option<&Board>,
    of: fn(&Board, usize) -> Option<[f64; 3]>,
) -> Result<Vec<[f64; 3]>> {
    let place = |&antenna: &usize| {
        let Some(board) = board else { return Ok([0.0; 3]) };
        of(board, antenna - 1).ok_or_else(|| {
            Error::field(config.file(), what, format!("antenna {antenna}"), format!("those of the {}", board.name))
                .with_hint("name the board with --board")
        })
    };
    antennas.iter().map(place).collect()
}

/// Which of the transmitters that take turns is imported, by its place among them.
///
/// # Errors
/// Several and none chosen: the second follows the first at once, and a recording's chirps are evenly spaced.
fn chosen(config: &Json, shape: &Shape, stated: &Stated) -> Result<usize> {
    let expected = |text: String| Error::field(config.file(), "transmitters", format!("numbers {:?} (from 1)", shape.tx), text);
    match stated.tx {
        None if shape.tx.len() == 1 => Ok(0),
        None => Err(expected("one, or several at even steps: the second sends right after the first".into())
            .with_hint("import each transmitter by itself with --tx 0, --tx 1: the chirps of one are evenly spaced")),
        Some(tx) => shape.tx.iter().position(|own| *own == tx + 1).ok_or_else(|| {
            expected(format!("number {}, as --tx {tx} asks for", tx + 1))
                .with_hint("leave --tx out, or name a transmitter that sends")
        }),
    }
}

fn radar(
    config: &Json,
    shape: &Shape,
    tx: usize,
    board: Option<&Board>,
    frames: usize,
    notes: &mut Vec<String>,
) -> Result<Radar> {
    notes.push("the first sample is taken to be at the start of the ramp".into());
    let bits =
        Json::read(&config.file().with_file_name("meta.json")).ok().and_then(|meta| meta.find("adc_resolution")?.count().ok());
    Ok(Radar {
        start_frequency_hz: shape.start_hz,
        slope_hz_per_s: (shape.end_hz - shape.start_hz) * shape.rate_hz / shape.samples as f64,
        sample_rate_hz: shape.rate_hz,
        sampling: Sampling::Real,
        samples_per_chirp: shape.samples,
        loops_per_frame: shape.chirps,
        adc_start_s: 0.0,
        chirp_period_s: shape.period_s,
        frame_period_s: shape.frame_period_s,
        frames,
        position_m: [0.0; 3],
        tx_m: places(config, "tx_antennas", &shape.tx[tx..tx + 1], board, Board::tx_m)?,
        rx_m: places(config, "rx_antennas", &shape.rx, board, Board::rx_m)?,
        full_scale_codes: bits.map(|bits| f64::from(1u32 << bits.min(16)) - 1.0),
    })
}

/// One transmitter's receivers among all that a frame holds, which are those of each transmitter in turn.
fn of_transmitter(frame: IfFrame, tx: usize, dims: [usize; 4]) -> IfFrame {
    let block = dims.iter().product::<usize>();
    IfFrame::new(dims, frame.re[tx * block..][..block].to_vec(), None)
}
