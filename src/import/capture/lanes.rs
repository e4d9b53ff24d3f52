//! How the samples of a chirp lie on the LVDS lanes of a TI radar, and so in a DCA1000 file.
//!
//! Source: TI, "Mmwave Radar Device ADC Raw Data Capture" (SWRA581B), sections 3 to 7.

use crate::radar::Sampling;

/// The order of the words of one chirp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lanes {
    pub count: usize,
    /// Receivers side by side within each sample (xWR12xx, xWR14xx); else one receiver after the other.
    pub interleaved: bool,
    /// Q comes before I.
    pub q_first: bool,
    pub sampling: Sampling,
}

impl Lanes {
    /// Words of one chirp of `rx` receivers.
    pub fn words_per_chirp(&self, rx: usize, samples: usize) -> usize {
        rx * samples * if self.sampling == Sampling::Complex { 2 } else { 1 }
    }

    /// Where a receiver's sample lies within its chirp; the second place is that of its quadrature part.
    ///
    /// Not interleaved: every receiver's samples go out in groups of `count`, one a lane, I of the group before Q
    /// (two lanes: I0 I1 Q0 Q1). Interleaved: I of all receivers, then Q of all receivers, sample by sample.
    pub fn place(&self, rx: usize, n_rx: usize, sample: usize, samples: usize) -> (usize, usize) {
        let (first, second) = match (self.sampling, self.interleaved) {
            (Sampling::Real, true) => return (sample * n_rx + rx, 0),
            (Sampling::Real, false) => return (rx * samples + sample, 0),
            (Sampling::Complex, true) => {
                let start = sample * 2 * n_rx + rx;
                (start, start + n_rx)
            }
            (Sampling::Complex, false) => {
                let (group, lane) = (sample / self.count, sample % self.count);
                let start = rx * 2 * samples + group * 2 * self.count + lane;
                (start, start + self.count)
            }
        };
        if self.q_first { (second, first) } else { (first, second) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lanes(count: usize, interleaved: bool, q_first: bool, sampling: Sampling) -> Lanes {
        Lanes { count, interleaved, q_first, sampling }
    }

    #[test]
    fn two_lanes_carry_two_samples_of_i_then_of_q() {
        let two = lanes(2, false, false, Sampling::Complex);
        let places: Vec<_> = (0..4).map(|sample| two.place(0, 4, sample, 4)).collect();
        assert_eq!(places, [(0, 2), (1, 3), (4, 6), (5, 7)]);
        assert_eq!(two.place(1, 4, 0, 4), (8, 10));
        assert_eq!(lanes(2, false, true, Sampling::Complex).place(0, 4, 1, 4), (3, 1));
    }

    #[test]
    fn interleaved_lanes_carry_i_of_all_receivers_then_q() {
        let four = lanes(4, true, false, Sampling::Complex);
        assert_eq!([four.place(0, 4, 0, 8), four.place(3, 4, 0, 8), four.place(1, 4, 2, 8)], [(0, 4), (3, 7), (17, 21)]);
        assert_eq!(lanes(4, true, false, Sampling::Real).place(3, 4, 2, 8), (11, 0));
    }

    #[test]
    fn every_word_of_a_chirp_has_one_place() {
        for (count, interleaved, sampling) in [
            (1, false, Sampling::Complex),
            (2, false, Sampling::Complex),
            (4, true, Sampling::Complex),
            (2, false, Sampling::Real),
            (4, true, Sampling::Real),
        ] {
            let order = lanes(count, interleaved, false, sampling);
            let mut places: Vec<usize> = Vec::new();
            for rx in 0..3 {
                for sample in 0..8 {
                    let (i, q) = order.place(rx, 3, sample, 8);
                    places.push(i);
                    places.extend((sampling == Sampling::Complex).then_some(q));
                }
            }
            places.sort_unstable();
            assert_eq!(places, (0..order.words_per_chirp(3, 8)).collect::<Vec<_>>(), "{order:?}");
        }
    }
}
