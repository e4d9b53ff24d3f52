//! Effects on the signal against what is known of them in closed form.

use std::f64::consts::{LN_10, TAU};

use burn::tensor::{Device, Tensor};

use super::test_support::{context, flat, operator, signal, values};
use super::*;
use crate::{
    radar::{Radar, SPEED_OF_LIGHT},
    support::{tensor, values as host},
};

/// One transmitter, receiver and loop; bins of 0.2 m. Echoes up to 4 m are below half the sample rate.
fn radar() -> Radar {
    let single = vec![[0.0; 3]];
    Radar { samples_per_chirp: 64, loops_per_frame: 1, tx_m: single.clone(), rx_m: single, ..super::test_support::radar() }
}

fn beat_hz(radar: &Radar, range_m: f64) -> f64 {
    radar.slope_hz_per_s * 2.0 * range_m / SPEED_OF_LIGHT
}

/// exp(j2π(f t + turns)), the real parts first.
fn tone(radar: &Radar, hz: f64, turns: f64) -> Vec<f64> {
    let angle = |sample: usize| TAU * (hz * sample as f64 / radar.sample_rate_hz + turns);
    let samples = radar.samples_per_chirp;
    (0..samples).map(|n| angle(n).cos()).chain((0..samples).map(|n| angle(n).sin())).collect()
}

fn echo(radar: &Radar, range_m: f64) -> Vec<f64> {
    tone(radar, beat_hz(radar, range_m), 0.1)
}

/// What an effect makes of a signal.
fn after(setting: &EffectSetting, radar: &Radar, parts: &[f64]) -> Vec<f64> {
    let apply = operator(&setting.id).on_signal().unwrap();
    let of: Tensor<1> = tensor(parts, [parts.len()], &Device::flex());
    host(&flat(apply(signal(of, radar), &values(setting), &context(radar))))
}

/// Energy of the difference over that of what is wanted, dB.
fn error_db(found: &[f64], wanted: &[f64]) -> f64 {
    let difference: f64 = found.iter().zip(wanted).map(|(a, b)| (a - b).powi(2)).sum();
    10.0 * (difference / wanted.iter().map(|x| x * x).sum::<f64>()).log10()
}

/// Amplitude and phase (turns) of a signal against a tone.
fn against(radar: &Radar, parts: &[f64], hz: f64) -> (f64, f64) {
    let (samples, reference) = (radar.samples_per_chirp, tone(radar, hz, 0.0));
    let (mut re, mut im) = (0.0, 0.0);
    for n in 0..samples {
        let (a, b, c, d) = (parts[n], parts[samples + n], reference[n], reference[samples + n]);
        re += a * c + b * d;
        im += b * c - a * d;
    }
    (re.hypot(im) / samples as f64, im.atan2(re) / TAU)
}

fn setting(id: &str) -> EffectSetting {
    EffectSetting::neutral(id)
}

#[test]
fn a_slope_error_moves_an_echo_in_proportion_to_its_range() {
    let radar = radar();
    for range in [1.0, 3.0] {
        let found = after(&setting("slope_error").with("relative", [0.004]), &radar, &echo(&radar, range));
        // The ramp has been steeper from its start on, so its frequency is off at the window's start already.
        let hz = beat_hz(&radar, range);
        let wanted = tone(&radar, hz * 1.004, 0.1 + 0.004 * hz * radar.adc_start_s);
        assert!(error_db(&found, &wanted) < -55.0, "{range} m: {:.1} dB", error_db(&found, &wanted));
    }
}

