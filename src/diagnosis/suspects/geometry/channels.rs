//! Receivers that differ, and bodies that stand to one side: phases and powers between receivers in the body's cells.
//!
//! Every cell that the body fills comes from a direction that the prediction knows, so what remains of the phase between
//! two receivers belongs to the receivers. A phase that grows in proportion to the receivers' places is a direction, and
//! might as well be the body's; anything else, and any difference of power, cannot be. Neither depends on amplitudes.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use nalgebra::DVector;
use num_complex::Complex64;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::change::{Change, Moves};
use super::coupling;
use super::estimated::Estimated;
use super::places::{self, Moments, neighbours};
use crate::diagnosis::power::{PowerModel, part_templates};
use crate::diagnosis::statistics::DECIBEL;
use crate::diagnosis::suspects::{paths::still_power, slow};
use crate::diagnosis::{BodyPrediction, Candidate, Correction, Estimate, Evidence, Place, Rung, statistics};
use crate::radar::Radar;

/// Expected power over the noise from which on a cell is used.
const LEAST_POWER: f32 = 10.0;
/// Cells of a group that is judged on its own, at least, and groups of a frame, at most.
const GROUP_CELLS: usize = 12;
const MOST_GROUPS: usize = 6;
/// Share of what stands still that may be left at low Doppler when it was taken out.
const STILL_LEFT: f64 = 1e-3;
/// What the power model's errors do to a phase and to a power between neighbouring receivers (half a wavelength).
const PHASE_FLOOR_RAD: f64 = 1.5 * PI / 180.0;
const GAIN_FLOOR_DB: f64 = 0.2;
/// Chance below which receivers are not alike.
const UNEVEN: f64 = 0.05;
/// Of the unevenness (squares), what a coupling may leave: a random one of four receivers lies so near to one that a
/// coupling makes with a probability of 1 %.
const BY_CHANCE: f64 = 0.1;
/// Cells that one independent draw is spread over by two Hann windows.
const CELLS_PER_DRAW: f64 = 2.25;

/// Sums over the cells of a frame after the predicted steering: products of every two receivers.
#[derive(Clone, Debug)]
pub struct Sums {
    /// `[rx, rx]`, the second one conjugated.
    pub products: Vec<Complex64>,
    /// Of the neighbours along x.
    pub along: Vec<Moments>,
    pub cells: f64,
    pub range_m: f64,
    /// Mean x of the cells' directions (unit vectors).
    pub sine: f64,
}

impl Sums {
    /// Of several groups of cells at once.
    pub fn together(groups: &[Self]) -> Self {
        let mut sum = groups[0].clone();
        sum.sine *= sum.cells;
        for group in &groups[1..] {
            sum.products.iter_mut().zip(&group.products).for_each(|(sum, product)| *sum += product);
            for (sum, own) in sum.along.iter_mut().zip(&group.along) {
                sum.iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
            }
            sum.cells += group.cells;
            sum.sine += group.sine * group.cells;
        }
        sum.sine /= sum.cells.max(1.0);
        sum
    }

    /// Without one of those that were put together; the mean direction stays.
    pub fn without(&self, part: &Self) -> Self {
        let mut rest = self.clone();
        rest.products.iter_mut().zip(&part.products).for_each(|(rest, product)| *rest -= product);
        for (rest, own) in rest.along.iter_mut().zip(&part.along) {
            rest.iter_mut().zip(own).for_each(|(rest, own)| *rest -= own);
        }
        rest.cells -= part.cells;
        rest
    }

    pub fn receivers(&self) -> usize {
        self.products.len().isqrt()
    }

    /// With the first receiver.
    fn cross(&self, rx: usize) -> Complex64 {
        self.products[rx * self.receivers()]
    }

    fn own(&self, rx: usize) -> f64 {
        self.products[rx * self.receivers() + rx].re
    }
}

/// A mean over frames and the standard error of it.
#[derive(Clone, Copy, Debug)]
struct Mean {
    value: f64,
    deviation: f64,
}

