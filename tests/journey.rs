//! The whole journey on a recording made here: record, train, resume, infer.

use std::path::{Path, PathBuf};

use burn::tensor::Device;
use hybridsim::{
    config::Config,
    data::{IfFrame, IfLayout, Recording, RecordingContents, write_recording},
    effects::EffectSetting,
    error::{Error, Result},
    recorder,
    training::{Event, LoadedRecording, checkpoint, load_recordings},
};

/// `configs/test.toml`, with its recording made once for all tests of this file.
fn config() -> Config {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/test.toml");
    let mut config = Config::read(&path, &[]).unwrap();
    config.data.recordings = vec![recording()];
    config
}

fn recording() -> PathBuf {
    static ONCE: std::sync::OnceLock<(tempfile::TempDir, PathBuf)> = std::sync::OnceLock::new();
    let (_, folder) = ONCE.get_or_init(|| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/test.toml");
        let config = Config::read(&path, &[]).unwrap();
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("recording");
        recorder::record_to(config.record(&path).unwrap(), parent.path(), &folder, &mut |_, _| {}).unwrap();
        (parent, folder)
    });
    folder.clone()
}

struct Run {
    folder: tempfile::TempDir,
    losses: Vec<f64>,
    result: Result<()>,
}

fn train(config: &Config, recordings: &[LoadedRecording], resume: Option<&Path>, stop_after: Option<usize>) -> Run {
    train_on(&[Device::flex()], config, recordings, resume, stop_after)
}

fn train_on(
    devices: &[Device],
    config: &Config,
    recordings: &[LoadedRecording],
    resume: Option<&Path>,
    stop_after: Option<usize>,
) -> Run {
    let folder = tempfile::tempdir().unwrap();
    let config_toml = config.to_toml();
    let trainer = config.trainer(recordings, &config_toml, folder.path(), devices).unwrap();
    let mut losses = Vec::new();
    let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        trainer.run(resume, &mut |event| {
            if let Event::Epoch(metrics) = &event {
                losses.push(metrics.training_loss);
            }
            if let Event::Saved(path) = &event
                && path.ends_with("last")
                && stop_after.is_some_and(|epochs| losses.len() >= epochs)
            {
                // What a killed process leaves: everything up to here, and nothing after.
                std::panic::resume_unwind(Box::new("killed"));
            }
        })
    }));
    let result = match outcome {
        Ok(outcome) => outcome.map(drop),
        Err(_) => Ok(()),
    };
    Run { folder, losses, result }
}

/// The numbers of the last weights; the header before them names the library's metadata in any order.
fn weights(run: &Run) -> Vec<u8> {
    let bytes = std::fs::read(run.folder.path().join("last").join(checkpoint::WEIGHTS)).unwrap();
    let header = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    bytes[8 + header..].to_vec()
}

#[test]
fn training_lowers_the_loss_on_held_out_frames() {
    let config = config();
    let recordings = load_recordings(&config.data.recordings, &config.simulator).unwrap();
    let run = train(&config, &recordings, None, None);
    run.result.as_ref().unwrap();
    let history = checkpoint::read_state(&run.folder.path().join("best")).unwrap().progress.history;
    let held_out = |index: usize| history[index].validation_loss.unwrap();
    let best = (0..history.len()).map(held_out).fold(f64::INFINITY, f64::min);
    // Decibels of exponentially distributed powers have the variance (10/ln 10)² π²/6; two independent noises differ by
    // twice that, and no simulator can come nearer in cells that hold nothing but noise.
    let floor = 2.0 * (10.0 / std::f64::consts::LN_10).powi(2) * std::f64::consts::PI.powi(2) / 6.0;
    let excess = |loss: f64| loss - floor;
    let (first, best) = (excess(held_out(0)), excess(best));
    assert!(best < 0.5 * first, "held-out loss above that of noise only fell from {first:.1} to {best:.1} dB²");
}

