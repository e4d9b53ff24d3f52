//! A compact return that wanders through range and Doppler outside the body: found frame by frame, linked by the most
//! likely way (track before detect).

use num_complex::Complex64;
use rayon::prelude::*;

use super::scene::Scene;
use crate::diagnosis::detectors::steering::{aperture_m, power, steering};
use crate::diagnosis::locate::CELLS_PER_VALUE;
use crate::diagnosis::statistics::{chi2_tail, mean_power_tail};

/// One frame's sighting.
#[derive(Clone, Copy, Debug)]
pub struct Sighting {
    pub frame: usize,
    pub range_m: f64,
    /// Modulo twice the greatest unambiguous velocity.
    pub velocity_mps: f64,
    /// Over the noise, at the peak.
    pub power: f64,
    /// x over range of the direction that the receivers see it in; none with one receiver.
    pub sine: Option<f64>,
}

pub struct Track {
    pub sightings: Vec<Sighting>,
    /// Under noise, corrected for every way that could have been taken.
    pub p_value: f64,
}

/// Unlikely under the base: −ln of the probability, by frame and range, of the most unlikely Doppler; and that Doppler.
struct Surprise {
    nats: Vec<f64>,
    doppler: Vec<usize>,
}

/// The most unlikely way through all frames; none where nothing is unlikely.
pub fn strongest(scene: &Scene) -> Option<Track> {
    let (frames, bins) = (scene.frames(), scene.bins);
    let surprises: Vec<Surprise> = (0..frames).into_par_iter().map(|frame| surprise(scene, frame)).collect();
    let radar = &scene.evidence.radar;
    let step_m = radar.max_velocity_mps() * radar.frame_period_s;
    let reach = ((step_m * scene.model.cells.bins_per_m).ceil() as usize + 1).min(bins / 4);
    // Anywhere is allowed to begin, near the last place to go on: so many cells were looked at.
    let values = |ranges: usize| ((ranges * scene.loops) as f64 / CELLS_PER_VALUE).max(1.0).ln();
    let (begin, go_on) = (values(bins), values((2 * reach + 1).min(bins)));
    let mut best = vec![vec![0.0; bins]; frames];
    let mut from = vec![vec![None; bins]; frames];
    let mut top = (0.0, 0, 0);
    for frame in 0..frames {
        for range in 0..bins {
            let own = surprises[frame].nats[range];
            let started = (own - begin).max(0.0);
            let (mut score, mut origin) = (started, None);
            if frame > 0 {
                let last = (range + reach + 1).min(bins);
                for (near, &before) in best[frame - 1].iter().enumerate().take(last).skip(range.saturating_sub(reach)) {
                    let going = before - 0.5 * near.abs_diff(range) as f64 + (own - go_on).max(0.0);
                    if before > 0.0 && going > score {
                        (score, origin) = (going, Some(near));
                    }
                }
            }
            (best[frame][range], from[frame][range]) = (score, origin);
            if score > top.0 {
                top = (score, frame, range);
            }
        }
    }
    let (score, mut frame, mut range) = top;
    if score <= 0.0 {
        return None;
    }
    let mut sightings = vec![];
    loop {
        let penalty = if from[frame][range].is_some() { go_on } else { begin };
        if surprises[frame].nats[range] > penalty {
            sightings.push(sighting(scene, frame, surprises[frame].doppler[range] * scene.samples + range));
        }
        match from[frame][range] {
            Some(near) if frame > 0 => (frame, range) = (frame - 1, near),
            _ => break,
        }
    }
    sightings.reverse();
    Some(Track { sightings, p_value: chi2_tail(2.0 * score, 2.0 * frames as f64) })
}

