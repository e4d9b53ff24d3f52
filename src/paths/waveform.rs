//! What a chirp makes of a path's length: phase and sweep.

use std::ops::Range;

use burn::tensor::{Tensor, TensorData};
use serde::{Deserialize, Serialize};

use super::{Leg, Phasors, column};
use crate::radar::{Radar, SPEED_OF_LIGHT};

/// Added to the product of the legs' lengths, m²: a point on an antenna is strong, not infinite.
pub(crate) const NEAR_FIELD_M2: f64 = 1e-8;

/// Which terms of the mixer's phase are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Dechirp {
    /// With the residual video phase −S τ²/2 and the motion within a chirp.
    #[default]
    Exact,
    /// Without them, as the paper's eq. 2 and 3 (strict parity).
    Paper,
}

/// Linear amplitude of the scatterers before spreading, `[point, chirp]` or `[point, 1]`; may be complex.
#[derive(Clone, Debug)]
pub struct Amplitude {
    /// Real part.
    pub re: Tensor<2>,
    /// Imaginary part; none where it is zero.
    pub im: Option<Tensor<2>>,
}

impl Amplitude {
    /// An amplitude without an imaginary part, `[point, chirp]` or `[point, 1]`.
    pub fn real(re: Tensor<2>) -> Self {
        Self { re, im: None }
    }

    /// Of some of the points.
    pub fn rows(&self, rows: Range<usize>) -> Self {
        let rows = |part: &Tensor<2>| part.clone().slice_dim(0, rows.clone());
        Self { re: rows(&self.re), im: self.im.as_ref().map(rows) }
    }
}

/// The chirp's constants. Times count from the start of the sampling window; positions are those at its middle,
/// which is where the phase is taken.
#[derive(Clone, Copy, Debug)]
pub struct Waveform {
    /// Frequency at the middle of the window.
    middle_hz: f64,
    bandwidth_hz: f64,
    slope_hz_per_s: f64,
    window_s: f64,
    loop_period_s: f64,
    dechirp: Dechirp,
    /// Delay that the path has beyond these legs; only the residual video phase needs to know it here.
    onward_s: f64,
}

impl Waveform {
    /// The constants of a radar's chirp, for paths that end at a receiver.
    pub fn new(radar: &Radar, dechirp: Dechirp) -> Self {
        Self {
            middle_hz: radar.carrier_hz() + 0.5 * radar.bandwidth_hz(),
            bandwidth_hz: radar.bandwidth_hz(),
            slope_hz_per_s: radar.slope_hz_per_s,
            window_s: radar.samples_per_chirp as f64 / radar.sample_rate_hz,
            loop_period_s: radar.loop_period_s(),
            dechirp,
            onward_s: 0.0,
        }
    }

    /// The same for legs after which the path goes on for `delay_s`, which [`Self::static_turns`] adds later.
    pub fn with_onward(self, delay_s: f64) -> Self {
        Self { onward_s: delay_s, ..self }
    }

    /// Sum of the legs → phasors.
    ///
    /// phase = f_mid τ − S τ²/2, sweep = B τ + f_mid τ̇ T, amplitude divided by the product of the legs' lengths
    /// (eq. 2 and 3). τ̇ comes from central differences along the chirps. Left out: the curvature S τ̇ T² s² of a
    /// moving point's phase within a chirp, −57 dB at 2 m/s for a 60 MHz/µs chirp of 58 µs.
    ///
    /// # Shapes
    /// legs and amplitude `[point, chirp]` (the amplitude may be `[point, 1]`); result `[point, chirp]`.
    ///
    /// # Gradient
    /// Flows to the amplitude and the legs. Smooth, also for a point on an antenna.
    pub fn phasors(&self, legs: &[&Leg], amplitude: &Amplitude) -> Phasors {
        let (first, rest) = legs.split_first().expect("a path has at least one leg");
        let (device, dtype) = (first.change_m.device(), first.change_m.dtype());
        let mut change = first.change_m.clone();
        let mut reference_m = first.reference_m.clone();
        let mut product = first.length_m();
        for leg in rest {
            change = change + leg.change_m.clone();
            product = product * leg.length_m();
            reference_m.iter_mut().zip(&leg.reference_m).for_each(|(sum, length)| *sum += length);
        }
        let spreading = product + NEAR_FIELD_M2;

        let at_rest: Vec<AtRest> = reference_m.iter().map(|&length| self.at_rest(length)).collect();
        let to_column = |of: fn(&AtRest) -> f64| column(at_rest.iter().map(of), &device, dtype);
        let phase = to_column(|point| point.phase_turns);
        let sweep = to_column(|point| point.sweep_turns);
        let phase_turns = match self.dechirp {
            Dechirp::Paper => change.clone() * (self.middle_hz / SPEED_OF_LIGHT) + phase,
            Dechirp::Exact => change.clone() * to_column(|point| point.turns_per_metre) + phase,
        };
        let sweep_turns = self.sweep_change(change) + sweep;
        Phasors {
            amplitude: amplitude.re.clone() / spreading.clone(),
            amplitude_im: amplitude.im.clone().map(|im| im / spreading),
            phase_turns,
            sweep_turns,
        }
    }

