//! Learning from the windows of the training sequences, and judging those of others.

use burn::module::Module;
use burn::optim::{AdamConfig, GradientsParams, ModuleOptimizer};
use burn::tensor::activation::log_softmax;
use burn::tensor::{Device, Tensor, TensorData};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::config::RecognitionConfig;
use super::maps::{Sequence, Window, cut, windows};
use super::network::Network;
use crate::error::{Error, Result};

/// Trains a network on all windows of the sequences; `progress` receives the epochs done and the last one's mean loss
/// (cross-entropy, nats). Equal seeds give equal networks. `device` is a plain one; gradients are its autodiff's.
///
/// # Errors
/// A loss that is no longer a number.
pub fn train(
    sequences: &[Sequence],
    classes: usize,
    config: &RecognitionConfig,
    device: &Device,
    progress: &mut dyn FnMut(usize, f64),
) -> Result<Network> {
    let device = device.clone().autodiff();
    let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
    let mut network = Network::init(config.channels, classes, &mut rng, &device);
    let mut optimizer = ModuleOptimizer::from(AdamConfig::new().with_epsilon(1e-8).build());
    let mut all = windows(sequences, config);
    let steps = config.epochs * all.len().div_ceil(config.batch);
    let mut step = 0;
    for epoch in 0..config.epochs {
        all.shuffle(&mut rng);
        let mut sum = 0.0;
        for batch in all.chunks(config.batch) {
            let changed: Vec<(Window, f32)> =
                batch.iter().map(|&window| augmented(window, sequences, config, &mut rng)).collect();
            let wanted: Vec<usize> = batch.iter().map(|window| sequences[window.sequence].class).collect();
            let output = network.forward(input(sequences, &changed, config.window_frames, &device));
            let loss = cross_entropy(output, &wanted, classes);
            let value: f64 = loss.clone().into_scalar::<f32>().into();
            if !value.is_finite() {
                return Err(Error::NonFinite { stage: "the loss of recognition".into(), step });
            }
            sum += value * batch.len() as f64;
            let mut gradients = loss.backward();
            let gradients = GradientsParams::from_module(&mut gradients, &network);
            // Down to nothing along half a cosine.
            let rate = 0.5 * (1.0 + (std::f64::consts::PI * step as f64 / steps as f64).cos());
            network = optimizer.step(config.learning_rate * rate, network, gradients);
            step += 1;
        }
        progress(epoch + 1, sum / all.len() as f64);
    }
    Ok(network.valid())
}

/// Probabilities `[window][class]` of all windows of the sequences, in the order of [`windows`].
pub fn judge(network: &Network, sequences: &[Sequence], config: &RecognitionConfig, device: &Device) -> Vec<Vec<f64>> {
    let all: Vec<(Window, f32)> = windows(sequences, config).into_iter().map(|window| (window, 0.0)).collect();
    let mut found = Vec::with_capacity(all.len());
    for batch in all.chunks(config.batch) {
        let output = log_softmax(network.forward(input(sequences, batch, config.window_frames, device)), 1);
        let classes = output.dims()[1];
        let values = output.into_data().convert::<f32>().try_into_vec::<f32>().expect("converted");
        found.extend(values.chunks_exact(classes).map(|row| row.iter().map(|value| f64::from(*value).exp()).collect()));
    }
    found
}

/// The window a little earlier or later within its sequence, and a change of its level.
fn augmented(window: Window, sequences: &[Sequence], config: &RecognitionConfig, rng: &mut ChaCha8Rng) -> (Window, f32) {
    let last = sequences[window.sequence].frames - config.window_frames;
    let shift = rng.random_range(0..=2 * config.shift_frames);
    let start = (window.start + shift).saturating_sub(config.shift_frames).min(last);
    let gain = config.gain_db / -config.floor_db * (2.0 * rng.random::<f64>() - 1.0);
    (Window { start, ..window }, gain as f32)
}

