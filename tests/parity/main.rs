//! The crate agrees with NumPy: golden arrays written by `scripts/golden.py` from the formulas alone, and captures read in NumPy.

mod body;
mod captures;
mod equations;
mod golden;
mod heatmaps;
mod learned;
mod metrics;
mod paths;
#[path = "../support/mod.rs"]
mod support;
