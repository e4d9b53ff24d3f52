//! Candidate: something that moves, and not with the body (`moving_reflector`).

use super::oscillation::Oscillation;
use super::removal::{emptied, patch};
use super::scene::Scene;
use super::track::{Sighting, Track};
use super::whereabouts::Whereabouts;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::power::Template;
use crate::diagnosis::statistics::{bounds, corrected, median};
use crate::diagnosis::vector::sine;
use crate::diagnosis::{Candidate, Estimate, Place};
use crate::effects::{self, Stage};
use crate::radar::Radar;

/// Sightings are good to this share of a cell, and no better than that: the windows' law holds for a steady tone.
const CELL_ERROR: f64 = 0.12;
/// A sighting so much weaker than the others is noise or a sidelobe on the way.
const CHANCE_SHARE: f64 = 0.03;
/// A thing that moves farther to either side is no fan, curtain or pendulum: it has no name.
pub const LARGEST_EXCURSION_M: f64 = 0.5;
/// A sinusoidal motion leaves less than this share of the velocities' variance.
const SINUSOID_LEAVES: f64 = 0.15;

/// A track that is judged: how far it predicts frames that it was not fitted to.
pub struct Mover {
    pub track: Track,
    /// Fitted to all frames that show it.
    pub oscillation: Option<Oscillation>,
    /// What the track behaves like; none: its ranges and its Doppler do not belong together.
    pub id: Option<&'static str>,
    /// Held-out frames, nats.
    pub gain: f64,
    pub power: f64,
    /// Standard deviation of its direction (x over range); none: as the sightings scatter.
    pub sine_error: Option<f64>,
    /// Why it is not the body.
    pub unlike: &'static str,
}

impl Mover {
    pub fn new(scene: &Scene, mut track: Track) -> Option<Self> {
        let usual = median(&mut track.sightings.iter().map(|s| s.power).collect::<Vec<_>>());
        track.sightings.retain(|s| s.power > CHANCE_SHARE * usual);
        let split = &scene.evidence.split;
        let training: Vec<Sighting> = track.sightings.iter().copied().filter(|s| split.training.contains(&s.frame)).collect();
        if training.len() < 4 || 3 * training.len() < split.training.len() {
            return None;
        }
        let oscillation = fit(scene, &training);
        let power = median(&mut training.iter().map(|s| s.power).collect::<Vec<_>>());
        let gain = split
            .held_out
            .iter()
            .map(|&frame| {
                let template = template(scene, frame, oscillation.as_ref(), &training);
                scene.gain(frame, &template, power)
            })
            .sum();
        let id = if oscillation.is_some() { Some(effects::moving_reflector::ID) } else { named(scene, &track.sightings) };
        let id = id.map(|id| if outside(scene, &track.sightings) { effects::range_alias::ID } else { id });
        // Where the body is, what moves with it has the same law: only a sinusoidal motion to one side of it is identified.
        let id = id.filter(|_| !scene.over_body || (oscillation.is_some() && aside(scene, &track.sightings)));
        let unlike = if scene.over_body {
            "far stronger than the body can be at that range and velocity"
        } else {
            "neither the body nor its mirror images can be there"
        };
        let oscillation = oscillation.and_then(|_| fit(scene, &track.sightings)).or(oscillation);
        Some(Self { track, oscillation, id, gain, power, sine_error: None, unlike })
    }

    pub fn candidate(&self, scene: &Scene, tried: f64) -> Candidate {
        let (evidence, sightings) = (scene.evidence, &self.track.sightings);
        let seen = Whereabouts::new(scene, sightings, self.oscillation.as_ref(), self.sine_error);
        let is_reflector = self.id == Some(effects::moving_reflector::ID);
        Candidate {
            id: self.id,
            estimates: if is_reflector { self.estimates(&seen, &evidence.radar) } else { vec![] },
            look_alikes: self.look_alikes(scene),
            statement: self.statement(&seen),
            energy: energy(scene, sightings.iter().map(|s| s.power).sum()),
            correction: emptied(evidence, self.cells(scene)),
            ..Candidate::new(Behaviour::PathLike, self.place(scene, &seen), corrected(self.track.p_value, tried), self.gain)
        }
    }

