//! Which antennas of a TI board a radar's are, and how the samples go out on its lanes.

use crate::error::{Error, Result};
use crate::import::capture::boards::Board;
use crate::import::capture::lanes::Lanes;
use crate::radar::{Radar, Sampling};

/// Farthest that an antenna may be from the board's, metres: a fifth of half a wavelength at 77 GHz, less than any two
/// antennas of a board are apart.
const SAME_M: f64 = 0.4e-3;

/// What a capture of this radar would be wired like.
pub struct Wiring {
    pub lanes: Lanes,
    /// Numbers of the transmitters in firing order, and of the receivers, ascending.
    pub tx: Vec<usize>,
    pub rx: Vec<usize>,
    /// `[rx]`: whose samples the import turns by half a turn.
    pub inverted: Vec<bool>,
    /// The chip as mmWave Studio writes it, such as `iwr6843`.
    pub device: String,
}

impl Wiring {
    /// Of a board, whose antennas the radar's must be up to a shift; without one, transmitters and receivers are numbered
    /// as they come. `carries_antennas`: the layout holds their places itself.
    ///
    /// # Errors
    /// A board of another maker, antennas that the board has not, receivers in another order than its own, and chirps that
    /// do not fill the lanes.
    pub fn of(radar: &Radar, board: Option<&Board>, carries_antennas: bool, notes: &mut Vec<String>) -> Result<Self> {
        let lanes = lanes(radar.sampling, board)?;
        if radar.sampling == Sampling::Complex && !lanes.interleaved && !radar.samples_per_chirp.is_multiple_of(lanes.count) {
            let expected = format!("a multiple of {}: one sample for each lane", lanes.count);
            return Err(Error::setting("radar.samples_per_chirp", radar.samples_per_chirp, expected)
                .with_hint("export to npz, or for a board with interleaved lanes (--board IWR1443BOOST)"));
        }
        let (tx, rx, inverted, device) = match board {
            Some(board) => {
                let (tx, tx_shift) = numbers(&radar.tx_m, &|index| board.tx_m(index)).ok_or_else(|| other("tx_m", board))?;
                let (rx, rx_shift) = numbers(&radar.rx_m, &|index| board.rx_m(index)).ok_or_else(|| other("rx_m", board))?;
                if !rx.is_sorted() {
                    let expected = "ascending numbers: the lanes carry receivers in the board's order";
                    return Err(Error::setting("radar.rx_m", format!("receivers {rx:?} of the {}", board.name), expected));
                }
                if !carries_antennas && [tx_shift, rx_shift].as_flattened().iter().any(|shift| shift.abs() > 1e-9) {
                    notes.push(format!(
                        "transmitters are {tx_shift:.4?} m and receivers {rx_shift:.4?} m from where --board {} puts them: only \
                         their places among each other come back",
                        board.name
                    ));
                }
                let inverted = rx.iter().map(|index| board.inverted_rx.contains(index)).collect();
                (tx, rx, inverted, board.name.chars().take(7).collect::<String>().to_lowercase())
            }
            None => {
                let device = if radar.carrier_hz() > 70e9 { "awr1843" } else { "iwr6843" };
                let wired =
                    format!("no board was named: wired like an {device} (two lanes), with transmitters numbered in firing order");
                notes.push(match carries_antennas {
                    true => wired,
                    false => format!(
                        "{wired}; antenna positions are not carried, give --set radar.tx_m and radar.rx_m to the import, and no --board"
                    ),
                });
                let all = |count: usize| (0..count).collect::<Vec<_>>();
                (all(radar.tx_m.len()), all(radar.rx_m.len()), vec![false; radar.rx_m.len()], device.to_string())
            }
        };
        // The masks of a capture have 16 bits; the largest boards have four of each.
        for (key, highest) in [("radar.tx_m", tx.iter().max()), ("radar.rx_m", rx.iter().max())] {
            if let Some(&highest) = highest.filter(|&&highest| highest > 3) {
                let expected = "at most 4 antennas, as many as one device has";
                return Err(Error::setting(key, format!("{} antennas", highest + 1), expected)
                    .with_hint("captures of several devices are not written; export to npz"));
            }
        }
        Ok(Self { lanes, tx, rx, inverted, device })
    }
}

/// Four lanes with the receivers side by side, or two lanes with one receiver after the other, as without a board.
fn lanes(sampling: Sampling, board: Option<&Board>) -> Result<Lanes> {
    let chip = board.map_or("AWR1843", |board| board.name);
    if !["AWR", "IWR"].iter().any(|maker| chip.starts_with(maker)) {
        return Err(Error::Usage {
            message: format!("--board {chip}: no board of TI that a DCA1000 captures"),
            hint: Some("a DCA1000 captures boards of one device of TI only; leave out --board, or export to npz".into()),
        });
    }
    let interleaved = board.is_some_and(Board::interleaves);
    Ok(Lanes { count: if interleaved { 4 } else { 2 }, interleaved, q_first: false, sampling })
}

fn other(key: &str, board: &Board) -> Error {
    Error::setting(format!("radar.{key}"), "another array", format!("antennas of the {} up to a shift", board.name))
        .with_hint("name the board that was simulated, or leave out --board")
}

/// The board's numbers of these places, and how far they are from the board's own.
fn numbers(places: &[[f64; 3]], board: &dyn Fn(usize) -> Option<[f64; 3]>) -> Option<(Vec<usize>, [f64; 3])> {
    let known: Vec<[f64; 3]> = (0..).map_while(board).collect();
    let less = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|axis| a[axis] - b[axis]) };
    let near = |a: [f64; 3], b: [f64; 3]| less(a, b).iter().all(|difference| difference.abs() < SAME_M);
    known.iter().find_map(|&first| {
        let shift = less(places[0], first);
        let number = |place: &[f64; 3]| known.iter().position(|&other| near(less(*place, shift), other));
        let numbers = places.iter().map(number).collect::<Option<Vec<_>>>()?;
        Some((numbers, shift))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_firing_order_of_a_board_is_found_up_to_a_shift() {
        let mut notes = Vec::new();
        let board = Board::named("AWR1843").unwrap();
        let wiring = Wiring::of(&Radar::mmmesh(1), Some(board), false, &mut notes).unwrap();
        assert_eq!((wiring.tx, wiring.rx, wiring.device.as_str()), (vec![0, 2, 1], vec![0, 1, 2, 3], "awr1843"));
        assert!(notes[0].contains("only their places among each other"), "{notes:?}");
        let one = Radar { tx_m: vec![[0.0; 3], [0.001, 0.0, 0.0]], ..Radar::mmmesh(1) };
        assert!(
            Wiring::of(&one, Some(board), false, &mut notes).err().unwrap().to_string().contains("`radar.tx_m` is another array")
        );
    }

    #[test]
    fn the_chip_decides_the_lanes() {
        for (name, count, interleaved) in
            [("IWR1443", 4, true), ("AWR2243BOOST", 4, true), ("IWR6843ISK", 2, false), ("IWR1642BOOST", 2, false)]
        {
            let found = lanes(Sampling::Complex, Some(Board::named(name).unwrap())).unwrap();
            assert_eq!((found.count, found.interleaved, found.q_first), (count, interleaved, false), "{name}");
        }
        assert!(lanes(Sampling::Real, Some(Board::named("BGT60TR13C").unwrap())).is_err());
        let odd = Radar { samples_per_chirp: 85, ..Radar::mmmesh(1) };
        assert!(Wiring::of(&odd, None, false, &mut vec![]).err().unwrap().to_string().contains("a multiple of 2"));
    }
}
