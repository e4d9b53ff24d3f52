//! Frames that are copies of earlier ones, sample by sample: noise never comes again, so the recorder wrote them twice.

use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Correction, Place, Rung};
use crate::diagnosis::suspects::receiver::field::distance;

pub const BEHAVES_LIKE: &str = "repeated frames";

pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    // Only what was received is told from its copy; corrections may make anything alike.
    if !evidence.accepted.is_empty() {
        return vec![];
    }
    let frames = evidence.cube.dims[0];
    let copies = copies(evidence);
    // A recording without noise in which nothing moves is alike everywhere.
    if copies.is_empty() || 2 * copies.len() >= frames {
        return vec![];
    }
    let size = evidence.cube.samples.len() / frames;
    let (still, samples) = (evidence.still(), evidence.cube.dims[4]);
    let moving = |frame: usize| -> f64 {
        let of_channel = |channel: usize| -> f64 {
            let still = &still[channel * samples..][..samples];
            evidence.cube.channel(frame, channel).chunks_exact(samples).map(|chirp| distance(chirp, still)).sum()
        };
        (0..evidence.cube.channels()).map(of_channel).sum()
    };
    let list: Vec<String> = copies.iter().map(|[copy, of]| format!("{copy} (of {of})")).collect();
    vec![Candidate {
        id: None,
        behaves_like: BEHAVES_LIKE,
        estimates: vec![],
        choice: None,
        place: Place { frames: Some(copies.iter().map(|copy| copy[0]).collect()), ..Place::at("receiver") },
        p_value: f64::MIN_POSITIVE,
        // Every sample is foretold by its copy, noise and all: far more than a nat each.
        gain: (copies.len() * size) as f64,
        rung: Rung::F,
        look_alikes: vec![],
        statement: format!(
            "Frame {} is a copy of an earlier one, sample by sample: what was received then is lost, and the person's motion does not \
             fit there.",
            list.join(", ")
        ),
        curve: None,
        energy: copies.iter().map(|copy| moving(copy[0])).sum(),
        correction: Correction::None,
    }]
}

/// Frames and the earlier ones that they are copies of.
fn copies(evidence: &Evidence) -> Vec<[usize; 2]> {
    let [frames, ..] = evidence.cube.dims;
    let size = evidence.cube.samples.len() / frames.max(1);
    let of = |frame: usize| &evidence.cube.samples[frame * size..(frame + 1) * size];
    (0..frames).filter_map(|frame| (0..frame).find(|&other| of(other) == of(frame)).map(|other| [frame, other])).collect()
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::diagnosis::cube::Loaded;
    use crate::radar::Radar;

    #[test]
    fn a_copied_frame_is_told_and_frames_that_are_all_alike_are_not() {
        let radar = Radar::small(8);
        let size = radar.dims().iter().product::<usize>();
        let evidence = |of: &dyn Fn(usize) -> usize| {
            let samples = (0..size).map(|i| Complex64::cis((of(i / (size / 8)) * size + i % (size / 8)) as f64)).collect();
            Evidence::new(Loaded::of_samples(radar.clone(), samples, [-100.0, 100.0]), None, None)
        };
        let found = find(&evidence(&|frame| if frame == 5 { 4 } else { frame }));
        assert_eq!(found[0].place.frames.as_deref(), Some(&[5][..]));
        assert!(find(&evidence(&|frame| frame)).is_empty() && find(&evidence(&|_| 0)).is_empty());
    }
}
