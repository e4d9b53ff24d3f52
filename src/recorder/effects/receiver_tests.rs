use num_complex::Complex64;

use super::decibels::from_db;
use super::test_support::*;
use super::*;
use crate::radar::{Radar, Sampling};
use crate::recorder::receiver::{ReceiverConfig, range_doppler_power};
use crate::recorder::record::Recorder;
use crate::recorder::world::World;

fn db(ratio: f64) -> f64 {
    20.0 * ratio.log10()
}

/// Turns per sample of the point's beat.
fn beat(radar: &Radar) -> f64 {
    radar.slope_hz_per_s * delay(radar, POINT_M, 0) / radar.sample_rate_hz
}

/// A chirp of the point with these effects, and its peak.
fn one(effects: EffectsConfig) -> (Vec<Complex64>, World, f64) {
    let world = point_world(effects);
    (chirp(&field(&world, 0), &world.radar, 0).to_vec(), world.clone(), peak(&world))
}

#[test]
fn leakage_is_a_tone_of_the_stated_level_at_its_range() {
    let leak = TxLeakage { range_m: 0.5, relative: 0.8, spread_db: 0.0 };
    let (with, world, peak) = one(EffectsConfig { tx_leakage: Some(leak), ..Default::default() });
    let (without, ..) = one(EffectsConfig::default());
    let extra: Vec<Complex64> = with.iter().zip(&without).map(|(a, b)| a - b).collect();
    let turns = world.radar.slope_hz_per_s * 2.0 * 0.5 / crate::radar::SPEED_OF_LIGHT / world.radar.sample_rate_hz;
    assert!((tone(&extra, turns).norm() / peak - 0.8).abs() < 1e-3);
    assert!((energy(&extra) / (extra.len() as f64 * peak * peak)).sqrt() < 0.801);
}

#[test]
fn the_image_of_an_imbalance_lies_at_the_mirrored_bin_with_the_predicted_level() {
    let imbalance = IqImbalance { gain_db: 0.5, phase_deg: 2.0 };
    let (with, world, _) = one(EffectsConfig { iq_imbalance: Some(imbalance), ..Default::default() });
    let turns = beat(&world.radar);
    let g = Complex64::from_polar(from_db(0.5), 2f64.to_radians());
    let wanted = db((1.0 - g).norm() / (1.0 + g).norm());
    // Whole turns in the chirp, so that the two tones do not leak into each other.
    let hann: Vec<Complex64> = with.iter().zip(crate::recorder::receiver::hann(128)).map(|(v, w)| v * w).collect();
    let found = db(tone(&hann, -turns).norm() / tone(&hann, turns).norm());
    assert!((found - wanted).abs() < 0.1, "{found} against {wanted}");
}

#[test]
fn a_second_harmonic_appears_at_twice_the_range_and_compression_costs_its_level() {
    let (with, world, _) = one(EffectsConfig { second_harmonic: Some(SecondHarmonic { level_db: -40.0 }), ..Default::default() });
    let (plain, ..) = one(EffectsConfig::default());
    let turns = beat(&world.radar);
    let extra: Vec<Complex64> = with.iter().zip(&plain).map(|(a, b)| a - b).collect();
    let found = db(tone(&extra, 2.0 * turns).norm() / tone(&plain, turns).norm());
    assert!((found + 40.0).abs() < 0.1, "{found}");
    let (pressed, ..) = one(EffectsConfig { compression: Some(Compression { level: 0.05 }), ..Default::default() });
    let left = tone(&pressed, turns).norm() / tone(&plain, turns).norm();
    assert!((left - 0.95).abs() < 1e-3, "{left}");
}

