//! Conventions and numerics, checked before any physics is named (DIAGNOSIS.md 3.1). A wrong convention is reported
//! as that.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::cube::Loaded;
use super::evidence::{Evidence, spectrum};
use super::prediction::Point;
use super::support::Support;
use crate::radar::Radar;

/// One thing that was checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    pub check: String,
    pub expected: String,
    pub found: String,
    pub ok: bool,
}

impl Check {
    fn new(check: &str, expected: impl Into<String>, found: impl Into<String>, ok: bool) -> Self {
        Self { check: check.into(), expected: expected.into(), found: found.into(), ok }
    }
}

/// How much stronger a wrong convention must fit before it is believed, dB of energy at the predicted cells.
const CLEARLY_DB: f64 = 6.0;
/// Largest shift of the body that counts as an effect and not as a wrong scene.
const CALIBRATION_M: f64 = 0.6;
/// A cell counts as a return above this many times the noise.
const RETURN: f64 = 20.0;

/// All checks.
pub fn audit(evidence: &Evidence) -> Vec<Check> {
    let mut checks = channels(evidence);
    checks.push(rail(evidence));
    if !evidence.is_real() {
        checks.push(iq_order(evidence));
    }
    checks.extend(doppler_sign(evidence));
    checks.extend(body_place(evidence));
    checks.extend(transmitter_order(evidence));
    checks.extend(room_ranges(evidence));
    checks.extend(numerics(evidence));
    checks
}

/// Whether a check is about a convention that must hold before physics is looked for.
pub fn is_convention(check: &Check) -> bool {
    ["iq_order", "doppler_sign", "tx_order", "body_place", "room"].contains(&check.check.as_str())
}

/// Why nothing can be said about a recording, if so.
pub fn undecidable(evidence: &Evidence, checks: &[Check]) -> Option<String> {
    if let Some(bad) = checks.iter().find(|check| check.check == "channels" && !check.ok) {
        return Some(format!("a channel holds no signal: {}", bad.found));
    }
    let samples = evidence.cube.dims[4];
    let loops = (evidence.cube.dims[3] * evidence.split.training.len()) as f64;
    let strongest = (0..evidence.cube.channels())
        .flat_map(|channel| {
            let variance = evidence.noise()[channel].max(f64::MIN_POSITIVE);
            spectrum(&evidence.still()[channel * samples..][..samples])
                .into_iter()
                .map(move |value| value.norm_sqr() * loops / variance)
        })
        .fold(0.0, f64::max);
    let moving = evidence.maps().iter().copied().fold(0.0, f32::max);
    // The mean of many cells' strongest noise value is about its logarithm.
    if strongest < RETURN && moving < RETURN as f32 {
        return Some(format!(
            "too noisy: neither a static nor a moving return stands out (strongest {:.0} dB over the noise)",
            10.0 * strongest.max(f64::from(moving)).log10()
        ));
    }
    None
}

fn channels(evidence: &Evidence) -> Vec<Check> {
    let dead: Vec<String> = (0..evidence.cube.channels())
        .filter(|&channel| {
            (0..evidence.cube.dims[0]).all(|frame| {
                let values = evidence.cube.channel(frame, channel);
                values.iter().all(|value| *value == values[0])
            })
        })
        .map(|channel| format!("tx {} rx {}", channel / evidence.cube.dims[2], channel % evidence.cube.dims[2]))
        .collect();
    let found = if dead.is_empty() { "all channels vary".into() } else { format!("constant: {}", dead.join(", ")) };
    vec![Check::new("channels", "no channel is constant or missing", found, dead.is_empty())]
}