    /// Phase at the middle of the window of a path at rest whose delay continues the legs' by `delay_s` (in turns,
    /// −½ … ½), and its sweep. The cross term of the residual video phase with the legs is in the legs' phasors.
    pub fn static_turns(&self, delay_s: f64) -> (f64, f64) {
        let residual = match self.dechirp {
            Dechirp::Paper => 0.0,
            // −S/2 ((τ+d)² − (τ+d₀)²) with the legs' τ, which is under a metre's delay beside d − d₀, left out.
            Dechirp::Exact => 0.5 * self.slope_hz_per_s * (delay_s * delay_s - self.onward_s * self.onward_s),
        };
        (fraction(self.middle_hz * delay_s - residual), self.bandwidth_hz * delay_s)
    }

    /// A path of the given length at rest, and how its phase follows the length.
    pub(crate) fn at_rest(&self, length_m: f64) -> AtRest {
        let delay_s = length_m / SPEED_OF_LIGHT;
        let (residual, lowered_hz) = match self.dechirp {
            Dechirp::Paper => (0.0, 0.0),
            Dechirp::Exact => {
                let whole_s = delay_s + self.onward_s;
                (0.5 * self.slope_hz_per_s * whole_s * whole_s, self.slope_hz_per_s * whole_s)
            }
        };
        AtRest {
            phase_turns: fraction(self.middle_hz * delay_s - residual),
            sweep_turns: self.bandwidth_hz * delay_s,
            turns_per_metre: (self.middle_hz - lowered_hz) / SPEED_OF_LIGHT,
        }
    }

    /// Growth of the sweep with the path's change, turns per metre (B/c), and with its difference from chirp to chirp
    /// (f_mid T/c over the chirps' spacing; zero where motion within a chirp is left out).
    pub(crate) fn sweep_factors(&self) -> (f64, f64) {
        let per_step = match self.dechirp {
            Dechirp::Paper => 0.0,
            Dechirp::Exact => self.middle_hz * self.window_s / SPEED_OF_LIGHT / self.loop_period_s,
        };
        (self.bandwidth_hz / SPEED_OF_LIGHT, per_step)
    }

    /// B/c·Δ + f_mid T/c·dΔ/dt as one product with a `[chirp, chirp]` matrix.
    fn sweep_change(&self, change: Tensor<2>) -> Tensor<2> {
        let [_, chirps] = change.dims();
        let (per_metre, per_step) = self.sweep_factors();
        if chirps == 1 || per_step == 0.0 {
            return change * per_metre;
        }
        let mut matrix = vec![0.0; chirps * chirps];
        for chirp in 0..chirps {
            matrix[chirp * chirps + chirp] += per_metre;
            for (from, weight) in difference(chirp, chirps) {
                matrix[from * chirps + chirp] += per_step * weight;
            }
        }
        let (device, dtype) = (change.device(), change.dtype());
        let matrix = TensorData::new(matrix, [chirps, chirps]).convert_dtype(dtype);
        change.matmul(Tensor::from_data(matrix, (&device, dtype)))
    }
}

/// What a path's length at the reference positions makes of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AtRest {
    /// At the middle of the window, −½ … ½.
    pub phase_turns: f64,
    pub sweep_turns: f64,
    /// Of the phase, with the length.
    pub turns_per_metre: f64,
}

/// Sum of the legs → phasors, for a path that ends after them. See [`Waveform::phasors`].
pub fn phasors(legs: &[&Leg], amplitude: &Amplitude, radar: &Radar, dechirp: Dechirp) -> Phasors {
    Waveform::new(radar, dechirp).phasors(legs, amplitude)
}

/// Central difference at a chirp as (chirp, weight) pairs; of second order at both ends too, zero for a single chirp.
pub(crate) fn difference(chirp: usize, chirps: usize) -> [(usize, f64); 3] {
    let last = chirps - 1;
    match (chirp, chirps) {
        (_, 1) => [(0, 0.0); 3],
        (_, 2) => [(0, -1.0), (1, 1.0), (0, 0.0)],
        (0, _) => [(0, -1.5), (1, 2.0), (2, -0.5)],
        _ if chirp == last => [(last, 1.5), (last - 1, -2.0), (last - 2, 0.5)],
        _ => [(chirp - 1, -0.5), (chirp + 1, 0.5), (chirp, 0.0)],
    }
}

/// Turns without their whole part, −½ … ½.
fn fraction(turns: f64) -> f64 {
    turns - turns.round()
}
