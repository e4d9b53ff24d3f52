//! Fewer transmitters than fired: loops that take turns.
//!
//! Where several transmitters fire in turn and one is stated, every m-th loop shows the room from one of them. Each static return then
//! differs between the m kinds of loops, by other phases in other directions. At a return, the energy between the kinds against that
//! within them has an F distribution where loops differ at random (analysis of variance); how many returns exceed its 5 % by chance is
//! binomial, Bonferroni over m. What moves, or vibrates at a harmonic of the loops' rate, does so at its range alone: most returns must
//! take turns. Loops of another gain or phase share one factor at all returns, as a receiver or a synthesiser that takes turns has; they
//! must take turns beyond the best such factor, too.

use hybridsim_fft::FftPlanner;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use num_complex::Complex64;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::stream::{Schedule, Stream};
use super::tails::log_binomial_tail;
use super::{ALARM, Finding, Inspector, Kind};

const CHECK: &str = "transmitter_count";
const EXPECTED: &str = "one loop like the next";
/// Frames that are looked at: loops take the same turns in all.
const FRAMES: usize = 4;
/// Kinds of loops that are tried, at most: the transmitters of four chips (AWR2243 cascade: twelve) and more.
const MOST: usize = 16;
/// Loops of each kind in a frame, at least.
const FEWEST: usize = 3;
/// Steps towards the common factor: each brings a cell that follows it nearer to its noise.
const ITERATIONS: usize = 8;
/// Level at which one return takes turns.
const LEVEL: f64 = 0.05;

/// What is summed over frames for loops of so many kinds; by range bin, over channels.
struct Turns {
    kinds: usize,
    /// Energy of the kinds' means around their mean, that beyond a factor common to all returns, and that of loops around their kind's.
    between: Vec<f64>,
    beyond: Vec<f64>,
    within: Vec<f64>,
}

pub(super) struct Alternation {
    schedule: Schedule,
    turns: Vec<Turns>,
    /// Energy of the mean loop by range bin, over channels.
    still: Vec<f64>,
    frames: usize,
}

impl Alternation {
    pub fn new(schedule: Schedule) -> Self {
        let is_possible = |kinds: &usize| schedule.loops.is_multiple_of(*kinds) && schedule.loops / kinds >= FEWEST;
        let zeros = || vec![0.0; schedule.samples];
        let of = |kinds| Turns { kinds, between: zeros(), beyond: zeros(), within: zeros() };
        Self { schedule, turns: (2..=MOST).filter(is_possible).map(of).collect(), still: zeros(), frames: 0 }
    }

    /// Chance that energy in so many more means exceeds that within kinds as much.
    fn chance(&self, means: usize, energy: f64, turns: &Turns, bin: usize) -> f64 {
        let (above, below) = (means * self.frames, (self.schedule.loops - turns.kinds) * self.frames);
        let within = turns.within[bin] / below as f64;
        if within <= 0.0 {
            return if energy > 0.0 { 0.0 } else { 1.0 };
        }
        // Complex values: two degrees each. Channels share what they see and count once.
        let law = FisherSnedecor::new(2.0 * above as f64, 2.0 * below as f64).expect("degrees of freedom");
        law.sf(energy / above as f64 / within)
    }

    /// Range bins of the returns of the static scene, above the noise.
    fn returns(&self, turns: &Turns) -> Vec<usize> {
        let bins = self.schedule.samples;
        let is_peak = |bin: usize| [bin + bins - 1, bin + 1].iter().all(|other| self.still[bin] > self.still[other % bins]);
        let noise = |bin: usize| turns.within[bin] / (self.schedule.loops - turns.kinds) as f64;
        // A real signal has each return twice.
        let different = if self.schedule.is_real { bins / 2 } else { bins };
        (0..different).filter(|&bin| is_peak(bin) && self.still[bin] > -ALARM.ln() * noise(bin)).collect()
    }

    /// At how many of the static returns loops of `turns` take turns beyond those of fewer kinds, of how many, and the chance of it.
    fn taken(&self, fewer: Option<&Turns>, turns: &Turns) -> (usize, usize, f64) {
        let returns = self.returns(turns);
        let means = turns.kinds - fewer.map_or(1, |fewer| fewer.kinds);
        let explained = |bin: usize| fewer.map_or(0.0, |fewer| fewer.between[bin]);
        let any =
            returns.iter().filter(|&&bin| self.chance(means, turns.between[bin] - explained(bin), turns, bin) < LEVEL).count();
        let beyond = returns.iter().filter(|&&bin| self.chance(turns.kinds - 1, turns.beyond[bin], turns, bin) < LEVEL).count();
        let log_p = |count| (self.turns.len() as f64).ln() + log_binomial_tail(count, returns.len(), LEVEL);
        (any, returns.len(), log_p(any).max(log_p(beyond)))
    }
}

