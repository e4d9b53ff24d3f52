//! The values of one effect, as configs, checkpoints and reports hold them.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{info, info::Choice, library};
use crate::{
    error::{Error, Result},
    person::JOINT_NAMES,
    room::Boundary,
};

/// Values of one effect. A parameter that is not named keeps its neutral value and does not learn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectSetting {
    pub id: String,
    /// Switched off, it stays in the settings and does nothing.
    #[serde(default = "yes")]
    pub enabled: bool,
    /// One number, or one for each channel, axis or order.
    #[serde(default)]
    pub parameters: BTreeMap<String, Vec<f64>>,
    /// A boundary of the room or a part of the body, for effects that act on one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub choice: Option<String>,
}

fn yes() -> bool {
    true
}

impl EffectSetting {
    /// An effect at its neutral values.
    pub fn neutral(id: &str) -> Self {
        Self { id: id.into(), enabled: true, parameters: BTreeMap::new(), choice: None }
    }

    /// The same with a parameter's values.
    pub fn with(mut self, parameter: &str, values: impl Into<Vec<f64>>) -> Self {
        self.parameters.insert(parameter.into(), values.into());
        self
    }

    /// The same for a boundary or a part of the body.
    pub fn choosing(mut self, choice: &str) -> Self {
        self.choice = Some(choice.into());
        self
    }

    /// Refuses unknown ids, parameters and choices, and numbers that are not finite or beyond belief.
    ///
    /// `key` names the setting in messages.
    pub fn check(&self, key: &str) -> Result<()> {
        let Some(info) = info(&self.id) else {
            let ids: Vec<&str> = library().iter().map(|info| info.id).collect();
            return Err(Error::setting(format!("{key}.id"), &self.id, format!("one of {}", ids.join(", "))));
        };
        for (name, values) in &self.parameters {
            let field = format!("{key}.parameters.{name}");
            let Some(parameter) = info.parameter(name) else {
                let names: Vec<&str> = info.parameters.iter().map(|parameter| parameter.name).collect();
                return Err(Error::setting(field, "unknown", format!("one of {}", names.join(", "))));
            };
            if values.is_empty() {
                return Err(Error::setting(field, "empty", "at least one number"));
            }
            let prior = if parameter.is_relative() { f64::MIN..=f64::MAX } else { parameter.least..=parameter.most };
            let within = |value: f64| prior.contains(&value) || value == parameter.neutral;
            if let Some(value) = values.iter().find(|value| !within(**value)) {
                let expected = format!("{} to {} {}", parameter.least, parameter.most, parameter.unit);
                return Err(Error::setting(field, value, expected));
            }
        }
        let field = format!("{key}.choice");
        let known: Vec<&str> = match info.choice {
            Choice::None => return Ok(()),
            Choice::Boundary => Boundary::ALL.map(Boundary::name).to_vec(),
            Choice::Part => JOINT_NAMES.to_vec(),
        };
        match self.choice.as_deref() {
            Some(choice) if !known.contains(&choice) => {
                Err(Error::setting(field, choice, format!("one of {}", known.join(", "))))
            }
            None if info.choice == Choice::Boundary => {
                Err(Error::setting(field, "missing", format!("one of {}", known.join(", "))))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_survive_toml_and_defaults_are_filled_in() {
        let setting = EffectSetting::neutral("wall_ghost").with("coefficient", [0.35]).choosing("right");
        let text = toml::to_string(&setting).unwrap();
        assert_eq!(toml::from_str::<EffectSetting>(&text).unwrap(), setting);
        let short: EffectSetting = toml::from_str("id = \"dc_offset\"").unwrap();
        assert_eq!(short, EffectSetting::neutral("dc_offset"));
        assert!(toml::from_str::<EffectSetting>("id = \"dc_offset\"\nenable = true").is_err());
    }

    #[test]
    fn what_no_effect_has_is_refused_by_name() {
        let refused = |setting: EffectSetting| setting.check("simulator.effects.0").unwrap_err().to_string();
        assert!(refused(EffectSetting::neutral("dc_offse")).starts_with("`simulator.effects.0.id` is dc_offse"));
        let wrong = refused(EffectSetting::neutral("dc_offset").with("j", [0.0]));
        assert_eq!(wrong, "`simulator.effects.0.parameters.j` is unknown, expected one of i, q, reference");
        for value in [f64::NAN, f64::INFINITY, 2.0] {
            assert!(EffectSetting::neutral("slope_error").with("relative", [value]).check("e").is_err(), "{value}");
        }
        assert!(EffectSetting::neutral("dc_offset").with("i", []).check("e").is_err());
        // In the recording's own units anything finite may be.
        assert!(EffectSetting::neutral("dc_offset").with("i", [3e4]).check("e").is_ok());
        assert!(EffectSetting::neutral("dc_offset").with("i", [f64::NAN]).check("e").is_err());
        assert!(refused(EffectSetting::neutral("wall_ghost").choosing("rght")).contains("one of left, right"));
    }
}
