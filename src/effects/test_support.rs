//! A tiny radar, signals and values for the effects' tests.

use burn::tensor::{DType, Tensor};

use super::{Context, EffectSetting, Operator, Values, effect::Effect, info};
use crate::{
    complex::Complex,
    radar::{Radar, SPEED_OF_LIGHT},
    support::numbers,
};

pub(super) fn operator(id: &str) -> Operator {
    info(id).unwrap().operator
}

pub(super) fn radar() -> Radar {
    Radar {
        start_frequency_hz: 77e9,
        slope_hz_per_s: 60e12,
        sample_rate_hz: 4e6,
        sampling: Default::default(),
        samples_per_chirp: 16,
        loops_per_frame: 3,
        adc_start_s: 1e-6,
        chirp_period_s: 20e-6,
        frame_period_s: 0.1,
        frames: 5,
        position_m: [0.0, 0.0, 0.1],
        tx_m: vec![[0.0; 3], [0.004, 0.0, 0.0]],
        rx_m: vec![[0.01, 0.0, 0.0], [0.012, 0.0, 0.0]],
        full_scale_codes: None,
    }
}

pub(super) fn context(radar: &Radar) -> Context<'_> {
    Context { radar, frame: 2, farthest_m: 4.0 }
}

/// Values as in an f64 simulator.
pub(super) fn values(setting: &EffectSetting) -> Values {
    let device = burn::tensor::Device::flex();
    let mut values = Effect::new(setting, &device).values(&device, DType::F64);
    // From f64 numbers, not by way of the parameters' f32.
    for (name, list) in &setting.parameters {
        if values.tensors.contains_key(name) {
            let exact = values.constant(list);
            values.tensors.insert(name.clone(), exact);
        }
    }
    values
}

/// The same values with some of them replaced by tensors, on their device.
pub(super) fn values_of(setting: &EffectSetting, replaced: &[(&str, Tensor<1>)], like: &Tensor<1>) -> Values {
    let mut all = values(setting);
    all.device = like.device();
    for (name, list) in &setting.parameters {
        if all.tensors.contains_key(name) {
            let constant = all.constant(list);
            all.tensors.insert(name.clone(), constant);
        }
    }
    for (name, tensor) in replaced {
        assert!(info(&setting.id).unwrap().parameter(name).is_some());
        all.tensors.insert(name.to_string(), tensor.clone());
    }
    all
}

/// Echoes at ranges in `ranges_m`, the same in all channels and chirps but for their phases.
pub(super) fn echoes(radar: &Radar, ranges_m: &[f64]) -> Vec<f64> {
    let [_, tx, rx, loops, samples] = radar.dims();
    let count = tx * rx * loops * samples;
    let phases = numbers(3, tx * rx * loops * ranges_m.len(), 0.0, 1.0);
    let mut parts = vec![0.0; 2 * count];
    for channel in 0..tx * rx * loops {
        for (echo, range) in ranges_m.iter().enumerate() {
            for sample in 0..samples {
                let beat_hz = radar.slope_hz_per_s * 2.0 * range / SPEED_OF_LIGHT;
                let turns = beat_hz * sample as f64 / radar.sample_rate_hz + phases[channel * ranges_m.len() + echo];
                let (sin, cos) = (std::f64::consts::TAU * turns).sin_cos();
                parts[channel * samples + sample] += cos;
                parts[count + channel * samples + sample] += sin;
            }
        }
    }
    parts
}

/// `[2 · count]`, the real parts first, as a signal of the radar.
pub(super) fn signal(parts: Tensor<1>, radar: &Radar) -> Complex<4> {
    let [_, tx, rx, loops, samples] = radar.dims();
    let count = tx * rx * loops * samples;
    let part = |from: usize| parts.clone().narrow(0, from, count).reshape([tx, rx, loops, samples]);
    Complex::new(part(0), part(count))
}

pub(super) fn flat<const D: usize>(signal: Complex<D>) -> Tensor<1> {
    let count: usize = signal.dims().iter().product();
    Tensor::cat(vec![signal.re.reshape([count]), signal.im.reshape([count])], 0)
}
