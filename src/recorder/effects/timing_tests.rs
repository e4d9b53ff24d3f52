use super::test_support::*;
use super::*;
use crate::radar::Radar;
use crate::recorder::RecorderConfig;
use crate::recorder::stages::Clock;

fn same(a: &[num_complex::Complex64], b: &[num_complex::Complex64]) {
    let db = difference_db(a, b, energy(b));
    assert!(db < -90.0, "{db:.1} dB");
}

#[test]
fn a_dropped_frame_shifts_all_later_ones() {
    let plain = ball_world(EffectsConfig::default());
    let dropped = ball_world(EffectsConfig { frame_drop: Some(FrameDrop { at: 1, count: 1 }), ..Default::default() });
    same(&field(&dropped, 0), &field(&plain, 0));
    same(&field(&dropped, 1), &field(&plain, 2));
}

#[test]
fn a_clock_offset_of_a_frame_is_the_next_frame_and_drift_is_an_offset_that_grows() {
    let plain = ball_world(EffectsConfig::default());
    let period = plain.radar.frame_period_s;
    let late = ball_world(EffectsConfig { clock_offset: Some(ClockOffset { offset_s: period }), ..Default::default() });
    same(&field(&late, 1), &field(&plain, 2));
    let drifting = ball_world(EffectsConfig { clock_drift: Some(ClockDrift { relative: 0.1 }), ..Default::default() });
    let shifted = ball_world(EffectsConfig { clock_offset: Some(ClockOffset { offset_s: 0.2 * period }), ..Default::default() });
    // Within the frame the drift also speeds the body up by a tenth: a part of the phase of one frame.
    let (a, b) = (field(&drifting, 2), field(&shifted, 2));
    let first = |signal: &[num_complex::Complex64]| chirp(signal, &plain.radar, 0).to_vec();
    assert!(difference_db(&first(&a), &first(&b), energy(&first(&b))) < -35.0);
}

#[test]
fn a_late_transmitter_sees_the_body_later() {
    let two = |slot_s: f64, tdm: bool| {
        let mut world = ball_world(EffectsConfig { tdm_phase: tdm.then_some(TdmPhase { slot_s }), ..Default::default() });
        world.radar = Radar { tx_m: vec![[0.0; 3]; 2], ..world.radar };
        field(&world, 0)
    };
    let (plain, late) = (two(0.0, false), two(1e-4, true));
    let half = plain.len() / 2;
    same(&late[..half], &plain[..half]);
    // 1 m/s for 0.1 ms: the phase of twice a tenth of a millimetre.
    let wavelength = ball_world(EffectsConfig::default()).radar.wavelength_m();
    let turn: num_complex::Complex64 = late[half..].iter().zip(&plain[half..]).map(|(a, b)| a * b.conj()).sum();
    let wanted = std::f64::consts::TAU * 2.0 * 1e-4 / wavelength;
    assert!((turn.arg() - wanted).abs() < 0.01 * wanted, "{} against {wanted}", turn.arg());
}

#[test]
fn embedded_motions_are_long_enough_for_every_clock() {
    for effects in [
        EffectsConfig { frame_drop: Some(FrameDrop { at: 1, count: 3 }), ..Default::default() },
        EffectsConfig { clock_offset: Some(ClockOffset { offset_s: -0.3 }), ..Default::default() },
        EffectsConfig {
            clock_offset: Some(ClockOffset { offset_s: 0.3 }),
            clock_drift: Some(ClockDrift { relative: 0.05 }),
            ..Default::default()
        },
    ] {
        let config = RecorderConfig { frames: Some(2), effects, ..RecorderConfig::default() };
        let world = config.world(std::path::Path::new(".")).unwrap();
        let times = world.person.as_ref().unwrap().pose_times_s();
        let (first, last) = Clock::new(&world.effects).motion_span_s(&world.radar);
        assert!(times[0] <= first && *times.last().unwrap() >= last, "{:?}", world.effects);
    }
}
