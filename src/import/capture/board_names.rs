//! Boards by their names, as people write them.

use super::boards::{BOARDS, Board, CASCADE};
use crate::error::{Error, Result};

/// Other names of the same boards, as [`key`] writes them. The MMWCAS-DSP-EVM is the capture card of the MMWCAS-RF-EVM, the TIDEP-01012
/// TI's reference design of both.
const ALIASES: &[(&str, &str)] = &[
    ("WR6843ISKODS", "WR6843ODS"),
    ("BGT60UTR11AIP", "BGT60UTR11"),
    ("MMWCAS", "MMWCASRF"),
    ("MMWCASDSP", "MMWCASRF"),
    ("TIDEP01012", "MMWCASRF"),
];

/// The shortest name that can stand for the only board of its device.
const DEVICE: usize = "WR1843".len();

/// Devices of a cascade, as [`key`] writes them.
const CASCADED: [&str; 2] = ["WR2243", "WR2243P"];

/// What boards of one array share: letters and digits of a name alone, without the A, I or x of TI's device names and without the words
/// for a board.
fn key(name: &str) -> String {
    let mut plain: String = name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_uppercase();
    if plain.get(1..).is_some_and(|rest| rest.starts_with("WR")) && plain.starts_with(['A', 'I', 'X']) {
        plain.remove(0);
    }
    if let Some(rest) = ["MMWAVECAS", "MMWAVCAS"].iter().find_map(|own| plain.strip_prefix(own)) {
        plain = format!("MMWCAS{rest}");
    }
    while let Some(shorter) = ["EVM", "BOOST"].iter().find_map(|end| plain.strip_suffix(end)) {
        plain.truncate(shorter.len());
    }
    plain
}

/// What a name says of a cascade other than its board's own name.
struct Cascade {
    /// Whether anything in it does.
    is_meant: bool,
    /// Whether it is the one of four AWR2243.
    is_known: bool,
}

impl Cascade {
    /// Of a name as [`key`] writes it: `AWR2243 cascade`, `4-chip cascade`, `4x AWR2243`.
    fn of(plain: &str) -> Self {
        let mut rest = plain.replace("FOUR", "4");
        let length = rest.len();
        for word in ["CASCADED", "CASCADE", "CHIPS", "CHIP", "DEVICES", "DEVICE", "IMAGING", "RADAR"] {
            rest = rest.replace(word, "");
        }
        // A 4 at the end may be the device's own, as of the AWR2944.
        let ends: &[&str] = if rest.len() < length { &["X4", "4"] } else { &["X4"] };
        let uncounted = ["4X", "4"].iter().find_map(|count| rest.strip_prefix(count));
        let uncounted = uncounted.or_else(|| ends.iter().find_map(|count| rest.strip_suffix(count)));
        let device = key(uncounted.unwrap_or(&rest));
        let is_cascaded = plain.contains("CASCADE");
        let is_counted = uncounted.is_some() && device.starts_with("WR");
        let is_known = CASCADED.contains(&device.as_str()) || is_cascaded && ["", "TI"].contains(&device.as_str());
        Self {
            is_meant: is_cascaded || is_counted || plain.starts_with("MMWCAS"),
            is_known: is_known && (is_cascaded || is_counted),
        }
    }
}

