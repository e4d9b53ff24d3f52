//! From fitted slow-time fields to findings: what they have in common here, each kind in its file.

mod drift;
mod line;
mod random;
mod settling;

use std::sync::Arc;

use num_complex::Complex64;

use super::field::{Field, Part, ahead};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::course::{Course, Of};
use crate::diagnosis::cube::Cube;
pub(super) use crate::diagnosis::detectors::description::Description;
use crate::diagnosis::detectors::undo;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Correction, Place, Volume};
use crate::effects::Stage;
use crate::radar::SPEED_OF_LIGHT;

pub use drift::of_drift;
pub use line::of_line;
pub use random::of_random;
pub use settling::of_settling;

/// Range at which a phase in proportion to the delay is stated.
const STATED_AT_M: f64 = 3.0;

/// Delay of the range at which phases are stated.
pub(super) fn stated_delay_s() -> f64 {
    2.0 * STATED_AT_M / SPEED_OF_LIGHT
}

/// Frame, transmitter and loop to the deviation of that chirp.
pub(super) type Deviation = Arc<dyn Fn([usize; 3]) -> f64 + Send + Sync>;

/// `coding_cost`: nats per chirp of deviations that no law predicts.
pub(super) fn correction(evidence: &Evidence, part: Part, deviation: Deviation, coding_cost: f64) -> Correction {
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
    let correction = Correction::inverse(volume.with_coding_cost(coding_cost, samples), undo);
    match course {
        Some(course) => Correction::Followed(Box::new(correction), Arc::new(course)),
        None => correction,
    }
}

/// Energy that a deviation adds to static clutter.
fn energy(evidence: &Evidence, field: &Field, part: Part, deviation: &dyn Fn([usize; 3]) -> f64) -> f64 {
    let clutter_energy: f64 = evidence.clutter().iter().map(|v| v.norm_sqr()).sum();
    // Phases in proportion to the delay act as much as at the typical delay.
    let lever = match part {
        Part::Delay => typical_delay_s(field),
        _ => 1.0,
    };
    let square: f64 = (0..field.frames)
        .flat_map(|frame| (0..field.loops).map(move |index| (frame, index)))
        .map(|(frame, index)| (deviation([frame, 0, index]) * lever).powi(2))
        .sum();
    clutter_energy * square
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