/// The kinds' common factor `[kind]`, which leaves least of most cells: the first eigenvector of the means' products, in which each cell
/// counts by what the factor before left of it and by its noise (a Lorentzian M-estimate by iteratively reweighted least squares: P. W.
/// Holland and R. E. Welsch, Commun. Stat. A6, 1977). One strong return that moves by itself does not outweigh the others. Means
/// `[kind, cell]`, their energies and that of noise in them `[cell]`.
fn common(means: &DMatrix<Complex64>, energies: &[f64], noise: &[f64]) -> DVector<Complex64> {
    let kinds = means.nrows();
    // At first each counts alike.
    let mut left = energies.to_vec();
    let mut factor = DVector::zeros(kinds);
    for _ in 0..ITERATIONS {
        let mut products = DMatrix::<Complex64>::zeros(kinds, kinds);
        for ((cell, left), noise) in means.column_iter().zip(&left).zip(noise) {
            let weight = 1.0 / (left + noise).max(f64::MIN_POSITIVE);
            products.gerc(weight.into(), &cell, &cell, Complex64::ONE);
        }
        let eigen = SymmetricEigen::new(products);
        factor = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
        let along = means.column_iter().map(|cell| factor.dotc(&cell).norm_sqr());
        left = energies.iter().zip(along).map(|(energy, along)| (energy - along).max(0.0)).collect();
    }
    factor
}

/// Means of the loops of each kind, `[kind, cell]`, from spectra `[loop][cell]`.
fn means(spectra: &[Complex64], cells: usize, kinds: usize) -> DMatrix<Complex64> {
    let mut means = DMatrix::zeros(kinds, cells);
    for (index, values) in spectra.chunks_exact(cells).enumerate() {
        means.row_mut(index % kinds).iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
    }
    means * Complex64::from(kinds as f64 * cells as f64 / spectra.len() as f64)
}

/// Windowed range spectra `[loop, channel, bin]`: Hann, so that a strong return does not take the place of the others.
fn spectra(stream: &Stream) -> Vec<Complex64> {
    let samples = stream.schedule.samples;
    let angle = |n: usize| std::f64::consts::TAU * (n as f64 + 0.5) / samples as f64;
    let window: Vec<f64> = (0..samples).map(|n| 0.5 - 0.5 * angle(n).cos()).collect();
    let mut values = stream.centred();
    for chirp in values.chunks_exact_mut(samples) {
        chirp.iter_mut().zip(&window).for_each(|(value, weight)| *value *= weight);
    }
    FftPlanner::new().plan_fft_forward(samples).process(&mut values);
    values
}