fn surprise(scene: &Scene, frame: usize) -> Surprise {
    let (map, base, taken) = (scene.map(frame), scene.base(frame), scene.taken(frame));
    let (mut nats, mut dopplers) = (vec![0.0; scene.bins], vec![0; scene.bins]);
    for range in 0..scene.bins {
        let loudest = (0..scene.loops)
            .map(|doppler| (doppler, doppler * scene.samples + range))
            .filter(|&(_, cell)| !taken[cell])
            .map(|(doppler, cell)| (doppler, f64::from(map[cell] / base[cell])))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((doppler, power)) = loudest
            && power > 1.0
        {
            // Beyond the reach of the gamma law's tail its exponential bound holds.
            let tail = mean_power_tail(power, scene.channels);
            let bound = scene.channels * (power - 1.0 - power.ln());
            nats[range] = if tail > 1e-280 { -tail.ln() } else { bound };
            dopplers[range] = doppler;
        }
    }
    Surprise { nats, doppler: dopplers }
}

/// Centre of gravity of the power around a peak, and where it arrives from.
fn sighting(scene: &Scene, frame: usize, cell: usize) -> Sighting {
    let map = scene.map(frame);
    // The peak may lie beside the most unlikely cell.
    let neighbours = |cell: usize| -> Vec<(i64, i64, usize)> {
        let (doppler, range) = ((cell / scene.samples) as i64, (cell % scene.samples) as i64);
        (-1..=1)
            .flat_map(|slow| (-1..=1).map(move |fast| (slow, fast)))
            .filter(|(_, fast)| (0..scene.bins as i64).contains(&(range + fast)))
            .map(|(slow, fast)| {
                let row = (doppler + slow).rem_euclid(scene.loops as i64) as usize;
                (slow, fast, row * scene.samples + (range + fast) as usize)
            })
            .collect()
    };
    let cell = neighbours(cell).into_iter().map(|(_, _, near)| near).max_by(|&a, &b| map[a].total_cmp(&map[b])).unwrap_or(cell);
    let at = |slow: i64, fast: i64| {
        neighbours(cell)
            .iter()
            .find(|near| near.0 == slow && near.1 == fast)
            .map_or(0.0, |near| (f64::from(map[near.2]) - 1.0).max(0.0))
    };
    let shift = |before: f64, middle: f64, after: f64| {
        // Of a Hann window: the ratio of neighbours' amplitudes gives the distance to the peak.
        let (before, middle, after) = (before.sqrt(), middle.sqrt(), after.sqrt());
        if middle <= 0.0 {
            0.0
        } else if after >= before {
            hann_shift(after / middle)
        } else {
            -hann_shift(before / middle)
        }
    };
    let doppler = (cell / scene.samples) as f64 + shift(at(-1, 0), at(0, 0), at(1, 0));
    let range = (cell % scene.samples) as f64 + shift(at(0, -1), at(0, 0), at(0, 1));
    let velocity = scene.velocity_mps(doppler.rem_euclid(scene.loops as f64));
    let range_m = scene.range_m(range - velocity * scene.model.cells.bins_per_mps);
    Sighting { frame, range_m, velocity_mps: velocity, power: f64::from(map[cell]), sine: sine(scene, frame, cell) }
}

/// Distance of a tone from a Hann cell whose neighbour has this share of its amplitude.
fn hann_shift(ratio: f64) -> f64 {
    ((2.0 * ratio - 1.0) / (ratio + 1.0)).clamp(-0.5, 0.5)
}

/// x over range of the direction of arrival, from the receivers of each transmitter.
fn sine(scene: &Scene, frame: usize, cell: usize) -> Option<f64> {
    let radar = &scene.evidence.radar;
    aperture_m(radar)?;
    let channels = 0..scene.evidence.cube.channels();
    let values: Vec<Complex64> = channels.map(|channel| scene.evidence.range_doppler(frame, channel)[cell]).collect();
    let beam = |sine: f64| power(&values, &steering(radar, sine));
    (-60..=60).map(|step| f64::from(step) / 60.0).max_by(|&a, &b| beam(a).total_cmp(&beam(b))).map(|coarse| {
        (-10..=10)
            .map(|step| (coarse + f64::from(step) / 600.0).clamp(-1.0, 1.0))
            .max_by(|&a, &b| beam(a).total_cmp(&beam(b)))
            .unwrap_or(coarse)
    })
}
