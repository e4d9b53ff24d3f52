//! An effect's amplitudes by the score test, and by Gauss-Newton steps through its operator.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::cells::{self, Cell, Part, Pattern, Shift};
use super::directions::{Amplitudes, Direction, Drive};
use super::looks::{left, of_cells};
use super::shifted::{self, Law};
use crate::diagnosis::estimated::Estimated;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::speckle::Look;
use crate::diagnosis::statistics::{chi2_tail, corrected};
use crate::effects::{EffectInfo, Role};

/// Samples whose cells are held at a time, at most, and frames that are looked at whatever their size.
const MOST_SAMPLES: usize = 4_000_000;
const FEWEST_FRAMES: usize = 12;
/// Chance of receivers that have the same values, below which each has its own.
const DIFFER: f64 = 1e-3;
/// Chance and gain (nats, `diagnosis.gain`) up to which a fit is refined by steps through the operator: others cannot be accepted.
pub const WORTH_REFINING: f64 = 1e-3;
const WORTH_GAINING: f64 = 6.0;
/// Gauss-Newton steps, at most, and the share of the errors below which a step is none.
const STEPS: usize = 8;
const CONVERGED: f64 = 0.1;

/// Of one frame: cells of what changes within it, and of what does not.
struct Frame {
    moving: Vec<Cell>,
    clutter: Vec<Cell>,
    /// Sum over all samples of |tangent|², by amplitude.
    energies: Vec<f64>,
}

impl Frame {
    fn new(pattern: Pattern) -> Self {
        let [moving, clutter] = [Part::Moving, Part::Clutter].map(|part| pattern.cells(part, Shift::default()));
        Self { moving, clutter, energies: pattern.energies }
    }

