//! How strong a planted effect came out, measured against the same recording without it.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::rules::MASKED_DB;
use super::surviving::{self, Draw, Frames};
use crate::data::IfFrame;
use crate::diagnosis::evidence::transform;
use crate::diagnosis::statistics::exponential_scale;

/// Of one case; energies are sums over all samples of |difference|², less what a common complex gain explains, because
/// gain and phase of a recording are unknown to everybody.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Strength {
    /// Energy of the effect over the noise's, dB.
    pub effect_to_noise_db: f64,
    /// Energy of the effect over that of what moves in the recording without it, dB.
    pub effect_to_moving_db: f64,
    /// √(2 energy / variance of a complex sample's noise): what an observer who knows everything but the effect sees.
    pub d_prime: f64,
    /// The same for the held-out frames alone.
    pub d_prime_held_out: f64,
    /// What is left of it for sure when neither the body's phases nor the room's amplitudes are known (capacity level E).
    pub d_prime_surviving: f64,
    /// Nine tenths of the effect's energy lie in range-Doppler cells whose return is stronger by at least this, dB.
    pub below_cover_db: f64,
    /// Of the recording with the effect over the one without, which the receiver scaled on its own.
    pub gain_db: f64,
}

/// Decibels that stand for nothing at all, so that JSON needs no infinity.
const NOTHING_DB: f64 = -200.0;
/// A return is what stands out of the noise by this factor.
const RETURN_OVER_NOISE: f64 = 10.0;

impl Strength {
    /// Whether stronger returns cover the effect, by [`MASKED_DB`].
    pub fn masked(&self) -> bool {
        self.below_cover_db >= MASKED_DB
    }
}

/// Which frames a diagnosis holds out when it is free to choose: every fourth, from the third on.
pub fn held_out(frame: usize) -> bool {
    frame % 4 == 2
}

fn decibels(ratio: f64) -> f64 {
    if ratio > 0.0 { (10.0 * ratio.log10()).clamp(NOTHING_DB, -NOTHING_DB) } else { NOTHING_DB }
}

fn samples(frame: &IfFrame) -> Vec<Complex64> {
    frame.complex().map(|value| Complex64::new(value.re.into(), value.im.into())).collect()
}

/// A scene under several draws of the mesh's error and the noise, with one receiver.
pub struct Draws {
    /// `[draw][frame]`
    pub frames: Vec<Vec<IfFrame>>,
    /// Without the person.
    pub empty: Vec<Vec<IfFrame>>,
    pub gain: f64,
}

/// `clean` and `planted`: the same scene, noise included, without and with the effect; all but what survives is of the
/// first draw.
pub fn strength(clean: &Draws, planted: &Draws) -> Strength {
    let [tx, rx, loops, fast] = clean.frames[0][0].dims;
    let gain = planted.gain / clean.gain;
    let pairs = |clean: &[Vec<IfFrame>], planted: &[Vec<IfFrame>]| -> Vec<Draw> {
        clean.iter().zip(planted).map(|(clean, planted)| draw(clean, planted, gain)).collect()
    };
    let (draws, empty) = (pairs(&clean.frames, &planted.frames), pairs(&clean.empty, &planted.empty));
    let Draw { clean: Frames { values: clean, .. }, effect: Frames { values: effect, .. } } = &draws[0];
    // What only turns or scales the whole recording is no effect: its gain and phase are unknown.
    let common: Complex64 = clean.iter().flatten().zip(effect.iter().flatten()).map(|(x, e)| x.conj() * e).sum();
    let power: f64 = clean.iter().flatten().map(Complex64::norm_sqr).sum();

    let (mut total, mut kept, mut moving, mut count) = (0.0, 0.0, 0.0, 0.0);
    let (mut noise_powers, mut cells) = (vec![], vec![]);
    for (frame, (x, e)) in clean.iter().zip(effect).enumerate() {
        let energy: f64 = e.iter().map(Complex64::norm_sqr).sum();
        total += energy;
        kept += if held_out(frame) { energy } else { 0.0 };
        count += x.len() as f64;
        let (mut cover, mut of_effect) = (vec![0.0; loops * fast], vec![0.0; loops * fast]);
        for (x, e) in x.chunks_exact(loops * fast).zip(e.chunks_exact(loops * fast)) {
            moving += energy_of_movers(x, fast);
            for (cell, (x, e)) in transform(x, fast).iter().zip(transform(e, fast)).enumerate() {
                cover[cell] += x.norm_sqr();
                of_effect[cell] += e.norm_sqr();
                let doppler = cell / fast;
                if doppler.min(loops - doppler) > 2 || loops < 8 {
                    noise_powers.push(x.norm_sqr());
                }
            }
        }
        cells.push((cover, of_effect));
    }
    let noise = exponential_scale(&mut noise_powers, 0.35).max(f64::MIN_POSITIVE);
    moving = (moving - noise * count).max(noise);
    let shared = (common.norm_sqr() / (power - noise * count).max(noise) / total.max(f64::MIN_POSITIVE)).min(1.0);
    (total, kept) = (total * (1.0 - shared), kept * (1.0 - shared));
    let d_prime = |energy: f64| (2.0 * energy / noise).sqrt();
    Strength {
        effect_to_noise_db: decibels(total / (noise * count)),
        effect_to_moving_db: decibels(total / moving),
        d_prime: d_prime(total),
        d_prime_held_out: d_prime(kept),
        d_prime_surviving: surviving::d_prime(&draws, &empty, noise),
        below_cover_db: below_cover(&cells, noise * (tx * rx) as f64),
        gain_db: decibels(gain * gain),
    }
}