#[test]
fn errors_of_start_frequency_sampling_start_and_if_delay_are_one_and_the_same() {
    let radar = radar();
    let before = echo(&radar, 2.0);
    let (relative, offset_s) = (2e-5, 2e-5 * radar.start_frequency_hz / radar.slope_hz_per_s);
    let frequency = after(&setting("start_frequency_error").with("relative", [relative]), &radar, &before);
    let start = after(&setting("adc_start_error").with("offset_s", [offset_s]), &radar, &before);
    let delay = after(&setting("if_delay").with("delay_s", [-offset_s]), &radar, &before);
    assert!(error_db(&frequency, &start) < -120.0 && error_db(&delay, &start) < -120.0);
    // 2π τ δf.
    let turns = 2.0 * 2.0 / SPEED_OF_LIGHT * relative * radar.start_frequency_hz;
    let wanted = tone(&radar, beat_hz(&radar, 2.0), 0.1 + turns);
    assert!(error_db(&frequency, &wanted) < -60.0, "{:.1} dB", error_db(&frequency, &wanted));
}

#[test]
fn a_range_bias_is_an_echo_from_farther_away() {
    let radar = radar();
    let found = after(&setting("range_bias").with("offset_m", [0.068]), &radar, &echo(&radar, 2.0));
    let carrier_turns = radar.carrier_hz() * 2.0 * 0.068 / SPEED_OF_LIGHT;
    let wanted = tone(&radar, beat_hz(&radar, 2.068), 0.1 + carrier_turns);
    assert!(error_db(&found, &wanted) < -120.0);
}

#[test]
fn filters_answer_to_a_tone_as_their_formula_says() {
    let radar = radar();
    for range in [0.6, 1.5, 3.0] {
        let hz = beat_hz(&radar, range);
        let (x, y) = (hz / 3.5e5, hz / 8e6);
        // j x/(1 + j x), twice; 1/(1 + j y).
        let high = (x * x / (1.0 + x * x), 2.0 * (1.0 / x).atan() / TAU);
        let low = (1.0 / (1.0 + y * y).sqrt(), -y.atan() / TAU);
        let highpass = setting("if_highpass").with("corner_hz", [3.5e5]).with("order", [2.0]);
        for (effect, (gain, turns)) in [(highpass, high), (setting("if_lowpass").with("corner_hz", [8e6]), low)] {
            let found = after(&effect, &radar, &echo(&radar, range));
            let wanted: Vec<f64> = tone(&radar, hz, 0.1 + turns).iter().map(|value| gain * value).collect();
            // Against the echo as it came, which is what the accuracy of the tones refers to.
            let error = error_db(&found, &wanted) + 20.0 * gain.log10();
            assert!(error < -30.0, "{} at {range} m: {error:.1} dB", effect.id);
            let (level, _) = against(&radar, &found, hz);
            assert!((level / gain - 1.0).abs() < 0.01, "{} at {range} m: {level}, wanted {gain}", effect.id);
        }
    }
}

#[test]
fn a_ripple_of_the_chirp_makes_a_pair_of_echoes_that_grow_with_range() {
    let radar = radar();
    let spacing = radar.sample_rate_hz / 8.0;
    let (deviation, levels): (f64, Vec<f64>) = (
        2e5,
        [1.0, 2.0]
            .map(|range| {
                let effect = setting("chirp_ripple").with("deviation_hz", [2e5]).with("ripple_hz", [spacing]);
                let found = after(&effect, &radar, &echo(&radar, range));
                let ghost: Vec<f64> = found.iter().zip(echo(&radar, range)).map(|(a, b)| a - b).collect();
                against(&radar, &ghost, beat_hz(&radar, range) + spacing).0
            })
            .to_vec(),
    );
    // π τ a
    let wanted = TAU / 2.0 * 2.0 / SPEED_OF_LIGHT * deviation;
    assert!((levels[0] / wanted - 1.0).abs() < 0.05, "{levels:?}, wanted {wanted}");
    assert!((levels[1] / levels[0] - 2.0).abs() < 0.05, "{levels:?}");
}

