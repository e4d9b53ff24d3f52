//! A planted recording whose samples were changed by hand.

use hybridsim::data::Recording;
use hybridsim::diagnosis::report::{Report, Verdict};
use num_complex::Complex32;

use super::{Change, close, ids, report, rewritten, value};
use crate::support;

/// What is said of the clean planted recording once its samples were changed by hand; of a frame of 4 receivers, 64 loops and 128
/// samples.
fn changed(change: Change) -> Option<Report> {
    let folder = tempfile::tempdir().unwrap();
    let to = folder.path().join("changed");
    rewritten(&support::shared("recordings/planted/p1")?, &to, change);
    Some(report(&to))
}

/// The antennas come first: undone out of turn, they would turn the image of every receiver by another angle.
#[test]
fn receivers_that_differ_and_the_image_after_them_are_both_found() {
    let differ = [(1.0, 0.0), (1.2, 0.4), (0.9, -0.3), (1.05, 0.2)].map(|(gain, phase)| Complex32::from_polar(gain, phase));
    let Some(report) = changed(&|_, re, im| {
        for (at, (re, im)) in re.iter_mut().zip(im).enumerate() {
            let value = Complex32::new(*re, *im) * differ[at / (64 * 128)];
            let value = value + Complex32::from_polar(0.02, 0.4) * value.conj();
            (*re, *im) = (value.re, value.im);
        }
    }) else {
        return;
    };
    let mut found = ids(&report);
    found.sort_unstable();
    assert_eq!(found, ["channel_mismatch", "iq_imbalance"], "{:?}", report.unexplained);
    close(value(&report, "iq_imbalance", "gain_db").abs(), 0.32, 0.03);
}

#[test]
fn a_receiver_that_compresses_is_no_mover() {
    let Some(report) = changed(&|_, re, im| {
        for (re, im) in re.iter_mut().zip(im) {
            let value = Complex32::new(*re, *im);
            // By 5 % at the strongest sample.
            let value = value * (1.0 - 0.05 * value.norm_sqr() / 9000f32.powi(2));
            (*re, *im) = (value.re, value.im);
        }
    }) else {
        return;
    };
    assert_eq!(ids(&report), ["compression"], "{:?}", report.unexplained);
    close(value(&report, "compression", "level"), 0.05, 0.015);
}

#[test]
fn a_recorder_that_slips_and_repeats_itself_has_damaged_the_recording() {
    let Some(plain) = support::shared("recordings/planted/p1") else { return };
    let before = Recording::open(&plain).unwrap().frame(19).unwrap();
    let report = changed(&|frame, re, im| {
        if frame == 20 {
            re.copy_from_slice(&before.re);
            im.copy_from_slice(before.im.as_ref().unwrap());
        }
        if frame >= 12 {
            re.chunks_exact_mut(128).chain(im.chunks_exact_mut(128)).for_each(|chirp| chirp.rotate_right(3));
        }
    })
    .unwrap();
    assert_eq!(report.verdict, Verdict::Damaged);
    assert!(report.effects.is_empty() && report.unexplained.is_empty(), "{:?}", ids(&report));
    let frames = |name: &str| report.audit.iter().find(|check| check.check == name && !check.ok).unwrap().frames.clone().unwrap();
    assert_eq!(frames("integrity_stream"), [12]);
    assert_eq!(frames("integrity_copies"), [20]);
}
