//! An effect's amplitudes by the score test, and by Gauss-Newton steps through its operator.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;

use super::cells::{self, Cell, Frame};
use super::directions::{Amplitudes, Direction, Drive};
use crate::diagnosis::estimated::Estimated;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::speckle::Look;
use crate::diagnosis::statistics::{chi2_tail, corrected, fisher_tail};
use crate::effects::{EffectInfo, Role};

/// Neighbouring range bins whose returns err together: the main lobe of the windows, to one side.
const PLACE: usize = cells::LOBE;
/// Cells along range and Doppler whose power is taken together: half a lobe.
const BLOCK: usize = 2;
/// Samples whose cells are held at a time, at most, and frames that are looked at whatever their size.
const MOST_SAMPLES: usize = 4_000_000;
const FEWEST_FRAMES: usize = 12;
/// Groups beyond the number of amplitudes, at least: with fewer, a scatter has no law to speak of.
const FEWEST_BESIDE: f64 = 6.0;
/// Chance of receivers that have the same values, below which each has its own.
const DIFFER: f64 = 1e-3;
/// Gauss-Newton steps, at most, and the share of the errors below which a step is none.
const STEPS: usize = 8;
const CONVERGED: f64 = 0.1;

/// What changes within a frame, and what does not.
#[derive(Clone, Copy)]
pub enum Part {
    Moving,
    Still,
}

impl Part {
    fn cells(self, frame: &Frame) -> &[Cell] {
        match self {
            Self::Moving => &frame.moving,
            Self::Still => &frame.still,
        }
    }
}

/// What a recording says of an effect's amplitudes.
pub struct Fit {
    pub amplitudes: Amplitudes,
    /// Whose cells it rests on.
    pub part: Part,
    /// Of their errors, by how groups of cells disagree.
    pub deviations: Vec<f64>,
    pub p_value: f64,
    /// Of each part of the frames, predicted by the others, nats.
    pub gain: f64,
    /// Of the power above the noise where the effect is above it: the share that the effect does not explain.
    pub left: f64,
    /// Energy that an amplitude of one adds to a frame, by direction.
    pub frame_energies: Vec<f64>,
}

