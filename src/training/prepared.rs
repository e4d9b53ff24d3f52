//! What training keeps of each recording beside its scene.

use crate::loss::DbLoss;
use crate::simulator::SceneConstants;

/// What training keeps of each recording beside its scene.
pub(super) struct Prepared {
    pub loss: DbLoss,
    pub constants: SceneConstants,
}
