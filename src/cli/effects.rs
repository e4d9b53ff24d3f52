//! Which of a checkpoint's effects a simulation is without.

use clap::Args;

use crate::{
    error::{Error, Result},
    simulator::Simulator,
};

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
    /// # Errors
    /// An effect that the checkpoint does not have.
    pub(super) fn switch_off(&self, simulator: &mut Simulator) -> Result<()> {
        if self.without_effects {
            simulator.effects.switch_off(None);
        }
        for id in &self.without_effect {
            if !simulator.effects.switch_off(Some(id)) {
                let mut known: Vec<&str> = simulator.effects.list.iter().map(|effect| effect.id()).collect();
                known.dedup();
                let known = if known.is_empty() { "none".to_string() } else { known.join(", ") };
                return Err(Error::Usage {
                    message: format!("--without-effect {id}: the checkpoint has no such effect"),
                    hint: Some(format!("its effects: {known}")),
                });
            }
        }
        Ok(())
    }
}
