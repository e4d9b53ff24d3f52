//! A spur (card R12).

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, fixed, level, shaping},
    points::host_value,
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "spur";

/// What reports and docs say of `spur`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "R12",
    stage: Stage::Receiver,
    needs_person: false,
    title: "a spur",
    explanation: "A clock's tone reaches the receiver: a line at one beat frequency that has no echo behind it.",
    equation: "+ (10^{level_db/20} + re + j im) reference exp(j2π frequency_hz T)",
    parameters: &[
        shaping("frequency_hz", "Hz", 0.0, -100000000.0, 100000000.0),
        level("level_db", "dB of the reference", -200.0, -120.0, 20.0),
        amplitude("re", "of the reference", 0.0, -10.0, 10.0),
        amplitude("im", "of the reference", 0.0, -10.0, 10.0),
        fixed("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    choice: Choice::None,
    look_alikes: &["static_reflector"],
    separate_by: "transmit nothing: the spur stays",
    operator: Operator::Added(apply),
};

/// A tone that runs on between chirps, T being the radar's time. `re` and `im` are for each channel, each receiver, or all.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let radar = context.radar;
    let frequency_hz = values.first("frequency_hz");
    // Thousands of turns on the host in f64; on the device, the small change with the learned frequency.
    let start_hz = host_value(&frequency_hz);
    let (tx, loops, samples) = (radar.tx_m.len(), radar.loops_per_frame, radar.samples_per_chirp);
    let times: Vec<f64> =
        context.ramp_times_s().iter().flat_map(|ramp| (0..samples).map(move |n| ramp + radar.sample_time_s(n))).collect();
    let dims = [tx, 1, loops, samples];
    let turns = values.tensor(times.iter().map(|time| (start_hz * time).fract()).collect(), dims);
    let change = (frequency_hz.clone() - frequency_hz.detach()).reshape([1, 1, 1, 1]);
    let turns = turns + values.tensor(times, dims) * change;
    let strength = values.amplitude();
    let reference = values.reference(&signal).reshape([1, 1, 1, 1]);
    let re = values.channels(strength.re, context.channels()) * reference.clone();
    let im = values.channels(strength.im, context.channels()) * reference;
    signal.add(Complex::unit(turns).mul(Complex::new(re, im)))
}
