//! The responses of the library that the intermediate frequency may have, and their action on a chirp.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::diagnosis::finding::Estimate;
use crate::effects;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// `wrapped`: beat frequencies above half the sample rate count as negative.
    Highpass {
        order: i32,
        from_rest: bool,
        wrapped: bool,
    },
    Lowpass {
        wrapped: bool,
    },
    Delay {
        wrapped: bool,
    },
}

impl Shape {
    pub fn id(self) -> &'static str {
        match self {
            Self::Highpass { .. } => effects::if_highpass::ID,
            Self::Lowpass { .. } => effects::if_lowpass::ID,
            Self::Delay { .. } => effects::if_delay::ID,
        }
    }

    /// Response over the DFT's bins; `value` in hertz, or seconds for a delay.
    pub fn response(self, value: f64, samples: usize, rate: f64) -> Vec<Complex64> {
        let one = Complex64::ONE;
        let hertz = |bin: usize, wrapped: bool| {
            let bin = if wrapped && 2 * bin >= samples { bin as f64 - samples as f64 } else { bin as f64 };
            bin * rate / samples as f64
        };
        (0..samples)
            .map(|bin| match self {
                Self::Highpass { order, wrapped, .. } => {
                    let ratio = Complex64::I * (hertz(bin, wrapped) / value);
                    (ratio / (one + ratio)).powi(order)
                }
                Self::Lowpass { wrapped } => one / (one + Complex64::I * (hertz(bin, wrapped) / value)),
                Self::Delay { wrapped } => Complex64::cis(-TAU * hertz(bin, wrapped) * value),
            })
            .collect()
    }

    pub fn grid(self, samples: usize, rate: f64) -> Vec<f64> {
        let geometric = |low: f64, high: f64, count: usize| {
            (0..count).map(move |i| low * (high / low).powf(i as f64 / (count as f64 - 1.0))).collect::<Vec<_>>()
        };
        match self {
            Self::Highpass { .. } => geometric(0.4 * rate / samples as f64, 0.25 * rate, 9),
            Self::Lowpass { .. } => geometric(0.15 * rate, 20.0 * rate, 6),
            Self::Delay { .. } => (-4..=4).filter(|&i| i != 0).map(|i| 0.4 * f64::from(i) / rate).collect(),
        }
    }

    /// Its numbers, with the error of the value, and what is said of it.
    pub fn described(self, value: f64, error: f64) -> (Vec<Estimate>, String) {
        match self {
            Self::Highpass { order, from_rest, .. } => (
                vec![
                    Estimate::normal("corner_hz", value, error),
                    Estimate { name: "order", values: vec![order.into()], ci90: vec![[f64::from(order), f64::from(order)]] },
                ],
                format!(
                    "the receiver attenuates low beat frequencies and turns their phase: a high-pass filter of order {order} with its \
                     corner at {:.0} kHz{}; near ranges appear too weak",
                    value * 1e-3,
                    if from_rest { ", which starts from rest in each chirp and leaves a transient" } else { "" }
                ),
            ),
            Self::Lowpass { .. } => (
                vec![Estimate::normal("corner_hz", value, error)],
                format!(
                    "the receiver weakens and delays high beat frequencies: a low-pass filter with its corner at {:.2} MHz",
                    value * 1e-6
                ),
            ),
            Self::Delay { .. } => (
                vec![Estimate::normal("delay_s", value, error)],
                format!("the intermediate frequency reaches the converter {:.1} ns late", value * 1e9),
            ),
        }
    }
}

pub const SHAPES: [Shape; 13] = [
    Shape::Highpass { order: 1, from_rest: false, wrapped: true },
    Shape::Highpass { order: 2, from_rest: false, wrapped: true },
    Shape::Highpass { order: 3, from_rest: false, wrapped: true },
    Shape::Highpass { order: 1, from_rest: false, wrapped: false },
    Shape::Highpass { order: 2, from_rest: false, wrapped: false },
    Shape::Highpass { order: 3, from_rest: false, wrapped: false },
    Shape::Highpass { order: 1, from_rest: true, wrapped: true },
    Shape::Highpass { order: 2, from_rest: true, wrapped: true },
    Shape::Highpass { order: 3, from_rest: true, wrapped: true },
    Shape::Lowpass { wrapped: true },
    Shape::Lowpass { wrapped: false },
    Shape::Delay { wrapped: true },
    Shape::Delay { wrapped: false },
];

/// A transient of a filter that starts from rest.
pub fn decay(turns_per_sample: f64, power: i32, samples: usize, amplitude: f64) -> Vec<Complex64> {
    (0..samples)
        .map(|n| {
            let turns = turns_per_sample * n as f64;
            Complex64::from(amplitude * (TAU * turns).powi(power) * (-TAU * turns).exp())
        })
        .collect()
}
