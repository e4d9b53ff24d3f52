//! Receivers of a cascade's devices exchanged: the file of one slave taken for another's.
//!
//! Where two virtual antennas have one place, whatever is far away comes to both with one phase, but for what the channels add: over the
//! ranges at which static returns stand out of the noise, their spectra are coherent, however many returns there are. Virtual
//! antennas at other places are so for returns from one direction alone. So the pairs of one place (each channel once, of two
//! devices) are at least as coherent as those that would have one place if the devices were exchanged: a paired Student test of
//! their Fisher transforms (artanh of the coherence, in the order of the channels), Bonferroni over the exchanges. Where no
//! exchange makes them less coherent, nothing can be decided.

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;

use super::still::{Still, transformed};
use super::stream::{Schedule, Stream};
use super::tails::student_tail;
use super::{ALARM, Finding, Inspector, Kind};
use crate::radar::{Radar, SPEED_OF_LIGHT};

const CHECK: &str = "devices";
const EXPECTED: &str = "every device's receivers where the board has them";
/// Receivers of one device (AWR2243).
const RECEIVERS: usize = 4;
/// More devices have more orders than can be tried.
const MOST_DEVICES: usize = 4;
/// Places closer than this share of a wavelength are one: a phase of 18 degrees.
const SAME: f64 = 0.05;
/// Pairs for a test.
const FEWEST: usize = 8;
/// Bins beside 0 in which the leakage between the antennas lies, which is near.
const GUARD: usize = 3;
/// A bin counts above this many times the noise: of noise alone, e⁻²⁰ in one channel.
const RETURN: f64 = 20.0;
/// Coherences count up to this one: the noise that is left decides beyond.
const HIGHEST: f64 = 0.9999;

pub(super) struct Devices {
    schedule: Schedule,
    tx_m: Vec<[f64; 3]>,
    rx_m: Vec<[f64; 3]>,
    wavelength_m: f64,
    /// None where it is no cascade.
    still: Option<Still>,
}

/// Orders of so many things, the given one first.
fn orders(count: usize) -> Vec<Vec<usize>> {
    let mut all = vec![vec![]];
    for _ in 0..count {
        let longer = |order: &Vec<usize>| {
            let free = (0..count).filter(|next| !order.contains(next));
            free.map(|next| [order.clone(), vec![next]].concat()).collect::<Vec<_>>()
        };
        all = all.iter().flat_map(longer).collect();
    }
    all
}

impl Devices {
    pub fn new(schedule: Schedule, radar: &Radar) -> Self {
        let (tx_m, rx_m) = (radar.tx_m.clone(), radar.rx_m.clone());
        let wavelength_m = SPEED_OF_LIGHT / radar.carrier_hz();
        let still = Self::is_cascade(&rx_m).then(|| Still::new(schedule));
        Self { schedule, tx_m, rx_m, wavelength_m, still }
    }

    fn is_cascade(rx_m: &[[f64; 3]]) -> bool {
        let devices = rx_m.len() / RECEIVERS;
        rx_m.len().is_multiple_of(RECEIVERS) && (2..=MOST_DEVICES).contains(&devices)
    }

    /// Channels of one place where device d's receivers are those of `order[d]`, each once, of two devices.
    fn pairs(&self, order: &[usize]) -> Vec<[usize; 2]> {
        let n_rx = self.rx_m.len();
        let place = |channel: usize| -> [f64; 3] {
            let (tx, rx) = (self.tx_m[channel / n_rx], channel % n_rx);
            let rx = self.rx_m[order[rx / RECEIVERS] * RECEIVERS + rx % RECEIVERS];
            std::array::from_fn(|axis| tx[axis] + rx[axis])
        };
        let places: Vec<[f64; 3]> = (0..self.tx_m.len() * n_rx).map(place).collect();
        let same = |a: usize, b: usize| {
            let apart_m = (0..3).map(|axis| (places[a][axis] - places[b][axis]).powi(2)).sum::<f64>().sqrt();
            apart_m < SAME * self.wavelength_m
        };
        let device = |channel: usize| channel % n_rx / RECEIVERS;
        let mut taken = vec![false; places.len()];
        let mut pairs = vec![];
        for first in 0..places.len() {
            let mut others = first + 1..places.len();
            let second = others.find(|&other| !taken[other] && device(other) != device(first) && same(first, other));
            if let Some(second) = second.filter(|_| !taken[first]) {
                (taken[first], taken[second]) = (true, true);
                pairs.push([first, second]);
            }
        }
        pairs
    }

