//! Items in a row that may take turns, the loops of a frame or frames: what tells kinds of them apart at the static returns.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use num_complex::Complex64;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::ALARM;
use super::stream::Schedule;
use super::tails::log_binomial_tail;

/// Of each kind, at least: what two differ by is known.
const FEWEST: usize = 2;
/// Steps towards the common factor: each brings a cell that follows it nearer to its noise.
const ITERATIONS: usize = 8;
/// Level at which one return takes turns.
const LEVEL: f64 = 0.05;
/// Least noise of a cell against the energy of a chirp: samples are held as f32, which rounds each by so much.
const ROUNDING: f64 = (f32::EPSILON as f64) * (f32::EPSILON as f64);

/// What is summed over rows for items of so many kinds.
struct Turns {
    kinds: usize,
    /// Items of a row: whole rounds.
    items: usize,
    /// Means of the kinds `[kind, cell]`: counted from each row's first item, and through all rows where that is not the same.
    means: Vec<DMatrix<Complex64>>,
    /// By cell: energy of each row's means around their mean, and that of items around their kind's.
    between: Vec<f64>,
    within: Vec<f64>,
}

/// What takes turns alike in all rows, by range bin, over channels.
struct Alike {
    /// Energy of the kinds' means around their mean, and that beyond a factor common to all returns.
    between: Vec<f64>,
    beyond: Vec<f64>,
    /// Of one mean's deviation without turns: within kinds, or between rows where that is more.
    noise: Vec<f64>,
}

/// Chances of the turns that each static return takes: of any, and of those beyond a common factor.
pub(super) type Chances = Vec<[f64; 2]>;

/// That most static returns take turns.
pub(super) struct TakenTurns {
    pub kinds: usize,
    /// At how many returns, in words.
    pub places: String,
    pub log_p: f64,
}

/// Rows of items that may take turns: the loops of each frame, or the first loops of all frames.
pub(super) struct Sequence {
    schedule: Schedule,
    turns: Vec<Turns>,
    /// Energy of the mean item by range bin, over channels.
    clutter: Vec<f64>,
    pub rows: usize,
}

impl Sequence {
    /// Rows of so many items, of each of `kinds` for which that is enough.
    pub fn new(schedule: Schedule, items: usize, kinds: impl Iterator<Item = usize>) -> Self {
        let cells = schedule.channels() * schedule.samples;
        let of = |kinds| {
            let zeros = || vec![0.0; cells];
            let ways = if items.is_multiple_of(kinds) { 1 } else { 2 };
            let means = vec![DMatrix::zeros(kinds, cells); ways];
            Turns { kinds, items: items - items % kinds, means, between: zeros(), within: zeros() }
        };
        let turns = kinds.filter(|kinds| items / kinds >= FEWEST).map(of).collect();
        Self { schedule, turns, clutter: vec![0.0; schedule.samples], rows: 0 }
    }

    pub fn is_empty(&self) -> bool {
        self.turns.is_empty()
    }

    /// Whether so many kinds are looked at.
    pub fn has(&self, kinds: usize) -> bool {
        self.turns.iter().any(|turns| turns.kinds == kinds)
    }

    /// Adds a row of spectra, `[item][cell]`, of which the first is the `start`-th of all.
    pub fn add(&mut self, spectra: &[Complex64], start: usize) {
        self.rows += 1;
        let samples = self.schedule.samples;
        let cells = self.schedule.channels() * samples;
        let items = spectra.len() / cells;
        for (cell, value) in means(spectra, cells, 1).iter().enumerate() {
            self.clutter[cell % samples] += items as f64 * value.norm_sqr();
        }
        for turns in &mut self.turns {
            let own = &spectra[..turns.items * cells];
            let mut energy = vec![0.0; cells];
            for values in own.chunks_exact(cells) {
                energy.iter_mut().zip(values).for_each(|(sum, value)| *sum += value.norm_sqr());
            }
            let each = (turns.items / turns.kinds) as f64;
            let means = means(own, cells, turns.kinds);
            // The strongest channel's: a dead one has next to no samples, and no less noise.
            let strongest = energy.chunks_exact(samples).map(|chirp| chirp.iter().sum::<f64>()).fold(0.0, f64::max);
            let floor = ROUNDING * strongest / samples as f64;
            for (cell, values) in means.column_iter().enumerate() {
                let all = each * values.norm_squared();
                turns.between[cell] += (all - each * values.sum().norm_sqr() / turns.kinds as f64).max(0.0);
                turns.within[cell] += (energy[cell] - all).max(floor);
            }
            for (sum, first) in turns.means.iter_mut().zip([0, start % turns.kinds]) {
                add_turned(sum, &means, first, samples);
            }
        }
    }