#[test]
fn equal_seeds_give_equal_weights_and_others_do_not() {
    let mut config = config();
    config.training.epochs = 2;
    let recordings = load_recordings(&config.data.recordings, &config.simulator).unwrap();
    let (first, second) = (train(&config, &recordings, None, None), train(&config, &recordings, None, None));
    assert_eq!(first.losses, second.losses);
    assert_eq!(weights(&first), weights(&second));
    config.seed += 1;
    assert_ne!(first.losses, train(&config, &recordings, None, None).losses);
}

#[test]
fn devices_that_share_the_frames_learn_what_one_learns() {
    let mut config = config();
    config.training.epochs = 2;
    config.training.frames_per_step = 4;
    let recordings = load_recordings(&config.data.recordings, &config.simulator).unwrap();
    let alone = train(&config, &recordings, None, None);
    let devices = [Device::flex(), Device::flex(), Device::flex()];
    let shared = train_on(&devices, &config, &recordings, None, None);
    shared.result.as_ref().unwrap();
    for (alone, shared) in alone.losses.iter().zip(&shared.losses) {
        assert!((alone - shared).abs() < 1e-5 * alone, "{alone} dB² alone, {shared} dB² shared");
    }
}

#[test]
fn a_killed_run_resumes_as_if_it_had_never_stopped() {
    let mut config = config();
    config.training.epochs = 3;
    let recordings = load_recordings(&config.data.recordings, &config.simulator).unwrap();
    let whole = train(&config, &recordings, None, None);
    let killed = train(&config, &recordings, None, Some(1));
    assert_eq!(killed.losses.len(), 1);
    let resumed = train(&config, &recordings, Some(&killed.folder.path().join("last")), None);
    resumed.result.as_ref().unwrap();
    assert_eq!(whole.losses[1..], resumed.losses[..]);
    assert_eq!(weights(&whole), weights(&resumed));
}

#[test]
fn a_checkpoint_of_another_configuration_is_refused() {
    let mut config = config();
    config.training.epochs = 1;
    let recordings = load_recordings(&config.data.recordings, &config.simulator).unwrap();
    let run = train(&config, &recordings, None, None);
    let last = run.folder.path().join("last");
    config.simulator.triplane.features += 1;
    let other = train(&config, &recordings, Some(&last), None);
    let error = other.result.unwrap_err();
    assert_eq!(error.to_string(), format!("{}: a checkpoint of another configuration", last.display()));

    // The same with the state forged to fit: the weights themselves give it away.
    let state = checkpoint::read_state(&last).unwrap();
    let mut simulator = state.simulator.clone();
    simulator.triplane.features += 1;
    let simulator = simulator.init(state.site.body_extent, state.seed, &burn::tensor::Device::flex());
    let error = checkpoint::load_weights(&last, simulator).unwrap_err();
    assert!(error.to_string().contains(checkpoint::WEIGHTS), "{error}");
    assert!(error.hint().unwrap().contains("belongs to another configuration"));
}

#[test]
fn a_loss_that_is_not_finite_stops_with_the_stage_that_broke() {
    let mut config = config();
    config.training.epochs = 2;
    config.training.learning_rate = 1e30;
    config.training.final_learning_rate = 1e30;
    config.training.gradient_clip = 1e30;
    let recordings = load_recordings(&config.data.recordings, &config.simulator).unwrap();
    let error = train(&config, &recordings, None, None).result.unwrap_err();
    assert!(matches!(&error, Error::NonFinite { stage, .. } if !stage.is_empty()), "{error}");
    assert!(error.hint().unwrap().contains("learning_rate"));
}

#[test]
fn truncated_weights_are_refused_by_name() {
    let mut config = config();
    config.training.epochs = 1;
    let recordings = load_recordings(&config.data.recordings, &config.simulator).unwrap();
    let run = train(&config, &recordings, None, None);
    let last = run.folder.path().join("last");
    let path = last.join(checkpoint::WEIGHTS);
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let error = checkpoint::open(&last, &burn::tensor::Device::flex()).unwrap_err();
    assert!(error.to_string().starts_with(&format!("{}: ", path.display())), "{error}");
}

