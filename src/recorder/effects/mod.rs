//! What a recording may hold beyond the baseline: every effect id of docs/report.md that has a physical cause, and some
//! that no id names.
//!
//! The signal meets them in this order: scene, paths, oscillator, antennas, IF filter, nonlinearity, what is added,
//! noise, converter.

mod antenna;
mod body;
mod decibels;
mod if_filter;
mod noise;
mod onto;
mod outside;
mod propagation;
mod receiver;
mod resample;
mod scene;
mod signal;
mod stage;
mod timing;
mod truth;
mod waveform;

pub use super::effect_settings::*;
pub use super::effects_config::EffectsConfig;
pub use super::physiology::Physiology;
pub(super) use super::streams::*;
pub use body::{garment_m, reflectivity_db};
pub use noise::shape as shape_noise;
pub use onto::{Ground, Onto};
pub use propagation::{MirrorPlan, Shadow, twice_bounced};
pub use receiver::Chain;
pub use scene::{Mover, SinusoidalMotion, Stage, movers, static_points, vibration};
pub use signal::Signal;
pub use stage::{Stages, codes};
pub use timing::Clock;
pub use truth::listed;

use super::world::World;
use crate::error::Result;

impl EffectsConfig {
    /// Refuses what cannot work in this world; `key` names the table in messages.
    pub fn check(&self, world: &World, key: &str) -> Result<()> {
        self.check_bounds(key)?;
        timing::check(self, &world.radar, key)?;
        antenna::check(self, &world.radar, key)?;
        scene::check(world, key)?;
        propagation::check(world, key)?;
        receiver::check(world, key)?;
        noise::check(world, key)?;
        outside::check(world, key)
    }
}

#[cfg(test)]
mod outside_tests;
#[cfg(test)]
mod receiver_tests;
#[cfg(test)]
mod scene_tests;
#[cfg(test)]
mod test_support;
#[cfg(test)]
mod timing_tests;
#[cfg(test)]
mod waveform_tests;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_survives_a_round_trip_and_mistakes_are_named() {
        let text = "[if_highpass]\ncorner_hz = 3.5e5\norder = 2\n\n[[moving_reflector]]\nposition_m = [0.0, 3.0, 0.0]\nswing_m = 0.1\n\
                    rate_hz = 0.9\namplitude = 0.02\n\n[[outside]]\nkind = \"mains_gain_ripple\"\nrate_hz = 100.0\ndepth = 0.05\n";
        let config: EffectsConfig = toml::from_str(text).unwrap();
        assert!(config.if_highpass.as_ref().unwrap().settled);
        assert_eq!(toml::from_str::<EffectsConfig>(&toml::to_string(&config).unwrap()).unwrap(), config);
        let unknown = toml::from_str::<EffectsConfig>("[if_highpass]\ncorner = 1.0").unwrap_err().to_string();
        assert!(unknown.contains("unknown field `corner`"), "{unknown}");
        let unknown =
            toml::from_str::<EffectsConfig>("[[outside]]\nkind = \"gain_hop\"\nrx = 0\ndb = 1.0\nextra = 1").unwrap_err();
        assert!(unknown.to_string().contains("unknown field `extra`"), "{unknown}");
        let wrong = EffectsConfig { slope_error: Some(SlopeError { relative: f64::NAN }), ..EffectsConfig::default() };
        let message = wrong.check(&World::default(), "effects").unwrap_err().to_string();
        assert!(message.contains("`effects.slope_error.relative` is NaN, expected between -0.2 and 0.2"), "{message}");
    }
}