impl Board {
    /// The board of a name as people write it, with A, I or x before it and BOOST or EVM behind it or not. A device alone stands for its
    /// board where it has only one.
    ///
    /// # Errors
    /// A name of no board, or of a device that is on several.
    pub fn named(name: &str) -> Result<&'static Self> {
        let plain = key(name);
        let plain = ALIASES.iter().find(|(alias, _)| *alias == plain).map_or(plain.as_str(), |(_, board)| board);
        let cascade = Cascade::of(plain);
        let is_named = |board: &&Self| if cascade.is_known { board.name == CASCADE } else { key(board.name) == plain };
        if let Some(exact) = BOARDS.iter().find(is_named) {
            return Ok(exact);
        }
        let is_of_device = |board: &&Self| plain.len() >= DEVICE && key(board.name).starts_with(plain);
        let names = |boards: &[&Self]| boards.iter().map(|board| board.name).collect::<Vec<_>>().join(", ");
        let (message, known) = match BOARDS.iter().filter(is_of_device).collect::<Vec<_>>()[..] {
            [only] => return Ok(only),
            [] => (format!("no board `{name}`"), names(&BOARDS.iter().collect::<Vec<_>>())),
            ref several => (format!("no board `{name}`: the device is on {} boards", several.len()), names(several)),
        };
        let meant = if cascade.is_meant { format!("four cascaded AWR2243 are the {CASCADE}; ") } else { String::new() };
        Err(Error::Usage {
            message,
            hint: Some(format!(
                "{meant}known are {known}; give other antennas with --set radar.tx_m=[…] and --set radar.rx_m=[…]"
            )),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boards_are_found_as_people_write_them() {
        for (written, name) in [
            ("iwr6843isk", "IWR6843ISK"),
            ("IWR6843-AOP", "IWR6843AOP"),
            ("awr1642 boost", "IWR1642BOOST"),
            ("AWR1843", "AWR1843BOOST"),
            ("IWR6843ISK-ODS", "IWR6843ODS"),
            ("BGT60UTR11AIP", "BGT60UTR11"),
            ("MMWCAS-DSP-EVM", CASCADE),
        ] {
            assert_eq!(Board::named(written).unwrap().name, name);
        }
        // The chip alone has three boards: nobody chooses for the user.
        for written in ["IWR6843", "awr6843"] {
            let error = Board::named(written).unwrap_err();
            assert!(error.to_string().contains(&format!("no board `{written}`")), "{error}");
            assert!(error.hint().unwrap().starts_with("known are IWR6843ISK, IWR6843AOP, IWR6843ODS;"), "{error}");
        }
        // Boards of other arrays.
        for written in ["AWR1843AOP", "AWR1642BOOST-ODS", "BGT60", "WR", ""] {
            assert!(Board::named(written).is_err(), "{written}");
        }
    }

    #[test]
    fn a_cascade_is_found_as_people_write_it_or_named() {
        for written in [
            "MMWCAS-RF-EVM",
            "mmwcas_rf",
            "MMWCAS",
            "MMWCAS-DSP",
            "mmWaveCAS-RF-EVM",
            "MMWAVCAS-RF-EVM",
            "TIDEP-01012",
            "cascade",
            "TI cascade",
            "AWR2243 cascade",
            "AWR2243P-cascade-EVM",
            "cascaded AWR2243",
            "AWR2243 4-chip cascade",
            "four-device cascade",
            "cascade imaging radar",
            "4x AWR2243",
            "AWR2243 x4",
            "four AWR2243",
        ] {
            assert_eq!(Board::named(written).unwrap().name, "MMWCAS-RF-EVM", "{written}");
        }
        // Cascades of other devices, or of two: nobody chooses for the user.
        for written in ["AWR1243 cascade", "2-chip cascade", "AWR2243 two-chip cascade", "4x AWR1843", "MMWCAS2"] {
            let error = Board::named(written).unwrap_err();
            assert!(error.to_string().ends_with(&format!("no board `{written}`")), "{error}");
            assert!(error.hint().unwrap().starts_with("four cascaded AWR2243 are the MMWCAS-RF-EVM; known are "), "{error}");
        }
        assert_eq!(Board::named("AWR2243").unwrap().name, "AWR2243BOOST");
        for written in ["4", "AWR2944", "four"] {
            assert!(Board::named(written).unwrap_err().hint().unwrap().starts_with("known are IWR1443BOOST, "), "{written}");
        }
    }

    /// Every name, of every maker's line, with and without the word for a board.
    #[test]
    fn a_board_of_ti_is_found_by_every_prefix_and_suffix() {
        for board in BOARDS {
            let plain = key(board.name);
            let prefixes: &[&str] = if plain.starts_with("WR") { &["A", "I", "x", "X"] } else { &[""] };
            for (prefix, suffix) in prefixes.iter().flat_map(|prefix| ["", "BOOST", "EVM", "-EVM"].map(|suffix| (prefix, suffix)))
            {
                let written = format!("{prefix}{plain}{suffix}");
                assert_eq!(Board::named(&written).unwrap().name, board.name, "{written}");
                assert_eq!(Board::named(&written.to_lowercase()).unwrap().name, board.name, "{written}");
            }
        }
    }
}
