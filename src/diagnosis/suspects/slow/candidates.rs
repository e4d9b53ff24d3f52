//! From fitted slow-time fields to findings.

use std::f64::consts::PI;
use std::sync::Arc;

use num_complex::Complex64;

use super::drift::{Drift, Shape};
use super::field::{Field, PATTERN, Part, ahead};
use super::lines::Line;
use super::random::Random;
use super::settling::Settling;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::course::{Course, Of};
use crate::diagnosis::cube::Cube;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Correction, Curve, Estimate, NINETY, Place, Volume};
use crate::diagnosis::statistics;
use crate::diagnosis::suspects::undo;
use crate::effects::{self, Stage};
use crate::radar::SPEED_OF_LIGHT;

/// Range at which a phase in proportion to the delay is stated.
const STATED_AT_M: f64 = 3.0;

/// Delay of the range at which phases are stated.
pub(super) fn stated_delay_s() -> f64 {
    2.0 * STATED_AT_M / SPEED_OF_LIGHT
}

/// Frame, transmitter and loop to the deviation of that chirp.
pub(super) type Deviation = Arc<dyn Fn([usize; 3]) -> f64 + Send + Sync>;

/// `spent`: nats per chirp on deviations that no law predicts.
pub(super) fn correction(evidence: &Evidence, part: Part, deviation: Deviation, spent: f64) -> Correction {
    let (radar, room) = (evidence.radar.clone(), evidence.room.clone());
    let known = deviation.clone();
    let undo = move |cube: &mut Cube| {
        let receivers = cube.dims[2];
        let deviation = &known;
        let of_channel = |[frame, channel, index]: [usize; 3]| deviation([frame, channel / receivers, index]);
        match part {
            Part::Gain => undo::gain(cube, |at| (1.0 + deviation(at)).max(0.05).into()),
            Part::Phase => undo::gain(cube, |at| Complex64::cis(deviation(at))),
            Part::Delay => undo::delay_phase(cube, &radar, |delay_s| delay_s, of_channel),
            Part::Boresight => {
                let lever = |delay_s: f64| ahead(room.as_ref(), 0.5 * SPEED_OF_LIGHT * delay_s);
                undo::delay_phase(cube, &radar, lever, of_channel);
            }
        }
    };
    let volume = if part == Part::Gain { Volume::BY_SAMPLE } else { Volume::KEPT };
    let samples = evidence.cube.dims[4] * evidence.cube.dims[2];
    let [frames, tx, _, loops, _] = evidence.cube.dims;
    let phase = |i: usize| Complex64::cis(deviation([i / (tx * loops), i / loops % tx, i % loops]));
    let course = (part == Part::Phase).then(|| Course { of: Of::All, turned: (0..frames * tx * loops).map(phase).collect() });
    let correction = Correction::Inverse(Arc::new(undo), volume.spent(spent, samples));
    match course {
        Some(course) => Correction::Followed(Box::new(correction), Arc::new(course)),
        None => correction,
    }
}

/// Energy that a deviation adds to static clutter.
fn energy(evidence: &Evidence, field: &Field, part: Part, deviation: &dyn Fn([usize; 3]) -> f64) -> f64 {
    let still: f64 = evidence.still().iter().map(|v| v.norm_sqr()).sum();
    // Phases in proportion to the delay act as much as at the typical delay.
    let lever = match part {
        Part::Delay => typical_delay_s(field),
        _ => 1.0,
    };
    let square: f64 = (0..field.frames)
        .flat_map(|frame| (0..field.loops).map(move |index| (frame, index)))
        .map(|(frame, index)| (deviation([frame, 0, index]) * lever).powi(2))
        .sum();
    still * square
}

fn typical_delay_s(field: &Field) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for frame in 0..field.frames {
        for (group, w) in field.groups.iter().zip(field.weights(frame)) {
            sum += w * group.delay_s.powi(2);
            weight += w;
        }
    }
    (sum / f64::max(weight, f64::MIN_POSITIVE)).sqrt()
}

pub(super) fn behaves_like(part: Part) -> Behaviour {
    match part {
        Part::Gain => Behaviour::SlowTimeGain,
        Part::Phase | Part::Boresight => Behaviour::SlowTimePhase,
        Part::Delay => Behaviour::DelayProportionalPhase,
    }
}

pub(super) fn place(part: Part) -> Place {
    Place::at(if part == Part::Delay { Stage::Waveform } else { Stage::Receiver })
}