pub fn find(evidence: &Evidence, model: &PowerModel, body: &BodyPrediction, moves: Moves) -> Vec<Candidate> {
    let receivers = evidence.radar.rx_m.len();
    // One channel whose gain hopped was brought to its own mean, which need not be that of the others.
    let hopped = evidence.accepted.contains(&slow::channels::BEHAVES_LIKE);
    if receivers < 2 || hopped || evidence.accepted.contains(&"antenna_position") {
        return vec![];
    }
    let still = still_power(evidence);
    let units: Vec<Option<Vec<Sums>>> =
        (0..evidence.cube.dims[0]).into_par_iter().map(|frame| sums(evidence, model, body, &still, frame)).collect();
    let sums: Vec<Option<Sums>> = units.iter().map(|units| units.as_ref().map(|units| Sums::together(units))).collect();
    let of = |frames: &[usize]| frames.iter().filter_map(|&frame| sums[frame].clone()).collect::<Vec<Sums>>();
    let (training, held_out) = (of(&evidence.split.training), of(&evidence.split.held_out));
    if training.len() < 6 || held_out.is_empty() {
        return vec![];
    }
    let groups: Vec<&[Sums]> = units.iter().flatten().map(Vec::as_slice).collect();
    // Receivers that differ do so in every direction alike, but displaced ones may look as if they differed in the mean one.
    let displaced = places::find(evidence, &groups);
    if evidence.accepted.contains(&"channel_mismatch") {
        return displaced.into_iter().collect();
    }
    let coupled = if evidence.accepted.contains(&"mutual_coupling") { None } else { coupled(evidence, &training, &held_out) };
    // A coupling turns phases with the direction, too, and changes powers besides.
    match (displaced, coupled) {
        (Some(displaced), coupled) if coupled.as_ref().is_none_or(|coupled| coupled.gain < displaced.gain) => {
            return vec![displaced];
        }
        (_, Some(coupled)) => return vec![coupled],
        _ => {}
    }
    let Judgement { phases, gains, direction, own, bearing, aside, .. } = judge(&evidence.radar, &training);
    let together = unlike(&evidence.radar, &groups).filter(|together| together.p_value < own);
    let own = statistics::corrected(together.as_ref().map_or(own, |together| together.p_value), 2.0);
    let (places, wave) = (along(&evidence.radar), TAU / evidence.radar.wavelength_m());
    if own < UNEVEN {
        let amplitudes: Vec<Complex64> = std::iter::once(Complex64::ONE)
            .chain(
                phases.iter().zip(&gains).map(|(phase, gain)| Complex64::from_polar(10f64.powf(gain.value / 20.0), phase.value)),
            )
            .collect();
        let gain = together.map_or_else(|| likelihood_gain(&training, &held_out, &amplitudes), |together| together.gain);
        return (gain > 0.0).then(|| mismatch(evidence, &phases, &gains, amplitudes, own, gain)).into_iter().collect();
    }
    if aside < 0.05 {
        let amplitudes: Vec<Complex64> = places.iter().map(|x| Complex64::cis(-direction * wave * x)).collect();
        let gain = likelihood_gain(&training, &held_out, &amplitudes);
        let range_m = training.iter().map(|sums| sums.range_m).sum::<f64>() / training.len() as f64;
        return (gain > 0.0).then(|| aside_of(evidence, bearing, range_m, moves, aside, gain)).into_iter().collect();
    }
    vec![]
}

/// A coupling, where receivers do not differ in any other way.
fn coupled(evidence: &Evidence, training: &[Sums], held_out: &[Sums]) -> Option<Candidate> {
    let coupling = coupling::find(evidence, training, held_out)?;
    // Receivers that differ in any other way remain different without it.
    let undone = |sums: &Sums| coupling::uncoupled(&evidence.radar, sums, coupling.strength);
    let rest: Vec<Sums> = training.iter().map(undone).collect::<Option<_>>()?;
    let rest = judge(&evidence.radar, &rest);
    if rest.own <= UNEVEN {
        return None;
    }
    let mut candidate = coupling.candidate;
    // Any receivers may look like that by chance, if not to the last digit.
    if rest.unevenness > BY_CHANCE * judge(&evidence.radar, training).unevenness {
        candidate.look_alikes.push("channel_mismatch");
        candidate.look_alikes.dedup();
    }
    Some(candidate)
}

/// Places of the receivers along x, from the first one.
fn along(radar: &Radar) -> Vec<f64> {
    radar.rx_m.iter().map(|rx| rx[0] - radar.rx_m[0][0]).collect()
}