    fn cells(&self, part: Part) -> &[Cell] {
        match part {
            Part::Moving => &self.moving,
            Part::Clutter => &self.clutter,
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
    pub nats: f64,
    /// Of the power above the noise where the effect is above it: the share that the effect does not explain.
    pub left: f64,
    /// Energy that an amplitude of one adds to a frame, by direction.
    pub frame_energies: Vec<f64>,
}

impl Fit {
    /// By effect: the score test of amplitudes of zero, and where that is significant its fit. None where too few cells say anything.
    pub fn at_zero(evidence: &Evidence, effects: &[&'static EffectInfo], reference: f64) -> Vec<Option<Self>> {
        let all = |info: &&'static EffectInfo| Some((Drive::new(info, evidence, reference)?, Direction::all(info)));
        let asked: Vec<(Drive, Vec<Direction>)> = effects.iter().filter_map(all).collect();
        assert_eq!(asked.len(), effects.len(), "effects that act on the summed signal");
        let of_frame = |frame| cells::of_frame(evidence, &asked, frame).into_iter().map(Frame::new).collect();
        let by_frame: Vec<Vec<Frame>> = some_frames(evidence).into_par_iter().map(of_frame).collect();
        let mut by_effect: Vec<Vec<Frame>> = asked.iter().map(|_| vec![]).collect();
        for frame in by_frame {
            by_effect.iter_mut().zip(frame).for_each(|(frames, cells)| frames.push(cells));
        }
        let of = |(asked, frames): ((Drive, Vec<Direction>), Vec<Frame>)| Self::best(evidence, asked, &frames);
        asked.into_iter().zip(by_effect).map(of).collect()
    }

    /// By movers or by static clutter, with a value of all receivers or, where these differ, of each; whichever says most.
    fn best(evidence: &Evidence, asked: (Drive, Vec<Direction>), frames: &[Frame]) -> Option<Self> {
        let may_differ = asked.1.iter().all(|direction| direction.parameter.role == Role::AmplitudeOfReceivers);
        let receivers = evidence.cube.dims[2];
        let numbers = if may_differ && receivers > 1 { vec![1, receivers] } else { vec![1] };
        let energies = mean_energies(frames.iter().map(|frame| &frame.energies));
        let of = |(part, receivers)| {
            let cells: Vec<&[Cell]> = frames.iter().map(|frame| frame.cells(part)).collect();
            let fit = Self::of(&cells, &energies, &asked.1, receivers, part)?;
            if fit.p_value > WORTH_REFINING || fit.nats < WORTH_GAINING {
                return Some(Self { p_value: fit.p_value.max(WORTH_REFINING), ..fit });
            }
            fit.refined(evidence, &asked).filter(|fit| receivers == 1 || fit.receivers_differ())
        };
        let tests =
            [Part::Moving, Part::Clutter].into_iter().flat_map(|part| numbers.iter().map(move |&receivers| (part, receivers)));
        let fit = tests.filter_map(of).min_by(|a, b| a.p_value.total_cmp(&b.p_value))?;
        Some(Self { p_value: corrected(fit.p_value, 2.0 * numbers.len() as f64), ..fit })
    }

    /// `cells`: of the part, by frame; `energies`: of a frame, by direction.
    fn of(
        cells: &[impl AsRef<[Cell]> + Sync],
        energies: &[f64],
        directions: &[Direction],
        receivers: usize,
        part: Part,
    ) -> Option<Self> {
        let count = directions.len() * receivers;
        let amplitudes = |values: &[f64]| Amplitudes { directions: directions.to_vec(), values: values.to_vec() };
        let first = looks(cells, &amplitudes(&vec![0.0; count]));
        let of = |at: &DVector<f64>| Some(looks(cells, &amplitudes(at.as_slice())));
        let found = Estimated::converged(&first, &DMatrix::identity(count, count), &vec![0.0; count], of)?;
        let unit = |index: usize| DVector::from_fn(count, |row, _| if row == index { 1.0 } else { 0.0 });
        let amplitudes = amplitudes(found.values.as_slice());
        Some(Self {
            deviations: (0..count).map(|index| found.deviation(&unit(index))).collect(),
            p_value: found.p_value,
            nats: found.nats,
            left: left(cells.iter().flat_map(AsRef::as_ref), &amplitudes),
            frame_energies: energies.to_vec(),
            amplitudes,
            part,
        })
    }

    /// By Gauss-Newton steps: the effect is undone by its operator, and what that changes to first order is fitted anew; then held against
    /// shifted patterns, which what is undone disturbs no more. None where there are too few of them, or where that leads beyond what is
    /// believed.
    fn refined(self, evidence: &Evidence, asked: &(Drive, Vec<Direction>)) -> Option<Self> {
        let mut fit = self;
        for step in 1..=STEPS {
            if !fit.is_believed() {
                return None;
            }
            let mut undone = evidence.clone();
            undone.cube = asked.0.undone(&evidence.cube, &fit.amplitudes);
            let patterns = patterns(&undone.changed(), asked);
            let cells: Vec<Vec<Cell>> = patterns.iter().map(|pattern| pattern.put_back(fit.part, &fit.amplitudes)).collect();
            let energies = mean_energies(patterns.iter().map(|pattern| &pattern.energies));
            let next = Self::of(&cells, &energies, &asked.1, fit.amplitudes.receivers(), fit.part)?;
            let mut changes = next.amplitudes.values.iter().zip(&fit.amplitudes.values).zip(&next.deviations);
            if step == STEPS || changes.all(|((next, last), deviation)| (next - last).abs() < CONVERGED * deviation) {
                let law = shifted::against(&patterns, &cells, &fit.amplitudes, fit.part)?;
                return Some(next.against(&law)).filter(Self::is_believed);
            }
            fit = next;
        }
        None
    }

    /// With the chance, the gain and the errors that shifted patterns leave it.
    fn against(self, law: &Law) -> Self {
        let errors = || self.deviations.iter().zip(&law.deviations).map(|(own, least)| own.max(*least));
        let wider = errors().zip(&self.deviations).map(|(error, own)| (error / own).powi(2)).sum::<f64>();
        let gain = self.nats * self.deviations.len() as f64 / wider;
        Self { p_value: self.p_value.max(law.p_value), nats: gain, deviations: errors().collect(), ..self }
    }

    /// Whether values of receivers differ by more than their errors.
    fn receivers_differ(&self) -> bool {
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
        chi2_tail(squares.sum(), (count * (receivers - 1)) as f64) < DIFFER
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

/// Of all frames that are looked at.
fn patterns(evidence: &Evidence, asked: &(Drive, Vec<Direction>)) -> Vec<Pattern> {
    let of_frame = |frame| cells::of_frame(evidence, std::slice::from_ref(asked), frame).remove(0);
    some_frames(evidence).into_par_iter().map(of_frame).collect()
}

/// By frame and ranges.
fn looks(cells: &[impl AsRef<[Cell]> + Sync], at: &Amplitudes) -> Vec<Vec<Look>> {
    cells.par_iter().map(|cells| of_cells(cells.as_ref(), at).into_values().collect()).collect()
}

/// By direction, of frames that are at least one.
fn mean_energies<'a>(frames: impl Iterator<Item = &'a Vec<f64>>) -> Vec<f64> {
    let frames: Vec<&Vec<f64>> = frames.collect();
    (0..frames[0].len()).map(|index| frames.iter().map(|frame| frame[index]).sum::<f64>() / frames.len() as f64).collect()
}
