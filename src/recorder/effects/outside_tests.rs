use std::f64::consts::TAU;

use num_complex::Complex64;

use super::decibels::from_db;
use super::test_support::*;
use super::*;
use crate::data::settings::read_text;
use crate::recorder::receiver::ReceiverConfig;
use crate::recorder::record::Recorder;
use crate::recorder::truth;
use crate::recorder::world::World;

fn with(effect: Outside) -> World {
    point_world(EffectsConfig { outside: vec![effect], ..Default::default() })
}

fn plain() -> World {
    point_world(EffectsConfig::default())
}

#[test]
fn gains_ripple_with_the_mains_and_hop_in_the_frames_of_the_truth() {
    let world = with(Outside::MainsGainRipple { rate_hz: 100.0, depth: 0.05 });
    let phase = planted(&world)["phase_rad"].as_f64().unwrap();
    for index in [0, 7, 15] {
        let found = (field(&world, 2)[index * 128] / field(&plain(), 2)[index * 128]).re;
        let time = world.radar.chirp_time_s(2, 0, index);
        assert!((found - 1.0 - 0.05 * (TAU * 100.0 * time + phase).cos()).abs() < 1e-9);
    }
    let world = with(Outside::GainHop { rx: 1, db: 1.0 });
    let drawn: Vec<u64> = planted(&world)["drawn_frames"].as_array().unwrap().iter().map(|k| k.as_u64().unwrap()).collect();
    for frame in 0..4 {
        let (a, b) = (field(&world, frame), field(&plain(), frame));
        assert_eq!(chirp(&a, &world.radar, 0), chirp(&b, &world.radar, 0));
        let gain = (chirp(&a, &world.radar, 1)[3] / chirp(&b, &world.radar, 1)[3]).norm();
        let wanted = if drawn.contains(&(frame as u64)) { from_db(1.0) } else { 1.0 };
        assert!((gain - wanted).abs() < 1e-9);
    }
}

#[test]
fn a_shared_converter_skews_and_mixes_and_remembers() {
    let (base, radar) = (field(&plain(), 0), plain().radar);
    let beat = radar.slope_hz_per_s * delay(&radar, POINT_M, 1) / radar.sample_rate_hz;
    let skewed = field(&with(Outside::RxMuxSkew { fraction: 0.25 }), 0);
    let turn = chirp(&skewed, &radar, 1)[50] / chirp(&base, &radar, 1)[50];
    assert!((turn - Complex64::cis(TAU * 0.25 * beat)).norm() < 1e-3, "{turn}");
    assert!(difference_db(chirp(&skewed, &radar, 0), chirp(&base, &radar, 0), energy(chirp(&base, &radar, 0))) < -200.0);
    let mixed = field(&with(Outside::MuxCrosstalk { level_db: -20.0 }), 0);
    let left = (chirp(&mixed, &radar, 1)[5] - chirp(&base, &radar, 1)[5]) / chirp(&base, &radar, 0)[5];
    assert!((left - 0.1).norm() < 1e-9);
    let glowing = field(&with(Outside::ChirpAfterglow { level_db: -20.0 }), 0);
    assert_eq!(glowing[..128], base[..128]);
    assert!(((glowing[128 + 5] - base[128 + 5]) / base[5] - 0.1).norm() < 1e-9);
}

