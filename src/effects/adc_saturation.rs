//! The converter's saturation (card R4).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "adc_saturation",
    card: "R4",
    stage: Stage::Receiver,
    title: "the converter's saturation",
    explanation: "Samples beyond the converter's rail are cut off: products of the strong echoes fill the map in the affected chirps.",
    equation: "Re s, Im s → clamped to ± level · reference",
    parameters: &[
        parameter("level", "of the reference", 10.0, 0.01, 10.0),
        parameter("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    look_alikes: &["compression", "interference"],
    separate_by: "a lower receiver gain; the samples' histogram shows a pile at the rail",
};