    /// Chance that energy in so many means exceeds the noise as much: from one row, the F law of what scatters within kinds; from more,
    /// that of what scatters between rows, as only what is alike in all of them is turns.
    fn chance(&self, means: usize, energy: f64, turns: &Turns, noise: f64) -> f64 {
        if noise <= 0.0 {
            return if energy > 0.0 { 0.0 } else { 1.0 };
        }
        let below = if self.rows > 1 { (self.rows - 1) * (turns.kinds - 1) } else { turns.items - turns.kinds };
        // Complex values: two degrees each. Channels share what they see and count once.
        let law = FisherSnedecor::new(2.0 * means as f64, 2.0 * below as f64).expect("degrees of freedom");
        law.sf(energy / means as f64 / noise)
    }

    /// What takes turns alike in all rows, counted one way.
    fn alike(&self, turns: &Turns, way: usize) -> Alike {
        let (samples, rows) = (self.schedule.samples, self.rows as f64);
        // Items of a kind in all rows.
        let all = rows * (turns.items / turns.kinds) as f64;
        let means = &turns.means[way] / Complex64::from(rows);
        let energies: Vec<f64> = means.column_iter().map(|cell| cell.norm_squared()).collect();
        let degrees = (turns.items - turns.kinds) as f64 * rows;
        let within: Vec<f64> = turns.within.iter().map(|within| within / degrees).collect();
        let of_means: Vec<f64> = within.iter().map(|within| within * (turns.kinds - 1) as f64 / all).collect();
        let factor = common(&means, &energies, &of_means);
        let zeros = || vec![0.0; samples];
        let mut alike = Alike { between: zeros(), beyond: zeros(), noise: zeros() };
        for (cell, values) in means.column_iter().enumerate() {
            let bin = cell % samples;
            let between = all * (energies[cell] - values.sum().norm_sqr() / turns.kinds as f64).max(0.0);
            alike.between[bin] += between;
            alike.beyond[bin] += all * (energies[cell] - factor.dotc(&values).norm_sqr()).max(0.0);
            let rest = (turns.between[cell] - between).max(0.0) / ((rows - 1.0) * (turns.kinds - 1) as f64);
            alike.noise[bin] += if self.rows > 1 { within[cell].max(rest) } else { within[cell] };
        }
        alike
    }

    /// Of what items scatter within kinds in a range bin, over channels.
    fn scatter(&self, turns: &Turns, bin: usize) -> f64 {
        turns.within.iter().skip(bin).step_by(self.schedule.samples).sum()
    }

    /// Range bins of the returns of the static scene, above the noise.
    fn returns(&self, turns: &Turns) -> Vec<usize> {
        let bins = self.schedule.samples;
        let is_peak = |bin: usize| [bin + bins - 1, bin + 1].iter().all(|other| self.clutter[bin] > self.clutter[other % bins]);
        let noise = |bin: usize| self.scatter(turns, bin) / (turns.items - turns.kinds) as f64;
        // A real signal has each return twice.
        let different = if self.schedule.is_real { bins / 2 } else { bins };
        (0..different).filter(|&bin| is_peak(bin) && self.clutter[bin] > -ALARM.ln() * noise(bin)).collect()
    }

    /// Of each static return, by chance alone, turns beyond those of fewer kinds.
    fn chances(&self, fewer: Option<(&Turns, &Alike)>, turns: &Turns, alike: &Alike) -> Chances {
        let means = turns.kinds - fewer.map_or(1, |(fewer, _)| fewer.kinds);
        let of = |bin: usize| {
            let explained = fewer.map_or(0.0, |(_, fewer)| fewer.between[bin]);
            let any = self.chance(means, alike.between[bin] - explained, turns, alike.noise[bin]);
            [any, self.chance(turns.kinds - 1, alike.beyond[bin], turns, alike.noise[bin])]
        };
        self.returns(turns).into_iter().map(of).collect()
    }

