//! Where a recording holds what is not explained: power over what is expected, along every axis and in boxes of all
//! sizes.
//!
//! Under the null every cell of the range-Doppler maps, over its expected power, is a gamma law of mean one; a box of
//! cells sums such values. Boxes are dyadic (halves of halves of every axis), so that a line, a spot and a whole frame
//! are all found at their own size. The Benjamini-Yekutieli rule at 5 % keeps the share of false boxes below that,
//! whatever the dependence between nested boxes (Annals of Statistics 29, 2001).

mod boxes;
mod parts;
mod profile;
mod residual;
mod sums;

pub use boxes::{Strongest, strongest};
pub use parts::{Seen, by_part, by_wall};
pub use profile::{Profile, profiles};
pub use residual::{BODY_FACTOR, CELLS_PER_VALUE, Residual};
pub use sums::{Table, intervals};

use super::Evidence;
use super::finding::Place;

/// A box of cells with more power than is expected there.
#[derive(Clone, Debug)]
pub struct Region {
    pub place: Place,
    /// Measured over expected power.
    pub excess_db: f64,
    /// Energy beyond the expected, in units of one sample's noise.
    pub energy: f64,
    pub p_value: f64,
}

/// The boxes that explain the excess best: significant, none inside another, the most unlikely first.
pub fn locate(evidence: &Evidence) -> Vec<Region> {
    Residual::new(evidence).map_or_else(Vec::new, |residual| boxes::regions(evidence, &residual))
}
