//! A bend of the chirp (card W6).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "chirp_nonlinearity",
    card: "W6",
    stage: Stage::Waveform,
    title: "a bend of the chirp",
    explanation: "The ramp is not straight: an echo is smeared over ranges, the more the farther it is.",
    equation: "× exp(j2π τ_p δf(t)), δf = Σ_k peak_hz[k] P_{k+2}(x), x = −1 … 1 over the window",
    parameters: &[parameter("peak_hz", "Hz", 0.0, -10000000.0, 10000000.0)],
    look_alikes: &["chirp_droop", "chirp_ripple"],
    separate_by: "a strong reflector at two ranges: this smear grows with the range, a receiver's does not",
};
