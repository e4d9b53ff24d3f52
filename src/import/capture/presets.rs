//! Public data sets by name: a table of what their pages say (`presets.toml`).

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Table;

use super::Layout;
use crate::data::settings::{nearest, read_text};
use crate::error::{Error, Result};

const TABLE: &str = include_str!("presets.toml");
const WITHOUT_SAMPLES: &str = include_str!("presets_without_samples.toml");

/// A data set that cannot be imported, and why.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Refused {
    title: String,
    page: String,
    reason: String,
}

/// Letters and digits of a name alone: `K-Radar`, `k_radar` and `KRadar` are one.
fn plain(name: &str) -> String {
    name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_lowercase()
}

/// What the page of a data set says of its samples.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Preset {
    pub title: String,
    /// Where it says so.
    pub page: String,
    layout: String,
    /// Which of a file's arrays.
    pub variable: Option<String>,
    /// Of words alone: every file is one frame.
    #[serde(default)]
    pub frame_files: bool,
    /// What is to be known besides.
    #[serde(default)]
    pub notes: Vec<String>,
    pub board: Option<String>,
    /// Which of the board's transmitters send, in firing order; all where it is absent.
    pub transmitters: Option<Vec<usize>>,
    /// Settings of the radar.
    #[serde(default)]
    pub radar: Table,
}

impl Preset {
    /// A data set by its name or by what only its name begins with; letters and digits count, in capitals or not.
    ///
    /// # Errors
    /// A name that several begin with, that of a data set without raw samples, or one that the tables have not; the hint then names the
    /// one that looks most alike, and all.
    pub fn named(name: &str) -> Result<Self> {
        let written = plain(name);
        let mut all = Self::all();
        let keys = |is: &dyn Fn(&str) -> bool| all.keys().filter(|key| is(&plain(key))).cloned().collect::<Vec<_>>();
        let refused: BTreeMap<String, Refused> = read_text(WITHOUT_SAMPLES).expect("the table is tested");
        let is_named = |key: &str| key == written;
        let begins = |key: &str| !written.is_empty() && key.starts_with(&written);
        if let Some((_, Refused { title, page, reason })) = refused.iter().find(|(key, _)| is_named(&plain(key))) {
            return Err(Error::Usage {
                message: format!("{title} cannot be imported: {reason}"),
                hint: Some(format!(
                    "see {page}; other files of it are described with --layout, --board and --set radar.KEY=VALUE"
                )),
            });
        }
        let known = all.keys().cloned().collect::<Vec<_>>().join(", ");
        let (exact, mut begun) = (keys(&is_named), keys(&begins));
        begun.extend(refused.keys().filter(|key| begins(&plain(key))).cloned());
        let hint = match (&exact[..], &begun[..]) {
            ([only], _) | ([], [only]) => return all.remove(only).map_or_else(|| Self::named(only), Ok),
            ([], []) => {
                let nearest = nearest(&written, all.keys().chain(refused.keys()).map(String::as_str));
                let meant = nearest.map_or(String::new(), |nearest| format!("did you mean `{nearest}`? "));
                format!("{meant}Known are {known}; describe others with --layout, --board and --set radar.KEY=VALUE")
            }
            _ => format!("several begin with it: name one of {}", begun.join(", ")),
        };
        Err(Error::Usage { message: format!("no data set `{name}`"), hint: Some(hint) })
    }

    fn all() -> BTreeMap<String, Self> {
        read_text(TABLE).expect("the table is tested")
    }

