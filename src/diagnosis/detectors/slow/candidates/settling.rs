//! The first chirps of every frame.

use std::sync::Arc;

use num_complex::Complex64;

use super::Description;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::detectors::slow::field::Field;
use crate::diagnosis::detectors::slow::settling::Settling;
use crate::diagnosis::detectors::undo;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Correction, Curve, Estimate, Place, Volume};
use crate::effects::{self, Stage};

/// Loop to the deviation of its chirps' gain.
type OfLoop = Arc<dyn Fn(usize) -> Complex64 + Send + Sync>;

pub fn of_settling(evidence: &Evidence, field: &Field, settling: &Settling) -> Candidate {
    let transmitters = evidence.radar.tx_m.len();
    let (named, free) = (is_named(evidence, settling), &settling.free);
    let deviation = deviation(settling, named);
    let square: f64 = (0..field.loops).map(|i| deviation(i).norm_sqr()).sum::<f64>() * field.frames as f64;
    let energy = square * evidence.clutter().iter().map(|v| v.norm_sqr()).sum::<f64>();
    let description = if named { decay(settling, transmitters as f64) } else { pattern(settling) };
    let curve = curve(settling, transmitters, &deviation);
    let reach = (3.0 * settling.loops).ceil() as usize;
    let place =
        Place { chirps: named.then(|| (0..reach.min(field.loops) * transmitters).collect()), ..Place::at(Stage::Receiver) };
    let nats = if named { settling.held_out_nats } else { free.held_out_nats };
    Candidate {
        curve: Some(curve),
        energy,
        correction: Correction::inverse(Volume::BY_SAMPLE, move |cube| undo::gain(cube, |[_, _, index]| 1.0 + deviation(index))),
        ..description.candidate(Behaviour::SlowTimeGain, place, if named { settling.p_value } else { free.p_value }, nats)
    }
}

/// A decay is a law of its own: without that effect only the free pattern is left.
fn is_named(evidence: &Evidence, settling: &Settling) -> bool {
    settling.is_named() && evidence.info(effects::chirp_settling::ID).is_some()
}

/// Of a decay from where the gain settles, of anything else from its mean over the frame.
fn deviation(settling: &Settling, named: bool) -> OfLoop {
    let shape = settling.clone();
    if named {
        Arc::new(move |index| shape.value(index) / (1.0 + shape.constant))
    } else {
        Arc::new(move |index| shape.free.values[index])
    }
}

fn decay(settling: &Settling, transmitters: f64) -> Description {
    // The deviation is from the mean over the frame, the depth from where the gain settles.
    let settled = 1.0 + settling.constant.re;
    let depth = -settling.amplitude.re / settled;
    let chirps = settling.loops * transmitters;
    Description {
        id: Some(effects::chirp_settling::ID),
        estimates: vec![
            Estimate::normal("depth", depth, settling.amplitude_deviation / settled),
            Estimate::normal("chirps", chirps, settling.loops_deviation * transmitters),
        ],
        statement: format!(
            "The first chirps of every frame are {} by {:.2} % and settle within {chirps:.1} chirps (time constant), at all \
             ranges alike.",
            if depth > 0.0 { "weaker" } else { "stronger" },
            100.0 * depth.abs()
        ),
    }
}

fn pattern(settling: &Settling) -> Description {
    let largest = settling.free.values.iter().map(|v| v.norm()).fold(0.0, f64::max);
    Description::unnamed(format!(
        "The gain depends on the chirp's place in its frame, by up to {:.2} %, in every frame and at all ranges alike.",
        100.0 * largest
    ))
}

fn curve(settling: &Settling, transmitters: usize, deviation: &OfLoop) -> Curve {
    let values = &settling.free.values;
    let x: Vec<f64> = (0..values.len()).map(|i| i as f64 * transmitters as f64).collect();
    Curve::new(
        "Gain of the static returns within a frame",
        ["chirp", "gain relative to its mean"],
        [
            ("measured", x.clone(), values.iter().map(|v| v.re).collect()),
            ("fitted", x, (0..values.len()).map(|i| deviation(i).re).collect()),
        ],
    )
}
