use std::fs;
use std::slice::from_ref;

use super::*;
use crate::data::{IfFrame, IfLayout, RecordingContents, write_recording};
use crate::heatmap::synthetic;

/// A point that walks away (`walk`) or swings to and fro (`swing`), recorded for 8 frames.
fn recorded(folder: &Path, name: &str, action: Option<&str>, radar: &Radar, seed: u64) -> PathBuf {
    let start = 2.5 + 0.13 * seed as f64;
    let place = |time: f64| match action {
        Some("swing") => start + 0.25 * (std::f64::consts::TAU * 1.3 * time + seed as f64).sin(),
        _ => start + 1.2 * time,
    };
    let signal = synthetic::point(radar, |time| [0.3, place(time), 0.0]);
    let [_, tx, rx, loops, samples] = radar.dims();
    let mut labels = BTreeMap::from([("subject".to_string(), format!("s{seed}"))]);
    labels.extend(action.map(|action| ("action".to_string(), action.to_string())));
    let contents =
        RecordingContents { radar, room: None, person: None, body_file: None, labels, layout: IfLayout::Complex, truth: None };
    let out = folder.join(name);
    write_recording(&out, &contents, &mut |frame| {
        let length = tx * rx * loops * samples;
        let values = &signal[frame * length..(frame + 1) * length];
        let (re, im) = values.iter().map(|value| (value.re, value.im)).unzip();
        Ok(IfFrame::new([tx, rx, loops, samples], re, Some(im)))
    })
    .unwrap();
    out
}

fn radar() -> Radar {
    Radar { frames: 8, ..Radar::small(8) }
}

fn config() -> RecognitionConfig {
    RecognitionConfig {
        window_frames: 6,
        stride_frames: 2,
        epochs: 30,
        batch: 4,
        azimuth_step_deg: 20.0,
        resamplings: 200,
        ..RecognitionConfig::default()
    }
}

fn attempt(train: &[PathBuf], test: &[PathBuf]) -> Result<Recognition> {
    run(&config(), train, test, &Device::flex(), &mut |_| {})
}

#[test]
fn two_motions_are_told_apart_in_recordings_of_others_and_the_result_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let (training, test) = (folder.path().join("train"), folder.path().join("test"));
    for seed in 0..4 {
        for action in ["walk", "swing"] {
            recorded(&training, &format!("{action}{seed}"), Some(action), &radar(), seed);
        }
    }
    for action in ["walk", "swing"] {
        recorded(&test, action, Some(action), &radar(), 9);
    }
    let result = attempt(from_ref(&training), from_ref(&test)).unwrap();
    assert_eq!(result.actions, ["swing", "walk"]);
    assert_eq!((result.training.windows, result.test.windows, result.test.sequences), (16, 4, 2));
    assert!(result.accuracy.value > 0.7, "{result:?}");
    assert!(result.notes.is_empty(), "{:?}", result.notes);
    let again = attempt(from_ref(&training), &[test]).unwrap();
    assert_eq!((&again.confusion, again.training_loss), (&result.confusion, result.training_loss));
    let out = folder.path().join("result");
    super::super::write(&result, &config(), crate::data::atomic::AtomicFolder::create(&out).unwrap()).unwrap();
    for name in ["config.toml", "recognition.json", "recognition.md", "confusion.png"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    // The same people in both.
    let known: Vec<PathBuf> = ["walk", "swing"].map(|action| training.join(format!("{action}3"))).into();
    let rest: Vec<PathBuf> = ["walk0", "swing0", "walk1", "swing3"].map(|name| training.join(name)).into();
    assert!(attempt(&rest, &known).unwrap_err().to_string().contains("trained on and tested"));
}

#[test]
fn what_does_not_fit_together_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str, action: Option<&str>, radar: &Radar| recorded(folder.path(), name, action, radar, 1);
    let (walk, swing) = (at("walk", Some("walk"), &radar()), at("swing", Some("swing"), &radar()));
    let both = [walk.clone(), swing.clone()];
    let unlabelled = at("unlabelled", None, &radar());
    let unknown = at("unknown", Some("climb"), &radar());
    let other = at("other", Some("walk"), &Radar { slope_hz_per_s: 50.0e12, ..radar() });
    let short = at("short", Some("walk"), &Radar { frames: 4, ..radar() });
    let empty = folder.path().join("empty");
    fs::create_dir(&empty).unwrap();
    for (test, told) in [
        (unlabelled, "labels.action` is missing"),
        (unknown, "`labels.action` is climb, expected an action that was trained: swing, walk"),
        (other, "`radar` is another one"),
        (short, "`radar.frames` is 4, expected at least the 6 of a window"),
        (empty, "neither a recording nor a folder of recordings"),
        (folder.path().join("absent"), "cannot be read"),
    ] {
        let message = attempt(&both, &[test]).unwrap_err().to_string();
        assert!(message.contains(told), "{told}: {message}");
    }
    let message = attempt(&[walk], &[swing]).unwrap_err().to_string();
    assert!(message.contains("at least two actions"), "{message}");
}
