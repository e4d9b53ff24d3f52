//! Conventions and numerics, checked before any physics is named (DIAGNOSIS.md 3.1). A wrong convention is reported
//! as that.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::cube::Loaded;
use super::evidence::{Evidence, spectrum};
use super::prediction::{BodyPrediction, Point};
use super::statistics::median;
use super::support::Support;
use crate::paths::distance;
use crate::radar::Radar;
use crate::room::Boundary;

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
const CALIBRATION_M: f64 = 0.45;
/// A cell counts as a return above this many times the noise.
const RETURN: f64 = 20.0;
/// Least energy over the noise where the motion puts the body.
const PRESENT_DB: f64 = 2.0;
/// Sine of the direction by which a body must be aside, and how well the receivers' phases must then agree, before it is
/// believed: receivers that differ by chance are in no such order.
const ASIDE: f64 = 0.3;
const ALIGNED: f64 = 0.93;
/// How far a motion may leave the room: the radar's place is known no better.
const OUTSIDE_M: f64 = 0.3;
/// A channel whose strongest return is weaker than the middle channel's by this much hears nothing.
const DEAF_DB: f64 = 20.0;
/// Share of the samples at the ends of the range from which on nothing can be restored.
const SATURATED: f64 = 0.3;
/// Fewest samples of a chirp, and fewest chirps of a transmitter in a frame, that say anything.
const FEWEST_SAMPLES: usize = 16;
const FEWEST_LOOPS: usize = 2;

/// All checks.
pub fn audit(evidence: &Evidence) -> Vec<Check> {
    let mut checks = channels(evidence);
    checks.push(rail(evidence));
    if !evidence.is_real() {
        checks.push(iq_order(evidence));
    }
    checks.extend(doppler_sign(evidence));
    checks.extend(body_in_room(evidence));
    checks.extend(body_place(evidence));
    checks.extend(body_direction(evidence));
    checks.extend(transmitter_order(evidence));
    checks.extend(room_ranges(evidence));
    checks.extend(numerics(evidence));
    checks
}

/// Whether a check is about a convention that must hold before physics is looked for.
pub fn is_convention(check: &Check) -> bool {
    ["iq_order", "doppler_sign", "tx_order", "body_in_room", "body_place", "body_direction", "room"]
        .contains(&check.check.as_str())
}

/// Whether a body was expected and is heard nowhere.
pub fn is_silent(check: &Check) -> bool {
    check.check == "body_place" && check.found.contains(SILENT)
}

/// Why nothing can be said about a recording, if so.
pub fn undecidable(evidence: &Evidence, checks: &[Check]) -> Option<String> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    if samples < FEWEST_SAMPLES || loops < FEWEST_LOOPS {
        return Some(format!(
            "too little: {samples} samples a chirp and {loops} loops a frame, where {FEWEST_SAMPLES} and {FEWEST_LOOPS} are the \
             least that say anything"
        ));
    }
    if let Some(bad) = checks.iter().find(|check| check.check == "channels" && !check.ok) {
        return Some(format!("a channel holds no signal: {}", bad.found));
    }
    let at_rail = rail_share(evidence);
    if at_rail > SATURATED {
        return Some(format!("saturated: {:.0} % of the samples lie at the ends of the converter's range", 100.0 * at_rail));
    }
    let strongest = (0..evidence.cube.channels()).map(|channel| strongest_still(evidence, channel)).fold(0.0, f64::max);
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

/// Power of a channel's strongest static return over the noise of its mean.
fn strongest_still(evidence: &Evidence, channel: usize) -> f64 {
    let samples = evidence.cube.dims[4];
    let loops = (evidence.cube.dims[3] * evidence.split.training.len()) as f64;
    let variance = evidence.noise()[channel].max(f64::MIN_POSITIVE);
    let spectrum = spectrum(&evidence.still()[channel * samples..][..samples]);
    spectrum.into_iter().map(|value| value.norm_sqr() * loops / variance).fold(0.0, f64::max)
}

