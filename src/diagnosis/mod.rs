//! The diagnosis: where a recording and what the simulator can explain part, what was left out, and how sure that is.
//!
//! The baseline is that of docs/diagnosis.md: the body's single bounce with free amplitudes, static clutter, thermal noise,
//! millimetre errors of the mesh, unknown phase and gain. [`Evidence`] is a recording as far as it is explained; every
//! detector looks at it and may return [`Candidate`]s; the best one is accepted, undone in the samples or added to what is
//! predicted, and all look again, until nobody has anything significant left to say.

pub mod audit;
pub mod behaviour;
pub mod calibration;
pub mod codes;
pub mod config;
mod course;
pub mod cube;
mod estimated;
pub mod evidence;
pub mod finding;
pub mod html;
pub mod journey;
pub mod limits;
pub mod locate;
pub mod misfit;
pub mod never;
pub mod null;
pub mod prediction;
mod residual;
pub mod report;
pub mod score;
pub mod select;
pub mod simulate;
mod speckle;
pub mod statistics;
pub mod support;
pub mod tones;
mod vector;
pub mod detectors;

pub use config::DiagnosisConfig;
pub use course::{Course, Of};
pub use cube::{Cube, Split};
pub use evidence::{Evidence, denoised, power, products};
pub use finding::{Candidate, Correction, Estimate, Place, Volume};
pub use journey::{Diagnosis, diagnose};
pub use prediction::{BodyPrediction, Point};
