//! Something that a part of the body carries: a point in the part's middle that returns alike to every side.
//!
//! How strongly skin reflects is not known, but it is the same skin everywhere: powers of the whole body with one reflectivity
//! are compared with the same and a point that moves with one of its parts. What returns as much as parts of a body may differ
//! by is none.

use rayon::prelude::*;

use super::{Detector, paths};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::locate::CELLS_PER_VALUE;
use crate::diagnosis::power::{LOBES, PowerModel, Template, fit_weights, log_likelihood, sum};
use crate::diagnosis::prediction::{Centre, range_and_velocity};
use crate::diagnosis::{BodyPrediction, Candidate, Correction, Estimate, Evidence, Place, statistics};
use crate::effects::{self, Stage};

/// Power over that of the part's own skin, dB, from which on it is no skin.
const LEAST_DB: f64 = 8.0;
/// Share of the whole body's power that a part's skin counts as at least.
const LEAST_SHARE: f64 = 0.01;
/// What hardly moves is mostly where static clutter was taken out: how strong it is, its sidelobes do not show.
const LEAST_SEEN: f64 = 0.3;
/// Parts of one body differ: their log-likelihood ratios scatter by so much more than those of one reflectivity.
const UNEVEN: f64 = 2.0;
/// Standard deviation of the amplitude, as a share: a level that is estimated from other parts.
const LEVEL_ERROR: f64 = 0.25;
/// Share of the best part's gain from which on another may carry it as well.
const NEARLY: f64 = 0.9;

/// How this family is asked: it counts only where no other detector finds anything.
pub const DETECTOR: Detector = Detector { last_resort: true, ..Detector::new("carried things", find) };

/// A part, and what it gains.
struct Found {
    part: usize,
    training: f64,
    held_out: f64,
    /// Of the skin's lobes, and of the point's power at one metre.
    weights: Vec<f64>,
    /// Of its power over its part's.
    over_skin_db: f64,
    /// Share of its power in cells that are looked at.
    seen: f64,
}

fn find(evidence: &Evidence) -> Vec<Candidate> {
    let (Some(model), Some(body)) = (evidence.power(), evidence.body.as_ref()) else { return vec![] };
    let parts = body.parts.len();
    // Residuals of paths that were subtracted are near the body, too, and in a copied frame the body is not where it is said to be.
    let residual = paths::LEAVE_RESIDUAL.iter().any(|id| evidence.accepted.contains(id));
    if parts < 2 || residual || body.centres.len() != body.frames.len() || !evidence.may_name(effects::carried_reflector::ID) {
        return vec![];
    }
    let skin: Vec<Vec<Template>> = (0..body.frames.len()).into_par_iter().map(|frame| skin(model, frame)).collect();
    let (_, alone) = fitted(evidence, model, &skin);
    let of_part = |part: usize| -> Found {
        let mut templates = skin.clone();
        let points: Vec<Template> = (0..body.frames.len()).map(|frame| point(evidence, model, body, part, frame)).collect();
        templates.iter_mut().zip(&points).for_each(|(templates, point)| templates.push(point.clone()));
        let (with, gained) = fitted(evidence, model, &templates);
        let weight = with[LOBES.len()];
        let strength: f64 = points.iter().map(|point| weight * total(point)).sum();
        let of_skin = |lobes: &Vec<Template>| -> f64 {
            lobes[part * LOBES.len()..(part + 1) * LOBES.len()].iter().zip(&with).map(|(lobe, weight)| weight * total(lobe)).sum()
        };
        // Skin that is hardly seen would make anything look strong.
        let own = model.lobes.iter().map(of_skin).sum::<f64>().max(LEAST_SHARE * of_body(&skin, &with));
        let over_skin_db = 10.0 * (strength / own.max(f64::MIN_POSITIVE)).max(1e-30).log10();
        let seen = seen(&points, model.usable());
        Found { part, training: gained[0] - alone[0], held_out: gained[1] - alone[1], weights: with, over_skin_db, seen }
    };
    let found: Vec<Found> = (0..parts).into_par_iter().map(of_part).collect();
    let gain = |found: &Found| found.training + found.held_out;
    let Some(best) = found.iter().max_by(|a, b| gain(a).total_cmp(&gain(b))) else { return vec![] };
    let nats = model.independent / CELLS_PER_VALUE;
    if best.over_skin_db < LEAST_DB || best.seen < LEAST_SEEN || best.held_out <= 0.0 {
        return vec![];
    }
    let p_value = statistics::corrected(statistics::chi2_tail(2.0 * nats * best.training / UNEVEN, 1.0), parts as f64);
    let others: Vec<&str> = found
        .iter()
        .filter(|other| other.part != best.part && gain(other) > NEARLY * gain(best))
        .map(|other| body.parts[other.part].as_str())
        .collect();
    vec![Candidate { p_value, nats: nats * best.held_out, ..candidate(evidence, model, body, best, &others, &skin) }]
}

