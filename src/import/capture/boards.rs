//! Boards whose antennas are known by name.
//!
//! Positions are in half wavelengths of the board's design frequency, x to the right and z up as the radar looks, in
//! the board's own numbering of transmitters and receivers.

use crate::error::{Error, Result};
use crate::radar::SPEED_OF_LIGHT;

/// A board: where its antennas are, and which receivers are fed the other way round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    pub name: &'static str,
    /// The document that the positions are taken from.
    pub source: &'static str,
    pub design_frequency_hz: f64,
    /// `[x, z]`.
    pub tx_half_wavelengths: &'static [[f64; 2]],
    pub rx_half_wavelengths: &'static [[f64; 2]],
    /// Fed from the opposite side: their samples are turned by half a turn.
    pub inverted_rx: &'static [usize],
}

const RX_LINE: &[[f64; 2]] = &[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]];
/// Transmitter 1 halfway between the two others and half a wavelength higher.
const TX_RAISED: &[[f64; 2]] = &[[0.0, 0.0], [2.0, 1.0], [4.0, 0.0]];
const PEOPLE_TRACKING: &str = "TI 3D People Tracking, chirp configurations: antGeometry0, antGeometry1, antPhaseRot";

/// Four AWR2243 that share their clocks.
pub const CASCADE: &str = "MMWCASRFEVM";

/// Every board that is known.
pub const BOARDS: &[Board] = &[
    raised("IWR1443BOOST", "TI user's guide SWRU518", 77.0e9),
    raised("AWR1243BOOST", "TI user's guide SWRU507", 77.0e9),
    raised("AWR1843BOOST", "TI user's guide SPRUIM4", 77.0e9),
    raised("AWR2243BOOST", "TI user's guide SPRUIT8", 77.0e9),
    raised("IWR6843ISK", "TI user's guide SWRU546; TI 3D People Tracking, antGeometry0 and antGeometry1", 62.0e9),
    Board {
        name: "IWR1642BOOST",
        source: "TI user's guide SWRU521",
        design_frequency_hz: 77.0e9,
        tx_half_wavelengths: &[[0.0, 0.0], [4.0, 0.0]],
        rx_half_wavelengths: RX_LINE,
        inverted_rx: &[],
    },
    Board {
        name: "IWR6843AOP",
        source: PEOPLE_TRACKING,
        design_frequency_hz: 62.0e9,
        tx_half_wavelengths: &[[0.0, 0.0], [2.0, -2.0], [0.0, -2.0]],
        rx_half_wavelengths: &[[1.0, -1.0], [1.0, 0.0], [0.0, -1.0], [0.0, 0.0]],
        inverted_rx: &[0, 2],
    },
    Board {
        name: "IWR6843ODS",
        source: PEOPLE_TRACKING,
        design_frequency_hz: 62.0e9,
        tx_half_wavelengths: &[[0.0, 0.0], [2.0, 0.0], [2.0, -2.0]],
        rx_half_wavelengths: &[[0.0, 0.0], [0.0, -1.0], [1.0, -1.0], [1.0, 0.0]],
        inverted_rx: &[1, 2],
    },
    Board {
        name: CASCADE,
        source: "TI user's guide SWRU553; TI cascade MATLAB examples of mmWave Studio, module_param.m: TI_Cascade_TX_position_azi, \
                 TI_Cascade_TX_position_ele, TI_Cascade_RX_position_azi, TI_Cascade_Antenna_DesignFreq",
        design_frequency_hz: 76.8e9,
        // Three of the master and of each slave in turn.
        tx_half_wavelengths: &[
            [11.0, 6.0],
            [10.0, 4.0],
            [9.0, 1.0],
            [32.0, 0.0],
            [28.0, 0.0],
            [24.0, 0.0],
            [20.0, 0.0],
            [16.0, 0.0],
            [12.0, 0.0],
            [8.0, 0.0],
            [4.0, 0.0],
            [0.0, 0.0],
        ],
        // Four of the master and of each slave in turn.
        rx_half_wavelengths: &[
            [11.0, 0.0],
            [12.0, 0.0],
            [13.0, 0.0],
            [14.0, 0.0],
            [50.0, 0.0],
            [51.0, 0.0],
            [52.0, 0.0],
            [53.0, 0.0],
            [46.0, 0.0],
            [47.0, 0.0],
            [48.0, 0.0],
            [49.0, 0.0],
            [0.0, 0.0],
            [1.0, 0.0],
            [2.0, 0.0],
            [3.0, 0.0],
        ],
        inverted_rx: &[],
    },
    Board {
        name: "BGT60TR13C",
        source: "Infineon data sheet BGT60TR13C: one transmitter, receivers 1 and 3 side by side, 2 and 3 one above the other",
        design_frequency_hz: 60.75e9,
        tx_half_wavelengths: &[[0.0, 0.0]],
        rx_half_wavelengths: &[[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]],
        inverted_rx: &[],
    },
    Board {
        name: "BGT60UTR11",
        source: "Infineon data sheet BGT60UTR11AIP: one transmitter, one receiver",
        design_frequency_hz: 60.75e9,
        tx_half_wavelengths: &[[0.0, 0.0]],
        rx_half_wavelengths: &[[0.0, 0.0]],
        inverted_rx: &[],
    },
];

