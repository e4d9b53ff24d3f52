//! Slow-time fields taken out of the samples again.

use num_complex::Complex64;
use rustfft::FftPlanner;

use crate::diagnosis::cube::Cube;
use crate::radar::Radar;

/// Divides every chirp by a gain, of which `gain` knows frame, transmitter and loop.
pub fn gain(cube: &mut Cube, gain: impl Fn([usize; 3]) -> Complex64 + Sync) {
    let rx = cube.dims[2];
    cube.each_chirp(|[frame, channel, index], samples| {
        let inverse = gain([frame, channel / rx, index]).inv();
        samples.iter_mut().for_each(|value| *value *= inverse);
    });
}

/// Undoes a phase of `slope` radians per second of delay in every chirp: each beat frequency is turned by its own delay.
pub fn delay_phase(cube: &mut Cube, radar: &Radar, slope: impl Fn([usize; 3]) -> f64 + Sync) {
    let (rx, count) = (cube.dims[2], cube.dims[4]);
    let mut planner = FftPlanner::new();
    let (forward, inverse) = (planner.plan_fft_forward(count), planner.plan_fft_inverse(count));
    let delay_of_bin = radar.sample_rate_hz / (count as f64 * radar.slope_hz_per_s);
    cube.each_chirp(|[frame, channel, index], samples| {
        let step = slope([frame, channel / rx, index]) * delay_of_bin;
        forward.process(samples);
        for (bin, value) in samples.iter_mut().enumerate() {
            // The last eighth is what leaks below zero frequency.
            let delay = if bin >= count - count / 8 { bin as f64 - count as f64 } else { bin as f64 };
            *value *= Complex64::cis(-step * delay) / count as f64;
        }
        inverse.process(samples);
    });
}
