//! Crossings of another radar that stand out in no single sample: a sweep through the receiver's band within one chirp,
//! which reaches all receivers from one direction.
//!
//! What moves turns slowly from chirp to chirp; a crossing is in one chirp, and so everywhere in Doppler. The band of Doppler in
//! which anything moves is projected off (discrete prolate spheroidal sequences, Slepian 1978). What is left of a chirp is
//! compared with sweeps of every duration, time and direction; the energy that one of them explains, over that of the noise, is
//! a draw from an exponential law where there is none. An impulse in one receiver is no crossing.

use std::collections::BTreeMap;
use std::f64::consts::{LN_2, PI};
use std::ops::Range;

use nalgebra::{DMatrix, SymmetricEigen};
use num_complex::Complex64;
use rayon::prelude::*;

use super::burst::Burst;
use crate::diagnosis::Evidence;
use crate::diagnosis::detectors::steering::{beam, sines, steering};
use crate::diagnosis::statistics::{median, poisson_tail};

/// Samples in which a sweep crosses a band as wide as the sample rate.
const DURATIONS: [f64; 7] = [1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0];
/// Samples to either side of its middle; times between two samples that are tried; edge of the receiver's band over the sample rate.
const REACH: i64 = 8;
const BETWEEN: usize = 2;
const BAND_EDGE: f64 = 0.45;
/// Of its magnitude's largest, from which on a sample is hit.
const HIT: f64 = 0.3;
/// Crossings that noise alone would show in all.
const BY_CHANCE: f64 = 0.05;
/// Of the strongest ones, the number that is least likely of noise: so many numbers are tried.
const NUMBERS: usize = 8;
/// Energy of a sweep over that of the loudest receiver alone.
const IN_ALL: f64 = 1.6;
/// Power that is left over the noise counts so many times its mean: what is not noise comes in larger portions. And the noise's level errs.
const PORTION: f64 = 25.0;
const LEVEL_ERROR: f64 = 0.03;
/// Powers of a chirp or a sample, medians of many values, that are so many times the usual are no chance.
const LOUD: f64 = 1.8;
/// A Doppler row that holds so many times the noise's power is one of things that move.
const MOVING: f32 = 4.0;
/// Rows beyond them that are projected off, too, and the widest band, as a share of all, with which enough is left.
const MARGIN: usize = 2;
const WIDEST: f64 = 0.7;
/// Share of a direction of slow time in the band, above which it is projected off, and share of a chirp that must be left.
const IN_BAND: f64 = 1e-5;
const LEAST_LEFT: f64 = 0.1;
/// Chirps in a row that are looked at together.
const LONGEST: usize = 64;
const FEWEST: usize = 16;
/// Most crossings of them: what hits more chirps is something else.
const MOST: usize = 24;

/// What was found.
pub struct Crossings {
    /// One for every receiver.
    pub bursts: Vec<Burst>,
    pub p_value: f64,
    /// Share of all chirps that could be looked at.
    pub seen: f64,
    /// Share of the crossings that hardly stand out: beside them are others that do not.
    pub faint: f64,
}