/// Other names of the same boards.
const ALIASES: &[(&str, &str)] = &[
    ("AWR1443BOOST", "IWR1443BOOST"),
    ("IWR1843BOOST", "AWR1843BOOST"),
    ("AWR1642BOOST", "IWR1642BOOST"),
    ("IWR6843AOPEVM", "IWR6843AOP"),
    ("IWR6843ISKODS", "IWR6843ODS"),
    ("BGT60UTR11AIP", "BGT60UTR11"),
    ("MMWCAS", CASCADE),
    ("MMWCASRF", CASCADE),
];

const fn raised(name: &'static str, source: &'static str, design_frequency_hz: f64) -> Board {
    Board { name, source, design_frequency_hz, tx_half_wavelengths: TX_RAISED, rx_half_wavelengths: RX_LINE, inverted_rx: &[] }
}

impl Board {
    /// The board of a name as people write it: letters and digits count, `AWR` and `IWR` of one number are one board.
    pub fn named(name: &str) -> Result<&'static Self> {
        let plain: String = name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_uppercase();
        let known = ALIASES.iter().find(|(alias, _)| *alias == plain).map_or(plain.as_str(), |(_, board)| board);
        let exact = BOARDS.iter().find(|board| board.name == known);
        let started = || {
            let of_chip: Vec<_> =
                BOARDS.iter().filter(|board| plain.len() >= 7 && board.name.starts_with(plain.as_str())).collect();
            if let [only] = of_chip[..] { Some(only) } else { None }
        };
        exact.or_else(started).ok_or_else(|| Error::Usage {
            message: format!("no board `{name}`"),
            hint: Some(format!(
                "known are {}; give other antennas with --set radar.tx_m=[…] and --set radar.rx_m=[…]",
                BOARDS.iter().map(|board| board.name).collect::<Vec<_>>().join(", ")
            )),
        })
    }

    fn half_m(&self) -> f64 {
        SPEED_OF_LIGHT / self.design_frequency_hz / 2.0
    }

    /// Which transmitters an array of so many has, where nothing says so: of fewer than there are, those that are as high as the first
    /// come first, in their order, as in TI's configurations of two (`profile_2d.cfg` of the SDK: masks 1 and 4).
    pub fn senders(&self, count: usize) -> Vec<usize> {
        let places = self.tx_half_wavelengths;
        if count >= places.len() {
            return (0..count).collect();
        }
        let apart = |tx: usize| (places[tx][1] - places[0][1]).abs();
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by(|&a, &b| apart(a).total_cmp(&apart(b)));
        order.truncate(count);
        order.sort_unstable();
        order
    }

    /// Where a transmitter is, metres.
    pub fn tx_m(&self, tx: usize) -> Option<[f64; 3]> {
        self.tx_half_wavelengths.get(tx).map(|&[x, z]| [x * self.half_m(), 0.0, z * self.half_m()])
    }

    pub fn rx_m(&self, rx: usize) -> Option<[f64; 3]> {
        self.rx_half_wavelengths.get(rx).map(|&[x, z]| [x * self.half_m(), 0.0, z * self.half_m()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_transmitters_neither_is_raised_above_the_other() {
        for (name, count, wanted) in
            [("IWR6843ISK", 2, vec![0, 2]), ("IWR6843ISK", 3, vec![0, 1, 2]), ("IWR1642", 2, vec![0, 1]), ("AWR1843", 1, vec![0])]
        {
            assert_eq!(Board::named(name).unwrap().senders(count), wanted, "{count} of {name}");
        }
    }

    #[test]
    fn boards_are_found_as_people_write_them() {
        for (written, name) in [
            ("iwr6843isk", "IWR6843ISK"),
            ("IWR6843-AOP", "IWR6843AOP"),
            ("awr1642 boost", "IWR1642BOOST"),
            ("AWR1843", "AWR1843BOOST"),
        ] {
            assert_eq!(Board::named(written).unwrap().name, name);
        }
        // The chip alone has three boards: nobody chooses for the user.
        assert!(Board::named("IWR6843").unwrap_err().to_string().contains("no board `IWR6843`"));
    }

    #[test]
    fn the_virtual_array_of_the_isk_is_eight_in_a_row_and_four_above() {
        let board = Board::named("IWR6843ISK").unwrap();
        let mut rows: Vec<(i64, i64)> = Vec::new();
        for tx in board.tx_half_wavelengths {
            for rx in board.rx_half_wavelengths {
                rows.push(((tx[1] + rx[1]) as i64, (tx[0] + rx[0]) as i64));
            }
        }
        rows.sort_unstable();
        let wanted: Vec<_> = (0..8).map(|x| (0, x)).chain((2..6).map(|x| (1, x))).collect();
        assert_eq!(rows, wanted);
    }

    #[test]
    fn no_two_virtual_antennas_of_one_device_coincide() {
        for board in BOARDS.iter().filter(|board| board.name != CASCADE) {
            let mut places: Vec<_> = board
                .tx_half_wavelengths
                .iter()
                .flat_map(|tx| board.rx_half_wavelengths.iter().map(move |rx| [(tx[0] + rx[0]) as i64, (tx[1] + rx[1]) as i64]))
                .collect();
            let count = places.len();
            places.sort_unstable();
            places.dedup();
            assert_eq!(places.len(), count, "{}", board.name);
        }
    }
    /// Nine transmitters and sixteen receivers in a row make 86 places in a row, of which 144 − 86 are there twice.
    #[test]
    fn the_cascade_has_eighty_six_places_in_a_row() {
        let board = Board::named("MMWCAS-RF-EVM").unwrap();
        let level = board.tx_half_wavelengths.iter().filter(|tx| tx[1] == 0.0);
        let sums = level.flat_map(|tx| board.rx_half_wavelengths.iter().map(move |rx| (tx[0] + rx[0]) as i64));
        let mut places: Vec<i64> = sums.collect();
        assert_eq!(places.len(), 144);
        places.sort_unstable();
        places.dedup();
        assert_eq!((places.len(), places[0], places[85]), (86, 0, 85));
        let raised: Vec<f64> = board.tx_half_wavelengths.iter().map(|tx| tx[1]).filter(|height| *height > 0.0).collect();
        assert_eq!(raised, [6.0, 4.0, 1.0]);
    }
}
