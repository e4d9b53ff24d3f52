//! Every effect that can be planted, graded from undetectable to obvious.
//!
//! Strengths are those of data sheets and application notes, and some thirty decibels below. They are fixed here, before
//! any sealed run; how strong a planted effect came out is measured on the recording itself.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::effects;
use crate::person::JOINT_NAMES;
use crate::radar::Radar;
use crate::recorder::effects::*;
use crate::room::{Boundary, Room};

/// What an effect must know of the scene it is put into.
#[derive(Clone, Debug)]
pub struct Surroundings {
    pub room: Room,
    /// Horizontal distance of the motion's origin.
    pub distance_m: f64,
    pub frames: usize,
    pub receivers: usize,
    pub max_range_m: f64,
    pub sample_rate_hz: f64,
}

impl Surroundings {
    /// Of a person at a horizontal distance from a radar in a room.
    pub fn new(radar: &Radar, room: Room, distance_m: f64) -> Self {
        Self {
            room,
            distance_m,
            frames: radar.frames,
            receivers: radar.rx_m.len(),
            max_range_m: radar.max_range_m(),
            sample_rate_hz: radar.sample_rate_hz,
        }
    }
}

/// An effect with the strengths between which it is drawn, log-uniformly.
pub struct Graded {
    /// As in docs/report.md; for what is outside the library, the recorder's word.
    pub id: &'static str,
    pub weakest: f64,
    pub strongest: f64,
    /// Adds the effect at a strength; everything else about it comes from the random numbers.
    pub add: fn(&mut EffectsConfig, f64, &Surroundings, &mut ChaCha8Rng),
}

impl Graded {
    /// `level` 0 is the weakest, 1 the strongest, also of what is above; below 0 it becomes weaker still.
    pub fn strength(&self, level: f64) -> f64 {
        self.weakest * (self.strongest / self.weakest).powf(level.min(1.0))
    }
}

fn sign(random: &mut ChaCha8Rng) -> f64 {
    if random.random::<bool>() { 1.0 } else { -1.0 }
}

fn between(low: f64, high: f64, random: &mut ChaCha8Rng) -> f64 {
    low + (high - low) * random.random::<f64>()
}

/// Not below what the recorder takes.
fn db(amplitude: f64) -> f64 {
    (20.0 * amplitude.log10()).max(-119.0)
}

/// A place in the room away from its boundaries, in front of the radar.
fn place(at: &Surroundings, random: &mut ChaCha8Rng) -> [f64; 3] {
    let room = &at.room;
    let side = |distance: Option<f64>| distance.unwrap_or(2.0) - 0.3;
    [
        between(-side(room.left_m), side(room.right_m), random),
        between(1.0, room.front_m.unwrap_or(5.0) - 0.3, random),
        between(-0.6 * room.floor_m.unwrap_or(1.0), 0.6, random),
    ]
}

/// A place near the person.
fn beside(at: &Surroundings, random: &mut ChaCha8Rng) -> [f64; 3] {
    [between(-0.5, 0.5, random), at.distance_m + between(-0.4, 0.4, random), between(-0.4, 0.4, random)]
}

fn joint(random: &mut ChaCha8Rng, among: &[usize]) -> String {
    JOINT_NAMES[among[random.random_range(0..among.len())]].into()
}

const TRUNK: [usize; 4] = [0, 3, 6, 9];
const LIMBS: [usize; 8] = [4, 5, 7, 8, 18, 19, 20, 21];

fn wall(at: &Surroundings, random: &mut ChaCha8Rng) -> Boundary {
    let walls: Vec<Boundary> = [Boundary::Left, Boundary::Right, Boundary::Front]
        .into_iter()
        .filter(|&wall| at.room.distance_m(wall).is_some())
        .collect();
    walls[random.random_range(0..walls.len())]
}

fn per_receiver(at: &Surroundings, mut value: impl FnMut() -> f64) -> Vec<f64> {
    // The first receiver is what the others are relative to.
    (0..at.receivers).map(|rx| if rx == 0 { 0.0 } else { value() }).collect()
}

