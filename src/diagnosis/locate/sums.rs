//! Sums over boxes of frame, Doppler and range.

use crate::grid::Grid;

/// Sums over everything before, `[frame + 1, doppler + 1, range + 1]`, from which boxes are differences. Scans come here: by whole rows.
pub struct Table {
    sums: Grid<f64, 3>,
}

impl Table {
    /// `of`: value of frame, Doppler and range.
    pub fn new(dims: [usize; 3], of: impl Fn([usize; 3]) -> f64) -> Self {
        let [frames, loops, bins] = dims;
        let mut sums = Grid::filled(["frame", "doppler", "range"], dims.map(|length| length + 1), 0.0);
        let mut line = vec![0.0; bins + 1];
        for frame in 0..frames {
            for doppler in 0..loops {
                let mut row = 0.0;
                let [beside, earlier, both] =
                    [[frame + 1, doppler], [frame, doppler + 1], [frame, doppler]].map(|at| &sums.below(at)[1..]);
                let before = beside.iter().zip(earlier).zip(both);
                for (range, (sum, ((beside, earlier), both))) in line[1..].iter_mut().zip(before).enumerate() {
                    row += of([frame, doppler, range]);
                    *sum = row + beside + earlier - both;
                }
                sums.below_mut([frame + 1, doppler + 1]).copy_from_slice(&line);
            }
        }
        Self { sums }
    }

    /// Of half-open intervals of frame and Doppler, up to each range: a box is the difference of two of these, `[range + 1]`.
    pub fn along(&self, frames: [usize; 2], dopplers: [usize; 2], line: &mut Vec<f64>) {
        let [earlier, later] = frames.map(|frame| {
            let [low, high] = dopplers.map(|doppler| self.sums.below([frame, doppler]));
            high.iter().zip(low).map(|(high, low)| high - low)
        });
        line.clear();
        line.extend(later.zip(earlier).map(|(later, earlier)| later - earlier));
    }
}

/// Half-open intervals of length 1, 4, 16 ... and the whole. Finer scales cost most and show little: a cell of a Hann window is four
/// wide.
pub fn intervals(length: usize) -> Vec<(usize, usize)> {
    let mut all = vec![];
    let mut step = 1;
    while step < length {
        all.extend((0..length.div_ceil(step)).map(|i| (i * step, ((i + 1) * step).min(length))));
        step *= 4;
    }
    all.push((0, length));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_the_sum_of_its_cells() {
        let of = |[frame, doppler, range]: [usize; 3]| (frame * 100 + doppler * 10 + range) as f64;
        let table = Table::new([3, 4, 5], of);
        let mut line = vec![];
        for frames in intervals(3) {
            for dopplers in intervals(4) {
                table.along(frames.into(), dopplers.into(), &mut line);
                for ranges in intervals(5) {
                    let cells = (frames.0..frames.1).flat_map(|frame| {
                        (dopplers.0..dopplers.1)
                            .flat_map(move |doppler| (ranges.0..ranges.1).map(move |range| [frame, doppler, range]))
                    });
                    let sum = line[ranges.1] - line[ranges.0];
                    assert!((sum - cells.map(of).sum::<f64>()).abs() < 1e-9);
                }
            }
        }
        assert_eq!(intervals(5), [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (0, 4), (4, 5), (0, 5)]);
    }
}
