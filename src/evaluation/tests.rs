//! Two recording folders whose agreement is known.

use std::{collections::BTreeMap, path::Path};

use num_complex::Complex32;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

use super::*;
use crate::{
    data::{IfFrame, IfLayout, Recording, RecordingContents, write_recording},
    error::Result,
    heatmap::{HeatmapConfig, synthetic},
    metrics::MetricsConfig,
    person::Person,
    radar::Radar,
};

/// One antenna pair, so that a cell's power is that of one complex number.
fn radar(frames: usize) -> Radar {
    Radar { frames, tx_m: vec![[0.0; 3]], rx_m: vec![[0.0; 3]], ..synthetic::radar() }
}

/// A walker of this amplitude over noise of unit power.
fn samples(radar: &Radar, amplitude: f32, noise_seed: u64) -> Vec<Complex32> {
    let mut random = ChaCha8Rng::seed_from_u64(noise_seed);
    let normal = Normal::new(0.0, 0.5f32.sqrt()).unwrap();
    let walker = synthetic::point(radar, |time| [0.0, 3.0 + time, 0.0]);
    let noise = |random: &mut ChaCha8Rng| Complex32::new(normal.sample(random), normal.sample(random));
    walker.into_iter().map(|value| amplitude * value + noise(&mut random)).collect()
}

fn write(folder: &Path, radar: &Radar, samples: &[Complex32], labels: &[(&str, &str)], person: Option<&Person>) -> Recording {
    let [_, tx, rx, loops, length] = radar.dims();
    let contents = RecordingContents {
        radar,
        room: None,
        person,
        body_file: None,
        labels: labels.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect::<BTreeMap<_, _>>(),
        layout: IfLayout::Complex,
        truth: None,
    };
    write_recording(folder, &contents, &mut |frame| {
        let values = &samples[frame * tx * rx * loops * length..][..tx * rx * loops * length];
        let im = values.iter().map(|value| value.im).collect();
        Ok(IfFrame::new([tx, rx, loops, length], values.iter().map(|value| value.re).collect(), Some(im)))
    })
    .unwrap()
}

fn compared(measured: &Recording, simulated: &Recording) -> Result<Evaluation> {
    compare(measured, simulated, &HeatmapConfig::default(), &MetricsConfig::default(), None)
}

#[test]
fn two_noises_differ_by_what_their_statistics_say() {
    let folder = tempfile::tempdir().unwrap();
    let radar = radar(6);
    let take = |name: &str, seed| write(&folder.path().join(name), &radar, &samples(&radar, 0.0, seed), &[], None);
    let found = compared(&take("measured", 1), &take("again", 2)).unwrap().global.unwrap();
    // The power of a cell is exponential, so the logarithm of two cells' ratio is logistic: its variance is π²/3, its mean
    // size 2 ln 2, and 10/ln 10 makes decibels of it.
    let scale = 10.0 / std::f64::consts::LN_10;
    let squared = std::f64::consts::PI.powi(2) / 3.0 * scale * scale;
    let psnr = -10.0 * (squared / (80.0 * 80.0)).log10();
    let error = 2.0 * std::f64::consts::LN_2 * scale;
    assert!((found.psnr_db.mean - psnr).abs() < 0.25, "PSNR {}, wanted {psnr}", found.psnr_db.mean);
    assert!((found.mean_absolute_error_db.mean - error).abs() < 0.15, "{}, wanted {error}", found.mean_absolute_error_db.mean);
    assert_eq!((found.psnr_db.count, found.psnr_db.interval), (6, None));
}