/// How the receivers differ from the first one.
struct Judgement {
    phases: Vec<Mean>,
    gains: Vec<Mean>,
    /// The part of the phases that is a direction, as a sine.
    direction: f64,
    /// Chance that the rest, and the powers, are the body's.
    own: f64,
    /// Sum of squares of the rest and of the gains, in units of their errors.
    unevenness: f64,
    bearing: Mean,
    /// Chance that the direction is the body's.
    aside: f64,
}

fn judge(radar: &Radar, training: &[Sums]) -> Judgement {
    let receivers = radar.rx_m.len();
    let freedom = training.len() as f64 - 1.0;
    let phases: Vec<Mean> = (1..receivers).map(|rx| phase(training, rx)).collect();
    let gains: Vec<Mean> = (1..receivers).map(|rx| gain_db(training, rx)).collect();
    // The part that is a direction: least squares through the receivers' places, of every frame on its own.
    let (places, wave) = (along(radar), TAU / radar.wavelength_m());
    let spread: f64 = places.iter().map(|x| x * x).sum();
    let sine = |phases: &[f64]| -phases.iter().zip(&places[1..]).map(|(phase, x)| phase * x).sum::<f64>() / (spread * wave);
    let values: Vec<f64> = phases.iter().map(|phase| phase.value).collect();
    let direction = if spread > 0.0 { sine(&values) } else { 0.0 };
    let rest: Vec<f64> = values.iter().zip(&places[1..]).map(|(phase, x)| phase + direction * wave * x).collect();

    let p = |value: f64, floor: f64, deviation: f64| tail((value.abs() - floor) / deviation.max(1e-12), freedom);
    let own = rest
        .iter()
        .zip(&phases)
        .map(|(rest, phase)| p(*rest, PHASE_FLOOR_RAD, phase.deviation))
        .chain(gains.iter().map(|gain| p(gain.value, GAIN_FLOOR_DB, gain.deviation)))
        .fold(1.0, f64::min);
    let in_errors = |value: f64, error: f64| (value / error.max(1e-12)).powi(2);
    let unevenness = rest.iter().zip(&phases).map(|(rest, phase)| in_errors(*rest, phase.deviation)).sum::<f64>()
        + gains.iter().map(|gain| in_errors(gain.value, gain.deviation)).sum::<f64>();
    let tried = 2.0 * receivers as f64;
    let own = statistics::corrected(own, tried);
    let bearing = {
        // One direction for all: its error from those of the phases, as if they erred together.
        let deviation =
            phases.iter().zip(&places[1..]).map(|(phase, x)| phase.deviation * x.abs()).sum::<f64>() / (spread * wave);
        Mean { value: direction, deviation }
    };
    let floor = PHASE_FLOOR_RAD / PI;
    let aside = if spread > 0.0 { statistics::corrected(p(bearing.value, floor, bearing.deviation), tried) } else { 1.0 };
    Judgement { phases, gains, direction, own, unevenness, bearing, aside }
}

/// Whether receivers are alike.
struct Unlike {
    p_value: f64,
    gain: f64,
}

/// From the groups of all frames: powers against the first one's, and what differs between the phases of neighbours of one
/// baseline, all at once. None where too few groups tell it.
fn unlike(radar: &Radar, frames: &[&[Sums]]) -> Option<Unlike> {
    let contrast = places::contrast(radar)?;
    let receivers = radar.rx_m.len();
    // As deviations; as bounds they are two of them.
    let floors: Vec<f64> = std::iter::repeat_n(0.5 * GAIN_FLOOR_DB / DECIBEL, receivers - 1)
        .chain(std::iter::repeat_n(0.5 * PHASE_FLOOR_RAD, contrast.nrows()))
        .collect();
    let numbers = |sums: &Sums| -> Option<DVector<f64>> {
        let phases = &contrast * DVector::from_iterator(sums.along.len(), sums.along.iter().map(|along| along[0].arg()));
        let gains = (1..receivers).map(|rx| 0.5 * (sums.own(rx) / sums.own(0)).ln());
        let all = DVector::from_iterator(floors.len(), gains.chain(phases.iter().copied()));
        all.iter().all(|value| value.is_finite()).then_some(all)
    };
    let found = Estimated::new(frames, &floors, numbers)?;
    Some(Unlike { p_value: found.p_value()?, gain: found.foretold(frames, numbers)? })
}

/// Two-sided, of Student's law.
pub fn tail(t: f64, freedom: f64) -> f64 {
    if t <= 0.0 { 1.0 } else { StudentsT::new(0.0, 1.0, freedom).map_or(1.0, |law| 2.0 * law.sf(t)) }
}