impl Fit {
    /// The score tests of amplitudes of zero, by effect. None where too few cells say anything.
    pub fn at_zero(evidence: &Evidence, effects: &[&'static EffectInfo], reference: f64) -> Vec<Option<Self>> {
        let all = |info: &&'static EffectInfo| Some((Drive::new(info, evidence, reference)?, Direction::all(info)));
        let asked: Vec<(Drive, Vec<Direction>)> = effects.iter().filter_map(all).collect();
        assert_eq!(asked.len(), effects.len(), "effects that act on the summed signal");
        let by_frame: Vec<Vec<Frame>> =
            some_frames(evidence).into_par_iter().map(|frame| cells::of_frame(evidence, &asked, frame)).collect();
        let mut by_effect: Vec<Vec<Frame>> = asked.iter().map(|_| vec![]).collect();
        for frame in by_frame {
            by_effect.iter_mut().zip(frame).for_each(|(frames, cells)| frames.push(cells));
        }
        let receivers = evidence.cube.dims[2];
        let of = |((_, directions), frames): ((Drive, Vec<Direction>), Vec<Frame>)| Self::best(&frames, &directions, receivers);
        asked.into_par_iter().zip(by_effect).map(of).collect()
    }

    /// By what moves or by what stands still, whichever says more: chance makes the same of a return that stands still in all frames, so
    /// that the few ranges which hold most of what it says would stand for all frames.
    fn best(frames: &[Frame], directions: &[Direction], receivers: usize) -> Option<Self> {
        let may_differ = directions.iter().all(|direction| direction.parameter.role == Role::AmplitudeOfReceivers);
        let of_part = |part: Part| {
            let common = Self::of(frames, directions, 1, part, None);
            if !may_differ || receivers < 2 {
                return common.map(|(fit, _)| fit);
            }
            // One value for all receivers; or one for each, where they do not agree.
            let each = Self::of(frames, directions, receivers, part, None);
            each.filter(|(_, alike)| *alike < DIFFER).or(common).map(|(fit, _)| fit)
        };
        let fits = [Part::Moving, Part::Still].into_iter().filter_map(of_part);
        let fit = fits.min_by(|a, b| a.p_value.total_cmp(&b.p_value))?;
        let tried = if may_differ { 4.0 } else { 2.0 };
        Some(Self { p_value: corrected(fit.p_value, tried), ..fit })
    }

    /// With the chance that all receivers have the same values. `undone`: what was taken out already, for the share that is left.
    fn of(
        frames: &[Frame],
        directions: &[Direction],
        receivers: usize,
        part: Part,
        undone: Option<&Amplitudes>,
    ) -> Option<(Self, f64)> {
        let count = directions.len() * receivers;
        let amplitudes = |values: &[f64]| Amplitudes { directions: directions.to_vec(), values: values.to_vec() };
        let first = looks(frames, &amplitudes(&vec![0.0; count]), part);
        let of = |at: &DVector<f64>| Some(looks(frames, &amplitudes(at.as_slice()), part));
        let found = Estimated::converged(&first, &DMatrix::identity(count, count), &vec![0.0; count], of)?;
        let unit = |index: usize| DVector::from_fn(count, |row, _| if row == index { 1.0 } else { 0.0 });
        let deviations: Vec<f64> = (0..count).map(|index| found.deviation(&unit(index))).collect();
        // Differences from the first receiver.
        let own = count - directions.len();
        let contrasts = DMatrix::from_fn(count, own, |row, column| match row {
            row if row == column + directions.len() => 1.0,
            row if row == column % directions.len() => -1.0,
            _ => 0.0,
        });
        let alike = if own > 0 { found.chance(&contrasts) } else { 1.0 };
        let amplitudes = amplitudes(found.values.as_slice());
        let p_value = chance(&looks(frames, &amplitudes, part), found.square, &deviations)?;
        // Of all frames alike.
        let energy = |index: usize| frames.iter().map(|frame| frame.energies[index]).sum::<f64>() / frames.len() as f64;
        let fit = Self {
            deviations,
            p_value,
            gain: found.gain,
            left: left(frames, &amplitudes, part, undone),
            frame_energies: (0..directions.len()).map(energy).collect(),
            amplitudes,
            part,
        };
        Some((fit, alike))
    }

    /// The same amplitudes by Gauss-Newton steps: the effect is undone by its operator, and tested for again. None where that leads
    /// beyond what is believed.
    pub fn refined(self, evidence: &Evidence, info: &'static EffectInfo, reference: f64) -> Option<Self> {
        let drive = Drive::new(info, evidence, reference)?;
        let mut fit = self;
        for _ in 0..STEPS {
            if !fit.is_believed() {
                return None;
            }
            let mut undone = evidence.clone();
            undone.cube = drive.undone(&evidence.cube, &fit.amplitudes);
            let undone = undone.changed();
            let directions = fit.amplitudes.directions.clone();
            let asked = [(Drive::new(info, &undone, reference)?, directions.clone())];
            let of_frame = |frame| cells::of_frame(&undone, &asked, frame).remove(0);
            let frames: Vec<Frame> = some_frames(&undone).into_par_iter().map(of_frame).collect();
            let (step, _) = Self::of(&frames, &directions, fit.amplitudes.receivers(), fit.part, Some(&fit.amplitudes))?;
            let steps = &step.amplitudes.values;
            let is_last = steps.iter().zip(&step.deviations).all(|(step, deviation)| step.abs() < CONVERGED * deviation);
            fit.amplitudes.values.iter_mut().zip(steps).for_each(|(amplitude, step)| *amplitude += step);
            (fit.deviations, fit.left) = (step.deviations, step.left);
            if is_last {
                match fit.in_common() {
                    // What seemed to differ between receivers was the first step's error.
                    Some(amplitudes) => fit.amplitudes = amplitudes,
                    None => break,
                }
            }
        }
        fit.is_believed().then_some(fit)
    }

    /// The mean over receivers, where each has values of its own and these agree within their errors.
    fn in_common(&self) -> Option<Amplitudes> {
        let Amplitudes { directions, values } = &self.amplitudes;
        let (count, receivers) = (directions.len(), self.amplitudes.receivers());
        let weights: Vec<f64> = self.deviations.iter().map(|deviation| deviation.powi(-2)).collect();
        let mean = |direction: usize| {
            let of = || (0..receivers).map(|receiver| receiver * count + direction);
            of().map(|i| values[i] * weights[i]).sum::<f64>() / of().map(|i| weights[i]).sum::<f64>()
        };
        let means: Vec<f64> = (0..count).map(mean).collect();
        let squares =
            values.iter().zip(&weights).enumerate().map(|(i, (value, weight))| (value - means[i % count]).powi(2) * weight);
        let freedom = (count * (receivers - 1)) as f64;
        let agree = receivers > 1 && chi2_tail(squares.sum(), freedom) > DIFFER;
        agree.then(|| Amplitudes { directions: directions.clone(), values: means })
    }

    /// Whether every amplitude lies within its prior.
    fn is_believed(&self) -> bool {
        let Amplitudes { directions, values } = &self.amplitudes;
        let is_complex = directions.iter().any(|direction| direction.is_quadrature);
        directions.iter().cycle().zip(values).all(|(direction, value)| {
            let parameter = direction.parameter;
            let value = if is_complex { value.abs() } else { *value };
            (parameter.least..=parameter.most).contains(&value)
        })
    }
}

/// All frames, or as many as bound what is held of their cells, evenly spread.
fn some_frames(evidence: &Evidence) -> Vec<usize> {
    let [frames, rest @ ..] = evidence.cube.dims;
    let count = (MOST_SAMPLES / rest.iter().product::<usize>().max(1)).max(FEWEST_FRAMES).min(frames);
    (0..count).map(|index| index * frames / count).collect()
}

/// By frame and ranges; of what stands still, a range errs in all frames alike.
fn looks(frames: &[Frame], at: &Amplitudes, part: Part) -> Vec<Vec<Look>> {
    frames.par_iter().map(|frame| of_cells(part.cells(frame), at, matches!(part, Part::Still))).collect()
}

/// Chance of amplitudes of zero by Hotelling's law, with as many groups as count: where a few hold most of the information, the scatter
/// between groups is that of those few (Satterthwaite 1946; for sandwiches Bell and McCaffrey 2002). None of too few.
///
/// `square`: of the amplitudes, in units of their covariance; `deviations`: of theirs.
fn chance(frames: &[Vec<Look>], square: f64, deviations: &[f64]) -> Option<f64> {
    let freedom = deviations.len() as f64;
    // What a group says of all amplitudes, each in units of its own.
    let share = |look: &Look| -> f64 {
        deviations.iter().enumerate().map(|(index, deviation)| look.information[(index, index)] * deviation.powi(2)).sum()
    };
    let mut groups: BTreeMap<(bool, usize, usize), f64> = BTreeMap::new();
    for (frame, looks) in frames.iter().enumerate() {
        for (index, look) in looks.iter().enumerate() {
            let group = look.place.map_or((false, frame, index), |place| (true, place, 0));
            *groups.entry(group).or_default() += share(look);
        }
    }
    let (sum, squares) = groups.values().fold((0.0, 0.0), |(sum, squares), share| (sum + share, squares + share * share));
    let count = sum * sum / f64::max(squares, f64::MIN_POSITIVE);
    let below = count - freedom;
    let p_value = fisher_tail(square * below / (freedom * (count - 1.0)), freedom, below);
    (below > FEWEST_BESIDE).then_some(p_value)
}

/// Scores and information of the amplitudes, by ranges. What is in the cells besides has the power that is left in them: cells that
/// strangers fill say as much less.
fn of_cells(cells: &[Cell], at: &Amplitudes, is_still: bool) -> Vec<Look> {
    let left: Vec<Complex64> = cells.iter().map(|cell| cell.found - cell.expected(at)).collect();
    let block = |cell: &Cell| (cell.range / BLOCK, cell.doppler / BLOCK);
    let mut powers: BTreeMap<(usize, usize), [f64; 2]> = BTreeMap::new();
    for (cell, left) in cells.iter().zip(&left) {
        let [sum, count] = powers.entry(block(cell)).or_default();
        (*sum, *count) = (*sum + left.norm_sqr() / cell.noise, *count + 1.0);
    }
    let mut looks: BTreeMap<usize, Look> = BTreeMap::new();
    for (cell, left) in cells.iter().zip(&left) {
        let [sum, count] = powers[&block(cell)];
        let weight = 2.0 / (cell.noise * (sum / count).max(1.0));
        // Where each receiver has its own, those of the others are no matter of this cell.
        let (receiver, receivers) = if at.receivers() > 1 { (cell.receiver, at.receivers()) } else { (0, 1) };
        let (place, first) = (cell.range / PLACE * receivers + receiver, receiver * at.directions.len());
        let look = looks.entry(place).or_insert_with(|| Look::new(at.values.len(), is_still.then_some(place)));
        for (a, tangent) in cell.tangents.iter().enumerate() {
            look.score[first + a] += weight * (tangent.conj() * left).re;
            for (b, other) in cell.tangents.iter().enumerate() {
                look.information[(first + a, first + b)] += weight * (tangent.conj() * other).re;
            }
        }
    }
    looks.into_values().collect()
}

/// Share of the power above the noise that amplitudes leave, in cells where what they make is above it. `undone`: amplitudes of what was
/// taken out of the cells already.
fn left(frames: &[Frame], amplitudes: &Amplitudes, part: Part, undone: Option<&Amplitudes>) -> f64 {
    let (mut before, mut after) = (0.0, 0.0);
    for cell in frames.iter().flat_map(|frame| part.cells(frame)) {
        let (out, rest) = (undone.map_or(Complex64::ZERO, |undone| cell.expected(undone)), cell.expected(amplitudes));
        if (out + rest).norm_sqr() > cell.noise {
            before += (cell.found + out).norm_sqr() / cell.noise - 1.0;
            after += (cell.found - rest).norm_sqr() / cell.noise - 1.0;
        }
    }
    if before > 0.0 { (after / before).max(0.0) } else { 0.0 }
}