    /// Spectra of the channels in the bins that count, each bin as strong as any other; none where these are too few.
    fn spectra(&self, still: &Still) -> Option<Vec<Vec<Complex64>>> {
        let samples = self.schedule.samples;
        let fft = FftPlanner::new().plan_fft_forward(samples);
        let all: Vec<Vec<Complex64>> = still.sum.chirps().map(|chirp| transformed(&*fft, chirp)).collect();
        let noise = still.noise_of_bin();
        let power = |bin: usize| all.iter().map(|own| own[bin].norm_sqr()).sum::<f64>();
        let last = if self.schedule.is_real { samples / 2 } else { samples };
        let counting: Vec<(usize, f64)> = (GUARD..last.saturating_sub(GUARD))
            .map(|bin| (bin, power(bin)))
            .filter(|(_, power)| *power >= RETURN * noise && *power > 0.0)
            .collect();
        let own = |values: Vec<Complex64>| counting.iter().map(|&(bin, power)| values[bin] / power.sqrt()).collect();
        (counting.len() >= 2).then(|| all.into_iter().map(own).collect())
    }
}

/// Fisher's transform of the coherence of each pair.
fn coherences(spectra: &[Vec<Complex64>], pairs: &[[usize; 2]]) -> Vec<f64> {
    let power = |values: &[Complex64]| values.iter().map(|value| value.norm_sqr()).sum::<f64>();
    let coherence = |&[a, b]: &[usize; 2]| {
        let (a, b) = (&spectra[a], &spectra[b]);
        let common: Complex64 = a.iter().zip(b).map(|(a, b)| a * b.conj()).sum();
        (common.norm() / (power(a) * power(b)).sqrt().max(f64::MIN_POSITIVE)).min(HIGHEST).atanh()
    };
    pairs.iter().map(coherence).collect()
}

fn mean_coherence(transforms: &[f64]) -> f64 {
    (transforms.iter().sum::<f64>() / transforms.len() as f64).tanh()
}