#[test]
fn a_high_pass_is_its_formula_at_the_beat_frequency_and_from_rest_it_starts_at_zero() {
    let high = |settled: bool, circular: bool| IfHighpass { corner_hz: 3.5e5, order: 2, settled, circular };
    let (plain, world, _) = one(EffectsConfig::default());
    let frequency = beat(&world.radar) * world.radar.sample_rate_hz;
    let ratio = Complex64::new(0.0, frequency / 3.5e5);
    let wanted = (ratio / (1.0 + ratio)).powi(2);
    let (settled, ..) = one(EffectsConfig { if_highpass: Some(high(true, false)), ..Default::default() });
    for (with, without) in settled.iter().zip(&plain) {
        let found = with / without;
        assert!((found - wanted).norm() < 3e-3, "{found} against {wanted}");
    }
    let low = IfLowpass { corner_hz: 4e6 };
    let (filtered, ..) = one(EffectsConfig { if_lowpass: Some(low), ..Default::default() });
    let wanted = 1.0 / (1.0 + Complex64::new(0.0, frequency / 4e6));
    assert!((filtered[60] / plain[60] - wanted).norm() < 3e-3);
    // Six microseconds after the ramp's start nothing is left of a transient at 350 kHz; right at its start all is.
    let mut early = point_world(EffectsConfig { if_highpass: Some(high(false, false)), ..Default::default() });
    let late = chirp(&field(&early, 0), &early.radar, 0).to_vec();
    assert!(change(&late, &settled) < 1e-4 * energy(&settled));
    early.radar.adc_start_s = 0.0;
    let from_rest = field(&early, 0);
    let mut same = early.clone();
    same.effects.if_highpass = Some(high(true, false));
    let steady = field(&same, 0);
    assert!((from_rest[0] - steady[0]).norm() > 0.1 * steady[0].norm());
    assert!((from_rest[60] - steady[60]).norm() < 1e-3 * steady[60].norm());
    let (circular, ..) = one(EffectsConfig { if_highpass: Some(high(true, true)), ..Default::default() });
    let error = change(&circular, &settled) / energy(&settled);
    assert!(error > 1e-6 && error < 0.3, "{error:e}");
}

#[test]
fn gains_over_fast_and_slow_time_are_as_stated() {
    let (plain, world, _) = one(EffectsConfig::default());
    let (drooped, ..) = one(EffectsConfig { chirp_droop: Some(ChirpDroop { db: 2.0 }), ..Default::default() });
    assert!((db((drooped[127] / plain[127]).norm()) + 2.0).abs() < 1e-9 && (drooped[0] - plain[0]).norm() == 0.0);
    let settling = ChirpSettling { depth: 0.3, chirps: 2.0 };
    let settled = field(&point_world(EffectsConfig { chirp_settling: Some(settling), ..Default::default() }), 1);
    let base = field(&world, 1);
    for index in [0, 1, 5] {
        let found = (settled[index * 128] / base[index * 128]).re;
        assert!((found - (1.0 - 0.3 * (-(index as f64) / 2.0).exp())).abs() < 1e-9);
    }
    let drift = point_world(EffectsConfig { gain_drift: Some(GainDrift { db: 1.0 }), ..Default::default() });
    let total = db((field(&drift, 3)[15 * 128] / field(&world, 3)[15 * 128]).norm());
    assert!((total - 1.0).abs() < 0.01 && (field(&drift, 0)[0] - field(&world, 0)[0]).norm() == 0.0, "{total}");
}

