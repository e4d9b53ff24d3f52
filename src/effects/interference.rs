//! Bursts from another radar (card I1).

use std::f64::consts::PI;

use burn::tensor::Tensor;
use rand::RngExt;

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, fixed, level},
    values::{Values, repeated},
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "interference";

/// What reports and docs say of `interference`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "I1",
    stage: Stage::Receiver,
    needs_person: false,
    title: "bursts from another radar",
    explanation: "Another radar's chirp crosses ours now and then: short bursts in single chirps, over all ranges.",
    equation: "+ (re + j im) reference e^{jπ (n − n_b)² / length} on samples first … first + length of a chirp",
    parameters: &[
        fixed("bursts", "per frame", 0.0, 0.0, 1000.0),
        fixed("frame", "frame", 0.0, 0.0, 1000000.0),
        fixed("chirp", "chirp of the frame", 0.0, 0.0, 1000000.0),
        fixed("first", "sample", 0.0, 0.0, 1000000.0),
        fixed("length", "samples", 16.0, 1.0, 1000000.0),
        level("level_db", "dB of the reference", -200.0, -120.0, 20.0),
        amplitude("re", "of the reference", 0.0, -10.0, 10.0),
        amplitude("im", "of the reference", 0.0, -10.0, 10.0),
        fixed("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    choice: Choice::None,
    look_alikes: &["impulsive_noise", "spur"],
    separate_by: "switch the other radar off, or transmit nothing: the bursts stay without our own signal",
    operator: Operator::Added(apply),
};

/// With the lists `frame`, `chirp`, `first` and `length`, the bursts that they name, `re` and `im` for each of them. With
/// `bursts` alone, as many in every frame, at random but the same whenever the frame is simulated. All receivers get
/// a burst alike: the other radar is taken to be on boresight.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let [tx, rx, loops, samples] = signal.dims();
    let bursts = bursts(values, context);
    if bursts.is_empty() {
        return signal;
    }
    let strength = values.amplitude();
    let reference = values.reference(&signal);
    let re = repeated(strength.re, bursts.len().max(1)) * reference.clone();
    let im = repeated(strength.im, bursts.len().max(1)) * reference;
    let mut signal = signal;
    for (index, burst) in bursts.iter().enumerate() {
        let Burst { chirp, first, length, listed } = *burst;
        let (own_tx, own_loop) = (chirp % tx, chirp / tx);
        let mut shape = (vec![0.0; tx * loops * samples], vec![0.0; tx * loops * samples]);
        for sample in first..(first + length).min(samples) {
            // Crosses the band once, from −f_s/2 to f_s/2, and is at rest in the burst's middle.
            let from_middle = sample as f64 - first as f64 - 0.5 * (length as f64 - 1.0);
            let (sin, cos) = (PI * from_middle * from_middle / length as f64).sin_cos();
            let at = (own_tx * loops + own_loop) * samples + sample;
            (shape.0[at], shape.1[at]) = (cos, sin);
        }
        let [re_shape, im_shape] = [shape.0, shape.1].map(|part| values.tensor(part, [tx, 1, loops, samples]));
        let from = listed.unwrap_or(index);
        let pick = |list: &Tensor<1>| list.clone().narrow(0, from.min(list.dims()[0] - 1), 1).reshape([1, 1, 1, 1]);
        let burst = Complex::new(re_shape, im_shape).mul(Complex::new(pick(&re), pick(&im)));
        let all = |part: Tensor<4>| part.expand([tx, rx, loops, samples]);
        signal = signal.add(Complex::new(all(burst.re), all(burst.im)));
    }
    signal
}

#[derive(Clone, Copy)]
struct Burst {
    chirp: usize,
    first: usize,
    length: usize,
    /// Its place in the lists.
    listed: Option<usize>,
}

/// The bursts of a frame.
fn bursts(values: &Values, context: &Context<'_>) -> Vec<Burst> {
    let radar = context.radar;
    let chirps = radar.tx_m.len() * radar.loops_per_frame;
    let samples = radar.samples_per_chirp;
    let whole = |name: &str| -> Vec<usize> { values.host(name).iter().map(|value| value.max(0.0).round() as usize).collect() };
    let (lengths, count) = (whole("length"), whole("bursts")[0]);
    if !values.has("chirp") {
        let mut random = context.random(0x1B57);
        let draw = |_| Burst {
            chirp: random.random_range(0..chirps),
            first: random.random_range(0..samples),
            length: lengths[0].max(1),
            listed: None,
        };
        return (0..count).map(draw).collect();
    }
    let (frames, chirp, first) = (whole("frame"), whole("chirp"), whole("first"));
    (0..chirp.len())
        .filter(|&index| frames[index % frames.len()] == context.frame && chirp[index] < chirps)
        .map(|index| Burst {
            chirp: chirp[index],
            first: first[index % first.len()],
            length: lengths[index % lengths.len()].max(1),
            listed: Some(index),
        })
        .collect()
}
