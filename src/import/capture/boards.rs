//! Boards whose antennas are known by name.
//!
//! Positions are in half wavelengths of the board's design frequency, x to the right and z up as the radar looks, in
//! the board's own numbering of transmitters and receivers.

use std::path::Path;

use crate::error::{Error, Result};
use crate::radar::{Radar, SPEED_OF_LIGHT};

/// Frequencies that a device sweeps, and the document that states them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    pub low_hz: f64,
    pub high_hz: f64,
    pub source: &'static str,
}

/// A board: where its antennas are, and which receivers are fed the other way round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    pub name: &'static str,
    /// The document that the positions are taken from.
    pub source: &'static str,
    pub design_frequency_hz: f64,
    pub band: Band,
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

const IWR6843: &str = "TI data sheet IWR6843, SWRS219, section Features, page 1";
/// What the maker's own driver lets the device sweep.
const AVIAN: &str = "Infineon Radar SDK, lib_avian, ifxAvian_DeviceTraits.cpp: allowed_rf_range";

/// Four AWR2243 that share their clocks.
pub const CASCADE: &str = "MMWCAS-RF-EVM";

const fn at_77(source: &'static str) -> Band {
    Band { low_hz: 76.0e9, high_hz: 81.0e9, source }
}

const fn at_60(source: &'static str) -> Band {
    Band { low_hz: 60.0e9, high_hz: 64.0e9, source }
}

/// Every board that is known.
pub const BOARDS: &[Board] = &[
    raised("IWR1443BOOST", "TI user's guide SWRU518", 77.0e9, at_77("TI data sheet IWR1443, SWRS211, section Features, page 1")),
    raised("AWR1243BOOST", "TI user's guide SWRU507", 77.0e9, at_77("TI data sheet AWR1243, SWRS188, section Features, page 1")),
    raised("AWR1843BOOST", "TI user's guide SPRUIM4", 77.0e9, at_77("TI data sheet AWR1843, SWRS222, section Features, page 1")),
    raised("AWR2243BOOST", "TI user's guide SPRUIT8", 77.0e9, at_77("TI data sheet AWR2243, SWRS223, section Features, page 1")),
    raised("IWR6843ISK", "TI user's guide SWRU546; TI 3D People Tracking, antGeometry0 and antGeometry1", 62.0e9, at_60(IWR6843)),
    Board {
        name: "IWR1642BOOST",
        source: "TI user's guide SWRU521",
        design_frequency_hz: 77.0e9,
        band: at_77("TI data sheet IWR1642, SWRS212, section Features, page 1"),
        tx_half_wavelengths: &[[0.0, 0.0], [4.0, 0.0]],
        rx_half_wavelengths: RX_LINE,
        inverted_rx: &[],
    },
    Board {
        name: "IWR6843AOP",
        source: PEOPLE_TRACKING,
        design_frequency_hz: 62.0e9,
        band: at_60("TI data sheet IWR6843AOP, SWRS237, section Features, page 1"),
        tx_half_wavelengths: &[[0.0, 0.0], [2.0, -2.0], [0.0, -2.0]],
        rx_half_wavelengths: &[[1.0, -1.0], [1.0, 0.0], [0.0, -1.0], [0.0, 0.0]],
        inverted_rx: &[0, 2],
    },
    Board {
        name: "IWR6843ODS",
        source: PEOPLE_TRACKING,
        design_frequency_hz: 62.0e9,
        band: at_60(IWR6843),
        tx_half_wavelengths: &[[0.0, 0.0], [2.0, 0.0], [2.0, -2.0]],
        rx_half_wavelengths: &[[0.0, 0.0], [0.0, -1.0], [1.0, -1.0], [1.0, 0.0]],
        inverted_rx: &[1, 2],
    },
    Board {
        name: CASCADE,
        source: "TI user's guide SWRU553; TI cascade MATLAB examples of mmWave Studio, module_param.m: TI_Cascade_TX_position_azi, \
                 TI_Cascade_TX_position_ele, TI_Cascade_RX_position_azi, TI_Cascade_Antenna_DesignFreq",
        design_frequency_hz: 76.8e9,
        band: at_77("TI data sheet AWR2243, SWRS223, section Features, page 1"),
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
        source: "Infineon data sheet BGT60TR13C: one transmitter, receivers 1 and 3 side by side, 2 and 3 one above the other; seen from \
                 the front; left/right and up/down to be checked with a target",
        design_frequency_hz: 60.75e9,
        band: Band { low_hz: 58.0e9, high_hz: 63.5e9, source: AVIAN },
        tx_half_wavelengths: &[[0.0, 0.0]],
        rx_half_wavelengths: &[[0.0, 1.0], [1.0, 0.0], [1.0, 1.0]],
        inverted_rx: &[],
    },
    Board {
        name: "BGT60UTR11",
        source: "Infineon data sheet BGT60UTR11AIP: one transmitter, one receiver",
        design_frequency_hz: 60.75e9,
        band: Band { low_hz: 57.4e9, high_hz: 63.0e9, source: AVIAN },
        tx_half_wavelengths: &[[0.0, 0.0]],
        rx_half_wavelengths: &[[0.0, 0.0]],
        inverted_rx: &[],
    },
];