macro_rules! graded {
    ($($id:ident $weakest:literal $strongest:literal |$strength:ident, $at:ident, $random:ident| $value:expr;)*) => {
        &[$(Graded {
            id: effects::$id::ID,
            weakest: $weakest,
            strongest: $strongest,
            add: |effects, $strength, $at, $random| { let _ = ($at, &$random); effects.$id = Some($value); },
        }),*]
    };
}

macro_rules! listed {
    ($($id:ident $weakest:literal $strongest:literal |$strength:ident, $at:ident, $random:ident| $value:expr;)*) => {
        &[$(Graded {
            id: effects::$id::ID,
            weakest: $weakest,
            strongest: $strongest,
            add: |effects, $strength, $at, $random| { let _ = ($at, &$random); effects.$id.push($value); },
        }),*]
    };
}

macro_rules! outside {
    ($($kind:ident $weakest:literal $strongest:literal |$strength:ident, $at:ident, $random:ident| $value:expr;)*) => {
        &[$(Graded {
            id: Outside::$kind,
            weakest: $weakest,
            strongest: $strongest,
            add: |effects, $strength, $at, $random| { let _ = ($at, &$random); effects.outside.push($value); },
        }),*]
    };
}

/// Of the library, one at most in a recording.
const SINGLE: &[Graded] = graded! {
    start_frequency_error 1e-5 1e-2 |s, at, random| StartFrequencyError { relative: s * sign(random) };
    adc_start_error 3e-10 3e-7 |s, at, random| AdcStartError { offset_s: s * sign(random) };
    slope_error 3e-5 2e-2 |s, at, random| SlopeError { relative: s * sign(random) };
    chirp_nonlinearity 3e3 3e6 |s, at, random| ChirpNonlinearity { peak_hz: s * sign(random) };
    chirp_ripple 2e3 1e6 |s, at, random| ChirpRipple { deviation_hz: s, ripple_hz: between(1e5, 9e5, random) };
    phase_noise 1e-3 0.5 |s, at, random| PhaseNoise { per_chirp_rad: s, per_frame_rad: 0.0 };
    chirp_start_jitter 1e-10 5e-8 |s, at, random| ChirpStartJitter { jitter_s: s };
    tx_leakage 1e-3 1.0 |s, at, random| TxLeakage { range_m: between(0.03, 0.2, random), relative: s, spread_db: 3.0 };
    dc_offset 1e-4 0.3 |s, at, random| {
        let angle = between(0.0, TAU, random);
        DcOffset { i: s * angle.cos(), q: s * angle.sin() }
    };
    iq_imbalance 3e-3 1.5 |s, at, random| IqImbalance { gain_db: s * sign(random), phase_deg: s * between(-5.0, 5.0, random) };
    compression 3e-4 0.25 |s, at, random| Compression { level: s };
    adc_saturation 1e-2 3.0 |s, at, random| AdcSaturation { level: 1.0 + s };
    second_harmonic 3e-4 0.2 |s, at, random| SecondHarmonic { level_db: db(s) };
    if_highpass 3e3 5e5 |s, at, random| IfHighpass { corner_hz: s.max(1.1e3), order: random.random_range(1..=2), settled: true, circular: false };
    if_lowpass 1e-3 1.0 |s, at, random| IfLowpass { corner_hz: (1e6 / s).min(9.9e8) };
    if_delay 3e-10 3e-7 |s, at, random| IfDelay { delay_s: s };
    chirp_droop 1e-2 4.0 |s, at, random| ChirpDroop { db: s };
    ramp_edge_transient 1e-3 3.0 |s, at, random| RampEdgeTransient { samples: random.random_range(1..=4), level_db: db(s) };
    chirp_settling 1e-3 0.6 |s, at, random| ChirpSettling { depth: s, chirps: between(1.5, 6.0, random) };
    gain_drift 1e-2 3.0 |s, at, random| GainDrift { db: s * sign(random) };
    spur 1e-4 0.3 |s, at, random| Spur {
        frequency_hz: between(-0.45, 0.45, random) * at.sample_rate_hz, level_db: db(s), coherent: false
    };
    interference 1e-2 10.0 |s, at, random| Interference {
        bursts: random.random_range(4..=40), relative: s, azimuth_deg: between(-50.0, 50.0, random)
    };
    channel_mismatch 1e-2 3.0 |s, at, random| ChannelMismatch {
        gain_db: per_receiver(at, || s * between(-1.0, 1.0, random)),
        phase_deg: per_receiver(at, || 6.0 * s * between(-1.0, 1.0, random)),
    };
    antenna_position 3e-6 1e-3 |s, at, random| AntennaPosition { offset_m: per_receiver(at, || s * between(-1.0, 1.0, random)) };
    antenna_pattern 3e-2 6.0 |s, at, random| AntennaPattern { exponent: s };
    mutual_coupling 1e-3 0.2 |s, at, random| MutualCoupling { level_db: db(s) };
    clock_offset 1e-3 0.3 |s, at, random| ClockOffset { offset_s: s * sign(random) };
    clock_drift 1e-4 5e-2 |s, at, random| ClockDrift { relative: s * sign(random) };
    frame_drop 1.0 6.0 |s, at, random| FrameDrop {
        at: random.random_range(2..at.frames.max(4) - 1), count: s.round().max(1.0) as usize
    };
    pose_offset 2e-3 0.5 |s, at, random| {
        let angle = between(0.0, TAU, random);
        PoseOffset { offset_m: [s * angle.cos(), s * angle.sin(), 0.0], yaw_deg: 0.0 }
    };
    range_bias 1e-3 0.3 |s, at, random| RangeBias { offset_m: s * sign(random) };
    carried_reflector 1e-2 2.0 |s, at, random| CarriedReflector { body_part: joint(random, &LIMBS), amplitude: s };
    radar_vibration 1e-6 3e-4 |s, at, random| RadarVibration { amplitude_m: s, frequency_hz: between(3.0, 60.0, random) };
    floor_bounce 3e-3 0.7 |s, at, random| FloorBounce { coefficient: s * sign(random) };
    object_radar_object 1e-3 0.5 |s, at, random| ObjectRadarObject { coefficient: s };
    range_alias 1e-2 3.0 |s, at, random| RangeAlias {
        range_m: at.max_range_m * between(1.1, 1.8, random), azimuth_deg: between(-40.0, 40.0, random), amplitude: s,
        swing_m: 0.1, rate_hz: between(0.4, 1.5, random)
    };
    soft_occlusion 0.3 3.0 |s, at, random| SoftOcclusion { width: s };
    body_multibounce 3e-3 0.6 |s, at, random| BodyMultibounce { extra_m: between(0.2, 1.0, random), coefficient: s };
    breathing 2e-5 6e-3 |s, at, random| Breathing { rate_hz: between(0.2, 0.45, random), amplitude_m: s };
    heartbeat 5e-6 1e-3 |s, at, random| Heartbeat { rate_hz: between(0.9, 1.8, random), amplitude_m: s };
    clothing_delay 3e-5 1e-2 |s, at, random| ClothingDelay {
        extra_m: s, body_parts: TRUNK.map(|joint| JOINT_NAMES[joint].to_string()).to_vec()
    };
    part_reflectivity 3e-2 15.0 |s, at, random| PartReflectivity { body_part: joint(random, &TRUNK), db: s * sign(random) };
    coloured_noise 3e3 6e5 |s, at, random| ColouredNoise { knee_hz: s, power: between(1.0, 2.0, random) };
    impulsive_noise 1e-5 2e-2 |s, at, random| ImpulsiveNoise { rate: s, strength: 10.0 };
    correlated_noise 1e-2 0.9 |s, at, random| CorrelatedNoise { rho: s };
};