#[test]
fn what_is_added_is_where_it_should_be_and_nowhere_else() {
    let (plain, world, peak) = one(EffectsConfig::default());
    let radar = &world.radar;
    let base: Vec<Vec<Complex64>> = (0..4).map(|frame| field(&world, frame)).collect();
    let extra = |effects: EffectsConfig, frame: usize| -> Vec<Complex64> {
        let with = field(&point_world(effects), frame);
        with.iter().zip(&base[frame]).map(|(a, b)| a - b).collect()
    };
    let edge = RampEdgeTransient { samples: 2, level_db: 9.5 };
    let edge = extra(EffectsConfig { ramp_edge_transient: Some(edge), ..Default::default() }, 0);
    assert!(edge.iter().enumerate().all(|(i, value)| (value.norm() > 1e-12) == (i % 128 >= 126)));
    assert!((db(edge[127].norm() / peak) - 9.5).abs() < 1e-6);
    let dc = extra(EffectsConfig { dc_offset: Some(DcOffset { i: 0.3, q: -0.1 }), ..Default::default() }, 0);
    assert!((2.0 / 3.0..4.0 / 3.0).contains(&(dc[0].re / peak / 0.3)) && (dc[0] - dc[100]).norm() < 1e-12 * peak.max(1.0));
    let spur = Spur { frequency_hz: 1.1e6, level_db: -10.0, coherent: false };
    let spur = extra(EffectsConfig { spur: Some(spur), ..Default::default() }, 2);
    let level = db(tone(chirp(&spur, radar, 1), 1.1e6 / radar.sample_rate_hz).norm() / peak);
    assert!((level + 10.0).abs() < 1e-6 && plain.len() == 128, "{level}");
    // Interference: only in the chirps of the truth, the same on all receivers.
    let bursts =
        EffectsConfig { interference: Some(Interference { bursts: 3, relative: 2.0, azimuth_deg: 20.0 }), ..Default::default() };
    let drawn = planted(&point_world(bursts.clone()))["drawn"].as_array().unwrap().clone();
    let mut hit = std::collections::BTreeSet::new();
    for burst in &drawn {
        hit.insert((burst["frame"].as_u64().unwrap() as usize, burst["loop"].as_u64().unwrap() as usize));
    }
    for frame in 0..4 {
        let extra = extra(bursts.clone(), frame);
        for (number, chirp) in extra.chunks_exact(128).enumerate() {
            let strong = chirp.iter().filter(|value| value.norm() > 0.5 * peak).count();
            assert_eq!(energy(chirp) > 0.0, hit.contains(&(frame, number % 16)), "frame {frame}, chirp {number}");
            assert!(strong <= 2 * 8);
        }
    }
}

#[test]
fn a_saturated_converter_clips_at_the_rail() {
    let mut world = point_world(EffectsConfig { adc_saturation: Some(AdcSaturation { level: 2.0 }), ..Default::default() });
    world.receiver = ReceiverConfig { adc: true, ..ReceiverConfig::ideal() };
    let frame = Recorder::new(&world).unwrap().frame(0).unwrap();
    let clipped = frame.re.iter().filter(|code| code.abs() >= 32767.0).count() as f64 / frame.re.len() as f64;
    // Of a sine of twice the rail: 1 − 2/π · asin(1/2).
    assert!((clipped - 2.0 / 3.0).abs() < 0.05, "{clipped}");
    world.receiver.adc = false;
    let frame = Recorder::new(&world).unwrap().frame(0).unwrap();
    assert_eq!(frame.re.iter().fold(0f32, |peak, code| peak.max(*code)), 32767.0);
}

#[test]
fn channels_have_their_own_gains_and_places_and_their_neighbours_share() {
    let base = point_world(EffectsConfig::default());
    let plain = field(&base, 0);
    let mismatch = ChannelMismatch { gain_db: vec![0.0, 1.0], phase_deg: vec![0.0, 30.0] };
    let with = field(&point_world(EffectsConfig { channel_mismatch: Some(mismatch), ..Default::default() }), 0);
    let ratio = chirp(&with, &base.radar, 1)[7] / chirp(&plain, &base.radar, 1)[7];
    assert!((ratio - Complex64::from_polar(from_db(1.0), 30f64.to_radians())).norm() < 1e-9);
    assert_eq!(chirp(&with, &base.radar, 0), chirp(&plain, &base.radar, 0));
    let position = AntennaPosition { offset_m: vec![0.0, 1e-4] };
    let with = field(&point_world(EffectsConfig { antenna_position: Some(position), ..Default::default() }), 0);
    let turn = (chirp(&with, &base.radar, 1)[64] / chirp(&plain, &base.radar, 1)[64]).arg();
    let sine = POINT_M[0] / POINT_M.iter().map(|x| x * x).sum::<f64>().sqrt();
    let wanted = -std::f64::consts::TAU * 1e-4 * sine / base.radar.wavelength_m();
    assert!((turn - wanted).abs() < 0.02 * wanted.abs(), "{turn} against {wanted}");
    let coupling = MutualCoupling { level_db: -20.0 };
    let with = field(&point_world(EffectsConfig { mutual_coupling: Some(coupling), ..Default::default() }), 0);
    let (own, other) = (chirp(&plain, &base.radar, 0), chirp(&plain, &base.radar, 1));
    let factor = (chirp(&with, &base.radar, 0)[9] - own[9]) / other[9];
    assert!((factor.norm() - 0.1).abs() < 1e-9);
    let pattern = AntennaPattern { exponent: 3.0 };
    let with = field(&point_world(EffectsConfig { antenna_pattern: Some(pattern), ..Default::default() }), 0);
    let cosine = POINT_M[1] / POINT_M.iter().map(|x| x * x).sum::<f64>().sqrt();
    assert!(((with[0] / plain[0]).norm() - cosine.powi(3)).abs() < 1e-3);
}

