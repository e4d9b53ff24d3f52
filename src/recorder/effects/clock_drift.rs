//! A motion whose clock runs differently.

use super::effect::Effect;
use super::settings::settings;

settings! {
    /// The motion's clock runs faster by this.
    #[derive(Copy)]
    ClockDrift { relative: f64 [-0.1, 0.1] }
}

impl Effect for ClockDrift {
    const OF_PERSON: bool = true;
}