/// None where there are none, or where they are not identifiable.
pub fn find(evidence: &Evidence) -> Option<Crossings> {
    let [frames, transmitters, receivers, loops, _] = evidence.cube.dims;
    if receivers < 2 || loops < FEWEST {
        return None;
    }
    let bank = Bank::new(evidence);
    let count = loops.div_ceil(LONGEST);
    let widths: Vec<usize> = (0..frames).into_par_iter().map(|frame| band_rows(evidence, frame)).collect();
    let ranges: Vec<Range<usize>> = (0..count).map(|block| block * loops / count..(block + 1) * loops / count).collect();
    let mut projectors = BTreeMap::new();
    let mut blocks: Vec<(usize, usize, Range<usize>)> = vec![];
    for (frame, &rows) in widths.iter().enumerate().filter(|(_, rows)| **rows as f64 / (loops as f64) < WIDEST) {
        for chirps in &ranges {
            projectors.entry((rows, chirps.len())).or_insert_with(|| projector(chirps.len(), rows as f64 / loops as f64));
            blocks.extend((0..transmitters).map(|tx| (frame, tx, chirps.clone())));
        }
    }
    let prepared = blocks.into_par_iter().map(|(frame, tx, chirps)| {
        let projector = &projectors[&(widths[frame], chirps.len())];
        Block::new(evidence, &bank, projector, frame, tx, chirps)
    });
    let prepared: Vec<Block> = prepared.collect();
    let seen: usize = prepared.iter().map(Block::chirps).sum();
    let looks = (seen * bank.looks()) as f64;
    let least = (looks / BY_CHANCE).ln();
    let mut found: Vec<Crossing> = prepared.into_par_iter().flat_map_iter(|block| block.crossings(least)).collect();
    found.sort_by(|a, b| b.energy.total_cmp(&a.energy));
    let chance = |(index, crossing): (usize, &Crossing)| poisson_tail(index + 1, looks * (-crossing.energy).exp());
    let p_value = found.iter().take(NUMBERS).enumerate().map(chance).fold(1.0, f64::min) * NUMBERS as f64;
    let faint = found.iter().filter(|crossing| crossing.energy < 2.0 * least).count() as f64 / found.len().max(1) as f64;
    let bursts = found.into_iter().flat_map(|crossing| crossing.bursts).collect::<Vec<_>>();
    let seen = seen as f64 / (frames * transmitters * loops) as f64;
    (!bursts.is_empty()).then_some(Crossings { bursts, p_value: p_value.min(1.0), seen, faint })
}

/// Doppler rows, about zero, in which anything moves in a frame.
fn band_rows(evidence: &Evidence, frame: usize) -> usize {
    let (maps, loops) = (evidence.maps(), evidence.cube.dims[3]);
    let moves = |&doppler: &usize| maps.below([frame, doppler])[..evidence.range_bins()].iter().any(|power| *power > MOVING);
    let last = (0..loops).filter(moves).map(|doppler| doppler.min(loops - doppler)).max().unwrap_or(0);
    2 * (last + MARGIN) + 1
}

/// Projects a band about zero, as a share of all Doppler, off so many chirps: `[chirp, chirp]`.
fn projector(chirps: usize, band: f64) -> DMatrix<f64> {
    let kernel = DMatrix::from_fn(chirps, chirps, |a, b| {
        let apart = PI * (a as f64 - b as f64);
        if a == b { band } else { (band * apart).sin() / apart }
    });
    let eigen = SymmetricEigen::new(kernel);
    let mut projector = DMatrix::identity(chirps, chirps);
    for (share, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *share > IN_BAND {
            projector -= direction * direction.transpose();
        }
    }
    projector
}

/// Sweeps of unit energy about their middle, and the phases of directions.
struct Bank {
    /// `[sweep][sample + REACH]`
    sweeps: Vec<Vec<Complex64>>,
    /// `[beam][rx]`
    beams: Vec<Vec<Complex64>>,
    samples: usize,
}

impl Bank {
    fn new(evidence: &Evidence) -> Self {
        let sweep = |duration: f64, sign: f64, between: f64| {
            let value = |n: i64| {
                let time = n as f64 - between;
                let beat = time / duration;
                let gain = 1.0 / (1.0 + (beat / BAND_EDGE).powi(8));
                Complex64::from_polar(gain, sign * PI * beat * time)
            };
            let values: Vec<Complex64> = (-REACH..=REACH).map(value).collect();
            let size = values.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt();
            values.into_iter().map(|value| value / size).collect()
        };
        // A receiver without quadrature does not distinguish the two signs.
        let signs: &[f64] = if evidence.is_real() { &[1.0] } else { &[1.0, -1.0] };
        let between = (0..BETWEEN).map(|step| step as f64 / BETWEEN as f64);
        let sweeps = DURATIONS.iter().flat_map(|&duration| signs.iter().map(move |&sign| (duration, sign)));
        let sweeps = sweeps.flat_map(|(duration, sign)| between.clone().map(move |between| sweep(duration, sign, between)));
        let beams = sines(&evidence.radar).into_iter().map(|sine| steering(&evidence.radar, sine));
        Self { sweeps: sweeps.collect(), beams: beams.collect(), samples: evidence.cube.dims[4] }
    }

