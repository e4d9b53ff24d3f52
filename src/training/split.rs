//! Which frames train and which are held out, and in which order an epoch visits them.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::{
    LoadedRecording,
    config::{Split, TrainingConfig},
};

/// A frame of one of several recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FrameId {
    pub recording: usize,
    pub frame: usize,
}

/// Disjoint frames to train on and to validate on, both ascending.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameSplit {
    pub training: Vec<FrameId>,
    pub validation: Vec<FrameId>,
}

impl FrameSplit {
    /// `frames` holds the number of frames of each recording; at least one of each with more than one is held out
    /// when `validation_fraction` is above zero.
    pub fn new(frames: &[usize], validation_fraction: f64, split: Split, seed: u64) -> Self {
        let mut training = Vec::new();
        let mut validation = Vec::new();
        for (recording, &count) in frames.iter().enumerate() {
            let held_out = match (validation_fraction > 0.0, count) {
                (false, _) | (_, 0 | 1) => 0,
                (true, _) => ((count as f64 * validation_fraction).round() as usize).clamp(1, count - 1),
            };
            let mut order: Vec<usize> = (0..count).collect();
            if split == Split::Random {
                order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed ^ (recording as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)));
            }
            if split == Split::Interleaved {
                // To the back, in the middle of each of `held_out` equal stretches.
                let is_held = |frame: &usize| (0..held_out).any(|part| (2 * part + 1) * count / (2 * held_out) == *frame);
                order.sort_by_key(is_held);
            }
            let (train, held) = order.split_at(count - held_out);
            training.extend(train.iter().map(|&frame| FrameId { recording, frame }));
            validation.extend(held.iter().map(|&frame| FrameId { recording, frame }));
        }
        training.sort_unstable();
        validation.sort_unstable();
        Self { training, validation }
    }

    /// The split of these recordings' whole frames: those with lost chirps are in neither part.
    pub fn of(recordings: &[LoadedRecording], config: &TrainingConfig, seed: u64) -> Self {
        let counts: Vec<usize> = recordings.iter().map(|recording| recording.scene.radar.frames).collect();
        let mut split = Self::new(&counts, config.validation_fraction, config.split, seed);
        for part in [&mut split.training, &mut split.validation] {
            part.retain(|id| recordings[id.recording].recording.is_whole(id.frame));
        }
        split
    }

    /// The same split with at most so many training frames, evenly spaced over all of them.
    pub fn with_most(mut self, frames: Option<usize>) -> Self {
        let all = self.training.len();
        if let Some(most) = frames.filter(|&most| most < all) {
            self.training = (0..most).map(|part| self.training[(2 * part + 1) * all / (2 * most)]).collect();
        }
        self
    }

    /// The same split whose epochs visit every training frame so many times.
    pub fn repeated(mut self, times: usize) -> Self {
        self.training = self.training.repeat(times);
        self.training.sort_unstable();
        self
    }

    /// The order in which an epoch visits the training frames: a function of seed and epoch alone, so that a
    /// resumed run continues as if it had never stopped.
    pub fn epoch_order(&self, seed: u64, epoch: usize) -> Vec<FrameId> {
        let mut order = self.training.clone();
        order.shuffle(&mut step_rng(seed, epoch, 0xE90C));
        order
    }
}

/// Random numbers for one step, a function of seed, step and purpose alone.
pub fn step_rng(seed: u64, step: usize, purpose: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ purpose.rotate_left(32));
    rng.set_stream(step as u64);
    rng
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_fifth_of_every_recording_is_held_out() {
        let split = FrameSplit::new(&[10, 5], 0.2, Split::Last, 1);
        assert_eq!(split.training.len(), 12);
        let held: Vec<_> = split.validation.iter().map(|id| (id.recording, id.frame)).collect();
        assert_eq!(held, [(0, 8), (0, 9), (1, 4)]);
    }

    #[test]
    fn a_random_split_is_disjoint_complete_and_set_by_its_seed() {
        let split = FrameSplit::new(&[40], 0.25, Split::Random, 7);
        assert_eq!(split.validation.len(), 10);
        assert!(split.validation.iter().all(|id| !split.training.contains(id)));
        assert_eq!(split, FrameSplit::new(&[40], 0.25, Split::Random, 7));
        assert_ne!(split, FrameSplit::new(&[40], 0.25, Split::Random, 8));
    }

    #[test]
    fn an_interleaved_split_holds_out_every_fourth_frame() {
        let split = FrameSplit::new(&[12], 0.25, Split::Interleaved, 1);
        assert_eq!(split.validation.iter().map(|id| id.frame).collect::<Vec<_>>(), [2, 6, 10]);
        assert_eq!(split.training.len(), 9);
    }

    #[test]
    fn a_single_frame_is_trained_on_not_held_out() {
        let split = FrameSplit::new(&[1], 0.2, Split::Last, 1);
        assert_eq!((split.training.len(), split.validation.len()), (1, 0));
    }

    #[test]
    fn few_frames_are_spread_over_all_recordings() {
        let split = FrameSplit::new(&[10, 10], 0.2, Split::Last, 1);
        let few = split.clone().with_most(Some(4));
        let found: Vec<_> = few.training.iter().map(|id| (id.recording, id.frame)).collect();
        assert_eq!(found, [(0, 2), (0, 6), (1, 2), (1, 6)]);
        assert_eq!(few.validation, split.validation);
        assert_eq!(split.clone().with_most(Some(99)), split);
        assert_eq!(split.clone().with_most(None), split);
        let often = few.repeated(3);
        assert_eq!(often.epoch_order(1, 0).len(), 12);
        assert_eq!(often.training.iter().filter(|id| (id.recording, id.frame) == (1, 6)).count(), 3);
    }

    #[test]
    fn every_epoch_visits_all_frames_in_an_order_of_its_own() {
        let split = FrameSplit::new(&[30], 0.2, Split::Last, 1);
        let (first, second) = (split.epoch_order(3, 0), split.epoch_order(3, 1));
        assert_ne!(first, second);
        assert_eq!(first, split.epoch_order(3, 0));
        let mut sorted = second.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, split.training);
    }
}
