//! A transient at the ramp's edge.

use burn::tensor::Tensor;

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, fixed, level},
    values::{Values, repeated},
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "ramp_edge_transient";

/// What reports and docs say of `ramp_edge_transient`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "",
    stage: Stage::Receiver,
    needs_person: false,
    title: "a transient at the ramp's edge",
    explanation: "At the start or the end of each ramp the receiver has not settled: the same additive jump in the first or last samples of every chirp.",
    equation: "+ (10^{level_db/20} + re + j im) reference on the last `samples` samples (the first ones where negative)",
    parameters: &[
        fixed("samples", "samples", 1.0, -64.0, 64.0),
        level("level_db", "dB of the reference", -200.0, -120.0, 20.0),
        amplitude("re", "of the reference", 0.0, -10.0, 10.0),
        amplitude("im", "of the reference", 0.0, -10.0, 10.0),
        fixed("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    choice: Choice::None,
    look_alikes: &["spur", "interference", "chirp_droop"],
    separate_by: "a shorter sampling window inside the ramp: the transient disappears",
    operator: Operator::Added(apply),
};

/// The same in all chirps and channels; `re` and `im` are for each of the edge's samples, or for all.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let samples = context.radar.samples_per_chirp;
    let asked = values.host("samples")[0];
    let count = (asked.abs().round().max(1.0) as usize).min(samples);
    let strength = values.amplitude();
    let reference = values.reference(&signal);
    let at_edge = |list: Tensor<1>| {
        let edge = repeated(list, count) * reference.clone();
        let rest = values.constant(&vec![0.0; samples - count]);
        let all = if asked < 0.0 { vec![edge, rest] } else { vec![rest, edge] };
        Tensor::cat(all.into_iter().filter(|part| part.dims()[0] > 0).collect(), 0).reshape([1, 1, 1, samples])
    };
    signal.add(Complex::new(at_edge(strength.re), at_edge(strength.im)))
}