    fn place(&self, scene: &Scene, seen: &Whereabouts) -> Place {
        let stage = if self.id == Some(effects::range_alias::ID) { Stage::Propagation } else { Stage::Scene };
        let frames: Vec<usize> = self.track.sightings.iter().map(|s| s.frame).collect();
        let everywhere = frames.len() == scene.frames();
        Place { frames: (!everywhere).then_some(frames), ..seen.place(&scene.evidence.radar, stage) }
    }

    /// As of a reflector that moves.
    fn estimates(&self, seen: &Whereabouts, radar: &Radar) -> Vec<Estimate> {
        let mut estimates: Vec<Estimate> = seen.position(radar).into_iter().collect();
        if let Some(fit) = &self.oscillation {
            estimates.push(Estimate::normal("rate_hz", fit.rate_hz, fit.deviations[2].max(0.005)));
            let excursion = fit.excursion_m();
            let error = 1.645 * fit.deviations[1].max(0.03 * excursion);
            // Only the part along the line of sight is seen.
            estimates.push(Estimate {
                name: "swing_m",
                values: vec![excursion],
                ci90: vec![[excursion - error, 1.1 * excursion + error]],
            });
        }
        estimates
    }

    fn statement(&self, seen: &Whereabouts) -> String {
        let motion = match &self.oscillation {
            Some(fit) => format!(
                "oscillates by ±{:.0} mm along the line of sight {:.2} times a second",
                1e3 * fit.excursion_m(),
                fit.rate_hz
            ),
            None => format!("moves between {:.2} and {:.2} m", seen.ranges_m[0], seen.ranges_m[1]),
        };
        let alias = match self.id {
            Some(effects::range_alias::ID) => {
                " Its range falls when its Doppler says that it recedes: it lies beyond the unambiguous range and is folded back."
            }
            None => " Its range and its Doppler do not belong together: no single reflector moves so.",
            _ => "",
        };
        format!(
            "Something {:.2} m away{} {motion}, {:.0} dB above the noise; {}.{alias}",
            seen.mean_m,
            seen.towards(),
            10.0 * self.power.log10(),
            self.unlike
        )
    }

    /// Cells `[doppler · samples + range]` of the frames in which it is seen, or follows from its law.
    fn cells(&self, scene: &Scene) -> Vec<(usize, Vec<usize>)> {
        let of_frame = |frame: usize| {
            let seen = self.track.sightings.iter().find(|s| s.frame == frame);
            let (range_m, velocity_mps) = match (seen, &self.oscillation) {
                (Some(seen), _) => (seen.range_m, seen.velocity_mps),
                (None, Some(fit)) => fit.at(middle_s(scene, frame)),
                (None, None) => return None,
            };
            let power = seen.map_or(self.power, |s| s.power);
            let expected = scene.model.template([(range_m, velocity_mps, power)].into_iter());
            // Over the body, what is mostly the body's stays: emptied, it would look like a body that returns less.
            let body = scene.model.expected(frame);
            let is_bodys = |cell: usize| !scene.over_body || body[cell] > expected[cell];
            let reached = scene.model.support(frame).iter().enumerate();
            let kept: Vec<bool> = reached.map(|(cell, reached)| *reached && is_bodys(cell)).collect();
            Some((frame, patch(&expected, scene.map(frame), &kept, scene.samples, 0.05)))
        };
        (0..scene.frames()).filter_map(of_frame).collect()
    }

    /// With quadrature, what is folded at the end of the unambiguous range looks as if it were there.
    fn look_alikes(&self, scene: &Scene) -> Vec<&'static str> {
        match self.id {
            Some(effects::range_alias::ID) => vec![effects::moving_reflector::ID],
            Some(effects::moving_reflector::ID) if !scene.evidence.is_real() => vec![effects::range_alias::ID],
            _ => vec![],
        }
    }
}

/// Whether most sightings come from a direction that the body does not fill.
pub fn aside(scene: &Scene, sightings: &[Sighting]) -> bool {
    const APART: f64 = 0.25;
    let Some(body) = &scene.evidence.body else { return false };
    let centre = scene.evidence.radar.centre_m();
    let apart = |sighting: &&Sighting| {
        let [low, high] = bounds(body.frames[sighting.frame].iter().map(|point| sine(point.position_m, centre)));
        sighting.sine.is_some_and(|sine| sine < low - APART || sine > high + APART)
    };
    3 * sightings.iter().filter(apart).count() > 2 * sightings.len()
}