/// By groups of neighbouring cells; none where the body fills too few cells. `still`: power of what stands still, by range.
fn sums(evidence: &Evidence, model: &PowerModel, body: &BodyPrediction, still: &[f64], frame: usize) -> Option<Vec<Sums>> {
    let radar = &evidence.radar;
    let (receivers, transmitters) = (radar.rx_m.len(), radar.tx_m.len());
    let expected = model.expected(frame);
    let map = &evidence.maps()[frame * model.size()..(frame + 1) * model.size()];
    let samples = evidence.cube.dims[4];
    // A body that hardly moves is known by what it leaves of itself where what stands still was taken out.
    let of_the_body = |cell: usize| model.usable()[cell] || f64::from(map[cell]) > STILL_LEFT * still[cell % samples];
    let cells: Vec<usize> = (0..model.size()).filter(|&cell| expected[cell] > LEAST_POWER && of_the_body(cell)).collect();
    if cells.len() < 10 {
        return None;
    }
    let points = &body.frames[frame];
    let (centre, wave) = (radar.centre_m(), TAU / radar.wavelength_m());
    // Mean direction and range of each cell: templates weighted with them. The centre may lie aside: sines need no care.
    let range = |position: [f64; 3]| (0..3).map(|axis| (position[axis] - centre[axis]).powi(2)).sum::<f64>().sqrt().max(1e-6);
    let mean = |of: &dyn Fn([f64; 3]) -> f64| -> Vec<f32> {
        let shifted: Vec<_> = points
            .iter()
            .map(|point| crate::diagnosis::Point { area_m2: point.area_m2 * (of(point.position_m) + 2.0), ..*point })
            .collect();
        let templates = part_templates(radar, &model.cells, &shifted, body.parts.len());
        let map = crate::diagnosis::power::sum(&templates, &model.weights, model.size());
        cells.iter().map(|&cell| (map[cell] - 1.0) / (expected[cell] - 1.0) - 2.0).collect()
    };
    let direction: [Vec<f32>; 3] =
        std::array::from_fn(|axis| mean(&|position| (position[axis] - centre[axis]) / range(position)));
    let range_m = points.iter().map(|point| range(point.position_m)).sum::<f64>() / points.len().max(1) as f64;
    let noise = evidence.noise();
    let maps: Vec<_> = (0..transmitters * receivers).map(|channel| evidence.range_doppler(frame, channel)).collect();
    let pairs = neighbours(radar);
    let groups = (cells.len() / GROUP_CELLS).clamp(1, MOST_GROUPS);
    let of_group = |group: usize| {
        let members = group * cells.len() / groups..(group + 1) * cells.len() / groups;
        let sine = direction[0][members.clone()].iter().map(|&x| f64::from(x)).sum::<f64>() / members.len() as f64;
        let mut sums = Sums {
            products: vec![Complex64::ZERO; receivers * receivers],
            along: vec![Moments::default(); pairs.len()],
            cells: 0.0,
            range_m,
            sine,
        };
        let mut steered = vec![Complex64::ZERO; receivers];
        for (maps, noise) in maps.chunks_exact(receivers).zip(noise.chunks_exact(receivers)) {
            for index in members.clone() {
                let cell = cells[index];
                // A cell tells as much as any other about what its receivers have in common, however loud its speckle is.
                let power = (0..receivers).map(|rx| maps[rx][cell].norm_sqr() / noise[rx].max(f64::MIN_POSITIVE)).sum::<f64>()
                    / receivers as f64;
                let weight = 1.0 / ((power + f64::from(LEAST_POWER)) * noise[0].max(f64::MIN_POSITIVE));
                sums.cells += 1.0;
                for rx in 0..receivers {
                    let phase: f64 = (0..3)
                        .map(|axis| (radar.rx_m[rx][axis] - radar.rx_m[0][axis]) * f64::from(direction[axis][index]) * wave)
                        .sum();
                    steered[rx] = maps[rx][cell] * Complex64::cis(phase);
                }
                for (i, product) in sums.products.iter_mut().enumerate() {
                    *product += steered[i / receivers] * steered[i % receivers].conj() * weight;
                }
                for (along, &[far, near]) in sums.along.iter_mut().zip(&pairs) {
                    let mut cross = steered[far] * steered[near].conj() * weight;
                    for moment in along.iter_mut() {
                        *moment += cross;
                        cross *= f64::from(direction[0][index]);
                    }
                }
            }
        }
        sums
    };
    Some((0..groups).map(of_group).collect())
}

