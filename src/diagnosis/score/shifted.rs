//! An effect's pattern against the same pattern elsewhere.
//!
//! What else is in the cells where an effect would be (untracked movers, tails, static clutter, which makes the same coincidence in all
//! frames) agrees with the pattern no more than with one that is shifted by more than a main lobe. So the statistic of the pattern is held
//! against that of shifted ones: F-test, with the degrees of freedom that the scatter of the latter has (Satterthwaite 1946). Of static
//! clutter, no range decides alone: that which says most is left out, of the pattern and of shifted ones.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::cells::{Cell, Part, Pattern, Shift};
use super::directions::Amplitudes;
use super::looks::of_cells;
use crate::diagnosis::speckle::Look;
use crate::diagnosis::statistics::fisher_tail;

/// Shifted patterns, at most, and fewest for a law.
const MOST: usize = 40;
const FEWEST: usize = 8;
/// Steps to the most likely amplitudes, and a share of their length that is no step.
const STEPS: usize = 8;
const CONVERGED: f64 = 1e-3;

pub struct Law {
    pub p_value: f64,
    /// Of the amplitudes' errors, where all is as in shifted patterns.
    pub deviations: Vec<f64>,
}

/// None of too few shifts. `patterns`: by frame, of what is left when the effect is undone; `cells`: by frame, where they are, with what
/// was undone; `of`: directions and receivers of the amplitudes.
pub fn against(patterns: &[Pattern], cells: &[Vec<Cell>], of: &Amplitudes, part: Part) -> Option<Law> {
    let count = of.values.len() as f64;
    let of_shift = |shift: Shift| {
        let cells: Vec<Vec<Cell>> = patterns.iter().map(|pattern| pattern.cells(part, shift)).collect();
        Some(Fitted::new(&cells, of, part)?.square)
    };
    let others: Vec<f64> = patterns.first()?.shifts(part, MOST).into_par_iter().filter_map(of_shift).collect();
    if others.len() < FEWEST {
        return None;
    }
    let found = Fitted::new(cells, of, part)?;
    let (level, p_value) = level_and_chance(found.square, &others, count);
    let inverse = found.information.cholesky()?.inverse();
    Some(Law { p_value, deviations: inverse.diagonal().iter().map(|variance| (variance * level / count).sqrt()).collect() })
}

/// Mean of what others have, at least that of noise alone, and chance of so much. `freedom`: that of noise alone.
fn level_and_chance(found: f64, others: &[f64], freedom: f64) -> (f64, f64) {
    let count = others.len() as f64;
    let mean = others.iter().sum::<f64>() / count;
    let variance = others.iter().map(|other| (other - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let scatter = (2.0 * mean * mean / variance.max(f64::MIN_POSITIVE)).min(freedom);
    let level = mean.max(freedom);
    (level, fisher_tail(found / level, scatter, scatter * count))
}

/// The most likely amplitudes, where cells have the power that these leave.
struct Fitted {
    /// θ̂ᵀ I θ̂; of static clutter, without the range that says most.
    square: f64,
    information: DMatrix<f64>,
}

impl Fitted {
    /// None where the cells do not show all of them. `frames`: cells by frame; `of`: directions and receivers.
    fn new(frames: &[Vec<Cell>], of: &Amplitudes, part: Part) -> Option<Self> {
        let count = of.values.len();
        let mut at = DVector::zeros(count);
        let mut places = BTreeMap::new();
        for _ in 0..STEPS {
            let amplitudes = Amplitudes { directions: of.directions.clone(), values: at.as_slice().to_vec() };
            places = by_place(frames.iter().flat_map(|cells| of_cells(cells, &amplitudes)));
            let sum = Look::sum(places.values(), count);
            let step = sum.information.clone().cholesky()?.solve(&sum.score);
            let squared = |of: &DVector<f64>| of.dot(&(&sum.information * of));
            if squared(&step) <= CONVERGED * CONVERGED * squared(&at) {
                break;
            }
            at += &step;
        }
        let information = Look::sum(places.values(), count).information;
        if matches!(part, Part::Clutter) {
            // A coincidence at one range is the same in all frames, and as wide as the main lobe.
            let receivers = of.receivers();
            for receiver in 0..receivers {
                let says = |look: &Look| 2.0 * look.score.dot(&at) + at.dot(&(&look.information * &at));
                let of_receiver = places.iter().filter(|(place, _)| *place % receivers == receiver);
                let most = *of_receiver.max_by(|a, b| says(a.1).total_cmp(&says(b.1)))?.0;
                places.retain(|place, _| place % receivers != receiver || place.abs_diff(most) > receivers);
            }
        }
        let rest = Look::sum(places.values(), count);
        // Scores at zero.
        let score = rest.score + &rest.information * at;
        let square = score.dot(&rest.information.cholesky()?.solve(&score));
        Some(Self { square, information })
    }
}

fn by_place(looks: impl Iterator<Item = (usize, Look)>) -> BTreeMap<usize, Look> {
    let mut places: BTreeMap<usize, Look> = BTreeMap::new();
    for (place, look) in looks {
        *places.entry(place).or_insert_with(|| Look::new(look.score.len(), None)) += &look;
    }
    places
}
