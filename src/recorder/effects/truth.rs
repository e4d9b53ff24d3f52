//! What `truth.json` says of the effects: their settings, what they drew, and in which other terms they can be said.

use serde_json::{Map, Value, json};

use super::decibels::from_db;
use super::receiver::{bursts, leakage, offsets};
use super::stage::Stages;
use super::{
    BREATHING, CHIRP_RIPPLE, HEARTBEAT, MOVING_REFLECTOR, MUTUAL_COUPLING, OUTSIDE, Outside, RADAR_VIBRATION, RANGE_ALIAS,
    outside,
};
use crate::recorder::world::World;

/// The entries of `effects[]`.
pub fn listed(world: &World) -> Vec<Value> {
    let mut entries: Vec<Value> = vec![];
    for (id, index, settings) in world.effects.listed() {
        let mut entry = Map::from_iter([("id".to_string(), json!(id)), ("name".to_string(), json!(id))]);
        if id == "outside"
            && let Some(effect) = world.effects.outside.get(index)
        {
            entry.insert("id".into(), json!(effect.kind()));
            entry.insert("name".into(), Value::Null);
        }
        if let Value::Object(settings) = settings {
            entry.extend(settings.into_iter().filter(|(key, _)| key != "kind"));
        }
        if let Value::Object(drawn) = drawn(world, id, index) {
            entry.extend(drawn);
        }
        entries.push(Value::Object(entry));
    }
    entries
}

/// What an effect drew, and its parameters in the terms of docs/report.md.
fn drawn(world: &World, id: &str, index: usize) -> Value {
    let (effects, radar) = (&world.effects, &world.radar);
    let in_db = |factor: f64| 20.0 * factor.max(1e-300).log10();
    let errors = |of: &dyn Fn(&super::waveform::ChirpError) -> f64| -> Value {
        let stages = Stages::new(world);
        let frame = |frame: usize| stages.chirp_errors(world, frame).map(|chirps| chirps.iter().map(of).collect::<Vec<f64>>());
        json!((0..radar.frames).map(frame).collect::<Vec<_>>())
    };
    match id {
        "chirp_ripple" => json!({ "phase_rad": world.phase(CHIRP_RIPPLE, 0) }),
        "phase_noise" => json!({ "drawn_hz": errors(&|chirp| chirp.offset_hz) }),
        "chirp_start_jitter" => json!({ "drawn_s": errors(&|chirp| chirp.late_s) }),
        "tx_leakage" => json!({
            "level_db": effects.tx_leakage.as_ref().map(|effect| in_db(effect.relative)),
            "drawn_relative": leakage(world).iter().map(|value| value.norm()).collect::<Vec<f64>>(),
        }),
        "dc_offset" => {
            let offsets = offsets(world);
            json!({
                "drawn_i": offsets.iter().map(|value| value.re).collect::<Vec<f64>>(),
                "drawn_q": offsets.iter().map(|value| value.im).collect::<Vec<f64>>(),
            })
        }
        "ramp_edge_transient" => {
            json!({ "relative": effects.ramp_edge_transient.as_ref().map(|effect| from_db(effect.level_db)) })
        }
        "interference" => json!({ "drawn": bursts(world).iter().map(|burst| json!({
            "frame": burst.frame, "tx": burst.tx, "loop": burst.index, "sample": burst.sample,
            "slope_hz_per_s": burst.slope_hz_per_s, "relative": burst.relative,
        })).collect::<Vec<Value>>() }),
        "mutual_coupling" => json!({ "phase_rad": world.phase(MUTUAL_COUPLING, 0) }),
        "moving_reflector" => json!({ "phase_rad": world.phase(MOVING_REFLECTOR, index) }),
        "radar_vibration" => json!({ "phase_rad": world.phase(RADAR_VIBRATION, 0) }),
        "range_alias" => {
            let seen = effects.range_alias.as_ref().map(|effect| effect.range_m.rem_euclid(radar.max_range_m()));
            json!({ "phase_rad": world.phase(RANGE_ALIAS, 0), "folded_range_m": seen })
        }
        "breathing" => json!({ "phase_rad": world.phase(BREATHING, 0) }),
        "heartbeat" => json!({ "phase_rad": world.phase(HEARTBEAT, 0) }),
        "outside" => match effects.outside[index] {
            Outside::MainsGainRipple { .. } | Outside::LampModulation { .. } | Outside::MovingCurtain { .. } => {
                json!({ "phase_rad": world.phase(OUTSIDE + index as u64, 0) })
            }
            Outside::GainHop { .. } => {
                json!({ "drawn_frames": (0..radar.frames).filter(|&k| outside::hops(world, index, k)).collect::<Vec<_>>() })
            }
            _ => Value::Null,
        },
        _ => Value::Null,
    }
}
