//! Samples in an array of any order of axes: NumPy, MATLAB, HDF5, or files of words alone.

use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::boards::Board;
use super::container;
use super::cube::{Cube, half_scale_note};
use super::layout::{Axis, Layout};
use super::radar_table::{finished, place_antennas, radar_table, table_of};
use super::words::{Lengths, WordArray};
use super::{Capture, Stated, coloradar};
use crate::data::entries::entries;
use crate::error::{Error, Result};
use crate::radar::Radar;

/// Arrays with `--layout` or `--preset`, and the radar of `--config`, `--board` and `--set`.
///
/// Several files, or a folder of them, are the frames of one recording, or of words alone one stream.
pub fn open(sources: &[PathBuf], stated: &Stated) -> Result<Capture> {
    let preset = stated.preset.as_ref();
    let layout = match (&stated.layout, preset) {
        (Some(layout), _) => layout.clone(),
        (None, Some(preset)) => preset.layout()?,
        (None, None) => {
            return Err(Error::Usage {
                message: format!("{}: the order of its axes is not known", sources[0].display()),
                hint: Some("write it from the outermost to the innermost, such as --layout \"frame chirp rx sample\"".into()),
            });
        }
    };
    let files = files(sources)?;
    let mut notes: Vec<String> =
        preset.map(|preset| format!("laid out as {} ({})", preset.title, preset.page)).into_iter().collect();
    notes.extend(preset.iter().flat_map(|preset| preset.notes.clone()));
    let mut settings = Settings::of(stated, &layout, &mut notes)?;
    if is_words(&files[0]) {
        let frame_files = preset.is_some_and(|preset| preset.frame_files);
        let words = WordArray::open(&files, &layout, settings.lengths(&mut notes)?, frame_files, &mut notes)?;
        return one(&files[0], Cube::of_words(words, layout), settings, notes);
    }
    let variable = stated.variable.as_deref().or_else(|| preset?.variable.as_deref());
    let cube = Cube::open(&files[0], variable, layout.clone())?;
    if files.len() == 1 {
        return one(&files[0], cube, settings, notes);
    }
    if cube.has(Axis::Frame) {
        return Err(Error::Usage {
            message: format!("{} files, expected one: their layout has an axis of frames", files.len()),
            hint: Some("several files are joined where each is one frame; import others one by one".into()),
        });
    }
    settings.fill(&cube, &mut notes);
    let one_frame = settings.finish(&mut notes)?;
    cube.check(&one_frame)?;
    notes.push(format!("{} files, in the order of the numbers in their names, are the frames", files.len()));
    notes.extend(half_scale_note(&cube)?);
    let radar = Radar { frames: files.len(), ..one_frame.clone() };
    radar.check("radar")?;
    let (stored_as, wrapped, variable) = (cube.stored_as(), cube.wrapped, variable.map(String::from));
    let source = files[0].clone();
    let frame = move |index: usize| {
        let mut cube = Cube::open(&files[index], variable.as_deref(), layout.clone())?;
        cube.wrapped = wrapped;
        cube.check(&one_frame)?;
        cube.frame(0)
    };
    Ok(Capture { source, radar, layout: stored_as, notes, lost: vec![], frame: Box::new(frame) })
}

fn one(path: &Path, cube: Cube, mut settings: Settings, mut notes: Vec<String>) -> Result<Capture> {
    settings.fill(&cube, &mut notes);
    let radar = settings.finish(&mut notes)?;
    cube.check(&radar)?;
    notes.extend(half_scale_note(&cube)?);
    Ok(Capture {
        source: path.into(),
        layout: cube.stored_as(),
        radar,
        notes,
        lost: vec![],
        frame: Box::new(move |index| cube.frame(index)),
    })
}

fn extension(path: &Path) -> String {
    path.extension().map(|extension| extension.to_string_lossy().to_lowercase()).unwrap_or_default()
}

fn is_words(path: &Path) -> bool {
    extension(path) == "bin"
}

/// The files themselves, or those of a folder by the numbers in their names.
fn files(sources: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let [folder] = sources else { return Ok(sources.to_vec()) };
    if !folder.is_dir() {
        return Ok(sources.to_vec());
    }
    let mut files = entries(folder)?;
    files.retain(|file| is_words(file) || container::EXTENSIONS.contains(&extension(file).as_str()));
    files.sort_by_cached_key(|file| numbered(&file.file_name().unwrap_or_default().to_string_lossy()));
    match files.iter().find(|file| extension(file) != extension(&files[0])) {
        Some(other) => {
            Err(Error::field(other, "name", "another type of file", format!("`.{}`, as before", extension(&files[0])))
                .with_hint("name the files themselves"))
        }
        None if files.is_empty() => Err(Error::Usage {
            message: format!("{}: no array in this folder", folder.display()),
            hint: Some("name the folder that holds the frames themselves: .bin, .npy, .npz, .mat or .h5".into()),
        }),
        None => Ok(files),
    }
}

/// A name in which numbers count as such: `frame_9` before `frame_10`.
fn numbered(name: &str) -> Vec<(String, u64)> {
    let mut parts = vec![(String::new(), 0u64)];
    let mut in_number = false;
    for letter in name.chars() {
        match letter.to_digit(10) {
            Some(digit) => {
                let (_, number) = parts.last_mut().expect("there is one");
                *number = number.saturating_mul(10).saturating_add(digit.into());
            }
            None if in_number => parts.push((letter.into(), 0)),
            None => parts.last_mut().expect("there is one").0.push(letter),
        }
        in_number = letter.is_ascii_digit();
    }
    parts
}

