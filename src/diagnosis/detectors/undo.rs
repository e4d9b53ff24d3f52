//! Slow-time fields taken out of the samples again.

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;

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

/// Delay of every beat frequency of a chirp of so many samples.
pub fn delays_s(radar: &Radar, count: usize) -> impl Iterator<Item = f64> {
    let delay_of_bin = radar.sample_rate_hz / (count as f64 * radar.slope_hz_per_s);
    // The last eighth is what leaks below zero frequency.
    let bins = (0..count).map(move |bin| if bin >= count - count / 8 { bin as f64 - count as f64 } else { bin as f64 });
    bins.map(move |bin| bin * delay_of_bin)
}

/// Undoes a phase in every chirp: each beat frequency is turned by `amount` (of frame, channel and loop) times the lever that its delay
/// has.
pub fn delay_phase(cube: &mut Cube, radar: &Radar, lever: impl Fn(f64) -> f64, amount: impl Fn([usize; 3]) -> f64 + Sync) {
    let count = cube.dims[4];
    let mut planner = FftPlanner::new();
    let (forward, inverse) = (planner.plan_fft_forward(count), planner.plan_fft_inverse(count));
    let levers: Vec<f64> = delays_s(radar, count).map(lever).collect();
    cube.each_chirp(|chirp, samples| {
        let amount = amount(chirp);
        forward.process(samples);
        for (value, lever) in samples.iter_mut().zip(&levers) {
            *value *= Complex64::cis(-amount * lever) / count as f64;
        }
        inverse.process(samples);
    });
}