/// `[window, row, frame]` of each map.
fn input(sequences: &[Sequence], batch: &[(Window, f32)], frames: usize, device: &Device) -> [Tensor<3>; 3] {
    std::array::from_fn(|map| {
        let of = |&(window, gain): &(Window, f32)| cut(&sequences[window.sequence], map, window.start, frames, gain);
        let values: Vec<f32> = batch.iter().flat_map(of).collect();
        let rows = sequences[batch[0].0.sequence].rows[map];
        Tensor::from_data(TensorData::new(values, [batch.len(), rows, frames]), device)
    })
}

/// Mean over the windows, nats.
fn cross_entropy(output: Tensor<2>, wanted: &[usize], classes: usize) -> Tensor<1> {
    let chosen: Vec<f32> =
        wanted.iter().flat_map(|&class| (0..classes).map(move |other| if other == class { 1.0 } else { 0.0 })).collect();
    let chosen = Tensor::<2>::from_data(TensorData::new(chosen, [wanted.len(), classes]), &output.device());
    -(log_softmax(output, 1) * chosen).sum() / wanted.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config() -> RecognitionConfig {
        RecognitionConfig { window_frames: 8, stride_frames: 4, epochs: 25, batch: 8, ..RecognitionConfig::default() }
    }

    /// Sequences of two classes: a ridge that rises, or falls, through noise.
    fn toys(count: usize, seed: u64) -> Vec<Sequence> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let toy = |index: usize| {
            let class = index % 2;
            let values = std::array::from_fn(|_| {
                let offset = rng.random_range(0..16);
                (0..16 * 16)
                    .map(|cell| {
                        let (row, frame) = (cell / 16, cell % 16);
                        let ridge = if class == 0 { offset + frame } else { offset + 32 - frame } % 16;
                        if row == ridge { 1.0 } else { rng.random_range(0.0..0.4) }
                    })
                    .collect()
            });
            Sequence { name: format!("toy {index}"), class, frames: 16, rows: [16; 3], values }
        };
        (0..count).map(toy).collect()
    }

    fn right(network: &Network, sequences: &[Sequence], config: &RecognitionConfig) -> f64 {
        let found = judge(network, sequences, config, &Device::flex());
        let all = windows(sequences, config);
        let hits = found.iter().zip(&all).filter(|(p, window)| (p[1] > p[0]) == (sequences[window.sequence].class == 1));
        hits.count() as f64 / all.len() as f64
    }

    #[test]
    fn two_classes_are_learned_and_shuffled_labels_are_not() {
        let (config, device) = (config(), Device::flex());
        let (training, unseen) = (toys(24, 1), toys(40, 2));
        let mut losses = vec![];
        let network = train(&training, 2, &config, &device, &mut |_, loss| losses.push(loss)).unwrap();
        assert!(losses.last().unwrap() < &(0.5 * losses[0]), "{losses:?}");
        let accuracy = right(&network, &unseen, &config);
        assert!(accuracy > 0.9, "{accuracy}");
        let mut shuffled = training;
        // Half of each class keeps its label: nothing is left to learn.
        shuffled.iter_mut().enumerate().for_each(|(index, sequence)| sequence.class = index / 2 % 2);
        let network = train(&shuffled, 2, &config, &device, &mut |_, _| {}).unwrap();
        let accuracy = right(&network, &unseen, &config);
        // Forty fair coins, one for each unseen sequence: within four standard errors of 0.079.
        assert!((accuracy - 0.5).abs() < 0.32, "{accuracy}");
    }

    #[test]
    fn equal_seeds_judge_equally_and_others_do_not() {
        let (sequences, device) = (toys(6, 3), Device::flex());
        let of = |seed| {
            let config = RecognitionConfig { seed, epochs: 2, ..config() };
            judge(&train(&sequences, 2, &config, &device, &mut |_, _| {}).unwrap(), &sequences, &config, &device)
        };
        assert_eq!(of(1), of(1));
        assert_ne!(of(1), of(2));
    }

    #[test]
    fn the_loss_of_an_even_guess_is_the_logarithm_of_the_classes() {
        let loss = cross_entropy(Tensor::zeros([3, 8], &Device::flex()), &[0, 5, 7], 8).into_scalar::<f32>();
        assert!((loss - 8f32.ln()).abs() < 1e-6, "{loss}");
    }
}
