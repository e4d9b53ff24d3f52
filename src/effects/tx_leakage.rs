//! Leakage from transmitters to receivers (card R1).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "tx_leakage",
    card: "R1",
    stage: Stage::Receiver,
    title: "leakage from transmitters to receivers",
    explanation: "Part of the transmitted wave goes straight to the receivers: a strong echo at rest in the first range bins, different in every channel.",
    equation: "+ L_{t,r} exp(j2π S τ_L t), τ_L = 2 range_m / c, L = reference (10^{level_db/20} + re + j im)",
    parameters: &[
        parameter("range_m", "m", 0.08, 0.0, 0.5),
        parameter("level_db", "dB of the reference", -200.0, -120.0, 20.0),
        parameter("re", "of the reference", 0.0, -10.0, 10.0),
        parameter("im", "of the reference", 0.0, -10.0, 10.0),
        parameter("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    look_alikes: &["dc_offset", "static_reflector"],
    separate_by: "turn the radar: leakage stays, the room moves; a cover of absorber on the radar takes the room away",
};
