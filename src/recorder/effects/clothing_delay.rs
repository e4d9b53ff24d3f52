//! A garment that delays what it covers.

use super::body_part::part_weights;
use super::effect::Effect;
use super::settings::settings;
use crate::error::Result;
use crate::person::Person;

settings! {
    /// One-way extra path of what a garment covers.
    ClothingDelay { extra_m: f64 [0.0, 0.05], #[serde(default = "torso")] body_parts: Vec<String> }
}

fn torso() -> Vec<String> {
    ["pelvis", "spine1", "spine2", "spine3"].map(String::from).to_vec()
}

impl Effect for ClothingDelay {
    const OF_PERSON: bool = true;
}

impl ClothingDelay {
    /// One-way extra path, `[vertex]`, metres.
    pub fn extra_m(&self, person: &Person) -> Result<Vec<f64>> {
        let weights = part_weights(person, &self.body_parts, "effects.clothing_delay.body_parts")?;
        Ok(weights.into_iter().map(|weight| weight * self.extra_m).collect())
    }
}