    /// In one chirp.
    fn looks(&self) -> usize {
        self.sweeps.len() * self.beams.len() * self.samples
    }

    /// Σ conj(sweep) value about a sample.
    fn product(&self, sweep: usize, values: &[Complex64], middle: usize) -> Complex64 {
        let first = middle as i64 - REACH;
        let inside = |i: &usize| (0..values.len() as i64).contains(&(first + *i as i64));
        let sweep = &self.sweeps[sweep];
        (0..sweep.len()).filter(inside).map(|i| sweep[i].conj() * values[(first + i as i64) as usize]).sum()
    }
}

/// One sweep in one chirp.
#[derive(Clone, Copy, Debug)]
struct Look {
    energy: f64,
    chirp: usize,
    sweep: usize,
    beam: usize,
    middle: usize,
}

struct Crossing {
    energy: f64,
    bursts: Vec<Burst>,
}

/// Chirps in a row of one transmitter and all receivers, without what moves.
struct Block<'a> {
    bank: &'a Bank,
    projector: &'a DMatrix<f64>,
    frame: usize,
    tx: usize,
    first: usize,
    /// In units of the noise's deviation, `[rx][chirp · samples + sample]`.
    left: Vec<Vec<Complex64>>,
    /// Power over the noise's by chirp and sample, at least one.
    by_chirp: Vec<f64>,
    by_sample: Vec<f64>,
    by_beam: Vec<f64>,
    /// Mean power over the noise's that is no noise.
    excess: f64,
}

impl<'a> Block<'a> {
    fn new(
        evidence: &Evidence,
        bank: &'a Bank,
        projector: &'a DMatrix<f64>,
        frame: usize,
        tx: usize,
        chirps: Range<usize>,
    ) -> Self {
        let (receivers, samples) = (evidence.cube.dims[2], evidence.cube.dims[4]);
        let of_receiver = |rx: usize| -> Vec<Complex64> {
            let channel = tx * receivers + rx;
            let scale = evidence.noise()[channel].max(f64::MIN_POSITIVE).sqrt().recip();
            let signal = &evidence.cube.channel(frame, channel)[chirps.start * samples..chirps.end * samples];
            let mut left = vec![Complex64::ZERO; signal.len()];
            for (chirp, left) in left.chunks_exact_mut(samples).enumerate() {
                for (other, values) in signal.chunks_exact(samples).enumerate() {
                    let weight = projector[(chirp, other)] * scale;
                    left.iter_mut().zip(values).for_each(|(sum, value)| *sum += value * weight);
                }
            }
            left
        };
        let left: Vec<Vec<Complex64>> = (0..receivers).map(of_receiver).collect();
        let open: Vec<usize> = (0..chirps.len()).filter(|&chirp| projector[(chirp, chirp)] > LEAST_LEFT).collect();
        let power = |rx: usize, chirp: usize, n: usize| left[rx][chirp * samples + n].norm_sqr() / projector[(chirp, chirp)];
        let usual = |mut powers: Vec<f64>| median(&mut powers) / LN_2;
        let of_chirp = |chirp: usize| (0..receivers).flat_map(move |rx| (0..samples).map(move |n| power(rx, chirp, n))).collect();
        let of_sample =
            |n: usize| (0..receivers).flat_map(|rx| open.iter().map(move |&chirp| power(rx, chirp, n))).collect::<Vec<f64>>();
        let by_chirp: Vec<f64> = (0..chirps.len()).map(|chirp| usual(of_chirp(chirp))).collect();
        let excess = median(&mut open.iter().map(|&chirp| by_chirp[chirp]).collect::<Vec<_>>()) - 1.0 - LEVEL_ERROR;
        let of_beam = |steering: &Vec<Complex64>| {
            let cells = open.iter().flat_map(|&chirp| (chirp * samples..(chirp + 1) * samples).map(move |cell| (chirp, cell)));
            let power = |(chirp, cell): (usize, usize)| {
                let values: Vec<Complex64> = left.iter().map(|left| left[cell]).collect();
                beam(&values, steering).norm_sqr() / (receivers as f64 * projector[(chirp, chirp)])
            };
            usual(cells.map(power).collect())
        };
        // Medians of few values scatter: what is near to one is noise.
        let level = |power: f64| if power > LOUD { power } else { 1.0 };
        Self {
            by_chirp: by_chirp.iter().map(|&power| level(power)).collect(),
            by_sample: (0..samples).map(|n| level(usual(of_sample(n)))).collect(),
            by_beam: bank.beams.iter().map(|beam| of_beam(beam).max(1.0)).collect(),
            bank,
            projector,
            frame,
            tx,
            first: chirps.start,
            left,
            excess: excess.max(0.0),
        }
    }

