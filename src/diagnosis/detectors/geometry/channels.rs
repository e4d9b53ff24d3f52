//! Which of the ways in which receivers may differ it is, and bodies that stand to one side.
//!
//! Every cell that the body fills comes from a direction that the prediction knows, so the residual phase between
//! two receivers belongs to the receivers. A phase that grows in proportion to the receivers' places is a direction, and
//! might as well be the body's.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;
use rayon::prelude::*;

use super::bearing::{Bearing, PHASE_FLOOR_RAD, Sums, along, bearing};
use super::cells::{Cells, used};
use super::change::{Change, Moves};
use super::covariance::Array;
use super::found::{Found, UNEVEN};
use super::{coupling, mismatch, places, skew};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::detectors::clutter::{clutter_power, energy_beyond_noise};
use crate::diagnosis::power::{PowerModel, part_templates};
use crate::diagnosis::statistics::UNDECIDED;
use crate::diagnosis::{BodyPrediction, Candidate, Estimate, Evidence, Place};
use crate::effects::{self, Stage};
use crate::paths::distance;

/// Expected power over the noise from which on a cell is used.
const LEAST_POWER: f32 = 10.0;
/// Chance below which receivers are not alike.
const UNLIKELY: f64 = 1e-4;
/// Cells that one independent draw is spread over by two Hann windows.
const CELLS_PER_DRAW: f64 = 2.25;
/// What the receivers observe of the body.
pub struct Observed {
    training: Vec<Sums>,
    held_out: Vec<Sums>,
    pub array: Array,
}

impl Observed {
    /// None for a single receiver, and where the body fills too few cells.
    pub fn new(evidence: &Evidence, model: &PowerModel, body: &BodyPrediction) -> Option<Self> {
        if evidence.radar.rx_m.len() < 2 {
            return None;
        }
        let clutter_power = clutter_power(evidence);
        let sums: Vec<Option<Sums>> =
            (0..evidence.cube.dims[0]).into_par_iter().map(|frame| sums(evidence, model, body, &clutter_power, frame)).collect();
        let of = |frames: &[usize]| frames.iter().filter_map(|&frame| sums[frame].clone()).collect::<Vec<Sums>>();
        let (training, held_out) = (of(&evidence.split.training), of(&evidence.split.held_out));
        if training.len() < 6 || held_out.is_empty() {
            return None;
        }
        let bearing = bearing(&evidence.radar, &training);
        let array = Array::new(Cells::new(evidence, model, body, &clutter_power), bearing);
        Some(Self { training, held_out, array })
    }
}

/// `displaced`: the body is elsewhere than predicted, or at another time.
pub fn find(evidence: &Evidence, model: &PowerModel, body: &BodyPrediction, moves: Moves, displaced: bool) -> Vec<Candidate> {
    let radar = &evidence.radar;
    let accepted = |id: &str| evidence.accepted.contains(&id);
    // One channel whose gain hopped was brought to its own mean, which need not be that of the others.
    let hopped = evidence.accepted_unnamed.contains(&Behaviour::SlowTimeGainOfOneChannel);
    if hopped || accepted(effects::antenna_position::ID) {
        return vec![];
    }
    let Some(Observed { training, held_out, array }) = Observed::new(evidence, model, body) else { return vec![] };
    let bearing = array.bearing;
    if let Some(candidate) = differ(evidence, &array, displaced) {
        return vec![candidate];
    }
    if bearing.p_value < UNEVEN {
        let wave = TAU / radar.wavelength_m();
        let amplitudes: Vec<Complex64> = along(radar).iter().map(|x| Complex64::cis(-bearing.sine * wave * x)).collect();
        let nats = log_likelihood_gain(&training, &held_out, &amplitudes);
        let range_m = training.iter().map(|sums| sums.range_m).sum::<f64>() / training.len() as f64;
        if let Some(skew) = skew::find(evidence, &training, bearing, nats) {
            return vec![skew];
        }
        return (nats > 0.0).then(|| aside_of(evidence, bearing, range_m, moves, nats)).into_iter().collect();
    }
    vec![]
}

/// The way in which the receivers differ, if they do.
fn differ(evidence: &Evidence, array: &Array, displaced: bool) -> Option<Candidate> {
    let accepted = |id: &str| evidence.accepted.contains(&id);
    // What is common to the receivers says nothing of them where it is not the body's; and those that differed were
    // brought to the first one's, a neighbour's part included.
    let alike = !displaced && !accepted(effects::channel_mismatch::ID);
    let may_couple = alike && evidence.may_name(effects::mutual_coupling::ID);
    let coupled = if may_couple { coupling::find(evidence, array) } else { None };
    let differ = [
        if alike { mismatch::find(evidence, array) } else { None },
        if displaced || !evidence.may_name(effects::antenna_position::ID) { None } else { places::find(evidence, array) },
        if may_couple { coupling::one_way(evidence, array, coupled.as_ref()) } else { None },
        coupled,
    ];
    best(differ.into_iter().flatten().collect())
}

