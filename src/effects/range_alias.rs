//! An echo from beyond the unambiguous range (card P8).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "range_alias",
    card: "P8",
    stage: Stage::Propagation,
    title: "an echo from beyond the unambiguous range",
    explanation: "Something farther away than the radar can measure appears folded back to a near range.",
    equation: "+ (re + j im) exp j2π(f_c τ + S t τ), τ = 2 range_m / c, S τ beyond the sample rate",
    parameters: &[
        parameter("range_m", "m", 0.0, 0.0, 200.0),
        parameter("level_db", "dB of the reference", -200.0, -120.0, 20.0),
        parameter("re", "of the reference", 0.0, -10.0, 10.0),
        parameter("im", "of the reference", 0.0, -10.0, 10.0),
        parameter("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    look_alikes: &["static_reflector", "spur"],
    separate_by: "change the sample rate by 5 %: the alias moves, a near object does not",
};