/// Samples that pile up at a converter's rail.
fn rail(evidence: &Evidence) -> Check {
    let [low, high] = evidence.extremes;
    let at = |value: f64, rail: f64| (value - rail).abs() < 0.5;
    let parts = evidence.cube.samples.iter().flat_map(|value| [value.re, value.im]);
    let (mut count, mut all) = (0usize, 0usize);
    for part in parts {
        all += 1;
        count += usize::from(at(part, low) || at(part, high));
    }
    let share = count as f64 / all.max(1) as f64;
    // The extremes of a recording without clipping are reached once or twice.
    let ok = evidence.is_real() || share < 1e-4;
    Check::new(
        "converter_range",
        "the extreme codes are rare",
        format!("{:.4} % of the samples lie on {low} or {high}", 100.0 * share),
        ok,
    )
}

/// Static echoes lie at the room's delays; with I and Q swapped their mirror images do. Nothing can be said of an
/// unknown room: its far returns may fill the upper half of the spectrum.
fn iq_order(evidence: &Evidence) -> Check {
    let expected = "static echoes at the beat frequencies of the room's ranges";
    if evidence.room.is_none() {
        return Check::new("iq_order", expected, "cannot be told without the room's size", true);
    }
    let support = Support::new(&evidence.radar, evidence.room.as_ref());
    let outside = |chirp: &[Complex64]| -> f64 {
        support.project(chirp).iter().zip(chirp).map(|(inside, value)| (value - inside).norm_sqr()).sum()
    };
    let samples = evidence.cube.dims[4];
    let (mut as_is, mut swapped) = (0.0, 0.0);
    for chirp in evidence.still().chunks_exact(samples) {
        as_is += outside(chirp);
        swapped += outside(&chirp.iter().map(Complex64::conj).collect::<Vec<_>>());
    }
    let db = 10.0 * (as_is.max(1e-30) / swapped.max(1e-30)).log10();
    let ok = db < CLEARLY_DB;
    let hint = if ok { "" } else { ": I and Q are swapped, or the samples conjugated" };
    Check::new("iq_order", expected, format!("{db:+.1} dB left outside them, against the conjugated samples{hint}"), ok)
}

fn far_m(evidence: &Evidence) -> Option<f64> {
    evidence.room.as_ref().and_then(|room| room.farthest_m())
}

/// Energy near the predicted cells of the body, per predicted point; `flip` mirrors the velocity, `scale` the range.
fn energy_at(evidence: &Evidence, cell: impl Fn(&Point) -> Option<[f64; 2]>) -> f64 {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let Some(body) = &evidence.body else { return 0.0 };
    let maps = evidence.maps();
    let mut hit = vec![false; maps.len()];
    for (frame, points) in body.frames.iter().enumerate() {
        for [range_m, velocity] in points.iter().filter_map(&cell) {
            let bin = range_m / evidence.radar.range_resolution_m();
            let doppler = velocity / evidence.radar.velocity_resolution_mps();
            if doppler.abs() < 2.5 {
                continue;
            }
            let (bin, doppler) =
                ((bin.round() as i64).rem_euclid(samples as i64), (doppler.round() as i64).rem_euclid(loops as i64));
            hit[(frame * loops + doppler as usize) * samples + bin as usize] = true;
        }
    }
    let (sum, count) = hit
        .iter()
        .zip(maps)
        .filter(|(hit, _)| **hit)
        .fold((0.0, 0.0), |(s, n), (_, value)| (s + f64::from(*value).max(1.0).ln(), n + 1.0));
    if count > 0.0 { 10.0 / std::f64::consts::LN_10 * sum / count } else { 0.0 }
}

/// Range and radial velocity of a point of the body.
pub fn range_and_velocity(point: &Point, radar: &Radar) -> [f64; 2] {
    let centre = radar.centre_m();
    let to: [f64; 3] = std::array::from_fn(|axis| point.position_m[axis] - centre[axis]);
    let range = to.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-9);
    [range, to.iter().zip(&point.velocity_mps).map(|(x, v)| x * v).sum::<f64>() / range]
}