    /// That can be looked at.
    fn chirps(&self) -> usize {
        (0..self.by_chirp.len()).filter(|&chirp| self.projector[(chirp, chirp)] > LEAST_LEFT).count()
    }

    /// The strongest one after the other, each taken out of the chirps around before the next.
    fn crossings(mut self, least: f64) -> Vec<Crossing> {
        let mut looks: Vec<Option<Look>> = (0..self.by_chirp.len()).map(|chirp| self.strongest(chirp)).collect();
        let mut found = vec![];
        while let Some(look) = looks.iter().flatten().max_by(|a, b| a.energy.total_cmp(&b.energy)).copied()
            && look.energy > least
        {
            if found.len() == MOST {
                return vec![];
            }
            found.push(self.crossing(look));
            self.take_out(look);
            looks = (0..self.by_chirp.len()).map(|chirp| self.strongest(chirp)).collect();
        }
        found
    }

    fn strongest(&self, chirp: usize) -> Option<Look> {
        let share = self.projector[(chirp, chirp)];
        if share <= LEAST_LEFT {
            return None;
        }
        let samples = self.bank.samples;
        let mut best: Option<Look> = None;
        for sweep in 0..self.bank.sweeps.len() {
            for middle in 0..samples {
                let of_receiver = |left: &Vec<Complex64>| self.bank.product(sweep, &left[chirp * samples..][..samples], middle);
                let products: Vec<Complex64> = self.left.iter().map(of_receiver).collect();
                let scale = 1.0 / (share * self.by_chirp[chirp] * self.by_sample[middle]);
                let loudest = products.iter().map(Complex64::norm_sqr).fold(0.0, f64::max) * scale;
                for (index, steering) in self.bank.beams.iter().enumerate() {
                    let power = beam(&products, steering).norm_sqr() * scale / products.len() as f64;
                    let energy = power / self.by_beam[index] - PORTION * self.excess;
                    if power > IN_ALL * loudest && energy > best.map_or(0.0, |best| best.energy) {
                        best = Some(Look { energy, chirp, sweep, beam: index, middle });
                    }
                }
            }
        }
        best
    }

    fn crossing(&self, look: Look) -> Crossing {
        let receivers = self.left.len();
        let sweep = &self.bank.sweeps[look.sweep];
        let largest = sweep.iter().map(|value| value.norm()).fold(0.0, f64::max);
        let place = |i: usize| look.middle as i64 - REACH + i as i64;
        let hit = |i: &usize| sweep[*i].norm() > HIT * largest && (0..self.bank.samples as i64).contains(&place(*i));
        let hit: Vec<usize> = (0..sweep.len()).filter(hit).map(|i| place(i) as usize).collect();
        let (first, last) = (hit.first().copied().unwrap_or(look.middle), hit.last().copied().unwrap_or(look.middle));
        let of_receiver = |rx: usize| Burst {
            frame: self.frame,
            channel: self.tx * receivers + rx,
            chirp: self.first + look.chirp,
            first,
            last,
        };
        Crossing { energy: look.energy, bursts: (0..receivers).map(of_receiver).collect() }
    }

