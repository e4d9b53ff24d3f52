//! A motion whose clock is set differently.

use super::effect::Effect;
use super::settings::settings;

settings! {
    /// The body is recorded this much later in its motion than the radar's clock says.
    #[derive(Copy)]
    ClockOffset { offset_s: f64 [-2.0, 2.0] }
}

impl Effect for ClockOffset {
    const OF_PERSON: bool = true;
}