fn doppler_sign(evidence: &Evidence) -> Option<Check> {
    evidence.body.as_ref()?;
    let as_is = energy_at(evidence, |point| Some(range_and_velocity(point, &evidence.radar)));
    let flipped = energy_at(evidence, |point| {
        let [range, velocity] = range_and_velocity(point, &evidence.radar);
        Some([range, -velocity])
    });
    let ok = flipped - as_is < CLEARLY_DB;
    let hint = if ok { "" } else { ": the Doppler axis runs the other way" };
    Some(Check::new(
        "doppler_sign",
        "a receding body has a positive Doppler frequency",
        format!("{as_is:.1} dB where the motion puts the body, {flipped:.1} dB at the opposite velocities{hint}"),
        ok,
    ))
}

/// Whether the body is where the motion says, or somewhere else, or the motion belongs to other frames.
fn body_place(evidence: &Evidence) -> Option<Check> {
    let body = evidence.body.as_ref()?;
    let level = |shift_m: f64| {
        energy_at(evidence, |point| {
            let [range, velocity] = range_and_velocity(point, &evidence.radar);
            (range + shift_m > 0.2).then_some([range + shift_m, velocity])
        })
    };
    let here = level(0.0);
    let step = evidence.radar.range_resolution_m().max(0.1);
    let shifts = (-30..=30).map(|i| i as f64 * step);
    let (best_m, best) =
        shifts.map(|shift| (shift, level(shift))).fold((0.0, f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a });
    let moves = body
        .frames
        .iter()
        .flatten()
        .any(|point| range_and_velocity(point, &evidence.radar)[1].abs() > 2.5 * evidence.radar.velocity_resolution_mps());
    if !moves {
        return None;
    }
    // Nearer than that it is a matter of calibration, which has effects of its own.
    let ok = best - here < CLEARLY_DB || best_m.abs() < CALIBRATION_M;
    let found = if ok {
        format!("{here:.1} dB over the noise at the predicted ranges and velocities")
    } else {
        format!(
            "{here:.1} dB there, but {best:.1} dB {:.2} m {}: the body is in the wrong place, or the motion belongs to other frames",
            best_m.abs(),
            if best_m > 0.0 { "farther" } else { "nearer" }
        )
    };
    Some(Check::new("body_place", "moving energy where the motion puts the body", found, ok))
}

/// With several transmitters: the order whose array phases agree best with the body's direction.
fn transmitter_order(evidence: &Evidence) -> Option<Check> {
    let [_, transmitters, receivers, loops, samples] = evidence.cube.dims;
    let body = evidence.body.as_ref().filter(|_| (2..=4).contains(&transmitters))?;
    let radar = &evidence.radar;
    // Phase of every transmitter against the first over the strongest cell near the body, with geometry and slot taken out.
    let mut sums = vec![vec![Complex64::ZERO; transmitters]; transmitters];
    for &frame in &evidence.split.training {
        let Some(points) = body.frames.get(frame).filter(|points| !points.is_empty()) else { continue };
        let maps: Vec<Vec<Complex64>> = (0..transmitters).map(|tx| evidence.range_doppler(frame, tx * receivers)).collect();
        for point in points.iter().step_by(points.len().div_ceil(200).max(1)) {
            let [range, velocity] = range_and_velocity(point, radar);
            let bin = (range / radar.range_resolution_m()).round() as usize;
            let doppler = (velocity / radar.velocity_resolution_mps()).round() as i64;
            if bin >= samples || doppler.abs() < 3 {
                continue;
            }
            let cell = doppler.rem_euclid(loops as i64) as usize * samples + bin;
            let distance = |tx: usize| {
                let antenna = radar.tx_position_m(tx);
                (0..3).map(|axis| (point.position_m[axis] - antenna[axis]).powi(2)).sum::<f64>().sqrt()
            };
            for slot in 1..transmitters {
                for (antenna, sum) in sums[slot].iter_mut().enumerate() {
                    let path = distance(antenna) - distance(0) + 2.0 * velocity * slot as f64 * radar.chirp_period_s;
                    let turns = path / radar.wavelength_m();
                    *sum += maps[slot][cell] * maps[0][cell].conj() * Complex64::cis(-std::f64::consts::TAU * turns);
                }
            }
        }
    }
    let best: Vec<usize> = (1..transmitters)
        .map(|slot| (1..transmitters).max_by(|&a, &b| sums[slot][a].norm().total_cmp(&sums[slot][b].norm())).unwrap_or(slot))
        .collect();
    let as_stated = (1..transmitters).all(|slot| {
        let stated = sums[slot][slot].norm();
        sums[slot].iter().skip(1).all(|sum| sum.norm() <= 1.5 * stated)
    });
    let order: Vec<String> = std::iter::once(0).chain(best).map(|tx| tx.to_string()).collect();
    let found = if as_stated {
        "array phases agree with the stated order".into()
    } else {
        format!("slots fit the antennas {}", order.join(", "))
    };
    Some(Check::new("tx_order", "transmitters fire in the order of tx_m", found, as_stated))
}