/// A copy of the recording with leakage: a strong echo at rest in the first range bins, in codes.
fn leaking(parent: &Path, level: f64) -> PathBuf {
    let original = Recording::open(recording()).unwrap();
    let radar = &original.radar;
    let contents = RecordingContents {
        radar,
        room: original.room.as_ref(),
        person: original.person(),
        body_file: None,
        labels: Default::default(),
        layout: IfLayout::Complex,
        truth: None,
    };
    let folder = parent.join("leaking");
    write_recording(&folder, &contents, &mut |frame| {
        let samples = original.frame(frame)?;
        let at = |index: usize| std::f64::consts::TAU * LEAK_CYCLES * (index % radar.samples_per_chirp) as f64;
        let add = |part: &[f32], of: fn(f64) -> f64| {
            part.iter().enumerate().map(|(index, value)| value + (level * of(at(index))) as f32).collect::<Vec<f32>>()
        };
        let im = add(samples.im.as_ref().unwrap(), f64::sin);
        Ok(IfFrame::new(samples.dims, add(&samples.re, f64::cos), Some(im)))
    })
    .unwrap();
    folder
}

/// Cycles per sample of an echo at `LEAK_M`.
const LEAK_M: f64 = 0.08;
const LEAK_CYCLES: f64 = 60.012e12 * 2.0 * LEAK_M / 299_792_458.0 / 2.2e6;

#[test]
fn levels_are_found_beside_a_known_leakage_and_learned_effects_survive_the_checkpoint() {
    let mut config = config();
    config.training.epochs = 1;
    let gains = |config: &Config| -> (Vec<f32>, Vec<EffectSetting>) {
        let recordings = load_recordings(&config.data.recordings, &config.simulator).unwrap();
        let run = train(config, &recordings, None, None);
        run.result.as_ref().unwrap();
        let (simulator, state) = checkpoint::open(&run.folder.path().join("last"), &burn::tensor::Device::flex()).unwrap();
        assert_eq!(state.simulator, config.simulator);
        let gains =
            [&simulator.decoders.body_gain, &simulator.decoders.room_gain].map(|gain| gain.log_gain.val().into_scalar::<f32>());
        (gains.to_vec(), simulator.effects.settings())
    };
    // Without steps worth the name, gains are what the calibration found.
    config.training.learning_rate = 1e-9;
    config.training.final_learning_rate = 1e-9;
    let (wanted, _) = gains(&config);
    let parent = tempfile::tempdir().unwrap();
    let level = 12000.0;
    config.data.recordings = vec![leaking(parent.path(), level)];
    let (misled, _) = gains(&config);
    let leak = EffectSetting::neutral("tx_leakage").with("range_m", [LEAK_M]).with("re", [1.0]).with("reference", [level]);
    config.simulator.effects = vec![leak];
    let (found, _) = gains(&config);
    let off = |gains: &[f32]| gains.iter().zip(&wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(off(&misled) > 0.5, "the leakage should have misled: {misled:?}, {wanted:?}");
    assert!(off(&found) < 0.02, "{found:?}, wanted {wanted:?}");

    // What was learned is what the checkpoint holds, and nothing is learned where that is switched off. How far a few steps
    // come is not the question here: the room's gain makes up for some of what is missing.
    config.simulator.effects[0].parameters.insert("re".into(), vec![0.8]);
    config.training.learning_rate = 2e-2;
    config.training.final_learning_rate = 2e-2;
    config.training.epochs = 3;
    let learned = gains(&config).1[0].parameters.clone();
    // Range and amplitude make up for each other, and a dozen steps go to and fro: either may be back where it started.
    let moved = [learned["range_m"][0] / LEAK_M - 1.0, learned["re"][0] / 0.8 - 1.0];
    assert!(moved.into_iter().any(|share| share.abs() > 1e-3), "{learned:?}");
    config.training.learn_effects = false;
    let kept = gains(&config).1[0].parameters.clone();
    let moved = [kept["range_m"][0] / LEAK_M - 1.0, kept["re"][0] / 0.8 - 1.0];
    assert!(moved.into_iter().all(|share| share.abs() < 1e-6), "{kept:?}");
}