/// Phase of a receiver against the first, radians.
fn phase(frames: &[Sums], rx: usize) -> Mean {
    let total: Complex64 = frames.iter().map(|sums| sums.cross(rx)).sum();
    let turned = |sums: &Sums| (sums.cross(rx) * total.conj() / total.norm().max(f64::MIN_POSITIVE)).im;
    let scatter: f64 = frames.iter().map(|sums| turned(sums).powi(2)).sum();
    let count = frames.len() as f64;
    Mean { value: total.arg(), deviation: (scatter * count / (count - 1.0)).sqrt() / total.norm().max(f64::MIN_POSITIVE) }
}

/// Power of a receiver against the first, decibels.
fn gain_db(frames: &[Sums], rx: usize) -> Mean {
    let (own, first): (f64, f64) = frames.iter().fold((0.0, 0.0), |(own, first), sums| (own + sums.own(rx), first + sums.own(0)));
    let ratio = (own / first.max(f64::MIN_POSITIVE)).max(f64::MIN_POSITIVE);
    let scatter: f64 = frames.iter().map(|sums| (sums.own(rx) - ratio * sums.own(0)).powi(2)).sum();
    let count = frames.len() as f64;
    let db = 10.0 / std::f64::consts::LN_10;
    Mean { value: db * ratio.ln(), deviation: db * (scatter * count / (count - 1.0)).sqrt() / own.max(f64::MIN_POSITIVE) }
}

/// Of held-out frames, pair by pair with the first receiver: circular Gaussian fields with equal powers and a real
/// correlation, against the same with the amplitudes put in.
pub fn likelihood_gain(training: &[Sums], held_out: &[Sums], amplitudes: &[Complex64]) -> f64 {
    let mut gain = 0.0;
    for (rx, amplitude) in amplitudes.iter().enumerate().skip(1) {
        let undone = |sums: &[Sums], amplitude: Complex64| {
            let cells: f64 = sums.iter().map(|sums| sums.cells).sum::<f64>().max(1.0);
            let first = sums.iter().map(|sums| sums.own(0)).sum::<f64>() / cells;
            let own = sums.iter().map(|sums| sums.own(rx)).sum::<f64>() / (cells * amplitude.norm_sqr());
            let cross = sums.iter().map(|sums| sums.cross(rx)).sum::<Complex64>() / (amplitude * cells);
            (cells, 0.5 * (first + own), cross.re)
        };
        let log_likelihood = |amplitude: Complex64| {
            let (_, power, cross) = undone(training, amplitude);
            let (cells, seen, seen_cross) = undone(held_out, amplitude);
            let determinant = (power * power - cross * cross).max(1e-9 * power * power).max(f64::MIN_POSITIVE);
            let fit = 2.0 * (power * seen - cross * seen_cross) / determinant;
            // The Jacobian of the amplitude counts, too.
            -cells * (determinant.ln() + amplitude.norm_sqr().ln() + fit)
        };
        gain += log_likelihood(*amplitude) - log_likelihood(Complex64::ONE);
    }
    gain / CELLS_PER_DRAW
}

