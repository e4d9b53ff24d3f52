//! Sums over boxes of frame, Doppler and range; the innermost loop of the scans, which therefore indexes by hand.

/// Sums over everything before, `[frame + 1, doppler + 1, range + 1]`: a box costs eight look-ups.
pub struct Table {
    dims: [usize; 3],
    sums: Vec<f64>,
}

impl Table {
    /// `of`: value of frame, Doppler and range.
    pub fn new(dims: [usize; 3], of: impl Fn([usize; 3]) -> f64) -> Self {
        let [frames, loops, bins] = dims;
        let (wide, deep) = (bins + 1, (loops + 1) * (bins + 1));
        let mut sums = vec![0.0; (frames + 1) * deep];
        for frame in 0..frames {
            for doppler in 0..loops {
                let mut row = 0.0;
                for range in 0..bins {
                    row += of([frame, doppler, range]);
                    let at = (frame + 1) * deep + (doppler + 1) * wide + range + 1;
                    sums[at] = row + sums[at - wide] + sums[at - deep] - sums[at - deep - wide];
                }
            }
        }
        Self { dims, sums }
    }

    /// Of a half-open box.
    pub fn inside(&self, low: [usize; 3], high: [usize; 3]) -> f64 {
        let (wide, deep) = (self.dims[2] + 1, (self.dims[1] + 1) * (self.dims[2] + 1));
        let before = |frame: usize| {
            let at = |doppler: usize, range: usize| self.sums[frame * deep + doppler * wide + range];
            at(high[1], high[2]) - at(low[1], high[2]) - at(high[1], low[2]) + at(low[1], low[2])
        };
        before(high[0]) - before(low[0])
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
        for frames in intervals(3) {
            for dopplers in intervals(4) {
                for ranges in intervals(5) {
                    let cells = (frames.0..frames.1).flat_map(|frame| {
                        (dopplers.0..dopplers.1)
                            .flat_map(move |doppler| (ranges.0..ranges.1).map(move |range| [frame, doppler, range]))
                    });
                    let sum = table.inside([frames.0, dopplers.0, ranges.0], [frames.1, dopplers.1, ranges.1]);
                    assert!((sum - cells.map(of).sum::<f64>()).abs() < 1e-9);
                }
            }
        }
        assert_eq!(intervals(5), [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (0, 4), (4, 5), (0, 5)]);
    }
}