/// Of the library, as many as one likes.
const MANY: &[Graded] = listed! {
    static_reflector 3e-3 3.0 |s, at, random| StaticReflector { position_m: place(at, random), amplitude: s };
    moving_reflector 3e-3 1.0 |s, at, random| MovingReflector {
        position_m: place(at, random),
        axis: [0.0, 1.0, 0.0],
        swing_m: between(0.03, 0.15, random),
        rate_hz: between(0.4, 2.0, random),
        amplitude: s,
    };
    wall_ghost 3e-3 0.7 |s, at, random| WallGhost { boundary: wall(at, random), coefficient: s * sign(random), order: 1 };
};

/// Below returns of the person and the walls.
pub const MASKED: &[Graded] = &[
    Graded {
        id: effects::moving_reflector::ID,
        weakest: 3e-3,
        strongest: 0.1,
        add: |effects, strength, at, random| {
            effects.moving_reflector.push(MovingReflector {
                position_m: beside(at, random),
                axis: [0.0, 1.0, 0.0],
                swing_m: between(0.03, 0.15, random),
                rate_hz: between(0.4, 2.0, random),
                amplitude: strength,
            });
        },
    },
    Graded {
        id: effects::static_reflector::ID,
        weakest: 3e-3,
        strongest: 0.1,
        add: |effects, strength, at, random| {
            // Just before the wall ahead, whose own return covers it.
            let y = at.room.front_m.unwrap_or(5.0) - between(0.0, 0.04, random);
            effects.static_reflector.push(StaticReflector {
                position_m: [between(-0.1, 0.1, random), y, between(-0.1, 0.1, random)],
                amplitude: strength,
            });
        },
    },
    Graded {
        id: effects::carried_reflector::ID,
        weakest: 3e-3,
        strongest: 0.1,
        add: |effects, strength, _, random| {
            let body_part = if random.random::<bool>() { joint(random, &LIMBS) } else { joint(random, &TRUNK) };
            effects.carried_reflector = Some(CarriedReflector { body_part, amplitude: strength });
        },
    },
    Graded {
        id: effects::body_multibounce::ID,
        weakest: 3e-3,
        strongest: 0.1,
        add: |effects, strength, _, random| {
            effects.body_multibounce = Some(BodyMultibounce { extra_m: between(0.08, 0.3, random), coefficient: strength });
        },
    },
    Graded {
        id: effects::wall_ghost::ID,
        weakest: 3e-3,
        strongest: 0.1,
        add: |effects, strength, at, random| {
            let boundary = wall(at, random);
            effects.wall_ghost.push(WallGhost { boundary, coefficient: strength * sign(random), order: 1 });
        },
    },
    Graded {
        id: effects::chirp_ripple::ID,
        weakest: 2e3,
        strongest: 1e5,
        add: |effects, strength, _, random| {
            effects.chirp_ripple = Some(ChirpRipple { deviation_hz: strength, ripple_hz: between(4e4, 1.5e5, random) });
        },
    },
];

