//! What somebody does, recognised from a recording: how much a classifier that has seen simulated recordings only
//! knows about measured ones.
//!
//! Recordings become maps of velocity, range and angle over time ([`maps`]), windows of these go through one
//! convolutional branch each and are judged together ([`network`]), after training on all windows of the training
//! recordings ([`training`]). [`scores`] counts, with intervals that know that windows of one recording are alike.

mod config;
pub mod maps;
pub mod network;
mod report;
mod run;
pub mod scores;
pub mod training;

pub use config::RecognitionConfig;
pub use report::{text, write};
pub use run::{Recognition, Stage, run};
