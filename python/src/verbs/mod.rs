//! A verb, a file.

pub mod align;
pub mod challenge;
pub mod check;
pub mod diagnose;
pub mod export;
pub mod heatmaps;
pub mod import;
pub mod read;
pub mod record;
pub mod reproduce;
pub mod simulate;
pub mod site;
pub mod train;