    /// How the samples lie in the data set's files.
    ///
    /// # Errors
    /// A text that [`Layout::parse`] refuses.
    pub fn layout(&self) -> Result<Layout> {
        Layout::parse(&self.layout)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::{Path, PathBuf};

    use super::super::layout::Axis;
    use super::super::{Stated, boards::Board, open};
    use super::*;
    use crate::data::IfLayout;
    use crate::data::arrays::{Member, Values, write_npy, write_npz};

    #[test]
    fn every_preset_can_be_used_and_says_where_it_comes_from() {
        for (name, preset) in Preset::all() {
            preset.layout().unwrap();
            assert!(preset.page.starts_with("https://"), "{name}");
            let board = preset.board.as_deref().map(|board| Board::named(board).unwrap());
            for tx in preset.transmitters.iter().flatten() {
                assert!(board.is_none_or(|board| board.tx_m(*tx).is_some()), "{name}");
            }
        }
        assert!(Preset::named("nothing").unwrap_err().hint().unwrap().contains("uw_raw_adc"));
        let refused: BTreeMap<String, Refused> = read_text(WITHOUT_SAMPLES).unwrap();
        for (name, refused) in &refused {
            assert!(refused.page.starts_with("https://"), "{name}");
            let error = Preset::named(name).unwrap_err().to_string();
            assert_eq!(error, format!("{} cannot be imported: {}", refused.title, refused.reason));
            assert!(!Preset::all().contains_key(name), "{name}");
        }
    }

    #[test]
    fn names_are_found_as_their_papers_write_them_and_near_ones_are_suggested() {
        for (written, name) in [("mmMesh", "mmmesh"), ("HuPR", "hupr"), ("RADDet", "raddet"), ("CubeLearn", "cubelearn")] {
            assert_eq!(Preset::named(written).unwrap().title, Preset::all()[name].title);
        }
        for (written, name) in
            [("ColoRadar-Cascade", "coloradar_cascade"), ("RaDICaL indoor", "radical_indoor"), ("UW", "uw_raw_adc")]
        {
            assert_eq!(Preset::named(written).unwrap().title, Preset::all()[name].title);
        }
        for (written, name) in [("mmesh", "mmmesh"), ("K Radr", "k_radar")] {
            let hint = Preset::named(written).unwrap_err().hint().unwrap().to_string();
            assert!(hint.starts_with(&format!("did you mean `{name}`?")), "{hint}");
        }
        let hint = Preset::named("ColoRadar").unwrap_err().hint().unwrap();
        assert_eq!(hint, "several begin with it: name one of coloradar_cascade, coloradar_single_chip");
        for (written, part) in
            [("RADIal", "send at once"), ("K-Radar", "no raw samples"), ("RaDICaL outdoor", "indoor recordings alone")]
        {
            let error = Preset::named(written).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
        assert!(Preset::named("").is_err());
        assert!(Preset::all().keys().all(|name| *name == name.to_lowercase()));
    }

    const LOOPS: usize = 3;
    const SAMPLES: usize = 8;
    const FRAMES: usize = 2;

    /// What a page leaves open, and fewer loops and samples than it states.
    fn sets(preset: &Preset, tx: usize, rx: usize) -> Vec<String> {
        let row = |count: usize| (0..count).map(|at| format!("[{at}e-3, 0.0, 0.0]")).collect::<Vec<_>>().join(", ");
        let missing = [
            ("start_frequency_hz", "77e9".to_string()),
            ("slope_hz_per_s", "60e12".into()),
            ("sample_rate_hz", "4e6".into()),
            ("chirp_period_s", "60e-6".into()),
            ("frame_period_s", "0.1".into()),
            ("tx_m", format!("[{}]", row(tx))),
            ("rx_m", format!("[{}]", row(rx))),
        ];
        let has = |key: &str| preset.radar.contains_key(key) || preset.board.is_some() && key.ends_with("x_m");
        let mut sets: Vec<String> =
            missing.iter().filter(|(key, _)| !has(key)).map(|(key, value)| format!("radar.{key}={value}")).collect();
        sets.push(format!("radar.loops_per_frame={LOOPS}"));
        sets.push(format!("radar.samples_per_chirp={SAMPLES}"));
        sets
    }

    /// The place of a sample's I or Q, given by its number.
    fn number(place: [usize; 6], of: [usize; 6]) -> f32 {
        place.iter().zip(of).fold(0, |number, (at, length)| number * length + at) as f32
    }

    /// A preset's axes at a small size, and the place of each of its numbers.
    struct Small<'a> {
        preset: &'a Preset,
        layout: Layout,
        /// Transmitters, receivers, loops, samples.
        dims: [usize; 4],
        shape: Vec<usize>,
    }

    impl<'a> Small<'a> {
        fn of(preset: &'a Preset, dims: [usize; 4]) -> Self {
            let layout = preset.layout().unwrap();
            let [tx, rx, loops, samples] = dims;
            let length = |axis: &Axis| match axis {
                Axis::Frame => FRAMES,
                Axis::Tx => tx,
                Axis::Rx => rx,
                Axis::Loop => loops,
                Axis::Chirp => loops * tx,
                Axis::Antenna => tx * rx,
                Axis::Sample => samples / length_of_group(&layout),
                Axis::Lane | Axis::Iq => 2,
            };
            let shape = layout.axes.iter().map(length).collect();
            Self { preset, layout, dims, shape }
        }

        /// Lengths of the axes of [`Self::place`].
        fn lengths(&self) -> [usize; 6] {
            let [tx, rx, loops, samples] = self.dims;
            [FRAMES, tx, rx, loops, samples, 2]
        }

        fn place(&self, mut rank: usize, file: usize) -> [usize; 6] {
            let [tx, rx, ..] = self.dims;
            let mut at = [file, 0, 0, 0, 0, 0];
            for (axis, &length) in self.layout.axes.iter().zip(&self.shape).rev() {
                let index = rank % length;
                rank /= length;
                match axis {
                    Axis::Frame => at[0] = index,
                    Axis::Tx => at[1] = index,
                    Axis::Rx => at[2] = index,
                    Axis::Loop => at[3] = index,
                    Axis::Chirp => (at[1], at[3]) = (index % tx, index / tx),
                    Axis::Antenna => (at[1], at[2]) = (index / rx, index % rx),
                    Axis::Sample => at[4] += index * length_of_group(&self.layout),
                    Axis::Lane => at[4] += index,
                    Axis::Iq => at[5] = index,
                }
            }
            at
        }

        /// All numbers of a file; `part`: of I or Q, where they are no axis.
        fn values(&self, file: usize, part: usize) -> Vec<f32> {
            let place = |rank: usize| {
                let mut at = self.place(rank, file);
                at[5] += part;
                number(at, self.lengths())
            };
            (0..self.shape.iter().product()).map(place).collect()
        }

        fn write_words(&self, folder: &Path, file: usize) -> Vec<PathBuf> {
            let bytes: Vec<u8> = self.values(file, 0).iter().flat_map(|value| (*value as i16).to_le_bytes()).collect();
            let pieces = if self.preset.frame_files { FRAMES } else { 1 };
            let write = |(piece, bytes): (usize, &[u8])| {
                let path = folder.join(format!("frame_{}.bin", 9 + piece));
                fs::write(&path, bytes).unwrap();
                path
            };
            bytes.chunks(bytes.len() / pieces).enumerate().map(write).collect()
        }

        fn write_array(&self, path: PathBuf, file: usize) -> PathBuf {
            let all = self.values(file, 0);
            if self.layout.place(Axis::Iq).is_some() {
                write_npy(&path, &self.shape, Values::F32(&all)).unwrap();
                return path;
            }
            let pairs = all.iter().zip(self.values(file, 1)).map(|(&re, im)| num_complex::Complex32::new(re, im));
            let pairs: Vec<_> = pairs.collect();
            let values = Values::Complex64(&pairs);
            if let Some(variable) = &self.preset.variable {
                let path = path.with_extension("npz");
                write_npz(&path, &[Member { name: variable, shape: self.shape.clone(), values }]).unwrap();
                return path;
            }
            write_npy(&path, &self.shape, values).unwrap();
            path
        }
    }

    /// Files of a preset's layout, in the types that its data set has; where several are the frames, one for each.
    fn files(folder: &Path, preset: &Preset, dims: [usize; 4]) -> (Vec<PathBuf>, [usize; 6]) {
        let small = Small::of(preset, dims);
        let is_words = preset.frame_files || small.layout.place(Axis::Lane).is_some();
        let several = if small.layout.place(Axis::Frame).is_some() { 1 } else { FRAMES };
        let write = |file: usize| {
            if is_words {
                small.write_words(folder, file)
            } else {
                vec![small.write_array(folder.join(format!("frame_{}.npy", 9 + file)), file)]
            }
        };
        ((0..several).flat_map(write).collect(), small.lengths())
    }

    fn length_of_group(layout: &Layout) -> usize {
        if layout.place(Axis::Lane).is_some() { 2 } else { 1 }
    }

    #[test]
    fn a_small_file_of_every_layout_comes_back_sample_by_sample() {
        for (name, preset) in Preset::all() {
            let folder = tempfile::tempdir().unwrap();
            let board = preset.board.as_deref().map(|board| Board::named(board).unwrap());
            let rx = board.map_or(4, |board| board.rx_half_wavelengths.len());
            let tx =
                preset.transmitters.as_ref().map(Vec::len).or(board.map(|board| board.tx_half_wavelengths.len())).unwrap_or(2);
            let (files, of) = files(folder.path(), &preset, [tx, rx, LOOPS, SAMPLES]);
            let stated = Stated { sets: sets(&preset, tx, rx), preset: Some(preset.clone()), ..Stated::default() };
            // Several files by their folder, too.
            let sources = if files.len() > 1 { vec![folder.path().to_path_buf()] } else { files };
            let mut capture = open(&sources, &stated).unwrap_or_else(|error| panic!("{name}: {error} {:?}", error.hint()));
            assert_eq!(capture.radar.dims(), [FRAMES, tx, rx, LOOPS, SAMPLES], "{name}");
            capture.radar.check("radar").unwrap();
            for (key, value) in
                preset.radar.iter().filter(|(key, _)| !["loops_per_frame", "samples_per_chirp"].contains(&key.as_str()))
            {
                let table = toml::Table::try_from(&capture.radar).unwrap();
                assert_eq!(table[key].as_float(), value.as_float(), "{name}: {key}");
            }
            let is_words = capture.layout == IfLayout::Codes;
            assert_eq!(is_words, preset.frame_files || preset.layout.contains("lane"), "{name}");
            for frame in 0..FRAMES {
                let found = (capture.frame)(frame).unwrap();
                for rank in 0..tx * rx * LOOPS * SAMPLES {
                    let (rest, sample) = (rank / SAMPLES, rank % SAMPLES);
                    let (rest, index) = (rest / LOOPS, rest % LOOPS);
                    let place = [frame, rest / rx, rest % rx, index, sample];
                    let value = found.sample(place[1], place[2], index, sample);
                    let wanted = [0, 1].map(|part| {
                        let [a, b, c, d, e] = place;
                        let wanted = number([a, b, c, d, e, part], of);
                        if is_words { f32::from(wanted as i16) } else { wanted }
                    });
                    assert_eq!([value.re, value.im], wanted, "{name}: {place:?}");
                }
            }
            assert!(capture.notes.iter().any(|note| note.contains(&preset.page)), "{name}");
        }
    }

    #[test]
    fn a_frame_of_another_length_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let preset = Preset::named("coloradar_single_chip").unwrap();
        let (files, _) = files(folder.path(), &preset, [3, 4, LOOPS, SAMPLES]);
        let whole = fs::read(&files[1]).unwrap();
        fs::write(&files[1], &whole[..whole.len() - 2]).unwrap();
        let stated = Stated { sets: sets(&preset, 3, 4), preset: Some(preset), ..Stated::default() };
        let error = open(&[folder.path().into()], &stated).err().unwrap();
        assert!(error.to_string().contains("frame_10.bin") && error.to_string().contains("one frame"), "{error}");
    }
}
