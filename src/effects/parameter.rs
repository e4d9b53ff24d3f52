//! What the library says about a parameter.

/// What a parameter is to its effect's operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The effect is linear in it near its neutral value.
    Amplitude,
    /// The same, one for each receiver or one for all.
    AmplitudeOfReceivers,
    /// Phase of the amplitude beside it, radians.
    Angle,
    /// Amplitude beside it in decibels; an amplitude of zero has no derivative by it.
    Level,
    /// Frequency, place, order or threshold: it shapes what amplitudes scale, and its neutral value is where a search starts.
    Shape,
    /// Deviation of something that is drawn at random.
    Spread,
    /// Counts, chooses, or is what levels are relative to: it does not learn.
    Fixed,
}

/// A parameter of an effect: a single number, or a list with one for each channel, axis or order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo {
    pub name: &'static str,
    pub role: Role,
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

macro_rules! roles {
    ($($name:ident $role:ident;)*) => {
        $(pub(super) const fn $name(name: &'static str, unit: &'static str, neutral: f64, least: f64, most: f64) -> ParameterInfo {
            ParameterInfo { name, role: Role::$role, unit, neutral, least, most }
        })*
    };
}

roles! {
    amplitude Amplitude;
    amplitude_of_receivers AmplitudeOfReceivers;
    angle Angle;
    level Level;
    shaping Shape;
    spread Spread;
    fixed Fixed;
}
