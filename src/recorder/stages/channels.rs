//! The antennas' channels.

use num_complex::Complex64;

use crate::recorder::effects::{ChannelMismatch, MutualCoupling};
use crate::recorder::signal::Signal;
use crate::recorder::world::World;

/// `channel_mismatch` and `mutual_coupling`.
#[derive(Clone, Debug)]
pub struct Channels {
    coupling: Option<Complex64>,
    /// `[rx]` or `[tx, rx]`.
    factors: Option<Vec<Complex64>>,
}

impl Channels {
    pub fn new(world: &World) -> Self {
        let effects = &world.effects;
        Self {
            coupling: effects.mutual_coupling.as_ref().map(|coupling| coupling.factor(&world.draws())),
            factors: effects.channel_mismatch.as_ref().map(ChannelMismatch::factors),
        }
    }

    /// Each receiver also picks up what its neighbours do; then come the channels' own gains.
    pub fn apply(&self, signal: &mut Signal) {
        if let Some(coupling) = self.coupling {
            MutualCoupling::apply(coupling, signal);
        }
        if let Some(factors) = &self.factors {
            ChannelMismatch::apply(factors, signal);
        }
    }
}
