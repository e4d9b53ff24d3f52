//! Breathing and heartbeat of somebody nobody tracked: a return whose phase oscillates from frame to frame.
//!
//! At some range the echo is `c + a exp(jψ(T))`: a static return, and one that moves by
//! more or less than a wavelength, ψ = 4π/λ times its displacement. c and a of all channels and of neighbouring ranges
//! and the common ψ are fitted in turns; ψ is then searched for a rhythm.

mod circle;
pub mod frames;
mod rhythm;

use std::f64::consts::PI;
use std::sync::Arc;

use circle::{Along, Reflector};
use frames::{Frames, frames};
use num_complex::Complex64;
use rhythm::{BREATHING_HZ, HEART_HZ, Rhythm, rhythm, vibration};

use super::region::{Region, removal};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::course::{Course, Of};
use crate::diagnosis::evidence::{Evidence, MAY_MOVE};
use crate::diagnosis::finding::{Candidate, Correction, Curve, Estimate, Place};
use crate::diagnosis::statistics;
use crate::effects::{self, Stage};

/// Displacements of a chest in a breath and in a heartbeat, m.
const LARGEST_BREATH_M: f64 = 0.03;
const LARGEST_HEARTBEAT_M: f64 = 0.8e-3;
const FEWEST_FRAMES: usize = 24;
/// Nearer ranges belong to leakage and offsets.
const NEAREST_BIN: usize = 3;
/// Ranges on each side that may belong to the same reflector.
const NEIGHBOURS: usize = 1;
/// Nats by which an arc must be likelier than a line: a thousand times.
const DECIDES: f64 = 6.9;
/// Steps to the first principal component.
const ITERATIONS: usize = 20;
/// Share of the phase's variance that a rhythm must hold.
const RHYTHMIC: f64 = 0.5;

/// At most one candidate: a return whose phase has a rhythm. None where somebody is tracked, the radar is said to move, or frames
/// are few or blocks of a long one.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    // Of a tracked body the phase is known to millimetres only, which is more than a breath.
    if evidence.body.is_some() || evidence.cube.dims[0] < FEWEST_FRAMES || evidence.split.block_loops.is_some() {
        return vec![];
    }
    if evidence.is_said_to_move() {
        return vec![];
    }
    one(evidence).into_iter().collect()
}

fn one(evidence: &Evidence) -> Option<Candidate> {
    let data = frames(evidence);
    let (training, held_out) = (&evidence.split.training, &evidence.split.held_out);
    let bins = data.bins;
    let mean: Vec<Complex64> = (0..evidence.cube.channels() * bins)
        .map(|i| training.iter().map(|&f| data.values[f][i]).sum::<Complex64>() / training.len() as f64)
        .collect();
    let change = change(&data, &mean, training);
    let strongest = (NEAREST_BIN..bins.saturating_sub(1)).max_by(|&a, &b| change[a].total_cmp(&change[b]))?;
    if change[strongest] < 10.0 {
        return None;
    }
    let near = strongest.saturating_sub(NEIGHBOURS + 1)..(strongest + NEIGHBOURS + 2).min(bins);
    let moving: Vec<usize> = near.filter(|&bin| change[bin] > 10.0).collect();
    let best = circle::common(&data, &mean, &moving, training)?;
    let metres = evidence.radar.wavelength_m() / (4.0 * PI);
    let is_rhythmic = |r: &Rhythm| r.share > RHYTHMIC && r.p_value < 1e-3;
    let named = rhythm(&evidence.starts_s, &best.phase, training, held_out)
        .filter(is_rhythmic)
        .and_then(|r| Some((name(&r, metres)?, r)))
        .filter(|_| !evidence.may_move());
    let unnamed = || vibration(&evidence.starts_s, &best.phase, training, held_out).filter(is_rhythmic);
    let vibration = if named.is_none() { unnamed() } else { None };
    let gain = held_out_gain(evidence, &data, &mean, &best);
    if gain <= 3.0 {
        return None;
    }
    // Its range is where most power turns as it does: something else may change more.
    let turning = |bin: usize| (bin, circle::along(&data, &mean, bin, training, &best));
    let power = |of: &[Along]| of.iter().map(Along::over_noise).sum::<f64>();
    let (bin, along) = moving.into_iter().map(turning).max_by(|a, b| power(&a.1).total_cmp(&power(&b.1)))?;
    let amplitude = along.iter().map(|channel| channel.amplitude).collect();
    Some(Motion { evidence, data, mean, change, bin, amplitude, circle: best, metres, named, vibration }.candidate(gain))
}