const fn raised(name: &'static str, source: &'static str, design_frequency_hz: f64, band: Band) -> Board {
    let (tx_half_wavelengths, rx_half_wavelengths) = (TX_RAISED, RX_LINE);
    Board { name, source, design_frequency_hz, band, tx_half_wavelengths, rx_half_wavelengths, inverted_rx: &[] }
}

impl Board {
    /// Refuses a chirp that starts or ends outside of the device's band. Frequencies count in kilohertz, as Infineon's driver holds them;
    /// the steps of TI's registers (53.6 Hz at 77 GHz) round to them.
    pub fn hold_band(&self, radar: &Radar, source: &Path) -> Result<()> {
        let gigahertz = |hz: f64| (hz / 1e3).round() / 1e6;
        let Band { low_hz, high_hz, source: sheet } = self.band;
        let last_s = radar.samples_per_chirp.saturating_sub(1) as f64 / radar.sample_rate_hz;
        for (key, hz) in [
            ("radar.start_frequency_hz", radar.start_frequency_hz),
            ("frequency at the last sample", radar.carrier_hz() + radar.slope_hz_per_s * last_s),
        ] {
            if !(gigahertz(low_hz)..=gigahertz(high_hz)).contains(&gigahertz(hz)) {
                let (low, high) = (gigahertz(low_hz), gigahertz(high_hz));
                let expected = format!("{low} to {high} GHz, the band of the {} ({sheet})", self.name);
                return Err(Error::field(source, key, format!("{} GHz", gigahertz(hz)), expected).with_hint(
                    "name the board of this capture with --board, or take the description of this capture; of a board that is not known \
                     state --set radar.tx_m=[…] and --set radar.rx_m=[…] instead",
                ));
            }
        }
        Ok(())
    }

    /// Whether it sends the samples of all receivers side by side on four lanes, as xWR12xx, xWR14xx and xWR22xx do (SWRA581B); TI's others
    /// send one receiver after the other on two.
    pub fn interleaves(&self) -> bool {
        let is_of_ti = ["AWR", "IWR"].iter().any(|maker| self.name.starts_with(maker));
        is_of_ti && self.name.get(3..5).is_some_and(|line| ["12", "14", "22"].contains(&line))
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

    /// Where a receiver is, metres; none for a number that the board has not.
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
    fn a_chirp_outside_of_the_band_of_its_device_is_refused_to_the_kilohertz() {
        let file = Path::new("adc_data.bin");
        for board in BOARDS {
            let Band { low_hz, high_hz, .. } = board.band;
            // The whole band, while sampling.
            let slope_hz_per_s = (high_hz - low_hz) * 1e6 / 63.0;
            let whole = Radar {
                start_frequency_hz: low_hz,
                slope_hz_per_s,
                sample_rate_hz: 1e6,
                samples_per_chirp: 64,
                adc_start_s: 0.0,
                ..Radar::small(1)
            };
            board.hold_band(&whole, file).unwrap();
            let falling = Radar { start_frequency_hz: high_hz, slope_hz_per_s: -slope_hz_per_s, ..whole.clone() };
            board.hold_band(&falling, file).unwrap();
            for (key, radar) in [
                ("`radar.start_frequency_hz`", Radar { start_frequency_hz: low_hz - 1e3, ..whole.clone() }),
                ("`frequency at the last sample`", Radar { start_frequency_hz: low_hz + 1e3, ..whole.clone() }),
                ("`radar.start_frequency_hz`", Radar { start_frequency_hz: high_hz + 1e3, ..falling.clone() }),
            ] {
                let error = board.hold_band(&radar, file).unwrap_err();
                assert!(error.to_string().starts_with(&format!("adc_data.bin: {key} is ")), "{error}");
                assert!(
                    error.to_string().ends_with(&format!("the band of the {} ({})", board.name, board.band.source)),
                    "{error}"
                );
            }
        }
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

    /// Receivers 1 and 3 tell azimuth, as Infineon's example of range and angle takes them (`rx_mask` 5), and 2 and 3 elevation.
    #[test]
    fn the_pairs_of_the_bgt60tr13c_are_those_of_its_sheet() {
        let board = Board::named("BGT60TR13C").unwrap();
        let apart = |a: usize, b: usize| {
            let [a, b] = [a, b].map(|number| board.rx_half_wavelengths[number - 1]);
            [(a[0] - b[0]).abs(), (a[1] - b[1]).abs()]
        };
        assert_eq!((apart(1, 3), apart(2, 3)), ([1.0, 0.0], [0.0, 1.0]));
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
