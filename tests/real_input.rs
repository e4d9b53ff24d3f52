//! Recordings, bodies and motions made by others: `../shared`, or where HYBRIDSIM_SHARED points to.

use crate::support;

use std::{path::Path, process::Command};

use hybridsim::{
    config::Config,
    data::{Recording, read_body},
    import::{self, BvhConfig},
    training::{Event, load_recordings},
};

#[test]
fn training_on_a_planted_recording_lowers_its_loss() {
    let Some(shared) = support::shared("") else { return };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/recording.toml");
    // So few steps need long ones.
    let sets = [
        "training.epochs=6",
        "simulator.room.patches=400",
        "training.validation_fraction=0.7",
        "training.learning_rate=3e-3",
        "training.final_learning_rate=3e-4",
    ]
    .map(String::from);
    let mut config = Config::read(&path, &sets).unwrap();
    config.data.recordings = vec![shared.join("recordings/planted/p1")];
    let recordings = load_recordings(&config.data.recordings, &config.simulator).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (config_toml, devices) = (config.to_toml(), [burn::tensor::Device::flex()]);
    let trainer = config.trainer(&recordings, &config_toml, folder.path(), &devices).unwrap();
    let mut losses = Vec::new();
    trainer
        .run(None, &mut |event| {
            if let Event::Epoch(metrics) = event {
                losses.push(metrics.validation_loss.unwrap());
            }
        })
        .unwrap();
    println!("held-out losses {losses:?} nats a cell");
    // Far more than what another order of rounding changes: a quarter, on this recording.
    assert!(losses[5] < 0.9 * losses[0], "held-out losses {losses:?}");
}

#[test]
fn every_recording_opens_and_every_frame_can_be_read() {
    let Some(shared) = support::shared("") else { return };
    for kind in ["planted", "real"] {
        for entry in std::fs::read_dir(shared.join("recordings").join(kind)).unwrap() {
            let folder = entry.unwrap().path();
            let recording = Recording::open(&folder).unwrap();
            let first = recording.frame(0).unwrap();
            recording.frame(recording.frames() - 1).unwrap();
            assert!(first.re.iter().any(|&value| value != 0.0), "{} is silent", folder.display());
        }
    }
}

/// CMU walks as BVH and as npz, on three bodies, through the model that ships here.
#[test]
fn captured_motions_are_simulated_on_bodies_of_others() {
    let Some(shared) = support::shared("") else { return };
    let out = tempfile::tempdir().unwrap();
    let checkpoint = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/quickstart");
    for (index, (motion, body)) in
        [("cmu/02_01.bvh", "male_lite"), ("cmu/02_01_smpl24.npz", "female_lite"), ("procedural/arm_swing_s1.bvh", "neutral_lite")]
            .into_iter()
            .enumerate()
    {
        let folder = out.path().join(index.to_string());
        let output = Command::new(env!("CARGO_BIN_EXE_hybridsim"))
            .args(["infer", "--frames", "3", "-q", "--device", "flex", "--checkpoint"])
            .arg(&checkpoint)
            .arg("--motion")
            .arg(shared.join("motions").join(motion))
            .arg("--body")
            .arg(shared.join("bodies").join(format!("{body}.npz")))
            .arg("--out")
            .arg(&folder)
            .output()
            .unwrap();
        assert!(output.status.success(), "{motion}: {}", String::from_utf8_lossy(&output.stderr));
        let simulated = Recording::open(folder.join("recording")).unwrap();
        assert_eq!(simulated.frames(), 3);
        let frame = simulated.frame(2).unwrap();
        assert!(frame.re.iter().all(|value| value.is_finite()) && frame.re.iter().any(|&value| value != 0.0), "{motion}");
        assert!(folder.join("range_doppler.png").is_file() && folder.join("time_doppler.png").is_file());
    }
}

#[test]
fn every_captured_motion_is_read_for_every_body() {
    let Some(shared) = support::shared("") else { return };
    for body in ["neutral_lite", "male_lite", "female_lite"] {
        let model = read_body(shared.join("bodies").join(format!("{body}.npz"))).unwrap();
        for file in ["cmu/02_01.bvh", "cmu/02_02.bvh", "cmu/02_02_smpl24.npz", "procedural/walk_back_forth_armswing_s1.bvh"] {
            let (motion, _) = import::read_motion(&shared.join("motions").join(file), &model, &BvhConfig::default()).unwrap();
            assert!(motion.poses.len() > 10, "{file}");
            assert!(motion.poses.iter().flatten().flatten().all(|angle| angle.is_finite()), "{file}");
        }
    }
}
