//! Which bins of a spectrum hold more than the side lobes of stronger bins.
//!
//! Under a Hann window a tone x bins away has the amplitude |sin πx / (πx (1 − x²))| of its peak (Harris, "On the use of windows for
//! harmonic analysis with the discrete Fourier transform", Proc. IEEE 66, 1978, section V). The strongest bin of a tone is at most half a
//! bin from it and has at least 8 / 3π of its peak. So d bins from the strongest one there is at most 3 / (8 x (x² − 1)) of that bin's
//! amplitude, x = d − ½, and of several tones at most the sum of what there is of each.

/// In a chirp of N samples N sin(πx / N) / π takes the place of x, so that up to a quarter of the band away there is (π/4 / sin π/4)³ times
/// as much at most.
const FINITE: f64 = 1.4;
/// Bins within which a tone is in its main lobe: half of the width of a Hann window's, four bins.
const MAIN_LOBE: usize = 2;

/// The most that is so many bins from the strongest bin of a tone, over the amplitude of that bin.
fn side_lobe(distance: usize) -> f64 {
    let x = distance as f64 - 0.5;
    FINITE * 3.0 / (8.0 * x * (x * x - 1.0))
}

/// Whether each bin of a spectrum of power stands out of the side lobes of stronger ones.
///
/// An exchange shows a tone also half the band away, and of words or real samples (`is_mirrored`) at frequencies of either sign: distances
/// are those to the nearest of these places.
pub(super) fn standing_out(power: &[f64], is_mirrored: bool) -> Vec<bool> {
    let half = (power.len() / 2).max(1);
    let around = |bins: usize| (bins % half).min(half - bins % half);
    let distance = |a: usize, b: usize| {
        let own = around(a.abs_diff(b));
        if is_mirrored { own.min(around(a + b)) } else { own }
    };
    let mut by_power: Vec<usize> = (0..power.len()).collect();
    by_power.sort_by(|&a, &b| power[b].total_cmp(&power[a]));
    let mut stands_out = vec![false; power.len()];
    // Peaks whose main lobes are apart, and their amplitudes.
    let mut peaks: Vec<(usize, f64)> = vec![];
    for bin in by_power {
        let amplitude = power[bin].sqrt();
        let away = |peak: usize| Some(distance(bin, peak)).filter(|&distance| distance >= MAIN_LOBE);
        let side_lobes: f64 = peaks.iter().filter_map(|&(peak, own)| Some(own * side_lobe(away(peak)?))).sum();
        if amplitude > side_lobes {
            stands_out[bin] = true;
            if peaks.iter().all(|&(peak, _)| away(peak).is_some()) {
                peaks.push((bin, amplitude));
            }
        }
    }
    stands_out
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::integrity::still::spectrum;

    const SAMPLES: usize = 128;

    /// Bins that stand out of tones of an amplitude at a frequency, in the upper half but for the bins beside 0, where the mean was.
    fn found(tones: &[(f64, f64)]) -> Vec<usize> {
        let tone = |n: usize, frequency: f64| std::f64::consts::TAU * frequency * n as f64 / SAMPLES as f64;
        let sample = |n: usize| tones.iter().map(|&(amplitude, at)| Complex64::from_polar(amplitude, tone(n, at))).sum();
        let chirp: Vec<Complex64> = (0..SAMPLES).map(sample).collect();
        let stands_out = standing_out(&spectrum([&chirp[..]].into_iter(), SAMPLES), false);
        (SAMPLES / 2..SAMPLES - 2).filter(|bin| stands_out[*bin]).collect()
    }

    #[test]
    fn a_tone_stands_out_in_its_main_lobe_alone_and_a_weaker_one_beside_it() {
        for at in [90.0, 90.3, 90.5] {
            assert_eq!(found(&[(1500.0, at)]), [89, 90, 91], "{at}");
            // 60 dB below, where the side lobes are 80 dB below.
            assert_eq!(found(&[(1500.0, at), (1.5, 110.0)]), [89, 90, 91, 109, 110, 111], "{at}");
        }
        assert_eq!(standing_out(&[0.0; 8], true), [false; 8]);
    }
}
