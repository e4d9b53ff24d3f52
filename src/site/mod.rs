//! A site: many recordings of several subjects and actions in one room, by one board.
//!
//! Room, furniture, the board's imperfections, its gain and its noise level are the same in all sequences, and a subject's
//! surface is theirs; what differs from repetition to repetition is how the action is done, and the noise.

mod config;
mod plan;
mod record;

pub use config::{SiteConfig, StyleRanges};
pub use plan::{Sequence, drawn, implausible, sequences};
pub use record::{Site, record};
