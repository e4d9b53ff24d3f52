//! What is learned about each place, one vector of numbers each (paper, section 3.1).
//!
//! ```text
//! canonical body points -> triplane -> [graph: training only] -> [point, feature] \
//!                                                                                 -> scatterers::decoders
//! room patches          -> encoding                           -> [point, feature] /
//! ```
//! The body's features are learned directly, in three planes; the room's features are fixed functions of position, and
//! what is learned about the room sits in its decoders.

pub mod draw;
pub mod encoding;
pub mod extent;
pub mod graph;
pub mod mlp;
pub mod rows;
pub mod triplane;

pub use encoding::EncodingConfig;
pub use extent::Extent;
pub use graph::{Gcn, GcnConfig, MeshGraph};
pub use mlp::{Mlp, MlpConfig};
pub use rows::{RowIndex, WeightedRows};
pub use triplane::{Combination, TriPlane, TriPlaneConfig, TriPlaneSampler};