/// A line in slow time.
pub fn of_line(evidence: &Evidence, field: &Field, part: Part, line: &Line) -> Candidate {
    let radar = evidence.radar.clone();
    let starts = evidence.starts_s.clone();
    let time =
        move |[frame, tx, index]: [usize; 3]| starts[frame] + (index * radar.tx_m.len() + tx) as f64 * radar.chirp_period_s;
    let shape = line.clone();
    // The fitted deviation is relative to the mean of the training frames, this one to the undisturbed radar.
    let scale = if part == Part::Gain { 1.0 / (1.0 + line.constant) } else { 1.0 };
    let deviation: Deviation = Arc::new(move |at| scale * (shape.value(time(at)) - shape.constant));
    let amplitude = scale * line.amplitude();
    let interval = NINETY * line.frequency_deviation_hz;
    // As many places as the interval has.
    let places = (2.0 - interval.max(1e-6).log10().floor()).clamp(2.0, 5.0) as usize - 1;
    let hertz = format!("{:.places$} ± {:.places$} Hz", line.frequency_hz, interval);
    let harmonics =
        if line.amplitudes.len() > 1 { format!(", with harmonics up to the {}th", line.amplitudes.len()) } else { String::new() };
    let (id, estimates, statement, stage) = match part {
        Part::Gain => (
            None,
            vec![],
            format!(
                "The gain of the whole receiver is modulated by {:.2} % (amplitude) at {hertz}{harmonics}, at all ranges and in \
                 all channels alike: as mains ripple on a supply would do it.",
                100.0 * amplitude
            ),
            Stage::Receiver,
        ),
        Part::Phase | Part::Boresight => {
            // What moves along the boresight turns the returns by its cosine, whether or not the ranges tell it apart.
            let along = if part == Part::Phase { field.mean_ahead() } else { 1.0 };
            let metres = evidence.radar.wavelength_m() / (4.0 * PI * along);
            let deviation = line.amplitude_deviation.hypot(PATTERN * amplitude);
            let where_ = if part == Part::Phase { "the same at all ranges" } else { "the more the farther ahead they are" };
            (
                Some(effects::radar_vibration::ID),
                vec![
                    Estimate::normal("amplitude_m", amplitude * metres, deviation * metres),
                    Estimate::normal("frequency_hz", line.frequency_hz, line.frequency_deviation_hz),
                ],
                format!(
                    "The phases of all static returns oscillate together, by {:.3} rad at {hertz}{harmonics}, {where_}: the radar \
                     itself vibrates by {:.1} µm along its boresight.",
                    amplitude,
                    1e6 * amplitude * metres
                ),
                Stage::Scene,
            )
        }
        Part::Delay => (
            None,
            vec![],
            format!(
                "The phase of every return oscillates at {hertz}{harmonics} in proportion to its delay, by {:.4} rad at \
                 {STATED_AT_M} m: the local oscillator's frequency is modulated by {:.0} Hz.",
                amplitude * stated_delay_s(),
                amplitude / (2.0 * PI)
            ),
            Stage::Waveform,
        ),
    };
    Candidate {
        id,
        behaves_like: behaves_like(part),
        estimates,
        choice: None,
        place: Place::at(stage),
        p_value: statistics::corrected((-line.training_gain).exp(), line.tried),
        gain: line.held_out_gain,
        errs_alike: false,
        look_alikes: vec![],
        statement,
        curve: None,
        energy: energy(evidence, field, part, &*deviation),
        correction: correction(evidence, part, deviation, 0.0),
    }
}

