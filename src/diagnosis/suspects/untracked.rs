//! Movers of a recording in which nobody is tracked: power in the range-Doppler maps away from what stands still.

use std::sync::Arc;

use num_complex::Complex64;

use super::region::{Region, remove};
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Correction, Estimate, Place, Rung};
use crate::diagnosis::statistics;

/// Doppler bins around zero where a Hann window leaves what stands still.
const STILL_BINS: usize = 1;
/// A mover's cells are those down to this share of its peak.
const SHARE_OF_PEAK: f64 = 1e-2;
/// Nearer ones belong to leakage, offsets and low-frequency noise.
const NEAREST_BIN: usize = 3;
/// Factor by which a mover's cell must exceed the median over velocities.
const ABOVE_FLOOR: f64 = 4.0;
/// Range bins on each side that a mover may fill.
const REACH: usize = 8;
/// Directions that are tried, in sines of the azimuth.
const DIRECTIONS: usize = 181;

pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    if evidence.body.is_some() {
        return vec![];
    }
    strongest(evidence).into_iter().collect()
}

/// The strongest mover, if any.
fn strongest(evidence: &Evidence) -> Option<Candidate> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let (bins, channels) = (evidence.range_bins(), evidence.cube.channels() as f64);
    let (training, held_out) = (&evidence.split.training, &evidence.split.held_out);
    let cells = loops * samples;
    let maps = evidence.maps();
    let mean_over = |frames: &[usize], cell: usize| {
        frames.iter().map(|&f| f64::from(maps[f * cells + cell])).sum::<f64>() / frames.len().max(1) as f64
    };
    let moving = |doppler: usize| doppler.min(loops - doppler) > STILL_BINS;
    let mean: Vec<f64> = (0..cells).map(|cell| mean_over(training, cell)).collect();
    let mut column: Vec<f64> = vec![];
    // A floor over all velocities is the modulation of something strong, no mover.
    let floor: Vec<f64> = (0..bins)
        .map(|r| {
            column.clear();
            column.extend((0..loops).filter(|&d| moving(d)).map(|d| mean[d * samples + r]));
            statistics::median(&mut column)
        })
        .collect();
    let candidates: Vec<usize> = (0..loops)
        .filter(|&d| moving(d))
        .flat_map(|d| (NEAREST_BIN..bins).map(move |r| (d, r)))
        .filter(|&(d, r)| mean[d * samples + r] > ABOVE_FLOOR * floor[r])
        .map(|(d, r)| d * samples + r)
        .collect();
    let peak = candidates.iter().copied().max_by(|&a, &b| mean[a].total_cmp(&mean[b]))?;
    let (doppler, range) = (peak / samples, peak % samples);
    let count = training.len() as f64 * channels;
    let p_value = statistics::corrected(statistics::mean_power_tail(mean[peak], count), cells as f64);
    if p_value > 0.01 || held_out.is_empty() {
        return None;
    }
    let signed = |d: usize| if 2 * d >= loops { d as f64 - loops as f64 } else { d as f64 };
    // Relative to the peak, because Doppler wraps around.
    let offset = |d: usize| (signed(d) - signed(doppler) + 1.5 * loops as f64).rem_euclid(loops as f64) - 0.5 * loops as f64;
    // What is much stronger than its surroundings; the cells that belong to it hang together.
    let limit = (SHARE_OF_PEAK * mean[peak]).max(1.0 + 6.0 / count.sqrt());
    let mut region: Vec<usize> = vec![peak];
    let mut inside = vec![false; cells];
    inside[peak] = true;
    let mut next = 0;
    while next < region.len() {
        let (d, r) = (region[next] / samples, region[next] % samples);
        next += 1;
        let neighbours = [((d + 1) % loops, r), ((d + loops - 1) % loops, r), (d, r + 1), (d, r.wrapping_sub(1))];
        for (d, r) in neighbours {
            let near = r.abs_diff(range) <= REACH && offset(d).abs() <= (loops / 8 + 1) as f64;
            if near && r < bins && moving(d) && !inside[d * samples + r] && mean[d * samples + r] > limit {
                inside[d * samples + r] = true;
                region.push(d * samples + r);
            }
        }
    }
    // Exponential laws with the training's mean power, against noise alone.
    let gain: f64 = held_out
        .iter()
        .flat_map(|&f| region.iter().map(move |&cell| (f, cell)))
        .map(|(f, cell)| {
            let (power, expected) = (f64::from(maps[f * cells + cell]), mean[cell].max(1.0));
            channels * (power * (1.0 - 1.0 / expected) - expected.ln())
        })
        .sum();
    if gain < 3.0 {
        return None;
    }
    let span = |values: Vec<f64>| values.iter().fold([f64::MAX, f64::MIN], |[l, h], &v| [l.min(v), h.max(v)]);
    let ranges = span(region.iter().map(|c| (c % samples) as f64).collect());
    let offsets = span(region.iter().map(|c| offset(c / samples)).collect());
    let radar = &evidence.radar;
    let (bin_m, bin_mps) = (radar.range_resolution_m(), radar.velocity_resolution_mps());
    let centre = parabola(&mean, range, samples, doppler);
    let range_m = centre * bin_m;
    let weight: f64 = region.iter().map(|&c| mean[c]).sum();
    let velocity_mps = (signed(doppler) + region.iter().map(|&c| mean[c] * offset(c / samples)).sum::<f64>() / weight) * bin_mps;
    let azimuth = azimuth_deg(evidence, doppler, range);
    let decibel = 10.0 * mean[peak].log10();
    let noise: f64 = evidence.noise().iter().sum();
    let energy = region.iter().map(|&c| (mean[c] - 1.0).max(0.0)).sum::<f64>() * noise * evidence.cube.dims[0] as f64;
    let still = evidence.still().to_vec();
    let cut = Region {
        range: [ranges[0] - 1.0, ranges[1] + 1.0],
        doppler: [signed(doppler) + offsets[0] - 1.0, signed(doppler) + offsets[1] + 1.0],
    };
    let direction = azimuth.map_or(String::new(), |(a, _)| format!(", {a:+.0}° to the side"));
    let estimates = azimuth.map_or(vec![], |(a, deviation)| {
        let (s, c) = a.to_radians().sin_cos();
        let across = range_m * deviation.to_radians();
        vec![Estimate::list(
            "position_m",
            &[range_m * s, range_m * c],
            &[(across * c).abs().max(0.3 * bin_m), (across * s).abs().max(0.3 * bin_m)],
        )]
    });
    Some(Candidate {
        id: Some("moving_reflector"),
        behaves_like: "path-like",
        estimates,
        choice: None,
        place: Place {
            range_m: Some([(ranges[0] - 0.5).max(0.0) * bin_m, (ranges[1] + 0.5) * bin_m]),
            velocity_mps: Some([velocity_mps + (offsets[0] - 0.5) * bin_mps, velocity_mps + (offsets[1] + 0.5) * bin_mps]),
            azimuth_deg: azimuth.map(|(a, d)| [a - 2.0 * d, a + 2.0 * d]),
            ..Place::at("scene")
        },
        p_value,
        gain,
        rung: Rung::F,
        look_alikes: vec![],
        statement: format!(
            "Something moves at {range_m:.2} m with {velocity_mps:+.2} m/s along the line of sight{direction}, {decibel:.0} dB above \
             the noise, and nobody is tracked there."
        ),
        curve: None,
        energy,
        correction: Correction::Samples(Arc::new(move |cube| remove(cube, &still, &[cut]))),
    })
}