impl Inspector for Devices {
    fn see(&mut self, stream: &Stream) {
        if let Some(still) = &mut self.still {
            still.see(stream);
        }
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        let still = self.still.as_ref()?;
        let orders = orders(self.rx_m.len() / RECEIVERS);
        let stated = self.pairs(&orders[0]);
        if stated.len() < FEWEST || !still.shows_noise() {
            let why = "too few virtual antennas of two devices have one place, or one chirp shows no noise";
            return Some(Finding::undecided(CHECK, EXPECTED, why));
        }
        let Some(spectra) = self.spectra(still) else {
            return Some(Finding::undecided(CHECK, EXPECTED, "static returns stand out of the noise at too few ranges"));
        };
        let as_stated = coherences(&spectra, &stated);
        let (mut worst, mut is_decided) = ((1.0, &orders[0], 0.0), true);
        for order in &orders[1..] {
            let exchanged = coherences(&spectra, &self.pairs(order));
            let gains: Vec<f64> = exchanged.iter().zip(&as_stated).map(|(other, own)| other - own).collect();
            if gains.len() < FEWEST {
                continue;
            }
            let chance = student_tail(&gains);
            if chance < worst.0 {
                worst = (chance, order, mean_coherence(&exchanged));
            }
            is_decided &= student_tail(&gains.iter().map(|gain| -gain).collect::<Vec<_>>()) < ALARM;
        }
        let chance = worst.0 * (orders.len() - 1) as f64;
        let own = mean_coherence(&as_stated);
        let found = format!("{} pairs of virtual antennas at one place have a coherence of {own:.3}", stated.len());
        if chance < ALARM {
            let found = format!(
                "{found}, and of {:.3} where the devices 0, 1, … have the receivers of {:?}: files were exchanged between devices",
                worst.2, worst.1
            );
            return Some(Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, chance.ln()));
        }
        if is_decided {
            return Some(Finding::as_stated(CHECK, EXPECTED, found));
        }
        Some(Finding::undecided(CHECK, EXPECTED, format!("{found}, and no less if devices were exchanged")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::IfFrame;
    use crate::import::capture::boards::Board;
    use crate::support::numbers;

    const LOOPS: usize = 4;
    const SAMPLES: usize = 32;
    const TX: usize = 12;
    const RX: usize = 16;

    fn radar() -> Radar {
        let board = Board::named("MMWCAS-RF-EVM").unwrap();
        Radar {
            loops_per_frame: LOOPS,
            samples_per_chirp: SAMPLES,
            tx_m: (0..TX).rev().map(|tx| board.tx_m(tx).unwrap()).collect(),
            rx_m: (0..RX).map(|rx| board.rx_m(rx).unwrap()).collect(),
            ..Radar::mmmesh(1)
        }
    }

    /// Static returns at these sines of their azimuths, one every second bin, in channels of unknown gains; `order`: whose
    /// receivers' samples each device's file holds.
    fn seen(sines: &[f64], amplitude: f64, order: [usize; 4]) -> Finding {
        let radar = radar();
        let schedule = Schedule::of(&radar, None);
        let noise = numbers(9, 2 * TX * RX * LOOPS * SAMPLES, -1.0, 1.0);
        let gains = numbers(10, 2 * (TX + RX), 0.0, std::f64::consts::TAU);
        let wavelength_m = SPEED_OF_LIGHT / radar.carrier_hz();
        let (mut re, mut im) = (vec![], vec![]);
        for place in 0..TX * RX * LOOPS * SAMPLES {
            let (channel, sample) = (place / SAMPLES / LOOPS, place % SAMPLES);
            let (tx, rx) = (channel / RX, channel % RX);
            let source = order[rx / RECEIVERS] * RECEIVERS + rx % RECEIVERS;
            let x_m = radar.tx_m[tx][0] + radar.rx_m[source][0];
            let tone = |(at, sine): (usize, &f64)| {
                let cycles = (4 + 2 * at) as f64 * sample as f64 / SAMPLES as f64 - x_m * sine / wavelength_m + 0.37 * at as f64;
                Complex64::from_polar(amplitude, std::f64::consts::TAU * cycles + gains[tx] + gains[TX + source])
            };
            let value: Complex64 = sines.iter().enumerate().map(tone).sum();
            re.push((value.re + noise[2 * place]) as f32);
            im.push((value.im + noise[2 * place + 1]) as f32);
        }
        let mut inspector = Box::new(Devices::new(schedule, &radar));
        inspector.see(&Stream::of(schedule, 0, &IfFrame::new([TX, RX, LOOPS, SAMPLES], re, Some(im))));
        inspector.conclude().unwrap()
    }

    const ROOM: [f64; 6] = [-0.6, 0.35, 0.0, 0.7, -0.25, 0.12];

    #[test]
    fn files_in_their_places_are_so_and_exchanged_ones_are_named() {
        let right = seen(&ROOM, 10.0, [0, 1, 2, 3]);
        assert!(right.ok && right.decided, "{right:?}");
        for order in [[0, 2, 1, 3], [1, 0, 2, 3], [3, 1, 2, 0], [0, 2, 3, 1]] {
            let exchanged = seen(&ROOM, 10.0, order);
            assert!(exchanged.is_refusal() && exchanged.found.contains(&format!("receivers of {order:?}")), "{exchanged:?}");
        }
    }

    #[test]
    fn one_direction_and_noise_tell_nothing_and_accuse_nobody() {
        for (sines, amplitude) in [(&[0.3; 6][..], 10.0), (&[][..], 0.0)] {
            for order in [[0, 1, 2, 3], [0, 2, 1, 3]] {
                let finding = seen(sines, amplitude, order);
                assert!(finding.ok && !finding.decided, "{finding:?}");
            }
        }
    }

    #[test]
    fn one_device_has_no_row() {
        let radar = Radar::mmmesh(1);
        assert!(Box::new(Devices::new(Schedule::of(&radar, None), &radar)).conclude().is_none());
    }
}
