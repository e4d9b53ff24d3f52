//! What every effect says of itself.

use serde::Serialize;
use serde_json::Value;

use super::chirp_error::ChirpErrors;
use super::context::Context;
use super::settings::Bounds;
use crate::error::Result;
use crate::radar::Radar;
use crate::recorder::draws::Stream;

/// An effect: its settings with this trait, and its law as functions that `recorder::stages` calls where the signal meets it.
pub trait Effect: Bounds + Serialize {
    /// Whether it needs a person.
    const OF_PERSON: bool = false;
    /// Of its random numbers.
    const STREAM: Option<Stream> = None;

    /// Refuses what cannot work in this world; `key` names the effect in messages.
    fn check(&self, _context: &Context, _key: &str) -> Result<()> {
        Ok(())
    }

    /// Makes the stated radar into the one that there really is.
    fn disturb(&self, _radar: &mut Radar) {}

    /// What it drew, and its parameters in the terms of docs/report.md: an object, or null.
    fn drawn(&self, _context: &Context, _chirps: ChirpErrors) -> Value {
        Value::Null
    }

    /// The recorder's word for what no id of docs/report.md names.
    fn unnamed(&self) -> Option<&'static str> {
        None
    }
}

/// The same behind a pointer.
pub trait AnyEffect: Bounds {
    fn of_person(&self) -> bool;
    fn settings(&self) -> Value;
    fn check(&self, context: &Context, key: &str) -> Result<()>;
    fn disturb(&self, radar: &mut Radar);
    fn drawn(&self, context: &Context, chirps: ChirpErrors) -> Value;
    fn unnamed(&self) -> Option<&'static str>;
}

impl<E: Effect> AnyEffect for E {
    fn of_person(&self) -> bool {
        E::OF_PERSON
    }

    fn settings(&self) -> Value {
        serde_json::to_value(self).unwrap_or_default()
    }

    fn check(&self, context: &Context, key: &str) -> Result<()> {
        Effect::check(self, context, key)
    }

    fn disturb(&self, radar: &mut Radar) {
        Effect::disturb(self, radar);
    }

    fn drawn(&self, context: &Context, chirps: ChirpErrors) -> Value {
        Effect::drawn(self, context, chirps)
    }

    fn unnamed(&self) -> Option<&'static str> {
        Effect::unnamed(self)
    }
}
