//! What the stages do. Each fills its folder with files that later stages and the tables read.

pub mod baseline;
mod bench;
mod figure;
mod measure;
pub mod simulate;
mod sources;
pub mod train;

pub use bench::Bench;
pub use figure::figure;
pub use measure::{Speed, compare, recognise, write_json};
pub use sources::{diagnose, site};
pub use train::Stability;