#[test]
fn a_second_take_agrees_where_the_person_is_and_not_in_the_noise() {
    let folder = tempfile::tempdir().unwrap();
    let radar = radar(2);
    let vertices = vec![vec![[0.0, 3.0, 0.0], [0.1, 3.0, 0.0], [0.0, 3.0, 0.1]]; 2];
    let person = Person::Meshes { vertices, faces: vec![[0, 1, 2]], pose_times_s: vec![0.0, 1.0] };
    let take = |name: &str, seed, person| write(&folder.path().join(name), &radar, &samples(&radar, 30.0, seed), &[], person);
    let (measured, again) = (take("measured", 1, Some(&person)), take("again", 2, None));
    let found = compared(&measured, &again).unwrap();
    let (all, person) = (found.global.unwrap(), found.person.unwrap());
    assert!(person.mean_absolute_error_db.mean < 0.5, "{}", person.mean_absolute_error_db.mean);
    assert!(all.mean_absolute_error_db.mean > 4.0, "{}", all.mean_absolute_error_db.mean);
    assert!(person.psnr_db.mean < 100.0);
    // nobody was tracked in the other one
    assert!(compared(&again, &measured).unwrap().person.is_none());
    let same = compared(&measured, &measured).unwrap();
    for scores in [same.global.unwrap(), same.moving.unwrap(), same.person.unwrap()] {
        assert_eq!((scores.psnr_db.mean, scores.mean_absolute_error_db.mean), (100.0, 0.0));
        assert!((scores.ssim.mean - 1.0).abs() < 1e-12 && scores.lpips.is_none());
    }
}

#[test]
fn recordings_that_cannot_show_the_same_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, radar: &Radar, labels: &[(&str, &str)]| {
        write(&folder.path().join(name), radar, &samples(radar, 1.0, 3), labels, None)
    };
    let radar = radar(2);
    let measured = write("measured", &radar, &[("action", "lunge"), ("subject", "s1")]);
    let refused = |other: &Recording| compared(&measured, other).unwrap_err().to_string();
    let steep = write("steep", &Radar { slope_hz_per_s: 50e12, ..radar.clone() }, &[]);
    let text = refused(&steep);
    assert!(text.contains("steep") && text.contains("`radar.slope_hz_per_s` is 50000000000000.0"), "{text}");
    let text = refused(&write("short", &Radar { frames: 1, ..radar.clone() }, &[]));
    assert!(text.contains("`radar.frames` is 1, expected 2 as in"), "{text}");
    let text = refused(&write("other", &radar, &[("action", "jump")]));
    assert!(text.contains("`labels.action` is jump, expected lunge"), "{text}");
    // a rail and a label more or less are no contradiction
    let same =
        write("same", &Radar { full_scale_codes: Some(100.0), ..radar.clone() }, &[("action", "lunge"), ("method", "ours")]);
    assert_eq!(compared(&measured, &same).unwrap().frames, 2);
}

#[test]
fn intervals_are_over_sequences_and_one_has_none() {
    let folder = tempfile::tempdir().unwrap();
    let radar = radar(2);
    let take = |name: &str, seed| write(&folder.path().join(name), &radar, &samples(&radar, 1.0, seed), &[], None);
    let measured = take("measured", 1);
    let found: Vec<Evaluation> = (2..5).map(|seed| compared(&measured, &take(&format!("take-{seed}"), seed)).unwrap()).collect();
    let together = over_sequences(&found).unwrap();
    assert_eq!((together.sequences, together.frames, together.person.is_none()), (3, 6, true));
    let means: Vec<f64> = found.iter().map(|one| one.global.as_ref().unwrap().psnr_db.mean).collect();
    let psnr = together.global.unwrap().psnr_db;
    assert!((psnr.mean - means.iter().sum::<f64>() / 3.0).abs() < 1e-12);
    // t(0.975) with two degrees of freedom
    let wanted = 4.302_652_7 * psnr.deviation / 3f64.sqrt();
    assert!(wanted > 0.0 && (psnr.interval.unwrap() / wanted - 1.0).abs() < 1e-6, "{:?}, wanted {wanted}", psnr.interval);
    assert_eq!(over_sequences(&found[..1]).unwrap().global.unwrap().psnr_db.interval, None);
    assert!(over_sequences(&[]).is_none());
}