/// Of the whole body, by lobe.
fn skin(model: &PowerModel, frame: usize) -> Vec<Template> {
    let of_lobe = |lobe: usize| {
        let mut map = vec![0.0f32; model.size()];
        for template in model.lobes[frame].iter().skip(lobe).step_by(LOBES.len()) {
            template.cells.iter().zip(&template.power).for_each(|(&cell, power)| map[cell as usize] += power);
        }
        Template::keeping(&map, |_, power| power > 0.0)
    };
    (0..LOBES.len()).map(of_lobe).collect()
}

/// Of one return at one metre, where the part's middle is.
fn point(evidence: &Evidence, model: &PowerModel, body: &BodyPrediction, part: usize, frame: usize) -> Template {
    let Centre { position_m, velocity_mps } = body.centres[frame][part];
    let (range_m, velocity) = range_and_velocity(&evidence.radar, position_m, velocity_mps);
    let map = model.template(std::iter::once((range_m, velocity, range_m.max(0.1).powi(-4))));
    Template::keeping(&map, |_, power| power > 0.0)
}

fn total(template: &Template) -> f64 {
    template.power.iter().map(|&power| f64::from(power)).sum()
}

/// Share of a part's point that lies in cells that are looked at, over all frames.
fn seen(points: &[Template], usable: &[bool]) -> f64 {
    let used = |template: &Template| -> f64 {
        let cells = template.cells.iter().zip(&template.power).filter(|(cell, _)| usable[**cell as usize]);
        cells.map(|(_, &power)| f64::from(power)).sum()
    };
    points.iter().map(used).sum::<f64>() / points.iter().map(total).sum::<f64>().max(f64::MIN_POSITIVE)
}

/// Power of all skin in all frames.
fn of_body(skin: &[Vec<Template>], weights: &[f64]) -> f64 {
    skin.iter().flat_map(|lobes| lobes.iter().zip(weights)).map(|(lobe, weight)| weight * total(lobe)).sum()
}

/// Weights that training frames make most likely, and the log-likelihoods of training and held-out frames.
fn fitted(evidence: &Evidence, model: &PowerModel, templates: &[Vec<Template>]) -> (Vec<f64>, [f64; 2]) {
    let (maps, size, usable) = (evidence.maps(), model.size(), model.usable());
    let map = |frame: usize| maps.below([frame]);
    let training: Vec<(&[f32], &[Template])> =
        evidence.split.training.iter().map(|&frame| (map(frame), templates[frame].as_slice())).collect();
    let weights = fit_weights(&training, usable);
    let of = |frames: &[usize]| -> f64 {
        frames.iter().map(|&frame| log_likelihood(map(frame), &sum(&templates[frame], &weights, size), usable)).sum()
    };
    let likelihoods = [of(&evidence.split.training), of(&evidence.split.held_out)];
    (weights, likelihoods)
}

