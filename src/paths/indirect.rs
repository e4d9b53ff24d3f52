//! Transmitter → scatterer → wall's receiver → receiver (paper, eq. 3).
//!
//! The last leg does not depend on the scatterer. So the scatterers are summed once at the wall's receiver, and the sum
//! is then delayed to every antenna: a static delay is a phase that is linear in the sample.

use burn::tensor::{Tensor, TensorData};

use super::{Dechirp, Motion, Phasors, Points, Waveform, distance};
use crate::complex::Complex;
use crate::radar::{Radar, SPEED_OF_LIGHT};

/// A wall's receiver, and the static last leg from there to every antenna.
#[derive(Clone, Debug)]
pub struct WallReceiver {
    position_m: [f64; 3],
    /// For the legs before the last one.
    waveform: Waveform,
    /// `[rx]`
    onward_m: Vec<f64>,
}

impl WallReceiver {
    /// `position_m`: metres, radar frame.
    pub fn new(position_m: [f64; 3], radar: &Radar, dechirp: Dechirp) -> Self {
        let onward_m: Vec<f64> = (0..radar.rx_m.len()).map(|rx| distance(position_m, radar.rx_position_m(rx))).collect();
        let mean_s = onward_m.iter().sum::<f64>() / onward_m.len() as f64 / SPEED_OF_LIGHT;
        Self { position_m, waveform: Waveform::new(radar, dechirp).with_onward(mean_s), onward_m }
    }

    /// Where the wall's receiver is, radar frame.
    pub fn position_m(&self) -> [f64; 3] {
        self.position_m
    }

    /// The chirp for the legs before the last one.
    pub fn waveform(&self) -> &Waveform {
        &self.waveform
    }

    /// What arrives from one transmitter by way of points, `[point, chirp]`. The amplitude is that towards this receiver.
    pub fn phasors(&self, points: Points, radar: &Radar, tx: usize) -> Phasors {
        let motion = Motion::new(points.reference_m, points.displacement);
        let (from_tx, to_wall) = (motion.leg(radar.tx_position_m(tx)), motion.leg(self.position_m));
        self.waveform.phasors(&[&from_tx, &to_wall], points.amplitude)
    }

    /// What arrives, `[chirp, sample]`, delayed and spread over the last leg to every antenna, `[rx, chirp, sample]`. Exact but for the
    /// residual video phase's cross term with the antenna's distance from the array's mean: 10⁻⁴ turns for one centimetre.
    pub fn onward(&self, arriving: Complex<2>) -> Complex<3> {
        let [chirps, samples] = arriving.dims();
        let (device, dtype) = (arriving.device(), arriving.re.dtype());
        let (mut re, mut im) = (vec![], vec![]);
        for &length_m in &self.onward_m {
            let (phase, sweep) = self.waveform.static_turns(length_m / SPEED_OF_LIGHT);
            let gain = 1.0 / length_m.max(1e-3);
            for sample in 0..samples {
                let s = (sample as f64 - 0.5 * samples as f64) / samples as f64;
                let (sin, cos) = (std::f64::consts::TAU * (phase + sweep * s)).sin_cos();
                re.push(gain * cos);
                im.push(gain * sin);
            }
        }
        let rows = |values: Vec<f64>| -> Tensor<3> {
            let data = TensorData::new(values, [self.onward_m.len(), 1, samples]).convert_dtype(dtype);
            Tensor::from_data(data, (&device, dtype))
        };
        arriving.reshape([1, chirps, samples]).mul(Complex::new(rows(re), rows(im)))
    }
}