/// Static echoes beyond the farthest corner contradict the room, or the range axis.
fn room_ranges(evidence: &Evidence) -> Option<Check> {
    let far = far_m(evidence)?;
    let radar = &evidence.radar;
    if far > 0.8 * radar.max_range_m() {
        return None;
    }
    let samples = evidence.cube.dims[4];
    let bin_of = |range: f64| (range / radar.range_resolution_m()) as usize;
    let (mut inside, mut beyond) = (0.0f64, 0.0f64);
    for channel in 0..evidence.cube.channels() {
        let spectrum = spectrum(&evidence.still()[channel * samples..][..samples]);
        for (bin, value) in spectrum.iter().enumerate().take(evidence.range_bins()) {
            let range = bin as f64 * radar.range_resolution_m();
            if range > far + 0.6 && bin < bin_of(radar.max_range_m() * 0.9) {
                beyond = beyond.max(value.norm_sqr());
            } else if range > 0.6 && range <= far {
                inside = inside.max(value.norm_sqr());
            }
        }
    }
    let ratio = 10.0 * (beyond.max(1e-30) / inside.max(1e-30)).log10();
    let ok = ratio < -3.0;
    let hint = if ok { "" } else { ": the room's size contradicts the ranges" };
    Some(Check::new(
        "room",
        format!("static echoes end at the farthest corner, {far:.2} m"),
        format!("strongest echo beyond it {ratio:.1} dB against those inside{hint}"),
        ok,
    ))
}

/// What the answer rests on numerically.
fn numerics(evidence: &Evidence) -> Vec<Check> {
    let mut checks = vec![Check::new("precision", "double precision", "all sums and transforms in double precision", true)];
    if let Some(body) = &evidence.body {
        let (points, area) = body.frames.iter().flatten().fold((0.0, 0.0), |(n, sum), point| (n + 1.0, sum + point.area_m2));
        let spacing = if points > 0.0 { f64::sqrt(area / points) } else { 0.0 };
        let bin = evidence.radar.range_resolution_m();
        checks.push(Check::new(
            "surface_sampling",
            format!("points of the body much closer than a range bin of {:.0} mm", 1e3 * bin),
            format!("{:.0} mm apart; only powers and delays are predicted from them, no carrier phases", 1e3 * spacing),
            points > 0.0 && spacing < 0.5 * bin,
        ));
    }
    checks
}

/// What could not be looked for, and why.
pub fn limits(loaded: &Loaded, body: bool, room: bool) -> Vec<String> {
    let mut notes = vec![];
    if !body {
        notes.push("no tracked body: pose, timing and body effects and multiples of the body were not looked for".into());
    }
    if !room {
        notes.push(
            "the room's size is unknown: wall images were not looked for, and echoes of any range count as the room".into(),
        );
    }
    if loaded.is_real() {
        notes.push("no quadrature receiver: the negative half of the spectrum and I/Q imbalance cannot be looked at".into());
    }
    if let Some(loops) = loaded.split.block_loops {
        notes.push(format!("few frames: blocks of {loops} loops take their place, and some are held out"));
    }
    notes
}
