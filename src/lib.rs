//! HybridSim: a differentiable simulator of mmWave radar recordings of moving people.
//!
//! The modules in the order the data travels. A module imports only from those before it; `tests/layers.rs` enforces it.

// 0: what everyone needs
pub mod bounds;
pub mod complex;
mod device;
pub mod error;
pub mod grid;
pub mod text;
// 1: what the user gives
pub mod person;
pub mod radar;
pub mod room;
// 2: the files it comes in
pub mod data;
// whether samples are whole, before anybody asks what is in them
pub mod integrity;
pub mod import;
// whether it can be
pub mod plausibility;
// the independent world that makes recordings: shares settings, errors and files with the simulator, never physics
pub mod recorder;
// many recordings of one room and one board
pub mod site;
// 3: the simulator
pub mod body;
pub mod features;
pub mod scatterers;
pub mod paths;
pub mod if_signal;
pub mod heatmap;
pub mod loss;
pub mod metrics;
pub mod lpips;
pub mod effects;
pub mod simulator;
// 4: what is done with it
pub mod training;
pub mod evaluation;
pub mod pictures;
// recordings and what is seen in them, in the layouts of others
pub mod export;
// how others simulate the same recordings
pub mod baselines;
// why a recording and the simulator disagree
pub mod diagnosis;
// where and when a recording's motion happens
pub mod alignment;
// what somebody does in a recording
pub mod recognition;
pub mod config;
// the proof on concealed data
pub mod challenge;
pub mod catalogue;
// the paper's tables, from nothing
pub mod experiments;
// what the verbs do, without a terminal
pub mod verbs;
pub mod cli;

pub use error::{Error, Result};

#[cfg(test)]
mod gradient_tests;

/// Helpers of the tests, shared with the integration tests.
#[cfg(test)]
#[path = "../tests/support/mod.rs"]
mod support;
