//! Excess along one axis at a time, for curves in a report.

use crate::diagnosis::Evidence;
use crate::diagnosis::power::Cells;
use crate::diagnosis::statistics::mean_power_tail;

use super::residual::{CELLS_PER_VALUE, Residual};

/// Excess along an axis.
#[derive(Clone, Debug)]
pub struct Profile {
    /// "range", "velocity", "frame", "sample", "chirp", "tx", "rx".
    pub axis: &'static str,
    pub unit: &'static str,
    /// Where, in `unit`.
    pub at: Vec<f64>,
    /// Measured over expected power.
    pub excess_db: Vec<f64>,
    /// Probability of as much under the null, each on its own.
    pub p_value: Vec<f64>,
}

/// One curve per axis; empty for an empty recording.
pub fn profiles(evidence: &Evidence) -> Vec<Profile> {
    let Some(residual) = Residual::new(evidence) else { return vec![] };
    let [frames, loops, samples] = residual.shape();
    let cells = Cells::new(&evidence.radar);
    let mut curves = vec![
        folded(&residual, "range", "m", residual.bins, |_, _, range| range, |i| i as f64 / cells.bins_per_m),
        folded(&residual, "frame", "", frames, |frame, _, _| frame, |i| i as f64),
    ];
    let half = loops / 2;
    // Velocities from the most negative to the most positive.
    curves.push(folded(
        &residual,
        "velocity",
        "m/s",
        loops,
        |_, doppler, _| (doppler + half) % loops,
        |i| (i as f64 - half as f64) / cells.doppler_per_mps,
    ));
    curves.extend(raw(evidence, loops, samples));
    curves
}

fn folded(
    residual: &Residual,
    axis: &'static str,
    unit: &'static str,
    length: usize,
    index: impl Fn(usize, usize, usize) -> usize,
    at: impl Fn(usize) -> f64,
) -> Profile {
    let [_, loops, samples] = residual.shape();
    let (mut sum, mut count) = (vec![0.0; length], vec![0.0; length]);
    for (cell, (&ratio, &weight)) in residual.ratio.values().iter().zip(residual.count.values()).enumerate() {
        if weight > 0.0 {
            let i = index(cell / (loops * samples), cell / samples % loops, cell % samples);
            sum[i] += f64::from(ratio * weight);
            count[i] += f64::from(weight);
        }
    }
    profile(axis, unit, (0..length).map(at).collect(), &sum, &count)
}

fn profile(axis: &'static str, unit: &'static str, at: Vec<f64>, sum: &[f64], count: &[f64]) -> Profile {
    let mean = |i: usize| if count[i] > 0.0 { sum[i] / count[i] } else { 1.0 };
    let tail = |i: usize| if count[i] > 0.0 && mean(i) > 1.0 { mean_power_tail(mean(i), count[i]) } else { 1.0 };
    Profile {
        axis,
        unit,
        excess_db: (0..at.len()).map(|i| 10.0 * mean(i).max(1e-12).log10()).collect(),
        p_value: (0..at.len()).map(tail).collect(),
        at,
    }
}

/// Fast time, loop, transmitter and receiver: the power of differences of neighbouring loops, in which all that moves
/// slowly cancels, over its median along the axis.
fn raw(evidence: &Evidence, loops: usize, samples: usize) -> Vec<Profile> {
    let [frames, tx, rx, ..] = evidence.cube.dims;
    if loops < 4 {
        return vec![];
    }
    let lengths = [samples, loops - 2, tx, rx];
    let mut sums = lengths.map(|length| vec![0.0; length]);
    for frame in 0..frames {
        for channel in 0..tx * rx {
            let noise = evidence.noise()[channel].max(f64::MIN_POSITIVE);
            let chirps = evidence.cube.channel(frame, channel);
            for i in 1..loops - 1 {
                for n in 0..samples {
                    // Second differences: steady motion cancels to second order.
                    let difference =
                        2.0 * chirps[i * samples + n] - chirps[(i - 1) * samples + n] - chirps[(i + 1) * samples + n];
                    let power = difference.norm_sqr() / (6.0 * noise);
                    sums[0][n] += power;
                    sums[1][i - 1] += power;
                    sums[2][channel / rx] += power;
                    sums[3][channel % rx] += power;
                }
            }
        }
    }
    let total = (frames * tx * rx * (loops - 2) * samples) as f64;
    ["sample", "chirp", "tx", "rx"]
        .into_iter()
        .zip(lengths)
        .zip(&sums)
        .map(|((axis, length), sums)| {
            let each = total / length as f64;
            let mut means: Vec<f64> = sums.iter().map(|sum| sum / each).collect();
            let usual = crate::diagnosis::statistics::median(&mut means.clone()).max(1e-12);
            means.iter_mut().for_each(|mean| *mean /= usual);
            // Differences overlap, and what the body leaves in them is one draw per frame.
            let count = (each / CELLS_PER_VALUE).min(4.0 * (frames * rx * tx) as f64);
            let (sum, count): (Vec<f64>, Vec<f64>) = means.iter().map(|mean| (mean * count, count)).unzip();
            let offset = if axis == "chirp" { 1.0 } else { 0.0 };
            profile(axis, "", (0..length).map(|i| i as f64 + offset).collect(), &sum, &count)
        })
        .collect()
}