/// Of what is unlikely to be chance, what predicts held-out frames best; what does so nearly as well looks alike. A coupling
/// comes before any gains and phases where it leaves the receivers alike: few that differ in any other way look like that.
fn best(mut found: Vec<Found>) -> Option<Candidate> {
    found.retain(|found| found.candidate.p_value < UNEVEN && found.candidate.nats > 0.0);
    if found.iter().any(|found| found.explains_all && found.candidate.p_value < UNLIKELY) {
        found.retain(|found| found.candidate.id != Some(effects::channel_mismatch::ID));
    }
    let each: Vec<_> = found.iter().map(|found| (found.candidate.id, found.likelihood)).collect();
    let unlikely = found.into_iter().filter(|found| found.candidate.p_value < UNLIKELY);
    let Found { candidate: mut best, likelihood, .. } = unlikely.max_by(|a, b| a.likelihood.total_cmp(&b.likelihood))?;
    let alike = each.iter().filter(|(id, other)| *id != best.id && *other > likelihood - UNDECIDED);
    best.look_alikes.extend(alike.filter_map(|(id, _)| *id));
    best.look_alikes.sort_unstable();
    best.look_alikes.dedup();
    Some(best)
}

/// None where the body fills too few cells. `clutter_power`: power of static clutter, by range.
fn sums(evidence: &Evidence, model: &PowerModel, body: &BodyPrediction, clutter_power: &[f64], frame: usize) -> Option<Sums> {
    let radar = &evidence.radar;
    let (receivers, transmitters) = (radar.rx_m.len(), radar.tx_m.len());
    let expected = model.expected(frame);
    let cells = used(evidence, model, clutter_power, frame, LEAST_POWER)?;
    let points = &body.frames[frame];
    let (centre, wave) = (radar.centre_m(), TAU / radar.wavelength_m());
    // Mean direction and range of each cell: templates weighted with them. The centre may lie aside: sines need no care.
    let range = |position: [f64; 3]| distance(position, centre).max(1e-6);
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
    let mut sums = Sums { products: vec![Complex64::ZERO; receivers * receivers], cells: 0.0, range_m };
    let mut steered = vec![Complex64::ZERO; receivers];
    for (maps, noise) in maps.chunks_exact(receivers).zip(noise.chunks_exact(receivers)) {
        for (index, &cell) in cells.iter().enumerate() {
            // A cell has as much information as any other about what its receivers have in common, however strong its speckle is.
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
        }
    }
    Some(sums)
}

/// Of held-out frames, pair by pair with the first receiver: circular Gaussian fields with equal powers and a real
/// correlation, against the same with the amplitudes put in.
fn log_likelihood_gain(training: &[Sums], held_out: &[Sums], amplitudes: &[Complex64]) -> f64 {
    let mut nats = 0.0;
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
        nats += log_likelihood(*amplitude) - log_likelihood(Complex64::ONE);
    }
    nats / CELLS_PER_DRAW
}

