//! Classifiers that learn from a few recordings of each action.

use std::collections::BTreeMap;

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::first_site::Simulated;
use super::stages::Learned;
use super::{Drawn, FewStages, Method, Place, Planner};
use crate::error::{Error, Result};
use crate::experiments::few::Material;
use crate::experiments::takes::Take;

impl Planner<'_> {
    /// Every number and material of `few_measured`, once for each draw: each draws its own recordings, and more of them hold the
    /// fewer ones. `simulated`: every method's simulations.
    ///
    /// # Errors
    /// More recordings of an action than the others have.
    pub(super) fn few(&mut self, place: &Place, simulated: &[(Drawn, &Simulated<'_>)]) -> Result<()> {
        let Some(few) = &self.config.few_measured else { return Ok(()) };
        let unseen = &self.config.split.unseen;
        let (others, tested): (_, Vec<&Take>) = (self.others(place), place.of_subject(unseen).collect());
        for &count in &few.recordings {
            for material in Material::ALL {
                self.plan.few.push(FewStages { recordings: count, material, stages: vec![] });
            }
        }
        for draw in 0..self.config.seeds {
            let by = Drawn { method: Method::Variant(few.simulated_by), draw };
            let (_, simulated) = simulated.iter().find(|(drawn, _)| *drawn == by).expect("checked: one of the variants");
            let of_others: Simulated = simulated.iter().copied().filter(|(_, take)| take.subject != *unseen).collect();
            let order = shuffled(&others, self.config.seed + draw as u64);
            for point in 0..self.plan.few.len() {
                let FewStages { recordings: count, material, .. } = self.plan.few[point];
                let chosen = first_of_each(&order, count)?;
                let measured = Learned { draw, ..Learned::recorded(&place.recordings, &chosen) };
                let learned = match material {
                    Material::Measured => measured,
                    Material::Simulated => {
                        let few = of_others.iter().copied().filter(|(_, take)| chosen.contains(take));
                        self.simulated_by(draw, few)
                    }
                    Material::Both => measured.and(self.simulated_by(draw, of_others.iter().copied())),
                };
                let epochs = (self.config.recognition.epochs * others.len()).div_ceil(learned.folders.len());
                let id = if material == Material::Measured { format!("draw_{}", draw + 1) } else { by.id() };
                let name = format!("recognise/few/{count}_{}/{id}", material.id());
                let stage = self.classifier(name, place, &tested, learned, epochs);
                self.plan.few[point].stages.push(stage);
            }
        }
        Ok(())
    }
}

/// The recordings of each action in an order of their own.
fn shuffled<'a>(takes: &[&'a Take], seed: u64) -> BTreeMap<&'a str, Vec<&'a Take>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut order: BTreeMap<&str, Vec<&Take>> = BTreeMap::new();
    takes.iter().for_each(|take| order.entry(&take.action).or_default().push(take));
    order.values_mut().for_each(|takes| takes.shuffle(&mut rng));
    order
}

fn first_of_each<'a>(order: &BTreeMap<&str, Vec<&'a Take>>, count: usize) -> Result<Vec<&'a Take>> {
    let mut chosen = vec![];
    for (action, takes) in order {
        let expected = || format!("at most {}, the other subjects' recordings of {action}", takes.len());
        chosen.extend(takes.get(..count).ok_or_else(|| Error::setting("few_measured.recordings", count, expected()))?);
    }
    Ok(chosen)
}