fn channels(evidence: &Evidence) -> Vec<Check> {
    let [frames, _, rx, ..] = evidence.cube.dims;
    let name = |channel: usize| format!("tx {} rx {}", channel / rx, channel % rx);
    let is_constant = |values: &[Complex64], part: fn(&Complex64) -> f64| values.iter().all(|v| part(v) == part(&values[0]));
    let mut bad: Vec<String> = vec![];
    for channel in 0..evidence.cube.channels() {
        let of_frame = |frame: usize| evidence.cube.channel(frame, channel);
        let both = |frame: &usize| is_constant(of_frame(*frame), |v| v.re) && is_constant(of_frame(*frame), |v| v.im);
        let dead: Vec<usize> = (0..frames).filter(both).collect();
        if dead.len() == frames {
            bad.push(format!("{} is constant", name(channel)));
        } else if let (Some(first), Some(last)) = (dead.first(), dead.last()) {
            let frames = if dead.len() == 1 { "frame".into() } else { format!("{} frames from", dead.len()) };
            let until = if dead.len() == 1 { String::new() } else { format!(" to {last}") };
            bad.push(format!("{} is constant in {frames} {first}{until}", name(channel)));
        } else if !evidence.is_real() {
            for (what, part) in [("I", (|v| v.re) as fn(&Complex64) -> f64), ("Q", |v| v.im)] {
                if (0..frames).all(|frame| is_constant(of_frame(frame), part)) {
                    bad.push(format!("{what} of {} is constant", name(channel)));
                }
            }
        }
    }
    if bad.is_empty() {
        let returns: Vec<f64> = (0..evidence.cube.channels()).map(|channel| strongest_still(evidence, channel)).collect();
        let middle = median(&mut returns.clone());
        let deaf = |&channel: &usize| {
            returns[channel] < RETURN && 10.0 * (middle / returns[channel].max(f64::MIN_POSITIVE)).log10() > DEAF_DB
        };
        bad.extend((0..returns.len()).filter(deaf).map(|channel| format!("{} holds nothing but noise", name(channel))));
    }
    let found = if bad.is_empty() { "all channels vary".into() } else { bad.join(", ") };
    vec![Check::new("channels", "no channel is constant, missing or deaf", found, bad.is_empty())]
}

/// Share of the sampled components that lie at the recording's extremes.
fn rail_share(evidence: &Evidence) -> f64 {
    let [low, high] = evidence.extremes;
    // Half a code, or a hair of the range for samples that are no codes.
    let tolerance = if evidence.codes.is_some() { 0.5 } else { 1e-6 * (high - low) };
    let at = |value: f64, rail: f64| (value - rail).abs() <= tolerance;
    // Of a receiver without quadrature, the imaginary part was never sampled.
    let sampled = if evidence.is_real() { 1 } else { 2 };
    let parts = evidence.cube.samples.iter().flat_map(|value| [value.re, value.im].into_iter().take(sampled));
    let (mut count, mut all) = (0usize, 0usize);
    for part in parts {
        all += 1;
        count += usize::from(at(part, low) || at(part, high));
    }
    count as f64 / all.max(1) as f64
}