/// A drift or a step from frame to frame.
pub fn of_drift(evidence: &Evidence, field: &Field, part: Part, drift: &Drift) -> Candidate {
    let shape = drift.clone();
    let deviation: Deviation = Arc::new(move |[frame, _, _]| shape.value(frame));
    let change = match drift.shape {
        Shape::Smooth(_) => drift.change(),
        Shape::Step([before, after], _) => after - before,
    };
    let seconds = field.times_s[field.times_s.len() - 1] - field.times_s[0];
    let how = match drift.shape {
        Shape::Smooth(_) => format!("drifts over the {seconds:.1} s of the recording"),
        Shape::Step(_, at) => format!("steps at frame {at} ({:.2} s)", field.times_s[at * field.loops]),
    };
    let decibel = |gain: f64| 20.0 * (1.0 + gain).max(1e-3).log10();
    let first = drift.value(0);
    let db = decibel(match drift.shape {
        Shape::Smooth(_) => (1.0 + drift.value(field.frames - 1)) / (1.0 + first) - 1.0,
        Shape::Step([before, after], _) => (1.0 + after) / (1.0 + before) - 1.0,
    });
    let (id, estimates, statement) = match part {
        Part::Gain => (
            Some(effects::gain_drift::ID),
            vec![Estimate::normal("db", db, 8.686 * drift.deviation)],
            format!("The gain of the radar {how}, by {db:+.3} dB, the same at all ranges: all static returns share it."),
        ),
        Part::Phase | Part::Boresight => {
            (None, vec![], format!("The phase of all static returns {how}, by {change:+.4} rad, the same at all ranges."))
        }
        Part::Delay => (
            None,
            vec![],
            format!(
                "The phase of the static returns {how} in proportion to the delay, by {:+.4} rad at {STATED_AT_M} m: the carrier \
                 changes by {:+.0} Hz.",
                change * stated_delay_s(),
                change / (2.0 * PI)
            ),
        ),
    };
    let frames: Vec<f64> = (0..field.frames).map(|f| evidence.starts_s[f]).collect();
    let (unit, factor) = match part {
        Part::Gain => ("gain, dB", 8.686),
        Part::Phase | Part::Boresight => ("phase, rad", 1.0),
        Part::Delay => ("phase at 3 m, rad", stated_delay_s()),
    };
    let curve = Curve {
        title: "Static returns from frame to frame".into(),
        x_label: "time, s".into(),
        y_label: unit.into(),
        series: vec![("fitted".into(), frames, (0..field.frames).map(|f| factor * drift.value(f)).collect())],
    };
    Candidate {
        id,
        behaves_like: behaves_like(part),
        estimates,
        choice: None,
        place: Place {
            frames: match drift.shape {
                Shape::Step(_, at) => Some((at..field.frames).collect()),
                Shape::Smooth(_) => None,
            },
            ..place(part)
        },
        p_value: drift.p_value,
        gain: drift.held_out_gain,
        errs_alike: false,
        look_alikes: vec![],
        statement,
        curve: Some(curve),
        energy: energy(evidence, field, part, &*deviation),
        correction: correction(evidence, part, deviation, 0.0),
    }
}

/// The first chirps of every frame.
pub fn of_settling(evidence: &Evidence, field: &Field, settling: &Settling) -> Candidate {
    let transmitters = evidence.radar.tx_m.len() as f64;
    let free = &settling.free;
    let named = settling.is_named();
    let shape = settling.clone();
    let last_level = settling.constant;
    let deviation: Arc<dyn Fn(usize) -> Complex64 + Send + Sync> = if named {
        Arc::new(move |index| shape.value(index) / (1.0 + last_level))
    } else {
        Arc::new(move |index| shape.free.values[index])
    };
    let square: f64 = (0..field.loops).map(|i| deviation(i).norm_sqr()).sum::<f64>() * field.frames as f64;
    let energy = square * evidence.still().iter().map(|v| v.norm_sqr()).sum::<f64>();
    // The deviation is from the mean over the frame, the depth from where the gain settles.
    let settled = 1.0 + settling.constant.re;
    let depth = -settling.amplitude.re / settled;
    let chirps = settling.loops * transmitters;
    let (id, estimates, statement) = if named {
        (
            Some(effects::chirp_settling::ID),
            vec![
                Estimate::normal("depth", depth, settling.amplitude_deviation / settled),
                Estimate::normal("chirps", chirps, settling.loops_deviation * transmitters),
            ],
            format!(
                "The first chirps of every frame are {} by {:.2} % and settle within {chirps:.1} chirps (time constant), at all \
                 ranges alike.",
                if depth > 0.0 { "weaker" } else { "stronger" },
                100.0 * depth.abs()
            ),
        )
    } else {
        let largest = free.values.iter().map(|v| v.norm()).fold(0.0, f64::max);
        (
            None,
            vec![],
            format!(
                "The gain depends on the chirp's place in its frame, by up to {:.2} %, in every frame and at all ranges alike.",
                100.0 * largest
            ),
        )
    };
    let x: Vec<f64> = (0..field.loops).map(|i| i as f64 * transmitters).collect();
    let curve = Curve {
        title: "Gain of the static returns within a frame".into(),
        x_label: "chirp".into(),
        y_label: "gain relative to its mean".into(),
        series: vec![
            ("measured".into(), x.clone(), free.values.iter().map(|v| v.re).collect()),
            ("fitted".into(), x, (0..field.loops).map(|i| deviation(i).re).collect()),
        ],
    };
    let reach = (3.0 * settling.loops).ceil() as usize;
    Candidate {
        id,
        behaves_like: Behaviour::SlowTimeGain,
        estimates,
        choice: None,
        place: Place {
            chirps: named.then(|| (0..reach.min(field.loops) * evidence.radar.tx_m.len()).collect()),
            ..Place::at(Stage::Receiver)
        },
        p_value: if named { settling.p_value } else { free.p_value },
        gain: if named { settling.held_out_gain } else { free.held_out_gain },
        errs_alike: false,
        look_alikes: vec![],
        statement,
        curve: Some(curve),
        energy,
        correction: Correction::Inverse(
            Arc::new(move |cube| undo::gain(cube, |[_, _, index]| 1.0 + deviation(index))),
            Volume::BY_SAMPLE,
        ),
    }
}

