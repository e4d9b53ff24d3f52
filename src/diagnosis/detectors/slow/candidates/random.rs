//! Chirps that deviate at random.

use std::f64::consts::PI;
use std::sync::Arc;

use super::{Description, Deviation, STATED_AT_M, behaves_like, correction, energy, place, stated_delay_s};
use crate::diagnosis::detectors::slow::field::{Field, Part};
use crate::diagnosis::detectors::slow::random::{Random, Two};
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Estimate};
use crate::diagnosis::statistics;
use crate::effects;

pub fn of_random(evidence: &Evidence, field: &Field, part: Part, random: &Random) -> Candidate {
    let (deviation, coding_cost) = most_probable(field, part, random);
    let one = random.held_out_nats;
    let (description, look_alikes, gain) = match (part, &random.two) {
        (Part::Delay, Some(two)) if two.held_out_nats > one => {
            let rivals = if two.held_out_nats < one + statistics::UNDECIDED { vec![effects::phase_noise::ID] } else { vec![] };
            (start_jitter(evidence, two), rivals, two.held_out_nats)
        }
        (Part::Delay, two) => {
            let close = two.as_ref().is_some_and(|two| two.held_out_nats > one - statistics::UNDECIDED);
            (phase_noise(evidence, random), if close { vec![effects::chirp_start_jitter::ID] } else { vec![] }, one)
        }
        (part, _) => (common(part, random), vec![], one),
    };
    Candidate {
        look_alikes,
        energy: energy(evidence, field, part, &*deviation),
        correction: correction(evidence, part, deviation, coding_cost),
        ..description.candidate(behaves_like(part), place(part), random.p_value, gain.min(random.nats_within))
    }
}

/// The most probable deviation of every chirp, given its noise, and their coding cost (nats).
fn most_probable(field: &Field, part: Part, random: &Random) -> (Deviation, f64) {
    let series = field.series(part, |_| true);
    let variance = random.deviation.powi(2);
    let loops = series.loops;
    let ratio = |i: usize| variance * series.weight[i / loops];
    let values: Vec<f64> = series.value.iter().enumerate().map(|(i, value)| value * statistics::kept(ratio(i))).collect();
    let coding_cost = statistics::learned((0..values.len()).map(ratio));
    (Arc::new(move |[frame, _, index]| values[frame * loops + index]), coding_cost)
}

fn start_jitter(evidence: &Evidence, two: &Two) -> Description {
    let per_second = 1.0 / (2.0 * PI * evidence.radar.slope_hz_per_s);
    let jitter_s = two.distance * per_second;
    let estimates = vec![Estimate::normal("jitter_s", jitter_s, two.distance_error * per_second)];
    let observed = format!(
        "The phase of every return jumps at random between two values in proportion to its delay, by {:.4} rad at {STATED_AT_M} m",
        two.distance * stated_delay_s()
    );
    let cause =
        format!("chirps start at one of two times, {:.2} ns apart ({:.0} % of them late)", 1e9 * jitter_s, 100.0 * two.share);
    Description::named(evidence, effects::chirp_start_jitter::ID, estimates, [observed, cause])
}

fn phase_noise(evidence: &Evidence, random: &Random) -> Description {
    let at_stated = random.deviation * stated_delay_s();
    let error = random.deviation_error * stated_delay_s();
    let estimates = vec![Estimate::normal("per_chirp_rad", at_stated, error)];
    let observed = format!(
        "The phase of every return jitters at random from chirp to chirp in proportion to its delay, {at_stated:.4} rad (standard \
         deviation) at {STATED_AT_M} m"
    );
    Description::named(evidence, effects::phase_noise::ID, estimates, [observed, "phase noise of the local oscillator".into()])
}

/// The same at all ranges.
fn common(part: Part, random: &Random) -> Description {
    let (what, size, unit) =
        if part == Part::Gain { ("gain", 100.0 * random.deviation, "%") } else { ("phase", random.deviation, "rad") };
    Description::unnamed(format!(
        "The {what} of all static returns jitters at random from chirp to chirp, by {size:.4} {unit} (standard deviation), the same at \
         all ranges."
    ))
}