    /// Kinds and ways to count them.
    fn ways(&self) -> impl Iterator<Item = (&Turns, usize)> {
        self.turns.iter().flat_map(|turns| (0..turns.means.len()).map(move |way| (turns, way)))
    }

    /// Returns without which [`each_by_itself`] finds nothing, whatever they do.
    pub fn fewest_returns(&self) -> usize {
        ((ALARM.ln() - (self.ways().count() as f64).ln()) / LEVEL.ln()).ceil() as usize
    }

    /// The most kinds that most returns show, with the chance of it by `law`; and at how many returns was looked.
    pub fn found(&self, law: fn(&Chances) -> f64) -> (Option<TakenTurns>, usize) {
        let mut found: Option<(&Turns, Alike, String, f64)> = None;
        let mut most = 0;
        for (turns, way) in self.ways() {
            let fewer = found.as_ref().filter(|fewer| turns.kinds > fewer.0.kinds && turns.kinds % fewer.0.kinds == 0);
            if found.is_some() && fewer.is_none() {
                continue;
            }
            let alike = self.alike(turns, way);
            let chances = self.chances(fewer.map(|(fewer, alike, ..)| (*fewer, alike)), turns, &alike);
            most = most.max(chances.len());
            let any = chances.iter().filter(|[any, _]| *any < LEVEL).count();
            let log_p = (self.ways().count() as f64).ln() + law(&chances);
            if 2 * any > chances.len() && log_p < ALARM.ln() {
                found = Some((turns, alike, format!("at {any} of {} static returns", chances.len()), log_p));
            }
        }
        (found.map(|(turns, _, places, log_p)| TakenTurns { kinds: turns.kinds, places, log_p }), most)
    }
}

/// Of so many returns that take turns where each does so by itself.
pub(super) fn each_by_itself(chances: &Chances) -> f64 {
    let count = |which: usize| chances.iter().filter(|chances| chances[which] < LEVEL).count();
    [0, 1].map(|which| log_binomial_tail(count(which), chances.len(), LEVEL)).into_iter().fold(f64::NEG_INFINITY, f64::max)
}

/// Of more than half of the returns where all do so together.
pub(super) fn all_together(chances: &Chances) -> f64 {
    let middle = |which: usize| {
        let mut own: Vec<f64> = chances.iter().map(|chances| chances[which]).collect();
        own.sort_by(f64::total_cmp);
        own.get(own.len() / 2).map_or(0.0, |chance| chance.max(f64::MIN_POSITIVE).ln())
    };
    middle(0).max(middle(1))
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
            let weight = if left + noise > 0.0 { 1.0 / (left + noise) } else { 0.0 };
            products.gerc(weight.into(), &cell, &cell, Complex64::ONE);
        }
        let eigen = SymmetricEigen::new(products);
        factor = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
        let along = means.column_iter().map(|cell| factor.dotc(&cell).norm_sqr());
        left = energies.iter().zip(along).map(|(energy, along)| (energy - along).max(0.0)).collect();
    }
    factor
}

/// Adds a row's means `[kind, cell]`, of which the first is of the kind `first`, each range bin turned to the phase that it had: a phase
/// that all returns share from row to row is no turn.
fn add_turned(sum: &mut DMatrix<Complex64>, means: &DMatrix<Complex64>, first: usize, samples: usize) {
    let kinds = means.nrows();
    let mut along = vec![Complex64::ZERO; samples];
    for (cell, values) in means.column_iter().enumerate() {
        let known = sum.column(cell);
        along[cell % samples] += (0..kinds).map(|kind| values[kind].conj() * known[(first + kind) % kinds]).sum::<Complex64>();
    }
    for (cell, values) in means.column_iter().enumerate() {
        let turn = along[cell % samples];
        let turn = if turn.norm() > 0.0 { turn / turn.norm() } else { Complex64::ONE };
        let mut known = sum.column_mut(cell);
        (0..kinds).for_each(|kind| known[(first + kind) % kinds] += values[kind] * turn);
    }
}

/// Means of the items of each kind, `[kind, cell]`, from spectra `[item][cell]`.
fn means(spectra: &[Complex64], cells: usize, kinds: usize) -> DMatrix<Complex64> {
    let mut means = DMatrix::zeros(kinds, cells);
    for (index, values) in spectra.chunks_exact(cells).enumerate() {
        means.row_mut(index % kinds).iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
    }
    means * Complex64::from(kinds as f64 * cells as f64 / spectra.len() as f64)
}
