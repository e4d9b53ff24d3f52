//! A part of the body that reflects differently.

use super::body_part::part_weights;
use super::effect::Effect;
use super::settings::settings;
use crate::error::Result;
use crate::person::Person;

settings! {
    /// Of the parts that belong to a joint.
    PartReflectivity { body_part: String, db: f64 [-60.0, 40.0] }
}

impl Effect for PartReflectivity {
    const OF_PERSON: bool = true;
}

impl PartReflectivity {
    /// What it adds, `[vertex]`, decibels.
    pub fn added_db(&self, person: &Person) -> Result<Vec<f64>> {
        let weights = part_weights(person, &[&self.body_part], "effects.part_reflectivity.body_part")?;
        Ok(weights.into_iter().map(|weight| weight * self.db).collect())
    }
}
