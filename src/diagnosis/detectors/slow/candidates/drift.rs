//! A drift or a step from frame to frame.

use std::f64::consts::PI;
use std::sync::Arc;

use super::{Description, Deviation, STATED_AT_M, behaves_like, correction, energy, place, stated_delay_s};
use crate::diagnosis::detectors::slow::drift::{Drift, Shape};
use crate::diagnosis::detectors::slow::field::{Field, Part};
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Curve, Estimate, Place};
use crate::effects;

pub fn of_drift(evidence: &Evidence, field: &Field, part: Part, drift: &Drift) -> Candidate {
    let shape = drift.clone();
    let deviation: Deviation = Arc::new(move |[frame, _, _]| shape.value(frame));
    let description = describe(evidence, field, part, drift);
    let place = Place {
        frames: match drift.shape {
            Shape::Step(_, at) => Some((at..field.frames).collect()),
            Shape::Smooth(_) => None,
        },
        ..place(part)
    };
    Candidate {
        curve: Some(curve(evidence, field, part, drift)),
        energy: energy(evidence, field, part, &*deviation),
        correction: correction(evidence, part, deviation, 0.0),
        ..description.candidate(behaves_like(part), place, drift.p_value, drift.held_out_nats)
    }
}

fn describe(evidence: &Evidence, field: &Field, part: Part, drift: &Drift) -> Description {
    let change = match drift.shape {
        Shape::Smooth(_) => drift.change(),
        Shape::Step([before, after], _) => after - before,
    };
    let seconds = field.times_s[field.times_s.len() - 1] - field.times_s[0];
    let how = match drift.shape {
        Shape::Smooth(_) => format!("drifts over the {seconds:.1} s of the recording"),
        Shape::Step(_, at) => format!("steps at frame {at} ({:.2} s)", field.times_s[at * field.loops]),
    };
    match part {
        Part::Gain => {
            let db = gain_db(field, drift);
            let estimates = vec![Estimate::normal("db", db, 8.686 * drift.deviation)];
            let observed = format!("The gain of the radar {how}, by {db:+.3} dB, the same at all ranges");
            Description::named(evidence, effects::gain_drift::ID, estimates, [observed, "all static returns share it".into()])
        }
        Part::Phase | Part::Boresight => {
            Description::unnamed(format!("The phase of all static returns {how}, by {change:+.4} rad, the same at all ranges."))
        }
        Part::Delay => Description::unnamed(format!(
            "The phase of the static returns {how} in proportion to the delay, by {:+.4} rad at {STATED_AT_M} m, as if the \
             carrier changed by {:+.0} Hz.",
            change * stated_delay_s(),
            change / (2.0 * PI)
        )),
    }
}

/// From the first frame to the last, or from before a step to after it.
fn gain_db(field: &Field, drift: &Drift) -> f64 {
    let decibel = |gain: f64| 20.0 * (1.0 + gain).max(1e-3).log10();
    decibel(match drift.shape {
        Shape::Smooth(_) => (1.0 + drift.value(field.frames - 1)) / (1.0 + drift.value(0)) - 1.0,
        Shape::Step([before, after], _) => (1.0 + after) / (1.0 + before) - 1.0,
    })
}

fn curve(evidence: &Evidence, field: &Field, part: Part, drift: &Drift) -> Curve {
    let (unit, factor) = match part {
        Part::Gain => ("gain, dB", 8.686),
        Part::Phase | Part::Boresight => ("phase, rad", 1.0),
        Part::Delay => ("phase at 3 m, rad", stated_delay_s()),
    };
    let frames: Vec<f64> = (0..field.frames).map(|f| evidence.starts_s[f]).collect();
    Curve::new(
        "Static returns from frame to frame",
        ["time, s", unit],
        [("fitted", frames, (0..field.frames).map(|f| factor * drift.value(f)).collect())],
    )
}
