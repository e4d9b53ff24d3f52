//! An error of the chirp's start frequency (card W3).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "start_frequency_error",
    card: "W3",
    stage: Stage::Waveform,
    title: "an error of the chirp's start frequency",
    explanation: "The ramp starts at another frequency than declared, so that every path's phase is wrong in proportion to its delay.",
    equation: "× exp(j2π τ_p f_0 relative) on path p",
    parameters: &[parameter("relative", "1", 0.0, -0.005, 0.005)],
    look_alikes: &["adc_start_error", "if_delay", "if_lowpass"],
    separate_by: "the same scene with another slope: a delay in the receiver counts in proportion to the slope, the start frequency does not; never from one setting of the radar",
};