fn aside_of(evidence: &Evidence, bearing: Bearing, range_m: f64, moves: Moves, nats: f64) -> Candidate {
    let (offset, deviation) = (bearing.sine * range_m, bearing.deviation.hypot(0.5 * PHASE_FLOOR_RAD / PI) * range_m);
    let change = Change::Offset([offset, 0.0, 0.0]);
    Candidate {
        id: Some(effects::pose_offset::ID),
        estimates: vec![
            Estimate::list("offset_m", &[offset, 0.0, 0.0], &[deviation, 0.05, 0.2]),
            Estimate::normal("yaw_deg", 0.0, 1.0),
        ],
        errs_alike: true,
        // A phase in proportion to the receivers' places is a direction, whoever makes it.
        look_alikes: vec![effects::channel_mismatch::ID],
        statement: format!(
            "The body is seen {:.1}° to the {} of where it stands: {:.0} mm at its mean range, or the radar or its receivers are turned by that much.",
            bearing.sine.clamp(-1.0, 1.0).asin().abs() * 180.0 / PI,
            if bearing.sine > 0.0 { "right" } else { "left" },
            1e3 * offset.abs()
        ),
        energy: energy_beyond_noise(evidence) * (bearing.sine * PI).powi(2),
        correction: moves.correction(change),
        ..Candidate::new(Behaviour::DirectionOffset, Place::at(Stage::Scene), bearing.p_value, nats)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::super::walking::{four_receivers, walking};
    use super::*;
    use crate::diagnosis::cube::Loaded;
    use crate::diagnosis::statistics;

    /// What is found of a body seen by receivers: after a turn by receiver and sine, and a matrix.
    fn found(seed: u64, turned: impl Fn(usize, f64) -> Complex64, array: &DMatrix<Complex64>) -> Vec<Candidate> {
        let radar = four_receivers();
        let samples = vec![Complex64::ONE; radar.dims().iter().product()];
        let evidence = Evidence::new(Loaded::of_samples(radar, samples, [-1.0, 1.0]), None, None);
        let array = Array::new(walking(seed, turned, array), Bearing { sine: 0.0, deviation: 0.003, p_value: 1.0 });
        differ(&evidence, &array, false).into_iter().collect()
    }

    fn alike() -> DMatrix<Complex64> {
        DMatrix::identity(4, 4)
    }

    fn holds(estimate: &Estimate, truth: &[f64]) {
        for (truth, [low, high]) in truth.iter().zip(&estimate.ci90).skip(1) {
            assert!(low <= truth && truth <= high, "{truth:?} {estimate:?}");
        }
    }

    #[test]
    fn receivers_that_differ_are_found_with_their_gains_and_phases() {
        // Slightly, and so much that it is not linear.
        for scale in [1.0, 4.0] {
            let [gains, phases] =
                [[0.0, -0.10, 0.06, 0.04], [0.0, 0.06, -0.04, 0.02]].map(|of| of.map(|value: f64| value * scale));
            let array = DMatrix::from_diagonal(&DVector::from_fn(4, |rx, _| Complex64::from_polar(gains[rx].exp(), phases[rx])));
            let found = found(1, |_, _| Complex64::ONE, &array);
            assert!(found.len() == 1 && found[0].id == Some(effects::channel_mismatch::ID), "{scale} {found:?}");
            assert!(found[0].p_value < 1e-6 && found[0].nats > 10.0, "{scale} {found:?}");
            holds(&found[0].estimates[0], &gains.map(|gain| gain * statistics::DECIBEL));
            holds(&found[0].estimates[1], &phases.map(f64::to_degrees));
        }
    }

    #[test]
    fn a_coupling_is_estimated_with_its_level() {
        for level in [0.05, 0.2] {
            let strength = Complex64::from_polar(level, 1.1);
            let array = DMatrix::from_fn(4, 4, |i: usize, j| match i.abs_diff(j) {
                0 => Complex64::ONE,
                1 => strength,
                _ => Complex64::ZERO,
            });
            let found = found(2, |_, _| Complex64::ONE, &array);
            assert!(
                found.len() == 1 && found[0].id == Some(effects::mutual_coupling::ID) && found[0].p_value < 1e-5,
                "{level} {found:?}"
            );
            let level_db = 20.0 * level.log10();
            let [low, high] = found[0].estimates[0].ci90[0];
            assert!(low <= level_db && level_db <= high, "{level_db} {found:?}");
        }
    }

    #[test]
    fn receivers_that_hear_the_neighbour_on_one_side_have_no_name() {
        let strength = Complex64::from_polar(0.08, -0.4);
        for step in [1, -1] {
            let array = DMatrix::from_fn(4, 4, |i, j| match i as isize - j as isize {
                0 => Complex64::ONE,
                apart if apart == step => strength,
                _ => Complex64::ZERO,
            });
            let found = found(5, |_, _| Complex64::ONE, &array);
            assert!(found.len() == 1 && found[0].id.is_none() && found[0].p_value < 1e-5, "{step} {found:?}");
            assert!(found[0].statement.contains(if step == 1 { "before" } else { "after" }), "{step} {found:?}");
        }
    }

    #[test]
    fn displaced_receivers_are_told_but_for_a_common_stretch() {
        let wave = TAU / four_receivers().wavelength_m();
        let look =
            |seed: u64, offsets_m: [f64; 4]| found(seed, |rx, sine| Complex64::cis(-wave * offsets_m[rx] * sine), &alike());
        let offsets_m = [0.0, 2e-4, -1e-4, 1e-4];
        let displaced = look(3, offsets_m);
        assert!(displaced.len() == 1 && displaced[0].id == Some(effects::antenna_position::ID), "{displaced:?}");
        assert!(displaced[0].p_value < 1e-5 && displaced[0].nats > 6.0, "{displaced:?}");
        holds(&displaced[0].estimates[0], &offsets_m);
        // As the simulator takes them: of every antenna, along all axes.
        let setting = displaced[0].setting(1.0, 1.0, &four_receivers()).expect("no setting");
        let values = &setting.parameters["offset_m"];
        assert!(values.len() == 3 * (1 + 4) && values[6] == displaced[0].estimates[0].values[1], "{values:?}");
        // By so much that it is not linear.
        let far_m = [0.0, 8e-4, -4e-4, 4e-4];
        let displaced = look(6, far_m);
        assert!(displaced.len() == 1 && displaced[0].id == Some(effects::antenna_position::ID), "{displaced:?}");
        holds(&displaced[0].estimates[0], &far_m);
        assert!(look(4, [0.0, 1e-4, 2e-4, 3e-4]).iter().all(|found| found.p_value > 1e-3));
    }

    #[test]
    fn receivers_that_are_alike_and_a_turned_array_are_nothing() {
        for seed in 10..30 {
            let turn = if seed % 2 == 0 { 0.0 } else { 0.05 };
            let found = found(seed, |rx, _| Complex64::cis(turn * rx as f64), &alike());
            assert!(found.iter().all(|found| found.p_value > 1e-3), "{found:?}");
        }
    }
}
