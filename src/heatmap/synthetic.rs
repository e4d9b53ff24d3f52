//! Points with known positions, for tests: the formats' signal law in f64, written out.

use num_complex::{Complex32, Complex64};

use crate::radar::{Radar, SPEED_OF_LIGHT, Sampling};

/// 77 GHz, two transmitters and four receivers on x half a wavelength apart, lengths that are no powers of two.
pub fn radar() -> Radar {
    let half = 0.5 * SPEED_OF_LIGHT / 79e9;
    Radar {
        start_frequency_hz: 77e9,
        slope_hz_per_s: 60e12,
        sample_rate_hz: 4e6,
        sampling: Sampling::Complex,
        samples_per_chirp: 100,
        loops_per_frame: 48,
        adc_start_s: 6e-6,
        chirp_period_s: 80e-6,
        frame_period_s: 0.05,
        frames: 1,
        position_m: [0.0; 3],
        tx_m: vec![[0.0; 3], [4.0 * half, 0.0, 0.0]],
        rx_m: (0..4).map(|rx| [rx as f64 * half, 0.0, 0.0]).collect(),
        full_scale_codes: None,
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}

/// `[frame, tx, rx, loop, sample]` of one point of amplitude 1, still within each chirp.
pub fn point(radar: &Radar, position_m: impl Fn(f64) -> [f64; 3]) -> Vec<Complex32> {
    let [frames, transmitters, receivers, loops, samples] = radar.dims();
    let mut signal = Vec::with_capacity(radar.dims().iter().product());
    for frame in 0..frames {
        for tx in 0..transmitters {
            for rx in 0..receivers {
                for index in 0..loops {
                    let position = position_m(radar.chirp_time_s(frame, tx, index));
                    let path_m = distance(radar.tx_position_m(tx), position) + distance(position, radar.rx_position_m(rx));
                    let delay = path_m / SPEED_OF_LIGHT;
                    for sample in 0..samples {
                        let time = sample as f64 / radar.sample_rate_hz;
                        let turns = (radar.carrier_hz() + radar.slope_hz_per_s * time) * delay;
                        let value = Complex64::from_polar(1.0, std::f64::consts::TAU * turns.fract());
                        let value = if radar.sampling == Sampling::Real { Complex64::new(value.re, 0.0) } else { value };
                        signal.push(Complex32::new(value.re as f32, value.im as f32));
                    }
                }
            }
        }
    }
    signal
}
