//! How well frames in a wrong order fit: the law by which the best placement is no chance.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::coarse::Grid;
use crate::diagnosis::statistics::gumbel_tail;

/// Orders that are drawn: enough for two moments of a law, not for its tail, which is Gumbel's.
const ORDERS: usize = 60;
/// Pieces that keep their order inside, so that the speed of a change stays what it is.
const PIECES: usize = 8;

/// Largest gain of the recording's own order, and the chance that another order of it has as much: blocks of frames are permuted, the
/// search is the same, and Gumbel's law (that of a maximum) goes through their largest gains.
pub struct Chance {
    pub gain: f64,
    /// Mean over the orders.
    pub shuffled: f64,
    pub p_value: f64,
}

impl Chance {
    pub fn of(grid: &Grid) -> Self {
        let own: Vec<usize> = (0..grid.frames.len()).collect();
        let length = own.len().div_ceil(PIECES).max(1);
        let mut random = ChaCha8Rng::seed_from_u64(0);
        let mut gains = vec![];
        // Few pieces have few orders.
        for _ in 0..10 * ORDERS {
            let mut pieces: Vec<&[usize]> = own.chunks(length).collect();
            pieces.shuffle(&mut random);
            let order = pieces.concat();
            if order != own {
                gains.push(grid.largest(&order));
            }
            if gains.len() == ORDERS {
                break;
            }
        }
        let gain = grid.largest(&own);
        let shuffled = gains.iter().sum::<f64>() / gains.len().max(1) as f64;
        Self { gain, shuffled, p_value: if gain > 0.0 { gumbel_tail(gain, gains) } else { 1.0 } }
    }
}