/// Chirps that deviate at random.
pub fn of_random(evidence: &Evidence, field: &Field, part: Part, random: &Random) -> Candidate {
    let series = field.series(part, |_| true);
    let variance = random.deviation.powi(2);
    // The most probable deviation of every chirp, given its noise.
    let values: Vec<f64> = series
        .value
        .iter()
        .enumerate()
        .map(|(i, value)| value * statistics::kept(variance * series.weight[i / series.loops]))
        .collect();
    let loops = series.loops;
    let spent = statistics::learned((0..values.len()).map(|i| variance * series.weight[i / loops]));
    let deviation: Deviation = Arc::new(move |[frame, _, index]| values[frame * loops + index]);
    let at_stated = random.deviation * stated_delay_s();
    let error = random.deviation_error * stated_delay_s();
    let (id, look_alikes, estimates, statement, gain) = match (part, &random.two) {
        (Part::Delay, Some(two)) if two.held_out_gain > random.held_out_gain => {
            let per_second = 1.0 / (2.0 * PI * evidence.radar.slope_hz_per_s);
            let jitter_s = two.distance * per_second;
            (
                Some(effects::chirp_start_jitter::ID),
                if two.held_out_gain < random.held_out_gain + 4.6 { vec![effects::phase_noise::ID] } else { vec![] },
                vec![Estimate::normal("jitter_s", jitter_s, two.distance_error * per_second)],
                format!(
                    "Chirps start at one of two times, {:.2} ns apart ({:.0} % of them late), at random: the phase of every return \
                     jumps in proportion to its delay, by {:.4} rad at {STATED_AT_M} m.",
                    1e9 * jitter_s,
                    100.0 * two.share,
                    two.distance * stated_delay_s()
                ),
                two.held_out_gain,
            )
        }
        (Part::Delay, two) => (
            Some(effects::phase_noise::ID),
            match two {
                Some(two) if two.held_out_gain > random.held_out_gain - 4.6 => vec![effects::chirp_start_jitter::ID],
                _ => vec![],
            },
            vec![Estimate::normal("per_chirp_rad", at_stated, error)],
            format!(
                "The phase of every return jitters at random from chirp to chirp in proportion to its delay, {at_stated:.4} rad \
                 (standard deviation) at {STATED_AT_M} m: phase noise of the local oscillator."
            ),
            random.held_out_gain,
        ),
        (part, _) => (
            None,
            vec![],
            vec![],
            format!(
                "The {} of all static returns jitters at random from chirp to chirp, by {:.4} {} (standard deviation), the same at \
                 all ranges.",
                if part == Part::Gain { "gain" } else { "phase" },
                if part == Part::Gain { 100.0 * random.deviation } else { random.deviation },
                if part == Part::Gain { "%" } else { "rad" }
            ),
            random.held_out_gain,
        ),
    };
    Candidate {
        id,
        behaves_like: behaves_like(part),
        estimates,
        choice: None,
        place: place(part),
        p_value: random.p_value,
        gain: gain.min(random.gain_within),
        errs_alike: false,
        look_alikes,
        statement,
        curve: None,
        energy: energy(evidence, field, part, &*deviation),
        correction: correction(evidence, part, deviation, spent),
    }
}
