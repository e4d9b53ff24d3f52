//! What cells say of an effect's amplitudes: scores, information, and what is left.

use std::collections::BTreeMap;

use num_complex::Complex64;

use super::cells::{Cell, LOBE};
use super::directions::Amplitudes;
use crate::diagnosis::speckle::Look;

/// Neighbouring range bins whose returns err together: the main lobe of the windows, to one side.
const PLACE: usize = LOBE;
/// Cells along range and Doppler whose power is taken together: half a lobe.
const BLOCK: usize = 2;

/// Scores and information of the amplitudes, by ranges. What is in the cells besides has the power that is left in them: cells that
/// untracked movers fill say as much less.
pub fn of_cells(cells: &[Cell], at: &Amplitudes) -> BTreeMap<usize, Look> {
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
        let look = looks.entry(place).or_insert_with(|| Look::new(at.values.len(), None));
        for (a, tangent) in cell.tangents.iter().enumerate() {
            look.score[first + a] += weight * (tangent.conj() * left).re;
            for (b, other) in cell.tangents.iter().enumerate() {
                look.information[(first + a, first + b)] += weight * (tangent.conj() * other).re;
            }
        }
    }
    looks
}

/// Share of the power above the noise that amplitudes leave, in cells where what they make is above it.
pub fn left<'a>(cells: impl Iterator<Item = &'a Cell>, amplitudes: &Amplitudes) -> f64 {
    let (mut before, mut after) = (0.0, 0.0);
    for cell in cells {
        let expected = cell.expected(amplitudes);
        if expected.norm_sqr() > cell.noise {
            before += cell.found.norm_sqr() / cell.noise - 1.0;
            after += (cell.found - expected).norm_sqr() / cell.noise - 1.0;
        }
    }
    if before > 0.0 { (after / before).max(0.0) } else { 0.0 }
}