fn draw(clean: &[IfFrame], planted: &[IfFrame], gain: f64) -> Draw {
    let [tx, rx, loops, fast] = clean[0].dims;
    let of = |values| Frames { dims: [tx * rx, loops, fast], values };
    let (clean, planted): (Vec<_>, Vec<_>) = (clean.iter().map(samples).collect(), planted.iter().map(samples).collect());
    let difference = |(x, y): (&Vec<Complex64>, &Vec<Complex64>)| x.iter().zip(y).map(|(x, y)| y / gain - x).collect();
    let effect = clean.iter().zip(&planted).map(difference).collect();
    Draw { clean: of(clean), effect: of(effect) }
}

/// What is left of a channel's frame, `[loop, sample]`, without static clutter within the frame.
fn energy_of_movers(channel: &[Complex64], fast: usize) -> f64 {
    let loops = (channel.len() / fast) as f64;
    let mut mean = vec![Complex64::ZERO; fast];
    channel.iter().enumerate().for_each(|(i, value)| mean[i % fast] += value / loops);
    channel.iter().enumerate().map(|(i, value)| (value - mean[i % fast]).norm_sqr()).sum()
}

/// The tenth percentile, weighted by the effect's energy, of how far each cell's return lies above the effect.
fn below_cover(cells: &[(Vec<f64>, Vec<f64>)], noise: f64) -> f64 {
    let mut ratios: Vec<(f64, f64)> = cells
        .iter()
        .flat_map(|(cover, effect)| cover.iter().zip(effect))
        .filter(|&(_, &effect)| effect > 0.0)
        .map(|(&cover, &effect)| {
            let cover = if cover > RETURN_OVER_NOISE * noise { cover } else { 0.0 };
            (decibels(cover / effect), effect)
        })
        .collect();
    ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = ratios.iter().map(|(_, energy)| energy).sum();
    let mut passed = 0.0;
    for (ratio, energy) in ratios {
        passed += energy;
        if passed >= 0.1 * total && total > 0.0 {
            return ratio;
        }
    }
    NOTHING_DB
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const DIMS: [usize; 4] = [1, 2, 16, 32];

    fn frames(sigma: f64, extra: impl Fn(usize, usize) -> Complex64, gain: Complex64) -> Vec<IfFrame> {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        (0..4)
            .map(|_| {
                let values: Vec<Complex64> = (0..2 * 16 * 32)
                    .map(|i| {
                        let (slow, fast) = (i / 32 % 16, i % 32);
                        let [re, im]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
                        let mover = Complex64::cis(0.9 * slow as f64 + 0.7 * fast as f64) * 100.0;
                        (mover + Complex64::new(re, im) * sigma + extra(slow, fast)) * gain
                    })
                    .collect();
                IfFrame::new(
                    DIMS,
                    values.iter().map(|v| v.re as f32).collect(),
                    Some(values.iter().map(|v| v.im as f32).collect()),
                )
            })
            .collect()
    }

    fn one(frames: Vec<IfFrame>, gain: f64) -> Draws {
        Draws { empty: vec![frames.clone()], frames: vec![frames], gain }
    }

    #[test]
    fn a_known_tone_has_its_energy_whatever_the_gain() {
        let clean = frames(1.0, |_, _| Complex64::ZERO, Complex64::ONE);
        let tone = |slow: usize, fast: usize| Complex64::cis(-1.1 * slow as f64 + 2.2 * fast as f64) * 0.5;
        let planted = frames(1.0, tone, 0.4.into());
        let found = strength(&one(clean, 1.0), &one(planted, 0.4));
        // 4096 samples, energy 0.25 each, noise of variance 2.
        let wanted = (2.0 * 4096.0 * 0.25 / 2.0f64).sqrt();
        assert!((found.d_prime / wanted - 1.0).abs() < 0.05, "{} against {wanted}", found.d_prime);
        assert!((found.d_prime_held_out / wanted - 0.5).abs() < 0.05);
        assert!((found.effect_to_moving_db - 20.0 * (0.5f64 / 100.0).log10()).abs() < 0.5, "{}", found.effect_to_moving_db);
        assert!(!found.masked());
        assert!((found.gain_db - 20.0 * 0.4f64.log10()).abs() < 0.05);
    }

    #[test]
    fn an_effect_under_a_strong_return_is_masked_and_nothing_is_nothing() {
        let clean = frames(1.0, |_, _| Complex64::ZERO, Complex64::ONE);
        // The same cell as the mover, but from frame to frame alike only in one half of the chirps.
        let under = |slow: usize, fast: usize| Complex64::cis(0.95 * slow as f64 + 0.72 * fast as f64) * 2.0;
        let clean = one(clean, 1.0);
        let found = strength(&clean, &one(frames(1.0, under, Complex64::ONE), 1.0));
        assert!(found.masked(), "{} dB", found.below_cover_db);
        let nothing = strength(&clean, &clean);
        assert!(nothing.d_prime < 1e-3 && nothing.effect_to_noise_db < -60.0);
        let turned = strength(&clean, &one(frames(1.0, |_, _| Complex64::ZERO, Complex64::cis(0.7)), 1.0));
        assert!(turned.d_prime < 1.0, "{}", turned.d_prime);
    }
}
