//! CFAR over a range-Doppler map: every cell is held against the cells in a frame around it.

use std::collections::HashMap;

use super::threshold;
use super::{Method, PointsConfig};
use crate::error::{Error, Result};
use crate::heatmap::{HeatmapConfig, Window, range_bins};
use crate::radar::Radar;

/// A cell that stands out of the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// Doppler bin, zero in the middle, and range bin.
    pub row: usize,
    pub bin: usize,
    /// Averaged over the antennas, linear.
    pub power: f64,
    /// Of the noise in it, estimated from the training cells.
    pub noise: f64,
}

/// Windows correlate cells up to so many bins apart; Hann's up to two.
const REACH: i64 = 3;

/// A detector for the maps of one radar. Doppler closes upon itself; range does not: there the frame of training cells is
/// cut at the map's ends.
pub struct Cfar {
    rows: usize,
    bins: usize,
    method: Method,
    rank: f64,
    /// Steps from a cell to its training cells, `[doppler, range]`.
    steps: Vec<[i64; 2]>,
    /// `[doppler, range]`: what a cell must exceed, and what the estimate is of the noise, as factors on the statistic of the
    /// training cells. None where a cell is not tested.
    factors: Vec<Option<[f64; 2]>>,
    /// Doppler bins that the removal of what is static has emptied.
    blind: Vec<bool>,
}

impl Cfar {
    /// # Errors
    /// No training cell at all.
    pub fn new(radar: &Radar, heatmap: &HeatmapConfig, config: &PointsConfig) -> Result<Self> {
        let rows = radar.loops_per_frame;
        let bins = range_bins(radar.samples_per_chirp, radar.sampling);
        let centre = rows / 2;
        // The mean over the loops fills the bin of zero velocity and, under a Hann window, its two neighbours.
        let blind = (0..rows).map(|row| config.remove_static && row.abs_diff(centre) <= 1).collect();
        let [guard_rows, guard_bins] = config.guard.map(|cells| cells as i64);
        let [training_rows, training_bins] = config.training.map(|cells| cells as i64);
        // Around the circle of velocities no cell may come twice.
        let most_rows = (guard_rows + training_rows).min((rows as i64 - 1) / 2);
        let mut steps = Vec::new();
        for row in -most_rows..=most_rows {
            for bin in -(guard_bins + training_bins)..=guard_bins + training_bins {
                if row.abs() > guard_rows || bin.abs() > guard_bins {
                    steps.push([row, bin]);
                }
            }
        }
        let mut cfar = Self { rows, bins, method: config.method, rank: config.rank, steps, factors: Vec::new(), blind };
        let shared = Shared::new(radar, heatmap);
        let antennas = (radar.tx_m.len() * radar.rx_m.len()) as f64;
        let mut known: HashMap<Vec<[i64; 2]>, Option<[f64; 2]>> = HashMap::new();
        let mut factors = Vec::with_capacity(rows * bins);
        for row in 0..rows {
            for bin in 0..bins {
                factors.push(match cfar.blind[row] {
                    true => None,
                    false => {
                        let steps = cfar.present(row, bin);
                        *known.entry(steps).or_insert_with_key(|steps| cfar.factors_of(steps, antennas, &shared, config))
                    }
                });
            }
        }
        if factors.iter().all(Option::is_none) {
            let found = format!("guard {:?} and training {:?} in a map of {rows} x {bins}", config.guard, config.training);
            return Err(Error::setting("points.training", found, "training cells around at least one cell"));
        }
        cfar.factors = factors;
        Ok(cfar)
    }

    /// How many cells are tested.
    pub fn tested(&self) -> usize {
        (0..self.factors.len()).filter(|cell| self.factor(*cell).is_some()).count()
    }

    /// What a cell must exceed, as a factor on the statistic of its training cells; none where it is not tested.
    pub fn factor(&self, cell: usize) -> Option<f64> {
        self.factors[cell].map(|[threshold, _]| threshold)
    }

    /// The cells of a map `[doppler, range]` of powers that stand out, row by row.
    pub fn detect(&self, power: &[f64]) -> Vec<Detection> {
        assert_eq!(power.len(), self.rows * self.bins, "cfar: {} cells for {} x {}", power.len(), self.rows, self.bins);
        let mut found = Vec::new();
        let mut training = Vec::with_capacity(self.steps.len());
        for row in 0..self.rows {
            for bin in 0..self.bins {
                let cell = row * self.bins + bin;
                let Some([threshold, level]) = self.factors[cell] else { continue };
                training.clear();
                training.extend(self.steps.iter().filter_map(|step| self.at(row, bin, *step)).map(|cell| power[cell]));
                let statistic = match self.method {
                    Method::Ca => training.iter().sum::<f64>() / training.len() as f64,
                    Method::Os => {
                        let place = ordered(training.len(), self.rank) - 1;
                        *training.select_nth_unstable_by(place, f64::total_cmp).1
                    }
                };
                if power[cell] > threshold * statistic && statistic > 0.0 {
                    found.push(Detection { row, bin, power: power[cell], noise: level * statistic });
                }
            }
        }
        found
    }