impl Inspector for Alternation {
    fn see(&mut self, stream: &Stream) {
        let Schedule { samples, loops, .. } = self.schedule;
        if self.frames == FRAMES || self.turns.is_empty() {
            return;
        }
        self.frames += 1;
        let spectra = spectra(stream);
        let cells = self.schedule.channels() * samples;
        let mean = means(&spectra, cells, 1);
        let mut energy = vec![0.0; cells];
        for values in spectra.chunks_exact(cells) {
            energy.iter_mut().zip(values).for_each(|(sum, value)| *sum += value.norm_sqr());
        }
        for (cell, value) in mean.iter().enumerate() {
            self.still[cell % samples] += loops as f64 * value.norm_sqr();
        }
        for turns in &mut self.turns {
            let each = (loops / turns.kinds) as f64;
            let means = means(&spectra, cells, turns.kinds);
            let of_kinds: Vec<f64> = means.column_iter().map(|cell| cell.norm_squared()).collect();
            let within: Vec<f64> = energy.iter().zip(&of_kinds).map(|(all, kinds)| (all - each * kinds).max(0.0)).collect();
            let of_means = (turns.kinds - 1) as f64 / each / (loops - turns.kinds) as f64;
            let noise: Vec<f64> = within.iter().map(|within| of_means * within).collect();
            let factor = common(&means, &of_kinds, &noise);
            for (cell, values) in means.column_iter().enumerate() {
                let bin = cell % samples;
                turns.between[bin] += (each * of_kinds[cell] - loops as f64 * mean[cell].norm_sqr()).max(0.0);
                turns.beyond[bin] += each * (of_kinds[cell] - factor.dotc(&values).norm_sqr()).max(0.0);
                turns.within[bin] += within[cell];
            }
        }
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        if self.frames == 0 {
            return None;
        }
        let mut found: Option<(&Turns, String, f64)> = None;
        let mut most = 0;
        for turns in &self.turns {
            let fewer = found.as_ref().map(|(fewer, ..)| *fewer).filter(|fewer| turns.kinds % fewer.kinds == 0);
            if found.is_some() && fewer.is_none() {
                continue;
            }
            let (any, returns, log_p) = self.taken(fewer, turns);
            most = most.max(returns);
            if 2 * any > returns && log_p < ALARM.ln() {
                found = Some((turns, format!("at {any} of {returns} static returns"), log_p));
            }
        }
        match found {
            None if most == 0 => Some(Finding::undecided(CHECK, EXPECTED, "no static return stands out of the noise")),
            None => Some(Finding::as_stated(CHECK, EXPECTED, format!("at {most} static returns it is"))),
            Some((Turns { kinds, .. }, places, log_p)) => {
                let found = format!(
                    "loops of {kinds} kinds take turns {places}: {kinds} times as many transmitters fired in turn as are stated, or {kinds} \
                     kinds of chirps"
                );
                Some(Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, log_p))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::IfFrame;
    use crate::support::numbers;

    const LOOPS: usize = 24;
    const SAMPLES: usize = 64;
    const RX: usize = 2;

    /// What multiplies a return of a direction (−1 … 1) in a loop.
    type Turn = fn(usize, f64) -> Complex64;

    /// Eight static returns from several directions, and a stronger one that turns by half a turn from loop to loop.
    fn seen(turn: Turn, noise: f64) -> Finding {
        let schedule =
            Schedule { tx: 1, rx: RX, loops: LOOPS, samples: SAMPLES, is_real: false, is_falling: false, farthest_bin: None };
        let (phases, drawn) = (numbers(3, 16, 0.0, std::f64::consts::TAU), numbers(4, 2 * LOOPS * RX * SAMPLES, -noise, noise));
        let value = |rx: usize, index: usize, sample: usize| {
            let tone =
                |bin: f64, phase: f64| Complex64::from_polar(1.0, std::f64::consts::TAU * bin * sample as f64 / 64.0 + phase);
            let still = (0..8).map(|at| {
                let direction = (at as f64 * 0.37).sin();
                let phase = phases[at] + std::f64::consts::PI * direction * rx as f64;
                tone(5.0 + 7.0 * at as f64, phase) * turn(index, direction)
            });
            let vibrating = 3.0 * tone(37.3, phases[9]) * [1.0, -1.0][index % 2];
            still.sum::<Complex64>() + vibrating
        };
        let (mut re, mut im) = (vec![], vec![]);
        for (rx, index) in (0..RX).flat_map(|rx| (0..LOOPS).map(move |index| (rx, index))) {
            for sample in 0..SAMPLES {
                let value = value(rx, index, sample);
                let place = 2 * ((rx * LOOPS + index) * SAMPLES + sample);
                re.push((value.re + drawn[place]) as f32);
                im.push((value.im + drawn[place + 1]) as f32);
            }
        }
        let mut inspector = Box::new(Alternation::new(schedule));
        inspector.see(&Stream::of(schedule, 0, &IfFrame::new([1, RX, LOOPS, SAMPLES], re, Some(im))));
        inspector.conclude().unwrap()
    }

    /// As transmitters two wavelengths apart see it.
    fn by_transmitter(kinds: usize, index: usize, direction: f64) -> Complex64 {
        Complex64::from_polar(1.0, 4.0 * std::f64::consts::PI * direction * (index % kinds) as f64)
    }

    #[test]
    fn transmitters_that_take_turns_are_counted() {
        let turns: [(usize, Turn); 3] = [
            (2, |index, direction| by_transmitter(2, index, direction)),
            (3, |index, direction| by_transmitter(3, index, direction)),
            (4, |index, direction| by_transmitter(4, index, direction)),
        ];
        for (kinds, turn) in turns {
            for noise in [0.05, 0.5] {
                let found = seen(turn, noise);
                assert!(
                    found.is_refusal() && found.found.contains(&format!("loops of {kinds} kinds")),
                    "{kinds}, {noise}: {found:?}"
                );
            }
        }
    }

    #[test]
    fn a_still_scene_another_gain_and_a_vibration_are_not_accused() {
        let turns: [Turn; 3] = [
            |_, _| Complex64::ONE,
            |index, _| Complex64::from([1.3, 1.0, 1.0][index % 3]),
            |index, _| Complex64::from_polar(1.0, [0.7, 0.0][index % 2]),
        ];
        for (case, turn) in turns.into_iter().enumerate() {
            for noise in [0.02, 0.5, 5.0] {
                let found = seen(turn, noise);
                assert!(found.ok, "{case}, {noise}: {found:?}");
            }
        }
        let found = seen(|_, _| Complex64::ZERO, 1.0);
        assert!(found.ok, "{found:?}");
    }
}