#[test]
fn noise_is_coloured_impulsive_or_shared_as_asked() {
    let noisy = |effects: EffectsConfig| {
        let mut world = point_world(effects);
        world.receiver = ReceiverConfig { noise: true, snr_db: -60.0, ..ReceiverConfig::ideal() };
        world.radar.loops_per_frame = 64;
        let frame = Recorder::new(&world).unwrap().frame(0).unwrap();
        let im = frame.im.unwrap();
        let all: Vec<Complex64> = frame.re.iter().zip(im).map(|(&re, im)| Complex64::new(re.into(), im.into())).collect();
        all
    };
    let power = |signal: &[Complex64]| energy(signal) / signal.len() as f64;
    let half = |signal: &[Complex64]| (signal[..64 * 128].to_vec(), signal[64 * 128..].to_vec());
    let white = noisy(EffectsConfig::default());
    let (a, b) = half(&noisy(EffectsConfig { correlated_noise: Some(CorrelatedNoise { rho: 0.4 }), ..Default::default() }));
    let shared: Complex64 = a.iter().zip(&b).map(|(x, y)| x * y.conj()).sum();
    assert!((shared.re / (energy(&a) * energy(&b)).sqrt() - 0.4).abs() < 0.03);
    assert!((power(&a) / power(&white) - 1.0).abs() < 0.05);
    let coloured =
        noisy(EffectsConfig { coloured_noise: Some(ColouredNoise { knee_hz: 3e5, power: 1.0 }), ..Default::default() });
    let by_range = |signal: &[Complex64], bin: usize| {
        let map = range_doppler_power(&signal[..64 * 128], 128);
        (0..64).map(|doppler| map[doppler * 128 + bin]).sum::<f64>()
    };
    let bin_hz = 4.4e6 / 128.0;
    for bin in [4, 60] {
        let found = by_range(&coloured, bin) / by_range(&white, bin);
        let wanted = 1.0 + 3e5 / (bin as f64 * bin_hz);
        assert!((found / wanted - 1.0).abs() < 0.5, "bin {bin}: {found} against {wanted}");
    }
    let impulses =
        noisy(EffectsConfig { impulsive_noise: Some(ImpulsiveNoise { rate: 0.01, strength: 20.0 }), ..Default::default() });
    let wanted = 0.99 + 0.01 * 400.0;
    assert!((power(&impulses) / power(&white) / wanted - 1.0).abs() < 0.2);
}

#[test]
fn a_receiver_without_quadrature_stays_real() {
    let mut world = point_world(EffectsConfig {
        second_harmonic: Some(SecondHarmonic { level_db: -30.0 }),
        dc_offset: Some(DcOffset { i: 0.1, q: 0.1 }),
        chirp_ripple: Some(ChirpRipple { deviation_hz: 1e5, ripple_hz: 2e5 }),
        ..Default::default()
    });
    world.radar.sampling = Sampling::Real;
    assert!(field(&world, 0).iter().all(|value| value.im == 0.0 && value.re.is_finite()));
    world.effects.iq_imbalance = Some(IqImbalance { gain_db: 0.1, phase_deg: 0.0 });
    let message = Recorder::new(&world).err().unwrap().to_string();
    assert!(message.contains("effects.iq_imbalance"), "{message}");
}