    /// Whether no neighbour of a cell is stronger.
    pub fn is_peak(&self, power: &[f64], cell: &Detection) -> bool {
        (-1..=1).all(|row| {
            (-1..=1).all(|bin| self.around(cell.row, cell.bin, [row, bin]).is_none_or(|other| power[other] <= cell.power))
        })
    }

    /// The cell that lies a step away; none beyond the ends of range.
    fn around(&self, row: usize, bin: usize, [rows, bins]: [i64; 2]) -> Option<usize> {
        let row = (row as i64 + rows).rem_euclid(self.rows as i64) as usize;
        let bin = usize::try_from(bin as i64 + bins).ok().filter(|bin| *bin < self.bins)?;
        Some(row * self.bins + bin)
    }

    /// The same, of cells that hold noise.
    fn at(&self, row: usize, bin: usize, step: [i64; 2]) -> Option<usize> {
        self.around(row, bin, step).filter(|cell| !self.blind[cell / self.bins])
    }

    /// The steps to training cells that are there.
    fn present(&self, row: usize, bin: usize) -> Vec<[i64; 2]> {
        self.steps.iter().copied().filter(|step| self.at(row, bin, *step).is_some()).collect()
    }

    fn factors_of(&self, steps: &[[i64; 2]], antennas: f64, shared: &Shared, config: &PointsConfig) -> Option<[f64; 2]> {
        if steps.is_empty() {
            return None;
        }
        let cells = shared.independent(steps, self.rows as i64);
        Some(match self.method {
            Method::Ca => [threshold::cell_averaging(config.false_alarm_rate, antennas, cells), 1.0],
            Method::Os => {
                let rank = ordered(steps.len(), self.rank) as f64 * cells / steps.len() as f64;
                let threshold = threshold::order_statistic(config.false_alarm_rate, antennas, cells, rank);
                [threshold, 1.0 / threshold::ordered_level(antennas, cells, rank)]
            }
        })
    }
}

/// The number, from 1, of the ordered cell that stands for all.
fn ordered(cells: usize, share: f64) -> usize {
    ((cells as f64 * share).round() as usize).clamp(1, cells)
}

/// What white noise in two cells has in common under the windows: the squared correlation by their distance.
struct Shared {
    /// `[doppler, range]`, by distance from 0 to `REACH`.
    squares: [Vec<f64>; 2],
}

impl Shared {
    fn new(radar: &Radar, heatmap: &HeatmapConfig) -> Self {
        let of = |window: Window, length: usize| -> Vec<f64> {
            let squares: Vec<f64> = window.weights(length).into_iter().map(|weight| weight * weight).collect();
            let sum: f64 = squares.iter().sum();
            let at = |distance: i64| {
                let turns = std::f64::consts::TAU * distance as f64 / length as f64;
                let (re, im) = squares.iter().enumerate().fold((0.0, 0.0), |(re, im), (index, square)| {
                    let (sin, cos) = (turns * index as f64).sin_cos();
                    (re + square * cos, im + square * sin)
                });
                (re * re + im * im) / (sum * sum)
            };
            (0..=REACH).map(at).collect()
        };
        let range = of(heatmap.range_window, radar.samples_per_chirp);
        Self { squares: [of(heatmap.doppler_window, radar.loops_per_frame), range] }
    }

    /// As how many independent cells the mean of these varies: N² / Σ |ρ|² over all pairs.
    fn independent(&self, steps: &[[i64; 2]], rows: i64) -> f64 {
        let present: std::collections::HashSet<[i64; 2]> = steps.iter().map(|[row, bin]| [row.rem_euclid(rows), *bin]).collect();
        let mut sum = 0.0;
        for [row, bin] in &present {
            // No cell is met twice where there are few rows.
            for other in 0..rows.min(2 * REACH + 1) {
                let distance = if rows > 2 * REACH { other - REACH } else { other };
                let around = distance.rem_euclid(rows).min((-distance).rem_euclid(rows));
                for along in -REACH..=REACH {
                    if present.contains(&[(row + distance).rem_euclid(rows), bin + along]) {
                        sum +=
                            self.squares[0].get(around as usize).unwrap_or(&0.0) * self.squares[1][along.unsigned_abs() as usize];
                    }
                }
            }
        }
        (present.len() * present.len()) as f64 / sum
    }
}
