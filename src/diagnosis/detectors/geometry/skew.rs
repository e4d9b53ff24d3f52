//! Receivers that are sampled one after the other.
//!
//! A body that is seen aside of its place is seen there by a phase that grows along the row of receivers, and stays what it is, or
//! shrinks, as the body goes farther. A receiver that is sampled later than its neighbour turns all beats, the more the higher they
//! are: the same phase, but it grows with the range. No id of docs/report.md names it.

use std::f64::consts::TAU;

use super::bearing::{Bearing, Sums, along};
use super::wall_bearings::WallBearings;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::detectors::clutter::energy_beyond_noise;
use crate::diagnosis::detectors::undo;
use crate::diagnosis::{Candidate, Correction, Cube, Evidence, Place, Volume};
use crate::effects::Stage;
use crate::radar::{Radar, SPEED_OF_LIGHT};

/// How the sine of a body that stands aside, or is seen in another direction, may depend on the range, and that of what is sampled
/// later.
const ASIDE: [f64; 2] = [-1.0, 0.0];
const LATER: f64 = 1.0;
/// Log-likelihood by which it must be later samples: twenty to one.
const MUCH_BETTER: f64 = 3.0;
/// Share of what the walls say that counts: how rough they are, and what stands before them, is known roughly.
const ROUGHLY: f64 = 0.5;

/// The sine of every frame as a power of the range, fitted: its size at the mean range, and the log-likelihood up to a constant.
fn fit(frames: &[[f64; 3]], mean_m: f64, power: f64) -> (f64, f64) {
    let lever = |range_m: f64| (range_m / mean_m).powf(power);
    let sum = |of: &dyn Fn(&[f64; 3]) -> f64| frames.iter().map(of).sum::<f64>();
    let size =
        sum(&|[sine, range, weight]| weight * sine * lever(*range)) / sum(&|[_, range, weight]| weight * lever(*range).powi(2));
    let left = sum(&|[sine, range, weight]| weight * (sine - size * lever(*range)).powi(2));
    (size, -0.5 * frames.len() as f64 * left.max(f64::MIN_POSITIVE).ln())
}

/// The size at the mean range where it grows with the range, the mean range, and what the walls gain by it. `of_walls`: log-likelihood of
/// static clutter, by the size at the mean range, that range, and the power of the range with which the sine of everything grows.
fn later(frames: &[[f64; 3]], of_walls: impl Fn(f64, f64, f64) -> f64) -> Option<(f64, f64, f64)> {
    let weights: f64 = frames.iter().map(|frame| frame[2]).sum();
    let mean_m = frames.iter().map(|[_, range, weight]| range * weight).sum::<f64>() / weights;
    let (size, likelihood) = fit(frames, mean_m, LATER);
    // The body alone; or everything, where the radar is turned.
    let alone = of_walls(0.0, mean_m, ASIDE[0]);
    let other = ASIDE.map(|power| {
        let (size, likelihood) = fit(frames, mean_m, power);
        let walls = if power == 0.0 { of_walls(size, mean_m, power).max(alone) } else { alone };
        likelihood + ROUGHLY * walls
    });
    let walls = of_walls(size, mean_m, LATER);
    let better = likelihood + ROUGHLY * walls - other.into_iter().fold(f64::NEG_INFINITY, f64::max);
    (size.is_finite() && mean_m.is_finite() && better > MUCH_BETTER).then_some((size, mean_m, ROUGHLY * (walls - alone)))
}

