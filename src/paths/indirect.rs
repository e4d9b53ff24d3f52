//! Transmitter → scatterer → wall's receiver → receiver (paper, eq. 3).
//!
//! The last leg does not depend on the scatterer. So the scatterers are summed once at the wall's receiver, and the sum
//! is then delayed to every antenna: a static delay is a phase that is linear in the sample.

use burn::tensor::{Tensor, TensorData};

use super::{Dechirp, Motion, Phasors, Points, Waveform, distance};
use crate::complex::Complex;
use crate::radar::{Radar, SPEED_OF_LIGHT};

/// The paths of one transmitter by way of one wall receiver.
#[derive(Clone, Debug)]
pub struct IndirectPaths {
    /// As they arrive at the wall's receiver, `[point, chirp]`.
    pub at_wall: Phasors,
    /// From there to each antenna, `[rx]`.
    pub onward: Vec<Onward>,
}

impl IndirectPaths {
    /// `proxy_m`: position of the wall's receiver, metres, radar frame. The amplitude is that towards it.
    pub fn new(points: Points, proxy_m: [f64; 3], radar: &Radar, tx: usize, dechirp: Dechirp) -> Self {
        let (waveform, onward) = onward(proxy_m, radar, dechirp);
        let motion = Motion::new(points.reference_m, points.displacement);
        let (from_tx, to_wall) = (motion.leg(radar.tx_position_m(tx)), motion.leg(proxy_m));
        let at_wall = waveform.phasors(&[&from_tx, &to_wall], points.amplitude);
        Self { at_wall, onward }
    }
}

/// The last legs `[rx]` from a wall's receiver, and the waveform for the legs before them.
pub(crate) fn onward(proxy_m: [f64; 3], radar: &Radar, dechirp: Dechirp) -> (Waveform, Vec<Onward>) {
    let lengths_m: Vec<f64> = (0..radar.rx_m.len()).map(|rx| distance(proxy_m, radar.rx_position_m(rx))).collect();
    let mean_s = lengths_m.iter().sum::<f64>() / lengths_m.len() as f64 / SPEED_OF_LIGHT;
    let waveform = Waveform::new(radar, dechirp).with_onward(mean_s);
    (waveform, lengths_m.into_iter().map(|length_m| Onward { waveform, length_m }).collect())
}

/// The static last leg.
#[derive(Clone, Copy, Debug)]
pub struct Onward {
    waveform: Waveform,
    length_m: f64,
}

impl Onward {
    /// The sum at the wall, `[chirp, sample]`, delayed and spread over the last leg. Exact but for the residual
    /// video phase's cross term with the receiver's distance from the array's mean: 10⁻⁴ turns for one centimetre.
    pub fn apply(&self, at_wall: Complex<2>) -> Complex<2> {
        let [_, samples] = at_wall.dims();
        let (device, dtype) = (at_wall.device(), at_wall.re.dtype());
        let (phase, sweep) = self.waveform.static_turns(self.length_m / SPEED_OF_LIGHT);
        let gain = 1.0 / self.length_m.max(1e-3);
        let (im, re): (Vec<f64>, Vec<f64>) = (0..samples)
            .map(|sample| {
                let s = (sample as f64 - 0.5 * samples as f64) / samples as f64;
                let (sin, cos) = (std::f64::consts::TAU * (phase + sweep * s)).sin_cos();
                (gain * sin, gain * cos)
            })
            .unzip();
        let row = |values: Vec<f64>| -> Tensor<2> {
            Tensor::from_data(TensorData::new(values, [1, samples]).convert_dtype(dtype), (&device, dtype))
        };
        at_wall.mul(Complex::new(row(re), row(im)))
    }
}