/// Samples that pile up at a converter's rail.
fn rail(evidence: &Evidence) -> Check {
    let [low, high] = evidence.extremes;
    let share = rail_share(evidence);
    // The extremes of a recording without clipping are reached once or twice.
    let ok = share < 1e-4;
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

/// Energy near cells of the body's points, per cell: those of a point in the frame so many frames `later` in the motion.
fn energy_at(evidence: &Evidence, later: isize, cell: impl Fn(&Point) -> Option<[f64; 2]>) -> f64 {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let Some(body) = &evidence.body else { return 0.0 };
    let maps = evidence.maps();
    let mut hit = vec![false; maps.len()];
    for frame in 0..body.frames.len() {
        let Some(points) = frame.checked_add_signed(later).and_then(|shown| body.frames.get(shown)) else { continue };
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
    let as_is = energy_at(evidence, 0, |point| Some(range_and_velocity(point, &evidence.radar)));
    let flipped = energy_at(evidence, 0, |point| {
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

/// Whether the motion stays in the room.
fn body_in_room(evidence: &Evidence) -> Option<Check> {
    let (body, room) = (evidence.body.as_ref()?, evidence.room.as_ref()?);
    let beyond = |boundary: Boundary| -> Option<f64> {
        let (distance, (axis, sign)) = (room.distance_m(boundary)?, boundary.axis());
        // The middle of the body's points: a hand may reach through a wall that is not where it was measured.
        let of_frame = |points: &Vec<Point>| {
            let mut along: Vec<f64> = points.iter().map(|point| sign * point.position_m[axis] - distance).collect();
            (!along.is_empty()).then(|| median(&mut along))
        };
        body.frames.iter().filter_map(of_frame).reduce(f64::max)
    };
    let farthest = room.boundaries().into_iter().filter_map(|boundary| Some((boundary, beyond(boundary)?)));
    let (boundary, outside) = farthest.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let ok = outside <= OUTSIDE_M;
    let found = if ok {
        "it does".into()
    } else {
        let distance = room.distance_m(boundary).unwrap_or_default();
        format!(
            "the motion puts the body {outside:.2} m behind the {} boundary, which is {distance:.2} m away: the body's place or the \
             room's size is wrong",
            boundary.name()
        )
    };
    Some(Check::new("body_in_room", "the body stays in the room", found, ok))
}

const SILENT: &str = "no body is heard where the motion puts it, nor at other ranges";
/// Frames by which a clock may be wrong.
const LATE: isize = 3;

/// Whether the body is where the motion says, or somewhere else, or the motion belongs to other frames.
pub fn body_place(evidence: &Evidence) -> Option<Check> {
    let body = evidence.body.as_ref()?;
    let level = |shift_m: f64, later: isize| {
        energy_at(evidence, later, |point| {
            let [range, velocity] = range_and_velocity(point, &evidence.radar);
            (range + shift_m > 0.2).then_some([range + shift_m, velocity])
        })
    };
    let here = level(0.0, 0);
    let step = evidence.radar.range_resolution_m().max(0.1);
    let shifts = (-30..=30).map(|i| i as f64 * step);
    let (best_m, best) =
        shifts.map(|shift| (shift, level(shift, 0))).fold((0.0, f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a });
    let moves = body
        .frames
        .iter()
        .flatten()
        .any(|point| range_and_velocity(point, &evidence.radar)[1].abs() > 2.5 * evidence.radar.velocity_resolution_mps());
    if !moves {
        return None;
    }
    // Nearer than that it is a matter of calibration, which has effects of its own.
    let elsewhere = best - here >= CLEARLY_DB && best_m.abs() >= CALIBRATION_M;
    // And a clock that is wrong by a few frames has a name.
    let (late, then) =
        (-LATE..=LATE).map(|later| (later, level(0.0, later))).fold((0, f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a });
    let clock = late != 0 && then >= PRESENT_DB && then - here >= CLEARLY_DB && then >= best;
    let ok = clock || !elsewhere && (here >= PRESENT_DB || best - here >= CLEARLY_DB);
    let found = if clock {
        format!(
            "{here:.1} dB over the noise there, but {then:.1} dB {} frames {}",
            late.abs(),
            if late > 0 { "later" } else { "earlier" }
        )
    } else if ok {
        format!("{here:.1} dB over the noise at the predicted ranges and velocities")
    } else if !elsewhere {
        format!("{here:.1} dB over the noise there: {SILENT}")
    } else {
        format!(
            "{here:.1} dB there, but {best:.1} dB {:.2} m {}: the body is in the wrong place, or the motion belongs to other frames",
            best_m.abs(),
            if best_m > 0.0 { "farther" } else { "nearer" }
        )
    };
    Some(Check::new("body_place", "moving energy where the motion puts the body", found, ok))
}

/// Visits the cells of the body's points that move, in the training frames, where they hold a return that the same range has
/// not at all velocities (a spur does): `see` gets the point, its radial velocity, and what the channels hold there.
fn moving_cells(evidence: &Evidence, body: &BodyPrediction, channels: &[usize], mut see: impl FnMut(&Point, f64, &[Complex64])) {
    let ([_, _, _, loops, samples], radar) = (evidence.cube.dims, &evidence.radar);
    for &frame in &evidence.split.training {
        let Some(points) = body.frames.get(frame).filter(|points| !points.is_empty()) else { continue };
        let maps: Vec<Vec<Complex64>> = channels.iter().map(|&channel| evidence.range_doppler(frame, channel)).collect();
        let usual: Vec<f64> = (0..samples)
            .map(|bin| median(&mut (0..loops).map(|row| maps[0][row * samples + bin].norm_sqr()).collect::<Vec<_>>()))
            .collect();
        for point in points.iter().step_by(points.len().div_ceil(200).max(1)) {
            let [range, velocity] = range_and_velocity(point, radar);
            let bin = (range / radar.range_resolution_m()).round() as usize;
            let doppler = (velocity / radar.velocity_resolution_mps()).round() as i64;
            if bin >= samples || doppler.abs() < 3 {
                continue;
            }
            let cell = doppler.rem_euclid(loops as i64) as usize * samples + bin;
            if maps[0][cell].norm_sqr() < RETURN * usual[bin] {
                continue;
            }
            see(point, velocity, &maps.iter().map(|map| map[cell]).collect::<Vec<_>>());
        }
    }
}

/// What a channel's cell has in common with the first channel's once a longer path, in metres, is taken out.
fn aligned(own: Complex64, first: Complex64, path_m: f64, radar: &Radar) -> Complex64 {
    own * first.conj() * Complex64::cis(-std::f64::consts::TAU * path_m / radar.wavelength_m())
}

/// Whether the receivers' phases in the body's cells come from where the motion puts the body.
fn body_direction(evidence: &Evidence) -> Option<Check> {
    let receivers = evidence.cube.dims[2];
    let (body, radar) = (evidence.body.as_ref().filter(|_| receivers >= 3)?, &evidence.radar);
    let mut sums = vec![Complex64::ZERO; receivers];
    // Those of the first transmitter.
    let channels: Vec<usize> = (0..receivers).collect();
    moving_cells(evidence, body, &channels, |point, _, seen| {
        let path = |rx: usize| distance(point.position_m, radar.rx_position_m(rx));
        for (rx, sum) in sums.iter_mut().enumerate() {
            *sum += aligned(seen[rx], seen[0], path(rx) - path(0), radar);
        }
    });
    let phasors: Vec<Complex64> = sums.iter().filter(|sum| sum.norm() > 0.0).map(|sum| sum / sum.norm()).collect();
    if phasors.len() < receivers {
        return None;
    }
    // A shift of the direction's sine turns every receiver by its place across.
    let fit = |sine: f64| {
        let turned = |rx: usize| {
            let across = radar.rx_position_m(rx)[0] - radar.rx_position_m(0)[0];
            phasors[rx] * Complex64::cis(std::f64::consts::TAU * across * sine / radar.wavelength_m())
        };
        (0..receivers).map(turned).sum::<Complex64>().norm() / receivers as f64
    };
    let best = (-50..=50).map(|step| 0.02 * f64::from(step)).max_by(|a, b| fit(*a).total_cmp(&fit(*b)))?;
    let ok = best.abs() < ASIDE || fit(best) < ALIGNED || fit(0.0) > 0.75 * fit(best);
    let found = if ok {
        "array phases do not contradict it".into()
    } else {
        let side = if best > 0.0 { "right" } else { "left" };
        let degrees = best.abs().asin().to_degrees();
        format!(
            "array phases put it {degrees:.0}° farther to the {side}: the body is in the wrong place, or the receivers in another order"
        )
    };
    Some(Check::new("body_direction", "the body in the direction where the motion puts it", found, ok))
}

/// With several transmitters: the order whose array phases agree best with the body's direction.
fn transmitter_order(evidence: &Evidence) -> Option<Check> {
    let [_, transmitters, receivers, ..] = evidence.cube.dims;
    let body = evidence.body.as_ref().filter(|_| (2..=4).contains(&transmitters))?;
    let radar = &evidence.radar;
    // Phase of every transmitter against the first over the strongest cell near the body, with geometry and slot taken out.
    let mut sums = vec![vec![Complex64::ZERO; transmitters]; transmitters];
    let channels: Vec<usize> = (0..transmitters).map(|tx| tx * receivers).collect();
    moving_cells(evidence, body, &channels, |point, velocity, seen| {
        let path = |tx: usize| distance(point.position_m, radar.tx_position_m(tx));
        for slot in 1..transmitters {
            let moved = 2.0 * velocity * slot as f64 * radar.chirp_period_s;
            for (antenna, sum) in sums[slot].iter_mut().enumerate() {
                *sum += aligned(seen[slot], seen[0], path(antenna) - path(0) + moved, radar);
            }
        }
    });
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
            "the room's size is unknown: wall images were not looked for, and echoes of any range (with I and Q, up to half the \
             unambiguous one) count as the room"
                .into(),
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