/// Power of what changes over the noise, by range.
fn change(data: &Frames, mean: &[Complex64], training: &[usize]) -> Vec<f64> {
    let (bins, channels) = (data.bins, data.noise.len());
    (0..bins)
        .map(|bin| {
            let sum: f64 = (0..channels)
                .map(|c| {
                    let i = c * bins + bin;
                    training.iter().map(|&f| (data.values[f][i] - mean[i]).norm_sqr()).sum::<f64>() / data.noise[c]
                })
                .sum();
            sum / (channels * (training.len() - 1)) as f64
        })
        .collect()
}

/// Energy of changes, `[frame][cell]`, off the line along which most of it lies (the first principal component, by power iteration).
fn off_line(changes: &[Vec<Complex64>]) -> f64 {
    let along = |line: &[Complex64], change: &[Complex64]| line.iter().zip(change).map(|(l, c)| (l.conj() * c).re).sum::<f64>();
    let energy = |change: &[Complex64]| change.iter().map(Complex64::norm_sqr).sum::<f64>();
    let Some(largest) = changes.iter().max_by(|a, b| energy(a).total_cmp(&energy(b))) else { return 0.0 };
    let mut line = largest.clone();
    for _ in 0..ITERATIONS {
        let norm = energy(&line).sqrt().max(f64::MIN_POSITIVE);
        line.iter_mut().for_each(|value| *value /= norm);
        let mut next = vec![Complex64::ZERO; line.len()];
        for change in changes {
            let share = along(&line, change);
            next.iter_mut().zip(change).for_each(|(next, value)| *next += share * value);
        }
        line = next;
    }
    let whole = energy(&line).max(f64::MIN_POSITIVE);
    changes.iter().map(|change| energy(change) - along(&line, change).powi(2) / whole).sum()
}

/// Of millimetres, in words.
fn length(mm: f64) -> String {
    if mm < 0.1 { format!("{:.0} µm", 1e3 * mm) } else { format!("{mm:.1} mm") }
}

/// What moves in a rhythm by its rate and its size; `metres`: of a radian.
fn name(rhythm: &Rhythm, metres: f64) -> Option<&'static str> {
    let (rate, amplitude_m) = (rhythm.frequency_hz, rhythm.amplitude * metres);
    if (BREATHING_HZ[0]..=BREATHING_HZ[1]).contains(&rate) && amplitude_m < LARGEST_BREATH_M {
        Some(effects::breathing::ID)
    } else if (HEART_HZ[0]..=HEART_HZ[1]).contains(&rate) && amplitude_m < LARGEST_HEARTBEAT_M {
        Some(effects::heartbeat::ID)
    } else {
        None
    }
}

/// Log-likelihood that the held-out frames gain.
fn held_out_gain(evidence: &Evidence, data: &Frames, mean: &[Complex64], best: &Reflector) -> f64 {
    let (training, held_out) = (&evidence.split.training, &evidence.split.held_out);
    let times = &evidence.starts_s;
    // A held-out frame lies between two training frames; its phase is between theirs.
    held_out
        .iter()
        .map(|&f| {
            let before = training.iter().rev().find(|&&t| t < f);
            let after = training.iter().find(|&&t| t > f);
            let (Some(&b), Some(&a)) = (before, after) else { return 0.0 };
            let share = (times[f] - times[b]) / (times[a] - times[b]);
            let turned = Complex64::cis(best.phase[b] + share * (best.phase[a] - best.phase[b]));
            best.cells
                .iter()
                .enumerate()
                .map(|(i, &cell)| {
                    let value = data.values[f][cell];
                    let left = value - best.clutter[i] - best.amplitude[i] * turned;
                    ((value - mean[cell]).norm_sqr() - left.norm_sqr()) / best.variance[i]
                })
                .sum::<f64>()
        })
        .sum()
}

/// A slow motion at some range.
struct Motion<'a> {
    evidence: &'a Evidence,
    data: Frames,
    /// Over the training frames, by cell.
    mean: Vec<Complex64>,
    /// Power of what changes over the noise, by range.
    change: Vec<f64>,
    /// Where it is, and its amplitude there in every channel.
    bin: usize,
    amplitude: Vec<Complex64>,
    circle: Reflector,
    /// Of a radian.
    metres: f64,
    /// What it is by its rhythm.
    named: Option<(&'static str, Rhythm)>,
    /// What it is without such a name.
    vibration: Option<Rhythm>,
}

