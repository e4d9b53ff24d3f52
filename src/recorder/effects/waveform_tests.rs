use super::test_support::*;
use super::*;
use crate::radar::SPEED_OF_LIGHT;
use crate::recorder::record::Recorder;
use crate::recorder::surface::Returns;

/// a ∝ b to this relative error?
fn proportional(a: &[num_complex::Complex64], b: &[num_complex::Complex64]) -> f64 {
    let scale: num_complex::Complex64 = b.iter().zip(a).map(|(y, x)| y.conj() * x).sum::<num_complex::Complex64>() / energy(b);
    let scaled: Vec<_> = b.iter().map(|value| value * scale).collect();
    (change(a, &scaled) / energy(a)).sqrt()
}

#[test]
fn errors_of_the_ramp_change_the_phase_as_the_definition_says() {
    let base = point_world(EffectsConfig::default());
    let plain = field(&base, 0);
    let amplitude = chirp(&plain, &base.radar, 1)[0].norm();
    type Change = fn(&mut crate::radar::Radar);
    let cases: [(EffectsConfig, Change); 4] = [
        (EffectsConfig { start_frequency_error: Some(StartFrequencyError { relative: 2e-5 }), ..Default::default() }, |r| {
            r.start_frequency_hz *= 1.0 + 2e-5
        }),
        (EffectsConfig { adc_start_error: Some(AdcStartError { offset_s: 1e-7 }), ..Default::default() }, |r| {
            r.adc_start_s += 1e-7
        }),
        (EffectsConfig { slope_error: Some(SlopeError { relative: 4e-3 }), ..Default::default() }, |r| {
            r.slope_hz_per_s *= 1.0 + 4e-3
        }),
        (EffectsConfig { if_delay: Some(IfDelay { delay_s: 5e-8 }), ..Default::default() }, |r| r.adc_start_s -= 5e-8),
    ];
    for (effects, change_radar) in cases {
        let found = field(&point_world(effects.clone()), 0);
        let mut radar = base.radar.clone();
        change_radar(&mut radar);
        let wanted: Vec<_> = path(&radar, delay(&radar, POINT_M, 1)).iter().map(|v| v * amplitude).collect();
        let found = chirp(&found, &radar, 1);
        let error = (change(found, &wanted) / energy(&wanted)).sqrt();
        assert!(error < 1e-5, "{effects:?}: {error:e}");
        assert!(change(found, chirp(&plain, &radar, 1)) > 1e-6 * energy(found));
    }
}

#[test]
fn oscillator_errors_agree_with_the_definition_sixty_decibels_below_the_effect() {
    let cases = [
        EffectsConfig { chirp_nonlinearity: Some(ChirpNonlinearity { peak_hz: 2e6 }), ..Default::default() },
        EffectsConfig { chirp_ripple: Some(ChirpRipple { deviation_hz: 5e5, ripple_hz: 2e5 }), ..Default::default() },
        EffectsConfig { phase_noise: Some(PhaseNoise { per_chirp_rad: 0.1, per_frame_rad: 0.1 }), ..Default::default() },
        EffectsConfig { chirp_start_jitter: Some(ChirpStartJitter { jitter_s: 1.1e-8 }), ..Default::default() },
        EffectsConfig { outside: vec![Outside::ThermalCurvature { peak_hz: 2e6 }], ..Default::default() },
    ];
    for effects in cases {
        // Points: the phase within a facet has its own delay, which the reference does not know.
        let points = |effects: &EffectsConfig| {
            let mut world = ball_world(effects.clone());
            world.surface.returns = Returns::Vertices;
            Recorder::new(&world).unwrap()
        };
        let (recorder, plain) = (points(&effects), points(&EffectsConfig::default()));
        let errors = recorder.stages().chirp_errors(recorder.world(), 2).unwrap();
        let extra = |chirp: usize, time_s: f64, delay_s: f64| recorder.stages().extra_turns(&errors[chirp], time_s, delay_s);
        let wanted = plain.scatter().unwrap().reference_frame(2, &extra).unwrap();
        let without = plain.scatter().unwrap().reference_frame(2, &|_, _, _| 0.0).unwrap();
        let effect = change(&wanted, &without);
        // Only the effect is judged: what the fast path itself leaves open is in both.
        let found: Vec<_> =
            recorder.field(2).unwrap().iter().zip(plain.field(2).unwrap()).map(|(with, without)| with - without).collect();
        let asked: Vec<_> = wanted.iter().zip(&without).map(|(with, without)| with - without).collect();
        let db = difference_db(&found, &asked, effect);
        println!("{effects:?}: {db:.1} dB of the effect, which is {:.1} dB", 10.0 * (effect / energy(&without)).log10());
        assert!(db < -60.0, "{effects:?}: {db:.1} dB");
    }
}

#[test]
fn phase_noise_has_the_stated_strength_at_three_metres_and_jitter_has_two_values() {
    let noise = EffectsConfig { phase_noise: Some(PhaseNoise { per_chirp_rad: 0.1, per_frame_rad: 0.0 }), ..Default::default() };
    let recorder = Recorder::new(&point_world(noise)).unwrap();
    let errors: Vec<f64> =
        (0..4).flat_map(|k| recorder.stages().chirp_errors(recorder.world(), k).unwrap()).map(|e| e.offset_hz).collect();
    let rms = (errors.iter().map(|hz| hz * hz).sum::<f64>() / errors.len() as f64).sqrt();
    let rad = rms * std::f64::consts::TAU * 6.0 / SPEED_OF_LIGHT;
    assert!((rad / 0.1 - 1.0).abs() < 0.25, "{rad} of {} draws", errors.len());
    let jitter = EffectsConfig { chirp_start_jitter: Some(ChirpStartJitter { jitter_s: 1.1e-9 }), ..Default::default() };
    let recorder = Recorder::new(&point_world(jitter)).unwrap();
    let late: Vec<f64> =
        (0..4).flat_map(|k| recorder.stages().chirp_errors(recorder.world(), k).unwrap()).map(|e| e.late_s).collect();
    assert!(late.iter().all(|s| *s == 0.0 || *s == 1.1e-9));
    // Sixty-four fair coins, within four standard deviations of 4.
    assert!((16..=48).contains(&late.iter().filter(|s| **s > 0.0).count()), "{late:?}");
}

#[test]
fn a_range_bias_is_a_longer_cable() {
    let world = point_world(EffectsConfig { range_bias: Some(RangeBias { offset_m: 0.068 }), ..Default::default() });
    let found = field(&world, 1);
    let wanted = path(&world.radar, delay(&world.radar, POINT_M, 0) + 2.0 * 0.068 / SPEED_OF_LIGHT);
    let error = proportional(chirp(&found, &world.radar, 0), &wanted);
    assert!(error < 1e-4, "{error:e}");
}