#[test]
fn static_returns_are_modulated_and_move_where_stated() {
    let place = |effect: fn([f64; 3], f64) -> Outside, at: [f64; 3]| with(effect(at, 0.5));
    let lamp = |position_m, radius_m| Outside::LampModulation { position_m, radius_m, rate_hz: 100.0, depth: 0.2 };
    let world = place(lamp, POINT_M);
    let phase = planted(&world)["phase_rad"].as_f64().unwrap();
    let base = field(&plain(), 1);
    let time = world.radar.chirp_time_s(1, 0, 4) + world.radar.sample_time_s(64);
    let found = (field(&world, 1)[4 * 128] / base[4 * 128]).re;
    assert!((found - 1.0 - 0.2 * (TAU * 100.0 * time + phase).cos()).abs() < 1e-6, "{found}");
    let curtain = |position_m, radius_m| Outside::MovingCurtain { position_m, radius_m, rate_hz: 0.5, swing_m: 3e-4 };
    let world = place(curtain, POINT_M);
    let phase = planted(&world)["phase_rad"].as_f64().unwrap();
    let turn = (field(&world, 1)[4 * 128] / base[4 * 128]).arg();
    let cosine = 3.0 / (0.09f64 + 9.0 + 0.01).sqrt();
    let carrier = world.radar.carrier_hz();
    let wanted = 2.0 * TAU * cosine * 3e-4 * (TAU * 0.5 * time + phase).sin() * carrier / crate::radar::SPEED_OF_LIGHT;
    assert!((turn - wanted).abs() < 0.02, "{turn} against {wanted}");
    let error = Recorder::new(&place(lamp, [0.0, 1.0, 0.0])).err().unwrap().to_string();
    assert!(error.contains("effects.outside[0].position_m"), "{error}");
}

#[test]
fn a_pulled_oscillator_turns_with_the_signal() {
    let (a, b) = (field(&with(Outside::LoPulling { peak_rad: 0.1 }), 0), field(&plain(), 0));
    let peak = peak(&plain());
    for n in [3, 40] {
        assert!((a[n] - b[n] * Complex64::cis(0.1 * b[n].re / peak)).norm() < 1e-9 * peak);
    }
}

#[test]
fn codes_can_have_a_stuck_bit_and_a_slipped_buffer() {
    let codes = |outside: Vec<Outside>, frame: usize| {
        let mut world = point_world(EffectsConfig { outside, ..Default::default() });
        world.receiver = ReceiverConfig { adc: true, ..ReceiverConfig::ideal() };
        Recorder::new(&world).unwrap().frame(frame).unwrap()
    };
    let base = codes(vec![], 1);
    let stuck = codes(vec![Outside::LsbStuck { rx: 1, bit: 0 }], 1);
    let channel = 16 * 128;
    assert_eq!(stuck.re[..channel], base.re[..channel]);
    assert!(stuck.re[channel..].iter().all(|code| (*code as i32) & 1 == 1));
    assert!(stuck.re[channel..].iter().zip(&base.re[channel..]).all(|(a, b)| (a - b) == 0.0 || (a - b) == 1.0));
    assert_eq!(stuck.im, base.im);
    let slip = vec![Outside::BufferSlip { frame: 1, rx: 0, samples: 3 }];
    let slipped = codes(slip.clone(), 1);
    assert_eq!(slipped.re[3..128], base.re[..125]);
    assert_eq!(slipped.re[channel..], base.re[channel..]);
    assert_eq!(codes(slip, 0), codes(vec![], 0));
}

