//! A change of gain along the chirp (card R9).

use std::f64::consts::LN_10;

use super::{
    context::{Context, legendre},
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "chirp_droop";

/// What reports and docs say of `chirp_droop`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "R9",
    stage: Stage::Receiver,
    needs_person: false,
    title: "a change of gain along the chirp",
    explanation: "Transmitted power or gain changes along the ramp, alike for all echoes: it shapes the sidelobes in range.",
    equation: "× 10^{g(x)/20}, g = −½ db[0] P_1(x) + Σ_k db[k] P_{k+1}(x), x = −1 … 1 over the window",
    parameters: &[amplitude("db", "dB", 0.0, -20.0, 20.0)],
    choice: Choice::None,
    look_alikes: &["if_highpass"],
    separate_by: "a strong reflector at two ranges: the same shape at both, where a bent chirp's grows with range",
    operator: Operator::Signal(apply),
};

/// The first number of `db` is the fall from the first sample to the last, the others are Legendre polynomials of the
/// second order on.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let along = context.along_the_chirp();
    let decibels = values.get("db");
    let [orders] = decibels.dims();
    let mut gain_db = values.constant(&vec![0.0; along.len()]);
    for order in 0..orders {
        let weight = if order == 0 { -0.5 } else { 1.0 };
        let shape: Vec<f64> = along.iter().map(|&x| weight * legendre(order + 1, x)).collect();
        gain_db = gain_db + values.constant(&shape) * decibels.clone().narrow(0, order, 1);
    }
    let gain = (gain_db * (LN_10 / 20.0)).exp();
    signal.scale(gain.reshape([1, 1, 1, along.len()]))
}
