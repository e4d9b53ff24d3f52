//! A region of ranges and Doppler frequencies, and what moves in it taken out of the samples.

use num_complex::Complex64;
use rayon::prelude::*;

use crate::diagnosis::cube::Cube;

/// Bins (not whole numbers, ends included) that may be negative: an interval around the zero frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    pub range: [f64; 2],
    pub doppler: [f64; 2],
}

/// Bins beyond an interval's ends that its tones may leak into.
const MARGIN: f64 = 0.5;

/// Orthonormal basis, `[vector][sample]`, of all tones whose frequency lies in an interval of bins.
fn tones(length: usize, [low, high]: [f64; 2]) -> Vec<Vec<Complex64>> {
    let (low, high) = (low - MARGIN, high + MARGIN);
    let count = (((high - low) / 0.5).ceil() as usize + 1).min(2 * length);
    let mut basis: Vec<Vec<Complex64>> = vec![];
    for i in 0..count {
        let bin = low + (high - low) * i as f64 / (count - 1).max(1) as f64;
        let mut tone: Vec<Complex64> = (0..length)
            .map(|n| Complex64::cis(std::f64::consts::TAU * bin * n as f64 / length as f64) / (length as f64).sqrt())
            .collect();
        // Gram–Schmidt, twice for accuracy.
        for _ in 0..2 {
            for known in &basis {
                let share: Complex64 = known.iter().zip(&tone).map(|(k, t)| k.conj() * t).sum();
                tone.iter_mut().zip(known).for_each(|(t, k)| *t -= share * k);
            }
        }
        let norm = tone.iter().map(|t| t.norm_sqr()).sum::<f64>().sqrt();
        // Tones that the others contain already.
        if norm > 1e-3 {
            tone.iter_mut().for_each(|t| *t /= norm);
            basis.push(tone);
        }
    }
    basis
}

/// Subtracts from every frame what deviates from `still` (`[channel, sample]`) within the regions.
pub fn remove(cube: &mut Cube, still: &[Complex64], regions: &[Region]) {
    let [_, _, _, loops, samples] = cube.dims;
    let channels = cube.channels();
    for region in regions {
        let (fast, slow) = (tones(samples, region.range), tones(loops, region.doppler));
        let block = loops * samples;
        cube.samples.par_chunks_exact_mut(block).enumerate().for_each(|(chunk, values)| {
            let mean = &still[chunk % channels * samples..][..samples];
            // `[loop][fast tone]`
            let along: Vec<Vec<Complex64>> = values
                .chunks_exact(samples)
                .map(|chirp| {
                    fast.iter().map(|tone| chirp.iter().zip(mean).zip(tone).map(|((v, m), t)| (v - m) * t.conj()).sum()).collect()
                })
                .collect();
            for s in &slow {
                let shares: Vec<Complex64> =
                    (0..fast.len()).map(|i| along.iter().zip(s).map(|(a, s)| a[i] * s.conj()).sum()).collect();
                for (chirp, s) in values.chunks_exact_mut(samples).zip(s) {
                    for (tone, share) in fast.iter().zip(&shares) {
                        let factor = share * s;
                        chirp.iter_mut().zip(tone).for_each(|(v, t)| *v -= factor * t);
                    }
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tone_inside_goes_and_one_outside_stays() {
        let (loops, samples) = (16, 64);
        let tone = |range: f64, doppler: f64| -> Vec<Complex64> {
            (0..loops * samples)
                .map(|i| {
                    let turns = range * (i % samples) as f64 / samples as f64 + doppler * (i / samples) as f64 / loops as f64;
                    Complex64::cis(std::f64::consts::TAU * turns)
                })
                .collect()
        };
        let region = Region { range: [9.0, 12.0], doppler: [-4.0, -2.0] };
        let left = |range: f64, doppler: f64| {
            let mut cube = Cube::new([1, 1, 1, loops, samples], tone(range, doppler));
            remove(&mut cube, &vec![Complex64::ZERO; samples], &[region]);
            cube.samples.iter().map(|v| v.norm_sqr()).sum::<f64>() / (loops * samples) as f64
        };
        assert!(left(10.37, -2.81) < 1e-4, "{}", left(10.37, -2.81));
        // The basis holds tones between bins, whose side lobes reach far.
        assert!(left(30.0, -3.0) > 0.97, "{}", left(30.0, -3.0));
        assert!(left(10.0, 5.0) > 0.9, "{}", left(10.0, 5.0));
    }
}