/// Whether the room is too small for what was seen: farther than its farthest corner.
fn outside(scene: &Scene, sightings: &[Sighting]) -> bool {
    let farthest = scene.evidence.room.as_ref().and_then(|room| room.farthest_m());
    let range = median(&mut sightings.iter().map(|s| s.range_m).collect::<Vec<_>>());
    farthest.is_some_and(|farthest| range > farthest + 2.0 * scene.range_m(1.0))
}

/// Whether ranges change as Doppler says: as of something that moves, or with the sign of what is folded at the end of
/// the unambiguous range.
fn named(scene: &Scene, sightings: &[Sighting]) -> Option<&'static str> {
    let radar = &scene.evidence.radar;
    let (period_s, span) = (radar.frame_period_s, scene.loops as f64 / scene.model.cells.doppler_per_mps);
    let cell_m = scene.range_m(1.0);
    let pairs: Vec<(f64, f64)> = sightings
        .windows(2)
        .filter(|pair| pair[1].frame == pair[0].frame + 1)
        .map(|pair| (pair[1].range_m - pair[0].range_m, 0.5 * (pair[0].velocity_mps + pair[1].velocity_mps) * period_s))
        .collect();
    if pairs.len() < 4 {
        return None;
    }
    let apart = |sign: f64| {
        let mut steps: Vec<f64> = pairs
            .iter()
            .map(|(range, velocity)| {
                let difference = range - sign * velocity;
                (difference - span * period_s * (difference / (span * period_s)).round()).abs()
            })
            .collect();
        median(&mut steps) / cell_m
    };
    let (with, against) = (apart(1.0), apart(-1.0));
    if with < 0.5 && with <= against {
        Some(effects::moving_reflector::ID)
    } else if against < 0.5 && against < 0.5 * with {
        Some(effects::range_alias::ID)
    } else {
        None
    }
}

/// Energy of all samples of tones whose peaks in the maps sum to this much over the noise.
pub fn energy(scene: &Scene, power: f64) -> f64 {
    // The windows' coherent gains take 1.5 each off the peak.
    2.25 * power * scene.evidence.total_noise()
}

pub fn middle_s(scene: &Scene, frame: usize) -> f64 {
    scene.evidence.starts_s[frame] + 0.5 * scene.evidence.radar.frame_duration_s()
}

fn fit(scene: &Scene, sightings: &[Sighting]) -> Option<Oscillation> {
    let times: Vec<f64> = sightings.iter().map(|s| middle_s(scene, s.frame)).collect();
    let cells = &scene.model.cells;
    let errors = [CELL_ERROR / cells.bins_per_m, CELL_ERROR / cells.doppler_per_mps];
    Oscillation::fit(sightings, &times, errors, scene.loops as f64 / cells.doppler_per_mps)
        .filter(|fit| fit.left < SINUSOID_LEAVES && fit.excursion_m() < LARGEST_EXCURSION_M)
}

/// What a frame should show: the sinusoidal motion, or the way between the neighbouring sightings, blurred by what it may be off.
fn template(scene: &Scene, frame: usize, oscillation: Option<&Oscillation>, training: &[Sighting]) -> Template {
    let point = |range: f64, velocity: f64, power: f64| (range, velocity, power);
    let cells = &scene.model.cells;
    let map = match oscillation {
        Some(fit) => {
            let (range, velocity) = fit.at(middle_s(scene, frame));
            scene.model.template([point(range, velocity, 1.0)].into_iter())
        }
        None => {
            let after = training.partition_point(|s| s.frame < frame);
            let near = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|i| training.get(i));
            let points: Vec<(f64, f64)> = near.map(|s| (s.range_m, s.velocity_mps)).collect();
            let count = points.len().max(1) as f64;
            let middle = points.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / count, sum.1 + p.1 / count));
            let blur = (-2..=2).flat_map(|slow| (-1..=1).map(move |fast| (f64::from(slow), f64::from(fast))));
            scene.model.template(
                blur.map(|(slow, fast)| point(middle.0 + fast / cells.bins_per_m, middle.1 + slow / cells.doppler_per_mps, 0.1)),
            )
        }
    };
    scene.visible(frame, &map)
}