/// What is stated of the radar, before the array fills what is left open.
struct Settings {
    name: PathBuf,
    table: Table,
    board: Option<&'static Board>,
    transmitters: Option<Vec<usize>>,
    /// Whether the layout counts transmitters only together with something else.
    is_by_chirp: bool,
    has_tx: bool,
    has_rx: bool,
}

impl Settings {
    fn of(stated: &Stated, layout: &Layout, notes: &mut Vec<String>) -> Result<Self> {
        let preset = stated.preset.as_ref();
        let (others, configs): (Vec<_>, Vec<_>) = stated.configs.iter().partition(|path| extension(path) == "txt");
        let mut table = table_of(configs.first().map(|path| path.as_path()), &stated.sets)?;
        let radar = radar_table(&mut table)?;
        for path in others {
            coloradar::fill(path, radar)?;
        }
        for (key, value) in preset.iter().flat_map(|preset| &preset.radar) {
            radar.entry(key).or_insert_with(|| value.clone());
        }
        let board = stated.board.as_ref().or_else(|| preset?.board.as_ref()).map(|name| Board::named(name)).transpose()?;
        if let Some(board) = board {
            notes.push(format!("antennas of the {} ({})", board.name, board.source));
        }
        let has = |axes: &[Axis]| axes.iter().any(|axis| layout.place(*axis).is_some());
        Ok(Self {
            name: stated.configs.first().cloned().unwrap_or_else(|| "--set".into()),
            table,
            board,
            transmitters: preset.and_then(|preset| preset.transmitters.clone()),
            is_by_chirp: has(&[Axis::Chirp, Axis::Antenna]),
            has_tx: has(&[Axis::Tx, Axis::Chirp, Axis::Antenna]),
            has_rx: has(&[Axis::Rx, Axis::Antenna]),
        })
    }

    fn radar(&mut self) -> &mut Table {
        radar_table(&mut self.table).expect("it was looked at")
    }

    /// The board's antennas, where no others are stated; `tx` and `rx`: how many an array has, where it says so.
    fn place_antennas(&mut self, tx: Option<usize>, rx: Option<usize>, notes: &mut Vec<String>) {
        let Some(board) = self.board else { return };
        let count = tx.unwrap_or(board.tx_half_wavelengths.len());
        let senders = self.transmitters.clone().unwrap_or_else(|| board.senders(count));
        let is_assumed = self.transmitters.is_none() && count < board.tx_half_wavelengths.len();
        if is_assumed && !self.radar().contains_key("tx_m") {
            notes.push(format!(
                "not all transmitters of the board are in the array: numbers {senders:?} are assumed (from 0, of one height where there \
                 are so many); --set radar.tx_m states others"
            ));
        }
        place_antennas(self.radar(), board, &senders, rx.unwrap_or(board.rx_half_wavelengths.len()));
    }

    fn antennas(&mut self, key: &str) -> Option<usize> {
        self.radar().get(key).and_then(Value::as_array).map(Vec::len)
    }

    /// Lengths that words alone do not say.
    fn lengths(&mut self, notes: &mut Vec<String>) -> Result<Lengths> {
        self.place_antennas((!self.has_tx).then_some(1), (!self.has_rx).then_some(1), notes);
        let hint = "words alone do not say their lengths: give it with --set, or in a file with --config";
        let (tx, rx) = (self.antennas("tx_m"), self.antennas("rx_m"));
        let missing = |key: &str| Error::setting(format!("radar.{key}"), "missing", "a value").with_hint(hint);
        let (tx, rx) = (tx.ok_or_else(|| missing("tx_m"))?, rx.ok_or_else(|| missing("rx_m"))?);
        let mut count = |key: &str| {
            let value = self.radar().get(key).cloned().ok_or_else(|| missing(key))?;
            value
                .as_integer()
                .and_then(|count| usize::try_from(count).ok())
                .filter(|count| *count > 0)
                .ok_or_else(|| Error::setting(format!("radar.{key}"), value.to_string(), "a whole number of at least 1"))
        };
        Ok(Lengths { loops: count("loops_per_frame")?, samples: count("samples_per_chirp")?, tx, rx })
    }

    /// What the array itself says fills what is left open.
    fn fill(&mut self, cube: &Cube, notes: &mut Vec<String>) {
        let by_axis = |axis: Axis| cube.has(axis).then(|| cube.length(axis));
        let (tx, rx) = if cube.has(Axis::Antenna) {
            (None, None)
        } else {
            (by_axis(Axis::Tx).or_else(|| (!self.is_by_chirp).then_some(1)), Some(cube.length(Axis::Rx)))
        };
        self.place_antennas(tx, rx, notes);
        let transmitters = self.antennas("tx_m").unwrap_or(1).max(1);
        let chirps = cube.length(Axis::Loop) * cube.length(Axis::Chirp);
        let loops = chirps / if cube.has(Axis::Chirp) { transmitters } else { 1 };
        let radar = self.radar();
        for (key, number) in [("frames", cube.frames()), ("samples_per_chirp", cube.samples()), ("loops_per_frame", loops)] {
            radar.entry(key).or_insert(Value::Integer(number as i64));
        }
        radar.entry("sampling").or_insert_with(|| Value::String(format!("{:?}", cube.sampling()).to_lowercase()));
    }

    fn finish(self, notes: &mut Vec<String>) -> Result<Radar> {
        finished(self.table, &self.name, notes)
    }
}

#[cfg(test)]
mod tests {
    use super::numbered;

    #[test]
    fn names_are_in_the_order_of_their_numbers() {
        let mut names = ["frame_10.bin", "frame_9.bin", "frame_0.bin", "a.bin"];
        names.sort_by_cached_key(|name| numbered(name));
        assert_eq!(names, ["a.bin", "frame_0.bin", "frame_9.bin", "frame_10.bin"]);
    }
}
