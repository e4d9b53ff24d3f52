//! What the library says about a parameter.

/// A parameter of an effect: a single number, or a list with one for each channel, axis or order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo {
    pub name: &'static str,
    pub unit: &'static str,
    /// The value at which the effect does nothing. Parameters that only shape an effect have no such value; theirs is
    /// where a search starts.
    pub neutral: f64,
    /// Prior: nothing below this is believed.
    pub least: f64,
    /// Prior: nothing above this is believed.
    pub most: f64,
}

impl ParameterInfo {
    /// Whether it is in a unit that only the recording knows, so that its prior says nothing about its size.
    pub fn is_relative(&self) -> bool {
        self.unit.contains("reference") || self.unit.contains("recording")
    }
}

/// The parameter of this name.
pub(super) fn named(all: &'static [ParameterInfo], name: &str) -> Option<&'static ParameterInfo> {
    all.iter().find(|parameter| parameter.name == name)
}

pub(super) const fn parameter(name: &'static str, unit: &'static str, neutral: f64, least: f64, most: f64) -> ParameterInfo {
    ParameterInfo { name, unit, neutral, least, most }
}
