//! A reflector that a person carries.

use super::body_part::part_weights;
use super::effect::Effect;
use super::settings::settings;
use crate::error::Result;
use crate::person::Person;

settings! {
    /// A thing that moves with a joint of the body; amplitude as for a static reflector.
    CarriedReflector { body_part: String, amplitude: f64 [0.0, 1.0e3] }
}

impl Effect for CarriedReflector {
    const OF_PERSON: bool = true;
}

impl CarriedReflector {
    /// The mean of which vertices it moves with, `[(vertex, weight)]`.
    pub fn vertices(&self, person: &Person) -> Result<Vec<(usize, f64)>> {
        let weights = part_weights(person, &[&self.body_part], "effects.carried_reflector.body_part")?;
        let total: f64 = weights.iter().sum();
        Ok(weights.iter().enumerate().filter(|(_, w)| **w > 0.0).map(|(vertex, w)| (vertex, w / total)).collect())
    }
}
