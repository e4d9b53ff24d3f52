//! How often each low bit of the converter's codes is set, before anything is undone in the samples.

use num_complex::Complex64;
use rayon::prelude::*;

use super::cube::{Cube, Split};

/// Counts for one channel and component.
#[derive(Clone, Debug)]
pub struct Component {
    /// Transmitter · receivers + receiver.
    pub channel: usize,
    /// Whether it is the imaginary one.
    pub imaginary: bool,
    /// Deviation of the codes from their mean.
    pub deviation: f64,
    /// Of the training and of the held-out frames.
    pub counts: [Counts; 2],
}

/// Clipped codes do not count.
#[derive(Clone, Debug)]
pub struct Counts {
    /// `[bit, sample]`
    pub ones: Vec<u32>,
    /// `[sample]`
    pub all: Vec<u32>,
}

/// Bits that are counted.
pub const BITS: usize = 12;
/// A code is a whole number to this accuracy: making real samples analytic rounds.
const WHOLE: f64 = 1e-3;

/// None where the samples are no whole numbers; a real recording has one component.
pub fn count(cube: &Cube, split: &Split, extremes: [f64; 2]) -> Option<Vec<Component>> {
    let part = |value: &Complex64, imaginary: bool| if imaginary { value.im } else { value.re };
    let whole =
        |imaginary: bool| cube.samples.par_iter().all(|v| (part(v, imaginary) - part(v, imaginary).round()).abs() < WHOLE);
    if extremes.iter().any(|v| !v.is_finite() || v.abs() > 1e9) || !whole(false) {
        return None;
    }
    let components: &[bool] = if whole(true) { &[false, true] } else { &[false] };
    let wanted: Vec<(usize, bool)> = (0..cube.channels()).flat_map(|c| components.iter().map(move |&i| (c, i))).collect();
    let of = |&(channel, imaginary): &(usize, bool)| -> Component {
        let values = |frame: usize| cube.channel(frame, channel).iter().map(move |v| part(v, imaginary));
        let (mut count, mut sum, mut square) = (0.0, 0.0, 0.0);
        for value in split.training.iter().flat_map(|&frame| values(frame)) {
            (count, sum, square) = (count + 1.0, sum + value, square + value * value);
        }
        let count = f64::max(count, 1.0);
        let deviation = (square / count - (sum / count).powi(2)).max(0.0).sqrt();
        let counts = [&split.training, &split.held_out].map(|frames| {
            let samples = cube.dims[4];
            let (mut ones, mut all) = (vec![0; BITS * samples], vec![0; samples]);
            for (i, value) in frames.iter().flat_map(|&frame| values(frame).enumerate()) {
                if value <= extremes[0] || value >= extremes[1] {
                    continue;
                }
                let (sample, code) = (i % samples, value.round() as i64);
                all[sample] += 1;
                for bit in 0..BITS {
                    ones[bit * samples + sample] += u32::from(code >> bit & 1 == 1);
                }
            }
            Counts { ones, all }
        });
        Component { channel, imaginary, deviation, counts }
    };
    Some(wanted.par_iter().map(of).collect())
}

impl Counts {
    /// Ones and all codes over the whole chirp.
    pub fn total(&self, bit: usize) -> [f64; 2] {
        let samples = self.all.len();
        let sum = |values: &[u32]| values.iter().map(|&v| f64::from(v)).sum();
        [sum(&self.ones[bit * samples..][..samples]), sum(&self.all)]
    }
}