#[test]
fn a_bend_of_the_chirp_turns_phases_by_its_error_times_the_delay() {
    let radar = radar();
    let found = after(&setting("chirp_nonlinearity").with("peak_hz", [1e6]), &radar, &echo(&radar, 2.0));
    let delay_s = 2.0 * 2.0 / SPEED_OF_LIGHT;
    let samples = radar.samples_per_chirp;
    let hz = beat_hz(&radar, 2.0);
    let angle = |n: usize| {
        let x = 2.0 * n as f64 / (samples as f64 - 1.0) - 1.0;
        TAU * (hz * n as f64 / radar.sample_rate_hz + 0.1 + delay_s * 1e6 * 0.5 * (3.0 * x * x - 1.0))
    };
    let wanted: Vec<f64> = (0..samples).map(|n| angle(n).cos()).chain((0..samples).map(|n| angle(n).sin())).collect();
    assert!(error_db(&found, &wanted) < -60.0, "{:.1} dB", error_db(&found, &wanted));
}

#[test]
fn additive_effects_are_what_a_silent_receiver_shows() {
    let radar = radar();
    let samples = radar.samples_per_chirp;
    let silence = vec![0.0; 2 * samples];
    let given = |id: &str| setting(id).with("reference", [10.0]);
    let leak = after(&given("tx_leakage").with("range_m", [0.09]).with("level_db", [-20.0]), &radar, &silence);
    assert!(error_db(&leak, &tone(&radar, beat_hz(&radar, 0.09), 0.0)) < -120.0, "10 · 0.1 = 1");
    let alias = after(&given("range_alias").with("range_m", [14.0]).with("re", [0.1]), &radar, &silence);
    let folded = tone(&radar, beat_hz(&radar, 14.0) - radar.sample_rate_hz, 0.0);
    assert!(error_db(&alias, &folded) < -120.0);
    let offset = after(&given("dc_offset").with("i", [0.1]).with("q", [-0.2]), &radar, &silence);
    assert!(offset.iter().enumerate().all(|(i, value)| (value - if i < samples { 1.0 } else { -2.0 }).abs() < 1e-12));
    for (asked, edge) in [(2.0, samples - 2..samples), (-3.0, 0..3)] {
        let transient = after(&given("ramp_edge_transient").with("samples", [asked]).with("re", [0.3]), &radar, &silence);
        assert!((0..samples).all(|n| (transient[n] - if edge.contains(&n) { 3.0 } else { 0.0 }).abs() < 1e-12));
    }
    // A spur runs on with the radar's clock.
    let spur = after(&given("spur").with("frequency_hz", [9e5]).with("re", [0.1]), &radar, &silence);
    let start_s = radar.chirp_time_s(2, 0, 0) + radar.sample_time_s(0);
    assert!(error_db(&spur, &tone(&radar, 9e5, (9e5 * start_s).fract())) < -80.0);
    let burst = given("interference").with("frame", [2.0]).with("chirp", [0.0]).with("first", [5.0]).with("length", [8.0]);
    let burst = after(&burst.with("re", [0.5]), &radar, &silence);
    let level = |n: usize| burst[n].hypot(burst[samples + n]);
    assert!((0..samples).all(|n| (level(n) - if (5..13).contains(&n) { 5.0 } else { 0.0 }).abs() < 1e-9));
    let drawn = after(&given("interference").with("bursts", [2.0]).with("re", [0.5]), &radar, &silence);
    assert!(drawn.iter().any(|value| *value != 0.0));
}

