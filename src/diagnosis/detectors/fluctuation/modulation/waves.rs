//! The sinusoid of a line in the chirps, and the ranges that have it.

use std::ops::RangeInclusive;

use num_complex::Complex64;

use super::chirps::{Chirps, reached};
use super::line::Line;
use crate::diagnosis::detectors::filter::Filter;
use crate::diagnosis::detectors::fluctuation::sinusoid::Sinusoid;
use crate::grid::Grid;

/// Ranges to either side that may be modulated with it, and by how much more than by chance they must.
const WIDEST: usize = 16;
const PLAIN: f64 = 20.0;

impl Chirps<'_> {
    /// Of the frequencies that the frame rate aliases to one another, the one whose sinusoid explains most within the frames.
    pub fn settled(&self, line: Line) -> Line {
        let rate_hz = 1.0 / self.evidence.radar.frame_period_s;
        let [lowest_hz, highest_hz] = self.band_hz();
        let tooth = |k: i32| line.frequency_hz + f64::from(k) * rate_hz;
        let reach = ((highest_hz - lowest_hz) / rate_hz) as i32;
        let teeth = (-reach..=reach).map(tooth).filter(|frequency| (lowest_hz..highest_hz).contains(frequency));
        let explained = |frequency_hz: f64| {
            let sinusoid = self.sinusoid(frequency_hz)?;
            Some((frequency_hz, line.bins().map(|bin| self.explained(&sinusoid, bin)[0]).sum::<f64>()))
        };
        let best = teeth.filter_map(explained).max_by(|a, b| a.1.total_cmp(&b.1));
        Line { frequency_hz: best.map_or(line.frequency_hz, |best| best.0), ..line }
    }

    pub fn sinusoid(&self, frequency_hz: f64) -> Option<Sinusoid<'_>> {
        Sinusoid::new(&self.evidence.split.training, &self.middles_s, &self.loops_s, frequency_hz)
    }

    /// Energy that a sinusoid explains at a range beyond what is constant, and what it leaves.
    fn explained(&self, sinusoid: &Sinusoid, bin: usize) -> [f64; 2] {
        let [channels, _] = self.clutter.shape();
        let of_channel = |channel: usize| {
            let value = |frame: usize, index: usize| self.spectra[frame][[index, channel, bin]];
            let sums = sinusoid.sums(value);
            let fitted = sinusoid.fitted(sums);
            let all: f64 = (0..2).map(|part| (fitted[part].conj() * sums[part]).re).sum();
            let indices = || 0..self.loops_s.len();
            let energy: f64 =
                sinusoid.training.iter().flat_map(|&frame| indices().map(move |index| value(frame, index).norm_sqr())).sum();
            [all, energy - all]
        };
        (0..channels).map(of_channel).fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]])
    }

    /// The ranges around one that are modulated with it.
    pub fn patch(&self, sinusoid: &Sinusoid, line: &Line) -> RangeInclusive<usize> {
        let modulated_too = |bin: usize| {
            let [explained, left] = self.explained(sinusoid, bin);
            explained * sinusoid.basis.len() as f64 > PLAIN * 2.0 * left
        };
        let first = (0..line.first).rev().take(WIDEST).take_while(|&bin| modulated_too(bin)).last().unwrap_or(line.first);
        let last = (line.last + 1..self.clutter.shape()[1])
            .take(WIDEST)
            .take_while(|&bin| modulated_too(bin))
            .last()
            .unwrap_or(line.last);
        let reached = reached(line.first, line.last);
        first.min(*reached.start())..=last.max(*reached.end())
    }

    /// Parts in proportion to the cosine and to the sine in some ranges, cosine and sine, `[channel, sample]`.
    pub fn waves(&self, sinusoid: &Sinusoid, patch: &RangeInclusive<usize>) -> [Grid<Complex64, 2>; 2] {
        let evidence = self.evidence;
        let [frames, .., samples] = evidence.cube.dims;
        let channels = evidence.cube.channels();
        let filter = Filter::pass(samples, |bin| patch.contains(&bin));
        let mut waves = [vec![], vec![]];
        for channel in 0..channels {
            let moving: Vec<Vec<Complex64>> = (0..frames).map(|frame| evidence.moving(frame, channel)).collect();
            let of_sample = |n: usize| sinusoid.fitted(sinusoid.sums(|frame, index| moving[frame][index * samples + n]));
            let fitted: Vec<[Complex64; 2]> = (0..samples).map(of_sample).collect();
            for (part, waves) in waves.iter_mut().enumerate() {
                let mut wave: Vec<Complex64> = fitted.iter().map(|fitted| fitted[part]).collect();
                filter.apply(&mut wave);
                waves.extend(wave);
            }
        }
        waves.map(|waves| Grid::new(["channel", "sample"], [channels, samples], waves))
    }
}
