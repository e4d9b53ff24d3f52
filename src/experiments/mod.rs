//! The paper's experiments, from nothing to tables: a site is recorded, simulators are trained, every method simulates what
//! was measured, and what comes out is scored and learned from. Recording folders are all that methods exchange.
//!
//! - [`config`]: what is asked for
//! - [`few`]: what a classifier learns from few recordings
//! - [`takes`], [`variants`]: who does what in which recording; ours and its ablations
//! - [`preflight`]: what cannot work is refused before anything is recorded
//! - [`task`], [`mod@plan`]: every stage with what it depends on, before any of them runs
//! - [`stage`], [`mod@run`], [`schedule`], [`steps`]: each is done once, under the hash of all that it depends on
//! - [`results`], [`paper`], [`tables`], [`report`]: numbers, the paper's, and both side by side

mod cells;
pub mod config;
pub mod few;
pub mod figures;
mod further;
pub mod pairs;
pub mod paper;
pub mod plan;
pub mod preflight;
pub mod report;
pub mod results;
pub mod run;
pub mod schedule;
pub mod stage;
pub mod steps;
pub mod tables;
pub mod takes;
pub mod task;
pub mod variants;

pub use config::ReproduceConfig;
pub use plan::{Plan, plan, plan_again};
pub use run::{Event, run_one};
pub use schedule::with_jobs;
pub use stage::Store;