    fn take_out(&mut self, look: Look) {
        let samples = self.bank.samples;
        let steering = &self.bank.beams[look.beam];
        let products: Vec<Complex64> = self
            .left
            .iter()
            .map(|left| self.bank.product(look.sweep, &left[look.chirp * samples..][..samples], look.middle))
            .collect();
        let amplitude = beam(&products, steering) / (self.projector[(look.chirp, look.chirp)] * products.len() as f64);
        for (left, turn) in self.left.iter_mut().zip(steering) {
            for (other, left) in left.chunks_exact_mut(samples).enumerate() {
                let amplitude = amplitude * turn.conj() * self.projector[(other, look.chirp)];
                for (i, sweep) in self.bank.sweeps[look.sweep].iter().enumerate() {
                    let at = look.middle as i64 - REACH + i as i64;
                    if (0..samples as i64).contains(&at) {
                        left[at as usize] -= sweep * amplitude;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::Radar;

    const CHIRPS: [(usize, usize); 4] = [(1, 9), (4, 20), (5, 3), (10, 15)];

    /// Noise of four receivers and a thing that moves; `added`: to a receiver's sample of the chirps that are hit, so many after
    /// the fortieth.
    fn evidence(seed: u64, added: impl Fn(usize, f64) -> Complex64) -> Evidence {
        let mut radar = Radar::small(12);
        (radar.loops_per_frame, radar.samples_per_chirp) = (32, 128);
        radar.rx_m = (0..4).map(|rx| [0.5 * f64::from(rx) * radar.wavelength_m(), 0.0, 0.0]).collect();
        Evidence::in_noise(radar, seed, |[frame, rx, chirp, n]| {
            let moving = Complex64::cis(0.3 * chirp as f64 + 0.7 * n as f64 + 0.5 * rx as f64) * 3.0;
            moving + if CHIRPS.contains(&(frame, chirp)) { added(rx, n as f64 - 40.0) } else { Complex64::ZERO }
        })
    }

    #[test]
    fn faint_sweeps_from_one_direction_are_crossings_and_impulses_and_noise_are_none() {
        // Three times the noise's deviation in each part, in four samples.
        let sweep = |rx: usize, time: f64| {
            let gain = 3.0 / (1.0 + (time / 4.0 / BAND_EDGE).powi(8));
            Complex64::from_polar(gain, PI * time * time / 4.0 - 0.9 * rx as f64)
        };
        let found = find(&evidence(1, sweep)).expect("nothing found");
        let places: Vec<(usize, usize)> = found.bursts.iter().map(|burst| (burst.frame, burst.chirp)).collect();
        assert!(found.p_value < 1e-6, "{}", found.p_value);
        assert!(CHIRPS[1..].iter().all(|place| places.iter().filter(|other| *other == place).count() == 4), "{places:?}");
        let (hit, others): (Vec<&Burst>, Vec<&Burst>) =
            found.bursts.iter().partition(|burst| CHIRPS.contains(&(burst.frame, burst.chirp)));
        // One in twenty recordings may show one more by chance.
        assert!(others.len() <= 4 && hit.iter().all(|burst| burst.first <= 40 && burst.last >= 40), "{:?}", found.bursts);
        let sure = |found: Option<Crossings>| found.filter(|found| found.p_value < 1e-3).map(|found| found.bursts);
        let impulse = |rx: usize, time: f64| Complex64::from(if rx == 2 && time == 0.0 { 20.0 } else { 0.0 });
        assert_eq!(sure(find(&evidence(2, impulse))), None);
        for seed in 3..6 {
            assert_eq!(sure(find(&evidence(seed, |_, _| Complex64::ZERO))), None);
        }
    }
}