fn mismatch(
    evidence: &Evidence,
    phases: &[Mean],
    gains: &[Mean],
    amplitudes: Vec<Complex64>,
    p_value: f64,
    gain: f64,
) -> Candidate {
    let list = |name, means: &[Mean], unit: f64, floor: f64| {
        let values: Vec<f64> = std::iter::once(0.0).chain(means.iter().map(|mean| mean.value * unit)).collect();
        let deviations: Vec<f64> =
            std::iter::once(0.0).chain(means.iter().map(|mean| (mean.deviation * unit).hypot(0.5 * floor))).collect();
        Estimate::list(name, &values, &deviations)
    };
    let degrees = 180.0 / PI;
    let text =
        |values: Vec<f64>, digits: usize| values.iter().map(|value| format!("{value:.digits$}")).collect::<Vec<_>>().join(", ");
    let receivers = amplitudes.len();
    // Where the receivers' mean stays, gains are put back to the first one's.
    let inverse: Vec<Complex64> = amplitudes.iter().map(|amplitude| 1.0 / amplitude).collect();
    let energy = (0..evidence.cube.dims[0])
        .flat_map(|frame| (0..evidence.cube.channels()).map(move |channel| (frame, channel)))
        .map(|(frame, channel)| {
            let error = (1.0 - inverse[channel % receivers]).norm_sqr();
            error * evidence.cube.channel(frame, channel).iter().map(|value| value.norm_sqr()).sum::<f64>()
        })
        .sum();
    Candidate {
        id: Some("channel_mismatch"),
        behaves_like: "channel gain",
        estimates: vec![
            list("gain_db", gains, 1.0, GAIN_FLOOR_DB),
            list("phase_deg", phases, degrees, PHASE_FLOOR_RAD * degrees),
        ],
        choice: None,
        place: Place { rx: Some((1..receivers).collect()), ..Place::at("antenna") },
        p_value,
        gain,
        rung: Rung::E,
        look_alikes: vec![],
        statement: format!(
            "The receivers differ: against the first, the gains of receivers 1 to {} are {} dB and their phases {}°, which no direction \
             of the body explains.",
            receivers - 1,
            text(gains.iter().map(|gain| gain.value).collect(), 2),
            text(phases.iter().map(|phase| phase.value * degrees).collect(), 1),
        ),
        curve: None,
        energy,
        correction: Correction::Samples(Arc::new(move |cube| {
            cube.each_chirp(|[_, channel, _], samples| {
                samples.iter_mut().for_each(|value| *value *= inverse[channel % receivers]);
            });
        })),
    }
}

fn aside_of(evidence: &Evidence, bearing: Mean, range_m: f64, moves: Moves, p_value: f64, gain: f64) -> Candidate {
    let (offset, deviation) = (bearing.value * range_m, bearing.deviation.hypot(0.5 * PHASE_FLOOR_RAD / PI) * range_m);
    let change = Change::Offset([offset, 0.0, 0.0]);
    let total: f64 = evidence.maps().iter().map(|&power| f64::from(power - 1.0).max(0.0)).sum();
    Candidate {
        id: Some("pose_offset"),
        behaves_like: "direction offset",
        estimates: vec![
            Estimate::list("offset_m", &[offset, 0.0, 0.0], &[deviation, 0.05, 0.2]),
            Estimate::normal("yaw_deg", 0.0, 1.0),
        ],
        choice: None,
        place: Place::at("scene"),
        p_value,
        gain,
        rung: Rung::D,
        // A phase in proportion to the receivers' places is a direction, whoever makes it.
        look_alikes: vec!["channel_mismatch"],
        statement: format!(
            "The body is seen {:.1}° to the {} of where it stands: {:.0} mm at its mean range, or the radar or its receivers are turned by that much.",
            bearing.value.clamp(-1.0, 1.0).asin().abs() * 180.0 / PI,
            if bearing.value > 0.0 { "right" } else { "left" },
            1e3 * offset.abs()
        ),
        curve: None,
        energy: total * evidence.noise().iter().sum::<f64>() * (bearing.value * PI).powi(2),
        correction: Correction::Body(Arc::new(move |body| moves.apply(body, change))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::suspects::geometry::estimated::walking;

    #[test]
    fn receivers_that_differ_are_told_by_all_groups_together_and_a_turned_array_is_not() {
        let mut radar = Radar::small(12);
        radar.rx_m = (0..4).map(|rx| [0.5 * f64::from(rx) * radar.wavelength_m(), 0.0, 0.0]).collect();
        let look = |seed: u64, of: &[Complex64; 4]| {
            let frames = walking(&radar, seed, |rx, _| of[rx]);
            unlike(&radar, &frames.iter().map(Vec::as_slice).collect::<Vec<_>>()).expect("enough groups")
        };
        let differ =
            [(1.0, 0.0), (0.87, 0.11), (1.06, 0.16), (0.95, 0.04)].map(|(gain, phase)| Complex64::from_polar(gain, phase));
        let found = look(1, &differ);
        assert!(found.p_value < 1e-3 && found.gain > 6.0, "{} {}", found.p_value, found.gain);
        for seed in 2..12 {
            let turned = [0.0, 0.2, 0.4, 0.6].map(Complex64::cis);
            for alike in [[Complex64::ONE; 4], turned] {
                let found = look(seed, &alike);
                assert!(found.p_value > 0.01, "{} {}", found.p_value, found.gain);
            }
        }
    }
}