#[test]
fn everything_at_once_records_finite_samples_and_is_listed() {
    let text = "
        [start_frequency_error]\nrelative = 1e-5\n[adc_start_error]\noffset_s = 1e-8\n[slope_error]\nrelative = 1e-3
        [chirp_nonlinearity]\npeak_hz = 1e5\n[chirp_ripple]\ndeviation_hz = 1e5\nripple_hz = 2e5
        [phase_noise]\nper_chirp_rad = 0.02\n[chirp_start_jitter]\njitter_s = 1.1e-9
        [tx_leakage]\nrange_m = 0.09\nrelative = 0.5\nspread_db = 1.0\n[dc_offset]\ni = 0.1\nq = 0.05
        [iq_imbalance]\ngain_db = 0.3\nphase_deg = 1.0\n[compression]\nlevel = 0.02\n[adc_saturation]\nlevel = 1.2
        [second_harmonic]\nlevel_db = -40.0\n[if_highpass]\ncorner_hz = 3.5e5\norder = 2\n[if_lowpass]\ncorner_hz = 8e6
        [if_delay]\ndelay_s = 1e-8\n[chirp_droop]\ndb = 1.0\n[ramp_edge_transient]\nsamples = 2\nlevel_db = 3.0
        [chirp_settling]\ndepth = 0.1\nchirps = 3.0\n[gain_drift]\ndb = 0.5\n[spur]\nfrequency_hz = 1e6\nlevel_db = -30.0
        [interference]\nbursts = 3\n[channel_mismatch]\ngain_db = [0.0, 1.0]\nphase_deg = [0.0, 20.0]
        [antenna_position]\noffset_m = [0.0, 1e-4]\n[antenna_pattern]\nexponent = 2.0\n[mutual_coupling]\nlevel_db = -25.0
        [clock_offset]\noffset_s = 0.01\n[clock_drift]\nrelative = 1e-3\n[frame_drop]\nat = 1\ncount = 1
        [tdm_phase]\nslot_s = 1e-5\n[pose_offset]\noffset_m = [0.01, 0.0, 0.0]\nyaw_deg = 1.0\n[range_bias]\noffset_m = 0.02
        [carried_reflector]\nbody_part = \"spine2\"\namplitude = 0.3
        [radar_vibration]\namplitude_m = 1e-5\nfrequency_hz = 31.0
        [floor_bounce]\ncoefficient = 0.2\n[object_radar_object]\ncoefficient = 0.01
        [range_alias]\nrange_m = 13.0\namplitude = 0.1\n[soft_occlusion]\n[body_multibounce]\nextra_m = 0.2
        [breathing]\nrate_hz = 0.3\namplitude_m = 2e-3\n[heartbeat]\nrate_hz = 1.2\namplitude_m = 2e-4
        [clothing_delay]\nextra_m = 1e-3\n[part_reflectivity]\nbody_part = \"spine2\"\ndb = 2.0
        [coloured_noise]\nknee_hz = 1e5\npower = 1.0\n[impulsive_noise]\nrate = 1e-3\nstrength = 10.0\n[correlated_noise]\nrho = 0.1
        [[static_reflector]]\nposition_m = [0.5, 2.5, 0.0]\namplitude = 0.3
        [[moving_reflector]]\nposition_m = [-0.9, 3.4, 0.2]\nswing_m = 0.1\nrate_hz = 0.9\namplitude = 0.2
        [[wall_ghost]]\nboundary = \"right\"\ncoefficient = 0.35
        [[outside]]\nkind = \"mains_gain_ripple\"\nrate_hz = 100.0\ndepth = 0.05
        [[outside]]\nkind = \"rx_mux_skew\"\nfraction = 0.1
        [[outside]]\nkind = \"lamp_modulation\"\nposition_m = [1.0, 3.0, 0.0]\nradius_m = 1.5\nrate_hz = 120.0\ndepth = 0.1
        [[outside]]\nkind = \"thermal_curvature\"\npeak_hz = 1e5";
    let text: String = text.lines().map(|line| line.trim_start().to_string() + "\n").collect();
    let mut world = skinned_world(read_text(&text).unwrap());
    world.radar.tx_m = vec![[-0.01, 0.0, 0.0], [-0.012, 0.0, 0.0]];
    world.room = crate::room::Room { right_m: Some(1.5), floor_m: Some(1.0), ..Default::default() };
    world.receiver = ReceiverConfig::default();
    world.walls.clutter = true;
    let frame = Recorder::new(&world).unwrap().frame(2).unwrap();
    assert!(frame.re.iter().chain(frame.im.as_ref().unwrap()).all(|code| code.is_finite()));
    let truth = truth(&world, None);
    let effects = truth["effects"].as_array().unwrap();
    let tables = text.lines().filter(|line| line.starts_with('[')).count();
    assert_eq!(effects.len(), tables, "{truth}");
    assert_eq!(effects.iter().filter(|effect| effect["name"].is_null()).count(), 4);
    assert!(effects.iter().all(|effect| effect["id"].is_string()));
}