impl Motion<'_> {
    /// Range bins that it reaches.
    fn ends(&self) -> [usize; 2] {
        let (change, bins) = (&self.change, self.data.bins);
        let reach = |mut bin: usize, step: isize| {
            while change[bin] > 2.0 && (step > 0 || bin > NEAREST_BIN) && bin + 1 < bins {
                bin = bin.wrapping_add_signed(step);
            }
            bin
        };
        [reach(self.bin, -1), reach(self.bin, 1)]
    }

    /// `displacement`: mm.
    fn statement(&self, range_m: f64, displacement: &[f64]) -> String {
        let extent = displacement.iter().fold([f64::MAX, f64::MIN], |[low, high], &d| [low.min(d), high.max(d)]);
        match &self.named {
            Some((id, r)) => format!(
                "At {range_m:.2} m something moves to and fro {:.1} times a minute ({:.3} Hz) by {:.2} mm (amplitude of the \
                 fundamental); {:.0} % of its motion has this rhythm, as {} has.",
                60.0 * r.frequency_hz,
                r.frequency_hz,
                1e3 * r.amplitude * self.metres,
                100.0 * r.share,
                if *id == effects::breathing::ID { "a breathing chest" } else { "a beating heart" }
            ),
            // What moves farther than a range bin leaves it.
            None if 1e-3 * (extent[1] - extent[0]) > self.evidence.radar.range_resolution_m() => format!(
                "The return at {range_m:.2} m turns from frame to frame as if it moved over {:.0} mm, but its range does not change so: it is a \
                 tone that drifts, and no mover.",
                extent[1] - extent[0]
            ),
            None if !self.is_curved() => format!(
                "The return at {range_m:.2} m changes from frame to frame along one line in the complex plane{}: something moves there \
                 by far less than a wavelength, or passes in front of it, or its gain changes.",
                self.vibration.as_ref().map_or(String::new(), |r| format!(", {}", self.times_a_second(r)))
            ),
            None => {
                let extent = extent[1] - extent[0];
                let moves = match &self.vibration {
                    Some(r) => format!(
                        "At {range_m:.2} m something vibrates {}, by {} (amplitude of this line, {:.0} % of its motion)",
                        self.times_a_second(r),
                        length(1e3 * r.amplitude * self.metres),
                        100.0 * r.share
                    ),
                    None => format!("At {range_m:.2} m something moves slowly, over {} during the recording", length(extent)),
                };
                match (self.evidence.may_move(), &self.vibration) {
                    (true, _) => format!("{moves}. {MAY_MOVE}."),
                    (false, Some(_)) => format!("{moves}."),
                    (false, None) => format!("{moves}, without a rhythm that would show within its length."),
                }
            }
        }
    }

    /// Frames show a rate modulo their own.
    fn times_a_second(&self, rhythm: &Rhythm) -> String {
        let (times, frames) = (&self.evidence.starts_s, self.evidence.starts_s.len() as f64);
        let frame_rate_hz = (frames - 1.0) / (times[times.len() - 1] - times[0]);
        format!(
            "{:.2} times a second (or at that rate from a multiple of the {frame_rate_hz:.4} Hz of the frames)",
            rhythm.frequency_hz
        )
    }

    /// Whether its path is seen to be an arc and no line, which a gain makes as well: only then is its size known. Either has one number for
    /// each frame.
    fn is_curved(&self) -> bool {
        let Reflector { cells, clutter, amplitude, phase, .. } = &self.circle;
        let Frames { values, noise, bins } = &self.data;
        let training = &self.evidence.split.training;
        let scale = |cell: usize| noise[cell / bins].max(f64::MIN_POSITIVE).sqrt().recip();
        let off_arc = |&f: &usize| -> f64 {
            let off = |(i, &cell): (usize, &usize)| {
                ((values[f][cell] - clutter[i] - amplitude[i] * Complex64::cis(phase[f])) * scale(cell)).norm_sqr()
            };
            cells.iter().enumerate().map(off).sum()
        };
        let of_frame = |&f: &usize| -> Vec<Complex64> {
            cells.iter().map(|&cell| (values[f][cell] - self.mean[cell]) * scale(cell)).collect()
        };
        let changes: Vec<Vec<Complex64>> = training.iter().map(of_frame).collect();
        off_line(&changes) - training.iter().map(off_arc).sum::<f64>() > DECIDES
    }

    /// Of the change alone; a rhythm has its own.
    fn p_value(&self) -> f64 {
        if let Some((_, rhythm)) = &self.named {
            return statistics::corrected(rhythm.p_value, 4.0);
        }
        let count = (self.data.noise.len() * (self.evidence.split.training.len() - 1)) as f64;
        statistics::corrected(statistics::mean_power_tail(self.change[self.bin], count), self.data.bins as f64)
    }

    fn candidate(self, gain: f64) -> Candidate {
        let (evidence, metres, ends) = (self.evidence, self.metres, self.ends());
        let bin_m = evidence.radar.range_resolution_m();
        let range_m = self.bin as f64 * bin_m;
        let displacement: Vec<f64> = self.circle.phase.iter().map(|p| 1e3 * p * metres).collect();
        let (statement, p_value) = (self.statement(range_m, &displacement), self.p_value());
        let region = Region { range: [ends[0].saturating_sub(1) as f64, (ends[1] + 1) as f64], doppler: [-1.0, 1.0] };
        let turned = self.circle.phase.iter().map(|&phase| Complex64::cis(phase)).collect();
        let course = Course { of: Of::Mover { bin: self.bin as f64, amplitude: self.amplitude }, turned };
        let energy: f64 = self.change.iter().map(|c| (c - 1.0).max(0.0)).sum::<f64>()
            * self.data.noise.iter().sum::<f64>()
            * evidence.cube.chirps();
        let place = Place {
            range_m: Some([ends[0] as f64 * bin_m, ends[1] as f64 * bin_m]),
            ..Place::at(if self.named.is_some() { Stage::Body } else { Stage::Scene })
        };
        Candidate {
            id: self.named.as_ref().map(|n| n.0),
            estimates: self.named.as_ref().map_or(vec![], |(_, r)| {
                vec![
                    Estimate::normal("rate_hz", r.frequency_hz, r.frequency_deviation_hz),
                    Estimate::normal("amplitude_m", r.amplitude * metres, r.amplitude_deviation * metres),
                ]
            }),
            errs_alike: true,
            // A curtain in the wind does the same; so does whatever oscillates there.
            look_alikes: if self.named.is_some() { vec![effects::moving_reflector::ID] } else { vec![] },
            statement,
            curve: Some(Curve::new(
                format!("Displacement at {range_m:.2} m"),
                ["time, s", "displacement, mm"],
                [("measured", evidence.starts_s.clone(), displacement)],
            )),
            energy,
            correction: Correction::Followed(Box::new(removal(evidence, 1, region)), Arc::new(course)),
            ..Candidate::new(Behaviour::PathLike, place, p_value, gain)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::radar::Radar;

    /// Static returns, one of which has a factor that changes slowly, from 0 to 1 of a course without a rhythm.
    fn said(factor: impl Fn(f64) -> Complex64) -> String {
        said_of_frames(Radar::small(48).frame_period_s, |frame| factor((frame / 47.0).powi(2)))
    }

    /// The same by frame.
    fn said_of_frames(frame_period_s: f64, factor: impl Fn(f64) -> Complex64) -> String {
        let radar = Radar { samples_per_chirp: 64, loops_per_frame: 4, frame_period_s, ..Radar::small(48) };
        let evidence = Evidence::in_noise(radar, 6, |[frame, channel, _, n]| {
            let tone = |bin: f64, level: f64| Complex64::from_polar(level, TAU * bin * n as f64 / 64.0 + channel as f64 * bin);
            tone(8.0, 30.0) + tone(15.0, 30.0) + tone(22.0, 20.0) * factor(frame as f64) + tone(29.0, 25.0)
        });
        find(&evidence).pop().expect("a change").statement
    }

    #[test]
    fn how_far_something_moves_is_said_where_its_path_is_an_arc() {
        let fades = said(|course| (1.0 - 0.3 * course).into());
        assert!(fades.contains("along one line in the complex plane"), "{fades}");
        let moves = said(|course| Complex64::cis(2.5 * course));
        assert!(moves.contains("moves slowly, over"), "{moves}");
    }

    /// Its skirts reach farther; leakage and offsets, which lie nearer, are left.
    #[test]
    fn what_moves_at_the_nearest_ranges_has_a_range() {
        let radar = Radar { samples_per_chirp: 64, loops_per_frame: 4, ..Radar::small(48) };
        let evidence = Evidence::in_noise(radar, 6, |[frame, channel, _, n]| {
            let tone = |bin: f64, level: f64| Complex64::from_polar(level, TAU * bin * n as f64 / 64.0 + channel as f64 * bin);
            tone(2.6, 30.0) * Complex64::cis(2.5 * (frame as f64 / 47.0).powi(2)) + tone(22.0, 20.0)
        });
        let found = find(&evidence).pop().expect("a change");
        let bin_m = evidence.radar.range_resolution_m();
        let [low, high] = found.place.range_m.expect("a range").map(|range_m| range_m / bin_m);
        assert!(low < 3.5 && (3.5..8.0).contains(&high), "{low} to {high}: {}", found.statement);
    }

    /// Faster than a heart.
    #[test]
    fn a_machine_has_its_rate() {
        let turns = |frame: f64| TAU * 0.13 * frame;
        // 6.5 Hz.
        let machine = said_of_frames(0.02, |frame| Complex64::cis(1.5 * turns(frame).sin()));
        assert!(machine.contains("vibrates 6.50 times a second"), "{machine}");
    }
}
