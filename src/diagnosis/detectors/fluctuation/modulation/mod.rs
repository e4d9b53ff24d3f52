//! A static return that is modulated at one frequency while the others are constant: a lamp, a motor, a screen.
//!
//! Its two sidebands are alike and go on from frame to frame. What moves there has other phases in every frame, so the
//! frames' own scatter is what a line must stand out of. A lamp shines on all that is around it, so ranges are looked at
//! together, too.

mod chirps;
mod judged;
mod line;
mod waves;

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Correction, Place};
use crate::diagnosis::statistics::corrected;
use crate::effects::Stage;
use crate::grid::Grid;

use chirps::{Chirps, TOGETHER};
use line::Line;

/// Frequencies per resolution cell of the recording.
const FINE: f64 = 4.0;
/// Frequencies per resolution cell of a frame at which its amplitude is worked out.
const COARSE: f64 = 8.0;
const FEWEST_FRAMES: usize = 5;

pub fn find(evidence: &Evidence) -> Option<Candidate> {
    let training = &evidence.split.training;
    if training.len() < FEWEST_FRAMES
        || evidence.split.held_out.is_empty()
        || evidence.accepted_unnamed.contains(&Behaviour::Modulated)
    {
        return None;
    }
    let chirps = Chirps::new(evidence)?;
    let duration_s = chirps.middles_s[training[training.len() - 1]] - chirps.middles_s[training[0]];
    let [lowest_hz, highest_hz] = chirps.band_hz();
    if duration_s * lowest_hz < FEWEST_FRAMES as f64 || highest_hz <= lowest_hz {
        return None;
    }
    let coarse = 1.0 / (COARSE * chirps.frame_s());
    let fine = 1.0 / (FINE * duration_s);
    let cells = ((highest_hz - lowest_hz) / coarse).ceil() as usize;
    let strongest = |cell: usize| {
        let start = lowest_hz + cell as f64 * coarse;
        let sidebands = chirps.sidebands(start + 0.5 * coarse);
        let count = (coarse / fine).ceil() as usize;
        (0..count).filter_map(|i| chirps.strongest(&sidebands, start + i as f64 * fine)).max_by(Line::weaker)
    };
    let line = (0..cells).into_par_iter().filter_map(strongest).max_by(Line::weaker)?;
    let line = chirps.refined(line, 0.5 * fine);
    let tried = (highest_hz - lowest_hz) * duration_s * (chirps.clutter.shape()[1] / 2 * TOGETHER.len()) as f64;
    let p_value = corrected(line.chance, tried);
    if p_value >= 0.01 {
        return None;
    }
    let sidebands = chirps.referenced(line.frequency_hz);
    let nats = chirps.nats(&line, &sidebands);
    if nats > 0.0 && chirps.others_are_constant(&line, &sidebands) {
        candidate(&chirps, &chirps.settled(line), p_value, nats)
    } else {
        None
    }
}

fn candidate(chirps: &Chirps, line: &Line, p_value: f64, nats: f64) -> Option<Candidate> {
    let evidence = chirps.evidence;
    let bin_m = evidence.radar.range_resolution_m();
    let range_m = line.middle() * bin_m;
    let sinusoid = chirps.sinusoid(line.frequency_hz)?;
    let (patch, means) = (chirps.patch(&sinusoid, line), sinusoid.means);
    let waves = chirps.waves(&sinusoid, &patch);
    let [near_m, far_m] = [patch.start(), patch.end()].map(|bin| *bin as f64 * bin_m);
    let chirp_count = evidence.cube.chirps();
    let energy = waves.iter().flat_map(Grid::values).map(|value| value.norm_sqr()).sum::<f64>() * 0.5 * chirp_count;
    let (starts_s, loop_s, frequency_hz) = (evidence.starts_s.clone(), evidence.radar.loop_period_s(), line.frequency_hz);
    let frame_rate_hz = 1.0 / evidence.radar.frame_period_s;
    let place = Place { range_m: Some([near_m, far_m]), ..Place::at(Stage::Scene) };
    Some(Candidate {
        statement: format!(
            "The return {range_m:.2} m away is modulated at {frequency_hz:.1} Hz (or at that and a multiple of the \
             {frame_rate_hz:.1} frames per second), coherently from frame to frame, while the other ranges are constant: a lamp or \
             a machine is there."
        ),
        energy,
        correction: Correction::samples(move |cube| {
            cube.each_chirp(|[frame, channel, index], chirp| {
                let (sine, cosine) = (TAU * frequency_hz * (starts_s[frame] + index as f64 * loop_s)).sin_cos();
                let [with_cosine, with_sine] = [0, 1].map(|part| waves[part].below([channel]));
                for ((value, a), b) in chirp.iter_mut().zip(with_cosine).zip(with_sine) {
                    *value -= a * (cosine - means[0]) + b * (sine - means[1]);
                }
            });
        }),
        ..Candidate::new(Behaviour::Modulated, place, p_value.max(f64::MIN_POSITIVE), nats)
    })
}

#[cfg(test)]
mod tests;