#[test]
fn impossible_effects_are_refused_with_their_key() {
    let cases: Vec<(&str, World)> = vec![
        (
            "effects.frame_drop.at",
            point_world(EffectsConfig { frame_drop: Some(FrameDrop { at: 9, count: 1 }), ..Default::default() }),
        ),
        ("effects.tdm_phase", point_world(EffectsConfig { tdm_phase: Some(TdmPhase { slot_s: 1e-5 }), ..Default::default() })),
        (
            "effects.antenna_position.offset_m",
            point_world(EffectsConfig { antenna_position: Some(AntennaPosition { offset_m: vec![0.0] }), ..Default::default() }),
        ),
        (
            "effects.channel_mismatch.gain_db",
            point_world(EffectsConfig {
                channel_mismatch: Some(ChannelMismatch { gain_db: vec![], phase_deg: vec![0.0; 2] }),
                ..Default::default()
            }),
        ),
        (
            "effects.soft_occlusion",
            point_world(EffectsConfig { soft_occlusion: Some(SoftOcclusion { width: 1.0 }), ..Default::default() }),
        ),
        (
            "effects.breathing",
            ball_world(EffectsConfig { breathing: Some(Breathing { rate_hz: 0.3, amplitude_m: 0.0 }), ..Default::default() }),
        ),
        (
            "effects.coloured_noise",
            point_world(EffectsConfig { coloured_noise: Some(ColouredNoise { knee_hz: 1e5, power: 1.0 }), ..Default::default() }),
        ),
        (
            "effects.if_delay.delay_s",
            point_world(EffectsConfig { if_delay: Some(IfDelay { delay_s: 2e-6 }), ..Default::default() }),
        ),
        ("effects.outside[0].rx", with(Outside::GainHop { rx: 7, db: 1.0 })),
        ("effects.outside[0]", with(Outside::LsbStuck { rx: 0, bit: 0 })),
        ("effects.outside[0].depth", with(Outside::MainsGainRipple { rate_hz: 100.0, depth: 1.5 })),
        (
            "effects.radar_vibration.amplitude_m",
            point_world(EffectsConfig {
                radar_vibration: Some(RadarVibration { amplitude_m: 1e-3, frequency_hz: 10.0 }),
                ..Default::default()
            }),
        ),
    ];
    for (key, mut world) in cases {
        if key == "effects.if_delay.delay_s" {
            world.radar.adc_start_s = 1e-6;
        }
        let message = Recorder::new(&world).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(message.contains(key), "{key}: {message}");
    }
}

#[test]
#[ignore = "a measurement, seconds of CPU: cargo test --release recorder::effects -- --ignored --nocapture"]
fn a_case_of_twelve_frames_takes_seconds() {
    use crate::recorder::{RadarChoice, RecorderConfig, Returns};
    let radar = crate::radar::Radar {
        samples_per_chirp: 128,
        loops_per_frame: 32,
        rx_m: crate::radar::Radar::mmmesh(12).rx_m,
        ..crate::radar::Radar::small(12)
    };
    for (returns, edge_m) in [(Returns::Vertices, 5e-3), (Returns::Random, 5e-3), (Returns::Random, 1e-2)] {
        let mut config = RecorderConfig { radar: RadarChoice::Full(Box::new(radar.clone())), ..RecorderConfig::default() };
        config.surface.returns = returns;
        config.surface.edge_m = edge_m;
        let world = config.world(std::path::Path::new(".")).unwrap();
        let start = std::time::Instant::now();
        let recorder = Recorder::new(&world).unwrap();
        let prepared = start.elapsed().as_secs_f64();
        let frames = recorder.frames().filter(|frame| frame.is_ok()).count();
        let elements = recorder.scatter().unwrap().elements.len();
        println!(
            "{returns:?} at {edge_m} m, {elements} elements: {prepared:.2} s + {:.2} s for {frames} frames",
            start.elapsed().as_secs_f64() - prepared
        );
    }
}
