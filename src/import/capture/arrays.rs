//! Samples in an array of any order of axes: NumPy, MATLAB, HDF5, or files of words alone.

use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::boards::Board;
use super::container;
use super::cube::{Cube, half_scale_note};
use super::layout::{Axis, Layout};
use super::radar_table::{finished, missing, place_antennas, radar_table, refuse_unknown, table_of};
use super::words::{Lengths, WordArray};
use super::{Capture, Stated, coloradar, inverted, numbers};
use crate::data::arrays::Kind;
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
    notes.extend(missing_files(&files));
    let mut settings = Settings::of(stated, &layout, &mut notes)?;
    let number = layout.number.filter(|number| is_words(&files[0]) && number.kind != Kind::Int);
    if is_words(&files[0]) && number.is_none() {
        let frame_files = preset.is_some_and(|preset| preset.frame_files);
        let words = WordArray::open(&files, &layout, settings.lengths(&mut notes)?, frame_files, &mut notes)?;
        return one(&files[0], Cube::of_words(words, layout), settings, notes);
    }
    let variable = stated.variable.clone().or_else(|| preset?.variable.clone());
    let lengths = number.map(|_| settings.lengths(&mut notes)).transpose()?;
    let opened = move |path: &Path, notes: &mut Vec<String>| match number.zip(lengths) {
        Some((number, lengths)) => Cube::of(numbers::open(path, number, &layout, lengths, notes)?, layout.clone()),
        None => Cube::open(path, variable.as_deref(), layout.clone()),
    };
    let cube = opened(&files[0], &mut notes)?;
    if files.len() == 1 {
        return one(&files[0], cube, settings, notes);
    }
    if cube.has(Axis::Frame) {
        return Err(Error::Usage {
            message: format!("{} files, expected one: their layout has an axis of frames", files.len()),
            hint: Some("several files are joined where each is one frame; import others one by one".into()),
        });
    }
    settings.fill(&cube, &mut notes)?;
    let board = settings.board;
    let inverted_rx = settings.inverted_rx(&cube, &mut notes);
    let one_frame = settings.finish(&mut notes)?;
    cube.check(&one_frame)?;
    notes.push(format!("{} files, in the order of the numbers in their names, are the frames", files.len()));
    notes.extend(half_scale_note(&cube)?);
    let radar = Radar { frames: files.len(), ..one_frame.clone() };
    radar.check("radar")?;
    let (stored_as, wrapped) = (cube.stored_as(), cube.wrapped);
    let source = files[0].clone();
    let frame = move |index: usize| {
        let mut cube = opened(&files[index], &mut vec![])?;
        cube.wrapped = wrapped;
        cube.check(&one_frame)?;
        Ok(inverted::turned_back(cube.frame(0)?, &inverted_rx))
    };
    Ok(Capture { source, radar, layout: stored_as, board, notes, lost: vec![], rest: 0.0, frame: Box::new(frame) })
}

