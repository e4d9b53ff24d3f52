//! A change of gain along the chirp (card R9).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "chirp_droop",
    card: "R9",
    stage: Stage::Receiver,
    title: "a change of gain along the chirp",
    explanation: "Transmitted power or gain changes along the ramp, alike for all echoes: it shapes the sidelobes in range.",
    equation: "× 10^{g(x)/20}, g = −½ db[0] P_1(x) + Σ_k db[k] P_{k+1}(x), x = −1 … 1 over the window",
    parameters: &[parameter("db", "dB", 0.0, -20.0, 20.0)],
    look_alikes: &["chirp_nonlinearity", "if_highpass"],
    separate_by: "a strong reflector at two ranges: the same shape at both, where a bent chirp's grows with range",
};