/// Top of the parabola through a peak's logarithms.
fn parabola(mean: &[f64], range: usize, samples: usize, doppler: usize) -> f64 {
    if range == 0 || range + 1 >= samples {
        return range as f64;
    }
    let at = |r: usize| mean[doppler * samples + r].max(1e-9).ln();
    let (left, middle, right) = (at(range - 1), at(range), at(range + 1));
    let bend = left - 2.0 * middle + right;
    range as f64 + if bend < 0.0 { (0.5 * (left - right) / bend).clamp(-0.5, 0.5) } else { 0.0 }
}

/// Azimuth and the deviation of its error; none where the array has no width, or is not one line across.
fn azimuth_deg(evidence: &Evidence, doppler: usize, range: usize) -> Option<(f64, f64)> {
    let [_, _, receivers, loops, samples] = evidence.cube.dims;
    let radar = &evidence.radar;
    let channels = evidence.cube.channels();
    let wavelength = radar.wavelength_m();
    let signed = if 2 * doppler >= loops { doppler as f64 - loops as f64 } else { doppler as f64 };
    // Distance across of each virtual antenna, and how far the mover has gone when its transmitter's turn comes.
    let across: Vec<f64> = (0..channels).map(|c| radar.tx_m[c / receivers][0] + radar.rx_m[c % receivers][0]).collect();
    let turn = |c: usize| signed / loops as f64 * (c / receivers) as f64 / radar.tx_m.len() as f64;
    let mean = across.iter().sum::<f64>() / channels as f64;
    let spread = (across.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / channels as f64).sqrt();
    if spread < 0.1 * wavelength {
        return None;
    }
    let values: Vec<Vec<Complex64>> = evidence
        .split
        .training
        .iter()
        .map(|&frame| (0..channels).map(|c| evidence.range_doppler(frame, c)[doppler * samples + range]).collect())
        .collect();
    let power = |sine: f64| -> f64 {
        values
            .iter()
            .map(|channel| {
                channel
                    .iter()
                    .enumerate()
                    .map(|(c, v)| v * Complex64::cis(std::f64::consts::TAU * (across[c] * sine / wavelength - turn(c))))
                    .sum::<Complex64>()
                    .norm_sqr()
            })
            .sum()
    };
    let sine = |i: usize| -0.95 + 1.9 * i as f64 / (DIRECTIONS - 1) as f64;
    let best = (0..DIRECTIONS).max_by(|&a, &b| power(sine(a)).total_cmp(&power(sine(b))))?;
    let total: f64 = values.iter().flatten().map(|v| v.norm_sqr()).sum::<f64>() * channels as f64;
    // Not one direction: several movers, or an array that is not calibrated.
    if power(sine(best)) < 0.5 * total {
        return None;
    }
    let noise = evidence.noise().iter().sum::<f64>() / channels as f64;
    let ratio = (total / channels as f64 / noise).max(1.0);
    let deviation = wavelength / (std::f64::consts::TAU * spread) / (2.0 * ratio).sqrt();
    let azimuth = sine(best).asin();
    // An uncalibrated array errs by degrees.
    Some((azimuth.to_degrees(), (deviation / azimuth.cos()).to_degrees().max(2.0)))
}