/// Effects that learned amplitudes can absorb.
pub const ABSORBED: [&str; 10] = [
    effects::if_highpass::ID,
    effects::if_lowpass::ID,
    effects::antenna_pattern::ID,
    effects::part_reflectivity::ID,
    effects::start_frequency_error::ID,
    effects::clothing_delay::ID,
    effects::soft_occlusion::ID,
    effects::breathing::ID,
    effects::range_bias::ID,
    effects::chirp_droop::ID,
];

/// Effects outside the library: no id of docs/report.md names them.
pub const OUTSIDE: &[Graded] = outside! {
    MAINS_GAIN_RIPPLE 3e-4 0.2 |s, at, random| Outside::MainsGainRipple {
        rate_hz: [50.0, 60.0, 100.0, 120.0][random.random_range(0..4)], depth: s
    };
    LSB_STUCK 1.0 256.0 |s, at, random| Outside::LsbStuck {
        rx: random.random_range(0..at.receivers), bit: s.log2().round() as usize
    };
    RX_MUX_SKEW 1e-3 0.3 |s, at, random| Outside::RxMuxSkew { fraction: s };
    LAMP_MODULATION 3e-2 0.9 |s, at, random| Outside::LampModulation {
        position_m: [0.0, at.room.front_m.unwrap_or(5.0), 0.5], radius_m: 1.0, rate_hz: 100.0, depth: s
    };
    MOVING_CURTAIN 1e-5 5e-3 |s, at, random| Outside::MovingCurtain {
        position_m: [between(-1.0, 1.0, random), at.room.front_m.unwrap_or(5.0), 0.0], radius_m: 0.8,
        rate_hz: between(0.2, 1.0, random), swing_m: s
    };
    LO_PULLING 3e-3 1.0 |s, at, random| Outside::LoPulling { peak_rad: s };
    THERMAL_CURVATURE 1e4 5e6 |s, at, random| Outside::ThermalCurvature { peak_hz: s };
    GAIN_HOP 1e-2 3.0 |s, at, random| Outside::GainHop { rx: random.random_range(0..at.receivers), db: s };
    MUX_CROSSTALK 1e-3 0.2 |s, at, random| Outside::MuxCrosstalk { level_db: db(s) };
    CHIRP_AFTERGLOW 1e-3 0.2 |s, at, random| Outside::ChirpAfterglow { level_db: db(s) };
    BUFFER_SLIP 1.0 16.0 |s, at, random| Outside::BufferSlip {
        frame: random.random_range(0..at.frames), rx: random.random_range(0..at.receivers), samples: s.round().max(1.0) as usize
    };
};