fn candidate(
    evidence: &Evidence,
    model: &PowerModel,
    body: &BodyPrediction,
    found: &Found,
    others: &[&str],
    skin: &[Vec<Template>],
) -> Candidate {
    let name = body.parts[found.part].as_str();
    let noise = evidence.mean_noise();
    let (samples, weight) = (model.size() as f64, found.weights[LOBES.len()]);
    let start_m = range_and_velocity(&evidence.radar, body.centres[0][found.part].position_m, [0.0; 3]).0.max(0.1);
    // From the peak after two Hann windows to a sample; the body's level is that of all its skin.
    let amplitude = (weight * start_m.powi(-4) * 2.25 * noise / samples).sqrt();
    let level = (of_body(skin, &found.weights) / skin.len() as f64 * noise / samples).sqrt();
    let relative = amplitude / level.max(f64::MIN_POSITIVE);
    let middles = body.centres.iter().map(|centres| {
        let Centre { position_m, velocity_mps } = centres[found.part];
        range_and_velocity(&evidence.radar, position_m, velocity_mps)
    });
    let place = Place::spanning(Stage::Scene, middles);
    let power: f64 = (0..skin.len()).map(|frame| weight * total(&point(evidence, model, body, found.part, frame))).sum();
    let beside = if others.is_empty() {
        String::new()
    } else {
        format!(" (or at {}, as far as ranges and velocities resolve)", others.join(", "))
    };
    Candidate {
        id: Some(effects::carried_reflector::ID),
        estimates: vec![Estimate::normal("amplitude", relative, LEVEL_ERROR * relative)],
        errs_alike: true,
        look_alikes: vec![effects::part_reflectivity::ID],
        statement: format!(
            "Something at the {}{beside} returns {:.0} dB more than the skin there would if it were like that of the rest of the body: \
             something is carried or worn, or that part reflects far more strongly.",
            name.replace('_', " "),
            found.over_skin_db
        ),
        energy: power * noise * evidence.cube.channels() as f64,
        // The parts' own weights have taken it in already.
        correction: Correction::None,
        ..Candidate::new(Behaviour::ReturnOfOnePart, Place { body_part: Some(name.into()), ..place }, 1.0, 0.0)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use num_complex::Complex64;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::diagnosis::Point;
    use crate::diagnosis::cube::Loaded;
    use crate::radar::{Radar, SPEED_OF_LIGHT};

    const FRAMES: usize = 12;
    const PARTS: [(&str, f64); 3] = [("pelvis", 0.0), ("head", 0.35), ("left_hand", -0.35)];

    /// A body of three parts that walks away, one of them before and one behind the others and each with a speed of its own, and
    /// a return of this amplitude from the middle of the hand.
    fn evidence(seed: u64, carried: f64) -> Evidence {
        let mut radar = Radar { samples_per_chirp: 64, loops_per_frame: 32, frames: FRAMES, ..Radar::mmmesh(FRAMES) };
        radar.tx_m.truncate(1);
        radar.rx_m.truncate(2);
        radar.chirp_period_s *= 4.0;
        let [_, _, receivers, loops, samples] = radar.dims();
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
        let mut values = vec![Complex64::ZERO; radar.dims().iter().product()];
        let (mut frames, mut centres, mut middle_s) = (vec![], vec![], vec![]);
        for frame in 0..FRAMES {
            let time_s = frame as f64 * radar.frame_period_s;
            let (mut points, mut middles) = (vec![], vec![]);
            let mut returns: Vec<(f64, f64, Complex64)> = vec![];
            for (part, (_, ahead)) in PARTS.into_iter().enumerate() {
                let speed = 1.0 + 2.0 * ahead * (3.0 * time_s).sin();
                let middle = 2.0 + ahead + time_s;
                for _ in 0..30 {
                    let range = middle + between(-0.08, 0.08);
                    returns.push((range, speed, Complex64::from_polar(0.5, between(0.0, TAU))));
                    let at = |later: f64| [0.0, range + speed * later, 0.0];
                    points.push(Point {
                        position_m: at(0.5 * radar.frame_duration_s()),
                        velocity_mps: [0.0, speed, 0.0],
                        normal: [0.0, -1.0, 0.0],
                        area_m2: 0.01,
                        part,
                    });
                }
                middles.push(Centre { position_m: [0.0, middle, 0.0], velocity_mps: [0.0, speed, 0.0] });
                if part == 2 {
                    returns.push((middle, speed, Complex64::from_polar(carried, between(0.0, TAU))));
                }
            }
            for (range, speed, amplitude) in returns {
                for rx in 0..receivers {
                    for index in 0..loops {
                        let delay = 2.0 * (range + speed * index as f64 * radar.loop_period_s()) / SPEED_OF_LIGHT;
                        let start = amplitude * Complex64::cis(TAU * (radar.carrier_hz() * delay).fract());
                        let turn = Complex64::cis(TAU * radar.slope_hz_per_s * delay / radar.sample_rate_hz);
                        let at = ((frame * receivers + rx) * loops + index) * samples;
                        values[at..at + samples].iter_mut().fold(start, |value, sample| {
                            *sample += value;
                            value * turn
                        });
                    }
                }
            }
            frames.push(points);
            centres.push(middles);
            middle_s.push(time_s + 0.5 * radar.frame_duration_s());
        }
        for value in &mut values {
            *value += Complex64::from_polar((-2.0 * (1.0 - between(0.0, 1.0)).ln()).sqrt(), between(0.0, TAU));
        }
        let parts = PARTS.iter().map(|part| part.0.into()).collect();
        let body = BodyPrediction { parts, frames, centres, middle_s, ..BodyPrediction::default() };
        Evidence::new(Loaded::of_samples(radar, values, [-1e3, 1e3]), None, Some(body))
    }

    #[test]
    fn what_the_hand_carries_is_found_there_and_skin_is_nothing() {
        let found = find(&evidence(1, 12.0));
        assert!(found.len() == 1 && found[0].id == Some(effects::carried_reflector::ID), "{found:?}");
        assert_eq!(found[0].place.body_part.as_deref(), Some("left_hand"));
        assert!(found[0].p_value < 1e-6 && found[0].nats > 6.0, "{found:?}");
        for seed in 2..8 {
            let found = find(&evidence(seed, 0.0));
            assert!(found.iter().all(|found| found.p_value > 1e-3 || found.nats < 3.0), "{found:?}");
        }
    }
}