/// Instead of a body that is seen aside: None where the phases do not grow with the range.
pub fn find(evidence: &Evidence, training: &[Sums], bearing: Bearing, nats: f64) -> Option<Candidate> {
    let radar = &evidence.radar;
    let frames: Vec<[f64; 3]> = training.iter().map(|sums| sums.sine(radar)).collect();
    let (places, wave) = (along(radar), TAU / radar.wavelength_m());
    let walls = WallBearings::new(evidence);
    let of_walls = |size: f64, mean_m: f64, power: f64| {
        let off = |range_m: f64, rx: usize| -size * (range_m / mean_m).powf(power) * wave * places[rx];
        walls.as_ref().map_or(0.0, |walls| walls.log_likelihood(off))
    };
    let (size, mean_m, walls_gain) = later(&frames, of_walls)?;
    // Radian of a beat of one hertz, by receiver.
    let beat_hz = 2.0 * radar.slope_hz_per_s * mean_m / SPEED_OF_LIGHT;
    let turns: Vec<f64> = places.iter().map(|x| -size * wave * x / beat_hz).collect();
    let farthest = turns.iter().copied().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
    // The ratio of the walls' likelihoods, whose numbers the body gave, is one on average by chance: a p-value may be divided by it.
    let p_value = (bearing.p_value * (-walls_gain).exp()).clamp(f64::MIN_POSITIVE, 1.0);
    let place = Place { rx: Some((1..radar.rx_m.len()).collect()), ..Place::at(Stage::Receiver) };
    Some(Candidate {
        errs_alike: true,
        statement: format!(
            "Between the receivers everything is turned in proportion to its range, by {:.2} radian from the first to the last at \
             {mean_m:.1} m: as if the last one were sampled {:.1} ns later than the first.",
            farthest * beat_hz,
            1e9 * farthest / TAU
        ),
        energy: energy_beyond_noise(evidence) * (farthest * beat_hz).powi(2) / 3.0,
        correction: Correction::inverse(Volume::KEPT, {
            let (radar, clutter): (Radar, _) = (radar.clone(), evidence.clutter().to_vec());
            // Of what moves: static clutter would wrap around the chirps' ends, and how strong it is in every receiver is free.
            let add_clutter = move |cube: &mut Cube, sign: f64| {
                let samples = cube.dims[4];
                cube.each_chirp(|[_, channel, _], chirp| {
                    let clutter = &clutter[channel * samples..][..samples];
                    chirp.iter_mut().zip(clutter).for_each(|(value, clutter)| *value += sign * clutter);
                });
            };
            move |cube: &mut Cube| {
                let receivers = cube.dims[2];
                let lever = |delay_s: f64| radar.slope_hz_per_s * delay_s;
                add_clutter(cube, -1.0);
                undo::delay_phase(cube, &radar, lever, |[_, channel, _]| turns[channel % receivers]);
                add_clutter(cube, 1.0);
            }
        }),
        ..Candidate::new(Behaviour::DelayProportionalPhaseByReceiver, place, p_value, nats)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_grows_with_the_range_is_sampled_later() {
        // A body that walks from 2.5 to 3.5 m, known to a fiftieth.
        let walk = |power: f64| -> Vec<[f64; 3]> {
            let at = |i: usize| (2.5 + i as f64 / 8.0, if i.is_multiple_of(2) { 0.002 } else { -0.002 });
            (0..9).map(at).map(|(range, error): (f64, f64)| [0.1 * (range / 3.0).powf(power) + error, range, 1.0]).collect()
        };
        let nothing = |_: f64, _: f64, _: f64| 0.0;
        let (size, mean_m, _) = later(&walk(LATER), nothing).unwrap();
        assert!((size - 0.1).abs() < 0.002 && (mean_m - 3.0).abs() < 1e-9, "{size} at {mean_m}");
        assert!(ASIDE.iter().all(|&power| later(&walk(power), nothing).is_none()));
        // Walls that are seen where they are say that it is the body; walls that are turned as they should be say what the body hides.
        let walls = |of: f64| move |size: f64, _: f64, power: f64| if size * power == of { 0.0 } else { -40.0 };
        assert!(later(&walk(LATER), walls(0.0)).is_none());
        let near: Vec<[f64; 3]> = walk(LATER).into_iter().take(2).chain(walk(LATER).into_iter().take(2)).collect();
        assert!(later(&near, nothing).is_none());
        assert!(later(&near, |_, _, power| if power == LATER { 0.0 } else { -40.0 }).is_some());
    }
}
