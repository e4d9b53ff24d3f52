//! Phases that an accepted finding has over time: an observation for those that are asked after it.
//!
//! With e^{jφ} the course of a return, what the receiver adds after the mixer has order 0, its conjugate image order −1, and what goes out
//! a second time order 2.

use num_complex::Complex64;

/// Of which returns a phase is.
#[derive(Clone, Debug, PartialEq)]
pub enum Of {
    /// All static ones. It was undone in the samples.
    All,
    /// Of what moves at a beat frequency (range bins), with its amplitude in every channel. It was taken out of the samples.
    Mover { bin: f64, amplitude: Vec<Complex64> },
}

/// 1, e^{jφ} and e^{2jφ} of e^{jφ}.
pub fn powers(turned: Complex64) -> [Complex64; 3] {
    [Complex64::ONE, turned, turned * turned]
}

/// The phase that some returns have over time.
#[derive(Clone, Debug)]
pub struct Course {
    pub of: Of,
    /// e^{jφ}, `[frame][tx · loops + loop]` of all static returns, `[frame]` of a mover.
    pub turned: Vec<Complex64>,
}
