//! The receiver's IF high-pass filter (card R7).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "if_highpass",
    card: "R7",
    stage: Stage::Receiver,
    title: "the receiver's IF high-pass filter",
    explanation: "A filter that keeps leakage out also weakens near echoes and turns their phase, the more the nearer they are.",
    equation: "× [(j f_b/corner_hz) / (1 + j f_b/corner_hz)]^order, f_b = S τ",
    parameters: &[parameter("corner_hz", "Hz", 0.0, 0.0, 2000000.0), parameter("order", "1", 1.0, 1.0, 4.0)],
    look_alikes: &["if_lowpass", "start_frequency_error", "antenna_pattern"],
    separate_by: "a reflector at 0.3 to 1 m, or another filter setting of the chip; the noise floor has the filter's shape too",
};
