//! Antennas that see less to the sides; `recorder::amplitude` has the law.

use super::effect::Effect;
use super::settings::settings;

settings! {
    /// Power gain cos^q of every antenna.
    AntennaPattern { exponent: f64 [0.0, 40.0] }
}

impl Effect for AntennaPattern {}
