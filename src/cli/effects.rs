//! Which of a checkpoint's effects a simulation is without.

use clap::Args;

use crate::{error::Result, simulator::Simulator, verbs::simulate::Without};

#[derive(Args, Clone)]
pub(super) struct WithoutEffects {
    /// Leave out all effects beyond the plain simulator
    #[arg(long)]
    without_effects: bool,
    /// Leave out this effect, such as if_highpass; may be repeated
    #[arg(long, value_name = "ID", conflicts_with = "without_effects")]
    without_effect: Vec<String>,
}

impl WithoutEffects {
    pub(super) fn without(&self) -> Without {
        Without { all: self.without_effects, ids: self.without_effect.clone() }
    }

    /// # Errors
    /// An effect that the checkpoint does not have.
    pub(super) fn switch_off(&self, simulator: &mut Simulator) -> Result<()> {
        self.without().switch_off(simulator)
    }
}
