//! Settings of an effect. Numbers carry their bounds, so that a mistake is named before anything is recorded.

use crate::error::{Error, Result};

/// Something whose numbers can lie between bounds.
pub trait Bounded {
    /// The first number that lies outside.
    fn outside(&self, low: f64, high: f64) -> Option<f64>;
}

impl Bounded for f64 {
    fn outside(&self, low: f64, high: f64) -> Option<f64> {
        (!(low..=high).contains(self)).then_some(*self)
    }
}

impl Bounded for usize {
    fn outside(&self, low: f64, high: f64) -> Option<f64> {
        (*self as f64).outside(low, high)
    }
}

impl<const N: usize> Bounded for [f64; N] {
    fn outside(&self, low: f64, high: f64) -> Option<f64> {
        self.iter().find_map(|value| value.outside(low, high))
    }
}

impl<T: Bounded> Bounded for Vec<T> {
    fn outside(&self, low: f64, high: f64) -> Option<f64> {
        self.iter().find_map(|value| value.outside(low, high))
    }
}

pub fn within(key: &str, field: &str, value: &impl Bounded, low: f64, high: f64) -> Result<()> {
    match value.outside(low, high) {
        Some(found) => Err(Error::setting(format!("{key}.{field}"), found, format!("between {low} and {high}"))),
        None => Ok(()),
    }
}

/// Settings that know the bounds of their numbers.
pub trait Bounds {
    /// Refuses numbers out of bounds; `key` names the table in messages.
    fn check_bounds(&self, key: &str) -> Result<()>;
}

/// A struct of settings with their bounds.
macro_rules! settings {
    ($(#[$doc:meta])* $name:ident { $($(#[$attribute:meta])* $field:ident: $kind:ty $([$low:literal, $high:literal])?),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name { $($(#[$attribute])* pub $field: $kind),* }

        impl $crate::recorder::effects::settings::Bounds for $name {
            #[allow(unused_variables)]
            fn check_bounds(&self, key: &str) -> $crate::error::Result<()> {
                $($($crate::recorder::effects::settings::within(key, stringify!($field), &self.$field, $low, $high)?;)?)*
                Ok(())
            }
        }
    };
}
pub(super) use settings;

/// Defaults of settings.
pub fn first_order() -> usize {
    1
}

pub fn unit() -> f64 {
    1.0
}