fn one(path: &Path, cube: Cube, mut settings: Settings, mut notes: Vec<String>) -> Result<Capture> {
    settings.fill(&cube, &mut notes)?;
    let board = settings.board;
    let inverted_rx = settings.inverted_rx(&cube, &mut notes);
    let radar = settings.finish(&mut notes)?;
    cube.check(&radar)?;
    notes.extend(half_scale_note(&cube)?);
    Ok(Capture {
        source: path.into(),
        layout: cube.stored_as(),
        radar,
        board,
        notes,
        lost: vec![],
        rest: 0.0,
        frame: Box::new(move |index| Ok(inverted::turned_back(cube.frame(index)?, &inverted_rx))),
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

/// By how much the one number counts on in which two names differ.
fn step(pair: &[PathBuf]) -> Option<u64> {
    let names = [&pair[0], &pair[1]].map(|file| numbered(&file.file_name().unwrap_or_default().to_string_lossy()));
    let mut differing = names[0].iter().zip(&names[1]).filter(|(own, next)| own != next);
    let ((text, own), (same, next)) = differing.next()?;
    (names[0].len() == names[1].len() && differing.next().is_none() && text == same).then(|| next.checked_sub(*own))?
}

/// That files are missing, where most names count on by one.
fn missing_files(files: &[PathBuf]) -> Option<String> {
    let steps: Vec<u64> = files.windows(2).map(|pair| step(pair).unwrap_or(0)).collect();
    let counts_on = 2 * steps.iter().filter(|step| **step == 1).count() > steps.len();
    let first = steps.iter().position(|step| *step > 1).filter(|_| counts_on)?;
    let missing: u64 = steps.iter().map(|step| step.saturating_sub(1)).sum();
    Some(format!(
        "{missing} numbers are missing in the names of the files, the first after {}: what was recorded there is not put in, and what \
         follows comes too early",
        files[first].display()
    ))
}

/// What is stated of the radar, before the array fills what is left open.
struct Settings {
    name: PathBuf,
    table: Table,
    board: Option<&'static Board>,
    transmitters: Option<Vec<usize>>,
    /// Where what is left open could be found.
    page: Option<String>,
    /// Whether the layout counts transmitters only together with something else.
    is_by_chirp: bool,
    has_tx: bool,
    has_rx: bool,
    /// Antennas that the board places, by their keys.
    placed: Vec<&'static str>,
}

impl Settings {
    fn of(stated: &Stated, layout: &Layout, notes: &mut Vec<String>) -> Result<Self> {
        let preset = stated.preset.as_ref();
        let (others, configs): (Vec<_>, Vec<_>) = stated.configs.iter().partition(|path| extension(path) == "txt");
        if let Some(of_stream) = configs.iter().find(|path| ["cfg", "json"].contains(&extension(path).as_str())) {
            return Err(Error::field(of_stream, "type", format!("`.{}`", extension(of_stream)), "TOML with [radar], for arrays")
                .with_hint(
                    "TI's .cfg and .mmwave.json describe the .bin files of a capture card: leave --layout out for these; of an array state \
                     the radar in TOML, or with --board and --set radar.KEY=VALUE",
                ));
        }
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
            page: preset.map(|preset| preset.page.clone()),
            is_by_chirp: has(&[Axis::Chirp, Axis::Antenna]),
            has_tx: has(&[Axis::Tx, Axis::Chirp, Axis::Antenna]),
            has_rx: has(&[Axis::Rx, Axis::Antenna]),
            placed: vec![],
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
        let placed = place_antennas(self.radar(), board, &senders, rx.unwrap_or(board.rx_half_wavelengths.len()));
        self.placed.extend(placed);
    }

    /// Receivers whose samples are to be turned back: of words, which are as the board sent them, and of an array whose receivers the
    /// board places. Of an array nothing says whether its maker turned them back, so that the note says how to keep them.
    fn inverted_rx(&mut self, cube: &Cube, notes: &mut Vec<String>) -> Vec<usize> {
        let Some(board) = self.board.filter(|_| cube.holds_words() || self.placed.contains(&"rx_m")) else { return vec![] };
        let inverted = inverted::places(board, 0..self.antennas("rx_m").unwrap_or(0));
        notes.extend(if cube.holds_words() {
            inverted::note(&inverted)
        } else {
            inverted::note_of_array(&inverted, board, &self.placed)
        });
        inverted
    }

    fn antennas(&mut self, key: &str) -> Option<usize> {
        self.radar().get(key).and_then(Value::as_array).map(Vec::len)
    }

    /// Lengths that words alone do not say.
    fn lengths(&mut self, notes: &mut Vec<String>) -> Result<Lengths> {
        self.place_antennas((!self.has_tx).then_some(1), (!self.has_rx).then_some(1), notes);
        self.refuse_missing(&["frames"])?;
        let places = |own: Option<usize>, key: &str| {
            own.filter(|&count| count > 0)
                .ok_or_else(|| Error::setting(format!("radar.{key}"), "none", "places [x, y, z], one of each antenna"))
        };
        let (tx, rx) = (places(self.antennas("tx_m"), "tx_m")?, places(self.antennas("rx_m"), "rx_m")?);
        let mut count = |key: &str| {
            let value = self.radar().get(key).cloned().expect("nothing is missing");
            value
                .as_integer()
                .and_then(|count| usize::try_from(count).ok())
                .filter(|count| *count > 0)
                .ok_or_else(|| Error::setting(format!("radar.{key}"), value.to_string(), "a whole number of at least 1"))
        };
        Ok(Lengths { loops: count("loops_per_frame")?, samples: count("samples_per_chirp")?, tx, rx })
    }

    /// What the array itself says fills what is left open.
    ///
    /// # Errors
    /// More antennas than the board has; settings that neither the array nor anybody states.
    fn fill(&mut self, cube: &Cube, notes: &mut Vec<String>) -> Result<()> {
        let by_axis = |axis: Axis| cube.has(axis).then(|| cube.length(axis));
        let (tx, rx) = if cube.has(Axis::Antenna) {
            (None, None)
        } else {
            (by_axis(Axis::Tx).or_else(|| (!self.is_by_chirp).then_some(1)), Some(cube.length(Axis::Rx)))
        };
        self.refuse_more_than_the_board(cube, tx, rx)?;
        self.place_antennas(tx, rx, notes);
        let transmitters = self.antennas("tx_m").unwrap_or(1).max(1);
        let chirps = cube.length(Axis::Loop) * cube.length(Axis::Chirp);
        let loops = chirps / if cube.has(Axis::Chirp) { transmitters } else { 1 };
        let radar = self.radar();
        for (key, number) in [("frames", cube.frames()), ("samples_per_chirp", cube.samples()), ("loops_per_frame", loops)] {
            radar.entry(key).or_insert(Value::Integer(number as i64));
        }
        radar.entry("sampling").or_insert_with(|| Value::String(format!("{:?}", cube.sampling()).to_lowercase()));
        self.refuse_missing(&[])
    }

    /// Refuses an array of more antennas than the board has, where nothing else places them.
    fn refuse_more_than_the_board(&mut self, cube: &Cube, tx: Option<usize>, rx: Option<usize>) -> Result<()> {
        let Some(board) = self.board else { return Ok(()) };
        let of_board = [board.tx_half_wavelengths.len(), board.rx_half_wavelengths.len()];
        for (key, what, count, most) in [("tx_m", "transmitters", tx, of_board[0]), ("rx_m", "receivers", rx, of_board[1])] {
            let Some(count) = count.filter(|count| *count > most && !self.radar().contains_key(key)) else { continue };
            let found = format!("{} with {count} {what}", cube.describe());
            return Err(cube.wrong(found, format!("at most {most}, those of the {}", board.name)).with_hint(format!(
                "name the board of this capture with --board, correct --layout, or state the places with --set radar.{key}=[…]"
            )));
        }
        Ok(())
    }

    /// Refuses a radar of which something is not stated, all of it at once. `later`: what the file itself will say.
    fn refuse_missing(&mut self, later: &[&str]) -> Result<()> {
        let name = self.name.clone();
        let mut open = missing(self.radar());
        open.retain(|key| !later.contains(key));
        if open.is_empty() {
            return Ok(());
        }
        refuse_unknown(self.radar(), &name)?;
        let why = match &self.page {
            Some(page) => format!("{page} leaves this open"),
            None => "the file does not say this".into(),
        };
        let antennas = if open.iter().any(|key| key.ends_with("x_m")) { "; --board places antennas" } else { "" };
        let hint =
            format!("{why}: give each with --set radar.KEY=VALUE, or all in a TOML file with [radar] with --config{antennas}");
        Err(Error::field(&self.name, "radar", format!("without {}", open.join(", ")), "all of its settings").with_hint(hint))
    }

    fn finish(self, notes: &mut Vec<String>) -> Result<Radar> {
        finished(self.table, &self.name, notes)
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::{missing_files, numbered};

    #[test]
    fn names_are_in_the_order_of_their_numbers() {
        let mut names = ["frame_10.bin", "frame_9.bin", "frame_0.bin", "a.bin"];
        names.sort_by_cached_key(|name| numbered(name));
        assert_eq!(names, ["a.bin", "frame_0.bin", "frame_9.bin", "frame_10.bin"]);
    }

    #[test]
    fn missing_numbers_are_said_of_names_that_count_on() {
        let note = |names: &[String]| missing_files(&names.iter().map(PathBuf::from).collect::<Vec<_>>());
        let frames = |numbers: &[u64]| numbers.iter().map(|number| format!("s2/frame_{number}.bin")).collect::<Vec<_>>();
        let said = note(&frames(&[0, 1, 2, 3, 4, 6, 7, 8, 11])).unwrap();
        assert!(said.starts_with("3 numbers are missing in the names of the files, the first after s2/frame_4.bin: "), "{said}");
        assert_eq!(note(&frames(&[0, 1, 2, 3])), None);
        // Times, and names that differ otherwise.
        assert_eq!(note(&frames(&[100, 133, 167, 168, 200])), None);
        assert_eq!(note(&["a_1.bin", "b_3.bin", "b_4.bin"].map(String::from)), None);
        assert_eq!(note(&["a_1_2.bin".into(), "a_2_1.bin".into()]), None);
    }
}
