//! The crate agrees with NumPy: golden arrays written by `scripts/golden.py` from the formulas alone.

mod golden;
mod heatmaps;
mod metrics;