#[test]
fn nonlinear_effects_make_the_products_that_they_should() {
    let radar = radar();
    let (hz, before) = (beat_hz(&radar, 1.5), echo(&radar, 1.5));
    let harmonic = after(&setting("second_harmonic").with("re", [0.02]).with("reference", [1.0]), &radar, &before);
    let rest: Vec<f64> = harmonic.iter().zip(&before).map(|(a, b)| a - b).collect();
    let (level, turns) = against(&radar, &rest, 2.0 * hz);
    assert!((level - 0.02).abs() < 1e-9 && (turns - 0.2).abs() < 1e-9, "{level}, {turns}");
    let image = after(&setting("iq_imbalance").with("gain_db", [0.5]).with("phase_deg", [2.0]), &radar, &before);
    // What the branches are by themselves: Q is stronger than I, and not at a right angle to it.
    let (gain, angle) = ((0.5 * LN_10 / 20.0).exp(), 2.0 * TAU / 360.0);
    let half = before.len() / 2;
    let turned = |n: usize| gain * (before[half + n] * angle.cos() + before[n] * angle.sin());
    assert!((0..half).all(|n| (image[n] - before[n]).abs() < 1e-9 && (image[half + n] - turned(n)).abs() < 1e-9));
    let less = after(&setting("compression").with("level", [0.1]).with("reference", [2.0]), &radar, &before);
    assert!((against(&radar, &less, hz).0 - (1.0 - 0.1 / 4.0)).abs() < 1e-9);
    let clipped = after(&setting("adc_saturation").with("level", [0.35]).with("reference", [2.0]), &radar, &before);
    assert!(clipped.iter().zip(&before).all(|(a, b)| (a - b.clamp(-0.7, 0.7)).abs() < 1e-12));
    let again = after(&setting("object_radar_object").with("coefficient", [0.05]).with("reference", [1.0]), &radar, &before);
    let rest: Vec<f64> = again.iter().zip(&before).map(|(a, b)| a - b).collect();
    assert!((against(&radar, &rest, 2.0 * hz).0 - 0.05).abs() < 1e-9);
}

#[test]
fn with_an_array_a_second_trip_is_a_product_of_two_beams_and_a_harmonic_is_a_square() {
    let radar = super::test_support::radar();
    let [_, tx, rx, loops, samples] = radar.dims();
    // A far point whose phase differs by a from tx to tx and by b from rx to rx.
    let (a, b) = (0.07, 0.19);
    let hz = beat_hz(&radar, 1.0);
    let mut parts = vec![0.0; 2 * tx * rx * loops * samples];
    for t in 0..tx {
        for r in 0..rx {
            let own = tone(&radar, hz, a * t as f64 + b * r as f64);
            for index in 0..loops {
                let at = ((t * rx + r) * loops + index) * samples;
                parts[at..at + samples].copy_from_slice(&own[..samples]);
                let at = at + tx * rx * loops * samples;
                parts[at..at + samples].copy_from_slice(&own[samples..]);
            }
        }
    }
    let turns = |id: &str| {
        let effect = match id {
            "second_harmonic" => setting(id).with("re", [0.1]),
            _ => setting(id).with("coefficient", [0.1]),
        };
        let found = after(&effect.with("reference", [1.0]), &radar, &parts);
        let rest: Vec<f64> = found.iter().zip(&parts).map(|(a, b)| a - b).collect();
        let half = tx * rx * loops * samples;
        let last = |channel: usize| {
            let at = channel * loops * samples;
            let own = [&rest[at..at + samples], &rest[half + at..half + at + samples]].concat();
            against(&radar, &own, 2.0 * hz).1
        };
        (last(tx * rx - 1) - last(0)).rem_euclid(1.0)
    };
    assert!((turns("second_harmonic") - 2.0 * (a + b)).abs() < 1e-9);
    assert!((turns("object_radar_object") - (a + b)).abs() < 1e-9);
}

#[test]
fn gains_over_the_chirp_the_frame_and_the_recording_are_those_of_their_parameters() {
    let radar = Radar { loops_per_frame: 3, ..radar() };
    let samples = radar.samples_per_chirp;
    let ones = [vec![1.0; 3 * samples], vec![0.0; 3 * samples]].concat();
    let droop = after(&setting("chirp_droop").with("db", [2.0]), &radar, &ones);
    assert!((20.0 * (droop[0] / droop[samples - 1]).log10() - 2.0).abs() < 1e-9);
    let settling = after(&setting("chirp_settling").with("depth", [0.4]).with("chirps", [2.0]), &radar, &ones);
    assert!((0..3).all(|chirp| (settling[chirp * samples] - (1.0 - 0.4 * (-(chirp as f64) / 2.0).exp())).abs() < 1e-12));
    // Frame 2 of 5 is the middle: no change there for one number, the middle knot of three.
    let drift = after(&setting("gain_drift").with("db", [3.0]), &radar, &ones);
    assert!((drift[0] - 1.0).abs() < 1e-12);
    let drift = after(&setting("gain_drift").with("db", [0.0, 6.0, 0.0]), &radar, &ones);
    assert!((20.0 * drift[0].log10() - 6.0).abs() < 1e-9);
    let shaken = after(&setting("radar_vibration").with("amplitude_m", [1e-5]).with("frequency_hz", [40.0]), &radar, &ones);
    let time_s = radar.chirp_time_s(2, 0, 1) + radar.sample_time_s(samples / 2);
    let radians = 2.0 * TAU * 1e-5 * (TAU * 40.0 * time_s).sin() / radar.wavelength_m();
    assert!((shaken[samples] - radians.cos()).abs() < 1e-6 && (shaken[4 * samples] - radians.sin()).abs() < 1e-6);
}

