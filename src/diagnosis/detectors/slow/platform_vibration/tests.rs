//! A platform that vibrates, in made recordings.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::find;
use crate::diagnosis::cube::Loaded;
use crate::diagnosis::evidence::Evidence;
use crate::effects;
use crate::radar::Radar;
use crate::support;

/// Returns from all directions before the radar, some at every range, and what each of them does at some time: given
/// are the time, the cosine to the boresight and the bin.
fn evidence(seed: u64, change: impl Fn(f64, f64, f64) -> Complex64) -> Evidence {
    let mut radar = Radar::small(12);
    (radar.loops_per_frame, radar.samples_per_chirp, radar.frame_period_s) = (32, 64, 0.1);
    radar.rx_m = (0..4).map(|i| [0.0019 * f64::from(i), 0.0, 0.0]).collect();
    let mut normal = support::normal(seed);
    let returns: Vec<(f64, f64, Complex64)> = (0..300)
        .map(|i| (5.0 + f64::from(i) * 0.15, (0.6 * normal()).clamp(-1.4, 1.4).sin(), 2.0 * Complex64::new(normal(), normal())))
        .collect();
    let mut samples = vec![];
    for frame in 0..12 {
        for rx in 0..4 {
            for index in 0..32 {
                let time_s = radar.chirp_time_s(frame, 0, index);
                let weights: Vec<Complex64> = returns
                    .iter()
                    .map(|&(bin, sine, amplitude)| {
                        let array = Complex64::cis(std::f64::consts::PI * f64::from(rx) * sine);
                        amplitude * array * change(time_s, (1.0 - sine * sine).sqrt(), bin)
                    })
                    .collect();
                for n in 0..64 {
                    let value: Complex64 = (returns.iter().zip(&weights))
                        .map(|((bin, ..), weight)| weight * Complex64::cis(TAU * bin * f64::from(n) / 64.0))
                        .sum();
                    samples.push(value + Complex64::new(normal(), normal()));
                }
            }
        }
    }
    Evidence::new(Loaded::of_samples(radar, samples, [-1e3, 1e3]), None, None)
}

#[test]
fn a_radar_that_vibrates_before_returns_from_all_directions_is_known_and_undone() {
    let mut evidence = evidence(1, |t, ahead, _| Complex64::cis(0.3 * ahead * (TAU * 31.7 * t + 0.4).cos()));
    let found = find(&evidence).expect("nothing found");
    assert_eq!(found.id, Some(effects::radar_vibration::ID));
    assert!(found.p_value < 1e-9 && found.nats > 100.0, "{found:?}");
    let of = |name: &str| found.estimates.iter().find(|e| e.name == name).unwrap().values[0];
    assert!((of("frequency_hz") - 31.7).abs() < 0.1, "{}", of("frequency_hz"));
    // Without a room all returns count as if they lay ahead.
    let ahead = 0.3 * evidence.radar.wavelength_m() / (2.0 * TAU);
    assert!((0.7..1.1).contains(&(of("amplitude_m") / ahead)), "{} of {ahead}", of("amplitude_m"));
    let undo = found.correction.undo().unwrap();
    undo(&mut evidence.cube);
    let left = find(&evidence.changed());
    assert!(left.as_ref().is_none_or(|left| left.nats < 0.01 * found.nats), "{left:?}");
}

#[test]
fn what_one_range_does_or_what_turns_one_way_or_what_all_amplitudes_do_is_no_vibration() {
    let silent = |evidence: &Evidence| find(evidence).filter(|found| found.p_value < 1e-3 && found.nats > 3.0).is_none();
    assert!(silent(&evidence(2, |_, _, _| Complex64::ONE)));
    // A lamp or a fan at some ranges.
    let one = |t: f64, _: f64, bin: f64| 1.0 + if bin > 40.0 { 0.3 * (TAU * 31.7 * t).cos() } else { 0.0 };
    assert!(silent(&evidence(3, |t, ahead, bin| one(t, ahead, bin).into())));
    assert!(silent(&evidence(4, |t, ahead, _| 1.0 + 0.3 * ahead * Complex64::cis(TAU * 31.7 * t))));
    assert!(silent(&evidence(5, |t, _, _| (1.0 + 0.1 * (TAU * 31.7 * t).cos()).into())));
}