/// All graded effects of the library.
pub fn library() -> impl Iterator<Item = &'static Graded> {
    SINGLE.iter().chain(MANY)
}

/// Each effect once, those outside the library too.
pub fn every() -> impl Iterator<Item = &'static Graded> {
    library().chain(OUTSIDE)
}

/// A graded effect of the library by its id; none for what is outside it.
pub fn graded(id: &str) -> Option<&'static Graded> {
    library().find(|graded| graded.id == id)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::recorder::{RadarChoice, RecorderConfig};

    #[test]
    fn the_recorder_and_the_library_agree_on_what_needs_a_person() {
        let world = RecorderConfig::default().world(std::path::Path::new(".")).unwrap();
        let at = Surroundings::new(&world.radar, world.room.clone(), 2.8);
        for graded in library() {
            let mut config = EffectsConfig::default();
            (graded.add)(&mut config, graded.strength(1.0), &at, &mut ChaCha8Rng::seed_from_u64(0));
            let needs_person = effects::info(graded.id).unwrap().needs_person;
            assert_eq!(config.without_person().is_off(), needs_person, "{}", graded.id);
        }
    }

    #[test]
    fn every_kind_outside_the_library_is_graded_under_the_recorders_word() {
        let world = RecorderConfig::default().world(std::path::Path::new(".")).unwrap();
        let at = Surroundings::new(&world.radar, world.room.clone(), 2.8);
        for graded in OUTSIDE {
            let mut config = EffectsConfig::default();
            (graded.add)(&mut config, graded.strength(1.0), &at, &mut ChaCha8Rng::seed_from_u64(0));
            assert_eq!(config.outside[0].kind(), graded.id);
            let written = serde_json::to_value(&config.outside[0]).unwrap();
            assert_eq!(written["kind"], graded.id);
            assert!(effects::info(graded.id).is_none(), "{}", graded.id);
        }
    }

    #[test]
    fn every_effect_is_within_the_recorders_bounds_at_both_ends() {
        let mut world = RecorderConfig { radar: RadarChoice::Preset("small".into()), ..RecorderConfig::default() }
            .world(std::path::Path::new("."))
            .unwrap();
        let at = Surroundings::new(&world.radar, world.room.clone(), 2.8);
        for graded in library().chain(MASKED).chain(OUTSIDE) {
            for level in [-0.5, 0.0, 0.5, 1.0] {
                for seed in 0..5 {
                    let mut effects = EffectsConfig::default();
                    (graded.add)(&mut effects, graded.strength(level), &at, &mut ChaCha8Rng::seed_from_u64(seed));
                    assert_ne!(effects, EffectsConfig::default(), "{}", graded.id);
                    world.effects = effects;
                    world.check().unwrap_or_else(|error| panic!("{} at {level}: {error}", graded.id));
                }
            }
        }
        assert!(ABSORBED.iter().all(|id| graded(id).is_some()));
    }
}