#[test]
fn random_errors_of_the_chirps_have_their_size_and_grow_with_range() {
    let radar = Radar { loops_per_frame: 200, ..radar() };
    let samples = radar.samples_per_chirp;
    let phases = |effect: &EffectSetting, range: f64| -> Vec<f64> {
        let one = echo(&radar, range);
        let parts = [one[..samples].repeat(200), one[samples..].repeat(200)].concat();
        let found = after(effect, &radar, &parts);
        let chirp = |m: usize| [&found[m * samples..][..samples], &found[(200 + m) * samples..][..samples]].concat();
        (0..200).map(|m| TAU * (against(&radar, &chirp(m), beat_hz(&radar, range)).1 - 0.1)).collect()
    };
    let deviation = |values: &[f64]| (values.iter().map(|x| x * x).sum::<f64>() / 200.0).sqrt();
    let noise = setting("phase_noise").with("per_chirp_rad", [0.02]);
    let (near, far) = (phases(&noise, 1.5), phases(&noise, 3.0));
    assert!((deviation(&far) / 0.02 - 1.0).abs() < 0.15, "{}", deviation(&far));
    assert!((deviation(&far) / deviation(&near) - 2.0).abs() < 0.02);
    let late = phases(&setting("chirp_start_jitter").with("jitter_s", [1.1e-9]), 3.0);
    let step = TAU * beat_hz(&radar, 3.0) * 1.1e-9;
    assert!(late.iter().all(|x| x.abs() < 1e-5 || (x - step).abs() < 1e-5), "two values only");
    // Two hundred fair coins, within four standard deviations of 7.1.
    assert!((72..=128).contains(&late.iter().filter(|x| **x > 0.5 * step).count()));
}

#[test]
fn channels_get_their_own_gain_and_their_neighbours_signal() {
    let radar = super::test_support::radar();
    let [_, tx, rx, loops, samples] = radar.dims();
    let block = loops * samples;
    let half = tx * rx * block;
    // Channel c holds c + 1 everywhere.
    let parts: Vec<f64> = (0..half).map(|i| (i / block + 1) as f64).chain(vec![0.0; half]).collect();
    let gains = [0.0, 6.0, -6.0, 1.0];
    let found = after(&setting("channel_mismatch").with("gain_db", gains).with("phase_deg", [30.0, -60.0]), &radar, &parts);
    for (channel, gain) in gains.into_iter().enumerate() {
        let turn = [30.0f64, -60.0][channel % 2].to_radians();
        let level = (channel + 1) as f64 * 10f64.powf(gain / 20.0);
        assert!((found[channel * block] - level * turn.cos()).abs() < 1e-9);
        assert!((found[half + channel * block] - level * turn.sin()).abs() < 1e-9);
    }
    let coupled = after(&setting("mutual_coupling").with("level_db", [-20.0]), &radar, &parts);
    for (channel, neighbour) in [(0, 1), (1, 0), (2, 3), (3, 2)] {
        let wanted = (channel + 1) as f64 + 0.1 * (neighbour + 1) as f64;
        assert!((coupled[channel * block] - wanted).abs() < 1e-8);
    }
}
