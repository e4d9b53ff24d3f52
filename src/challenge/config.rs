//! The settings of a challenge: how many cases of which kind, and between which bounds their scenes are drawn.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::library;
use super::structures::Structure;
use crate::bounds;
use crate::data::read_settings;
use crate::error::{Error, Result};
use crate::person::actions::Action;
use crate::radar::Radar;
use crate::recorder::Returns;

/// What a case is meant to test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stratum {
    /// Nothing is missing: no more than the baseline of docs/diagnosis.md.
    Null,
    /// One effect, of a strength between undetectable and obvious.
    Single,
    /// One effect below a stronger return.
    Masked,
    /// One effect that learned amplitudes can take over.
    Absorbed,
    /// One effect that looks like another one.
    LookAlike,
    /// Two effects.
    Pair,
    /// One effect that no id names, or that the diagnosis is run without.
    Outside,
    /// One effect that nobody could detect.
    Undetectable,
}

impl Stratum {
    /// All eight, in the order of [`ChallengeConfig::counts`].
    pub const ALL: [Self; 8] =
        [Self::Null, Self::Single, Self::Masked, Self::Absorbed, Self::LookAlike, Self::Pair, Self::Outside, Self::Undetectable];

    /// The word of settings, truths and tables, such as `null`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Null => "null",
            Self::Single => "single",
            Self::Masked => "masked",
            Self::Absorbed => "absorbed",
            Self::LookAlike => "look_alike",
            Self::Pair => "pair",
            Self::Outside => "outside",
            Self::Undetectable => "undetectable",
        }
    }
}

/// Parts of all cases; they need not sum to 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Shares {
    pub null: f64,
    pub single: f64,
    pub masked: f64,
    pub absorbed: f64,
    pub look_alike: f64,
    pub pair: f64,
    pub outside: f64,
    pub undetectable: f64,
}

impl Default for Shares {
    fn default() -> Self {
        Self {
            null: 0.32,
            single: 0.28,
            masked: 0.08,
            absorbed: 0.08,
            look_alike: 0.06,
            pair: 0.06,
            outside: 0.07,
            undetectable: 0.05,
        }
    }
}

impl Shares {
    fn of(&self, stratum: Stratum) -> f64 {
        match stratum {
            Stratum::Null => self.null,
            Stratum::Single => self.single,
            Stratum::Masked => self.masked,
            Stratum::Absorbed => self.absorbed,
            Stratum::LookAlike => self.look_alike,
            Stratum::Pair => self.pair,
            Stratum::Outside => self.outside,
            Stratum::Undetectable => self.undetectable,
        }
    }
}

/// Between which bounds scenes are drawn; equal for all kinds of cases, so that the scene says nothing about the effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Scenes {
    pub subjects: Vec<String>,
    pub actions: Vec<Action>,
    /// Where returns come from: tier A and tier B.
    pub tiers: Vec<Returns>,
    /// Boundaries' distances from the radar.
    pub side_m: [f64; 2],
    /// Lower and upper bound, as for the boundaries that follow.
    pub front_m: [f64; 2],
    pub back_m: [f64; 2],
    pub floor_m: [f64; 2],
    pub ceiling_m: [f64; 2],
    /// Of the motion's origin; kept 1.5 m away from the wall ahead.
    pub distance_m: [f64; 2],
    /// Root mean square distance of the recorded surface from the mesh that is handed out.
    pub mesh_error_m: [f64; 2],
    /// Of the receiver, as [`crate::recorder::ReceiverConfig`] has it.
    pub snr_db: [f64; 2],
    /// Spread of the body's reflectivity.
    pub variation_db: [f64; 2],
    /// Backscatter (γ) of the walls and of what stands before them. Real rooms return 0 to 20 dB more than a person who
    /// walks in them.
    pub clutter_db: [f64; 2],
    /// Longest edge of the pieces that the surface is cut into.
    pub edge_m: f64,
}

impl Default for Scenes {
    fn default() -> Self {
        Self {
            subjects: crate::person::procedural::SUBJECTS.map(String::from).to_vec(),
            actions: Action::ALL.to_vec(),
            tiers: vec![Returns::Vertices, Returns::Random],
            side_m: [1.6, 3.0],
            front_m: [4.4, 7.0],
            back_m: [0.4, 1.5],
            floor_m: [0.8, 1.3],
            ceiling_m: [1.3, 2.0],
            distance_m: [2.2, 4.5],
            mesh_error_m: [5.0e-4, 3.0e-3],
            snr_db: [30.0, 45.0],
            variation_db: [1.0, 4.0],
            clutter_db: [-10.0, 5.0],
            edge_m: 1.0e-2,
        }
    }
}

/// A challenge. The radar must be given: a case's size follows from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChallengeConfig {
    pub cases: usize,
    /// Instead of a draw by shares: every effect once, at this place between its weakest (0) and its strongest (1), and
    /// nulls up to the number of cases. To learn from, not to count: how strong the effects came out is not measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every: Option<f64>,
    /// Cases outside the library: instead of effects that no id names, effects of the library, each of which its diagnosis is run without
    /// (leave-one-effect-out). As many nulls are diagnosed with an effect less, so that which cases these are says nothing.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub leave_one_out: bool,
    #[serde(default)]
    pub shares: Shares,
    #[serde(default)]
    pub scenes: Scenes,
    pub radar: Radar,
    /// Structures that cases are dealt, all equally often; none: all cases are as `radar` has them, with a person who is tracked.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub structures: Vec<Structure>,
}

/// Fewest nulls, as a part of all cases: false alarms are what claims stand on.
pub const FEWEST_NULLS: f64 = 0.3;

impl ChallengeConfig {
    /// Reads a file under `sets`, each `a.b=value`, and checks it.
    ///
    /// # Errors
    /// A file that cannot be read, unknown keys, too few cases or nulls, and scenes outside the recorder's limits.
    pub fn read(path: &Path, sets: &[String]) -> Result<Self> {
        let config: Self = read_settings(path, sets)?;
        config.check()?;
        Ok(config)
    }

    /// Refuses a set with too few cases or nulls, and scenes outside the recorder's limits.
    fn check(&self) -> Result<()> {
        self.radar.check("radar")?;
        self.kinds()?;
        // Each is planned before the first is recorded.
        bounds::count("cases", self.cases, 1_000_000)?;
        if let Some(level) = self.every {
            if self.leave_one_out {
                return Err(Error::setting("leave_one_out", true, "false where every effect is dealt once"));
            }
            if !(0.0..=1.0).contains(&level) {
                return Err(Error::setting("every", level, "between 0 (weakest) and 1 (strongest)"));
            }
            let least = (library::every().count() as f64 / (1.0 - FEWEST_NULLS)).ceil();
            if (self.cases as f64) < least {
                return Err(Error::setting("cases", self.cases, format!("at least {least}: every effect once, and the nulls")));
            }
        }
        for stratum in Stratum::ALL {
            let share = self.shares.of(stratum);
            if !(share.is_finite() && share >= 0.0) {
                return Err(Error::setting(format!("shares.{}", stratum.name()), share, "zero or more"));
            }
        }
        let nulls = self.shares.null / Stratum::ALL.iter().map(|&stratum| self.shares.of(stratum)).sum::<f64>();
        if nulls.is_nan() || nulls < FEWEST_NULLS {
            return Err(Error::setting("shares.null", format!("{nulls:.2} of all"), format!("at least {FEWEST_NULLS}"))
                .with_hint("a diagnosis that is never shown a null proves nothing"));
        }
        let scenes = &self.scenes;
        for (key, bounds, low, high) in [
            ("side_m", scenes.side_m, 0.5, 50.0),
            ("front_m", scenes.front_m, 3.0, 50.0),
            ("back_m", scenes.back_m, 0.05, 50.0),
            ("floor_m", scenes.floor_m, 0.1, 5.0),
            ("ceiling_m", scenes.ceiling_m, 0.1, 20.0),
            ("distance_m", scenes.distance_m, 0.5, 50.0),
            ("mesh_error_m", scenes.mesh_error_m, 0.0, 0.05),
            ("snr_db", scenes.snr_db, -20.0, 90.0),
            ("variation_db", scenes.variation_db, 0.0, 20.0),
            ("clutter_db", scenes.clutter_db, -60.0, 20.0),
        ] {
            if !(bounds[0] >= low && bounds[1] <= high && bounds[0] <= bounds[1]) {
                return Err(Error::setting(
                    format!("scenes.{key}"),
                    format!("{bounds:?}"),
                    format!("two ascending numbers between {low} and {high}"),
                ));
            }
        }
        for (key, empty) in
            [("subjects", scenes.subjects.is_empty()), ("actions", scenes.actions.is_empty()), ("tiers", scenes.tiers.is_empty())]
        {
            if empty {
                return Err(Error::setting(format!("scenes.{key}"), "empty", "at least one"));
            }
        }
        Ok(())
    }

    /// Structures with their radars, one at least.
    ///
    /// # Errors
    /// As [`Structure::radar`], and two of one name.
    pub fn kinds(&self) -> Result<Vec<(Structure, Radar)>> {
        if self.structures.is_empty() {
            return Ok(vec![(Structure::default(), self.radar.clone())]);
        }
        for (index, structure) in self.structures.iter().enumerate() {
            if self.structures[..index].iter().any(|other| other.name == structure.name) {
                return Err(Error::setting("structures.name", &structure.name, "a name of its own for each"));
            }
        }
        self.structures.iter().map(|structure| Ok((structure.clone(), structure.radar(&self.radar)?))).collect()
    }

    /// How many cases of each kind, summing to `cases`: the largest remainders are rounded up.
    pub fn counts(&self) -> [usize; 8] {
        let total: f64 = Stratum::ALL.iter().map(|&stratum| self.shares.of(stratum)).sum();
        let wanted = Stratum::ALL.map(|stratum| self.shares.of(stratum) / total * self.cases as f64);
        let mut counts = wanted.map(|count| count.floor() as usize);
        // Nulls are rounded up, whatever the others lose.
        counts[0] = (wanted[0].ceil() as usize).min(self.cases);
        let mut order: Vec<usize> = (1..8).collect();
        order.sort_by(|&a, &b| wanted[b].fract().total_cmp(&wanted[a].fract()));
        let mut next = order.iter().cycle();
        while counts.iter().sum::<usize>() < self.cases {
            counts[*next.next().expect("a cycle")] += 1;
        }
        while counts.iter().sum::<usize>() > self.cases {
            let most = (1..8).max_by_key(|&k| counts[k]).expect("seven kinds");
            counts[most] -= 1;
        }
        counts
    }

    /// The settings in full, as TOML.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("settings are plain data")
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub fn config(cases: usize) -> ChallengeConfig {
        ChallengeConfig {
            cases,
            every: None,
            leave_one_out: false,
            shares: Shares::default(),
            scenes: Scenes::default(),
            radar: Radar::small(12),
            structures: vec![],
        }
    }

    #[test]
    fn counts_sum_up_and_hold_enough_nulls() {
        for cases in [1, 2, 7, 30, 300, 1001] {
            let counts = config(cases).counts();
            assert_eq!(counts.iter().sum::<usize>(), cases);
            assert!(counts[0] as f64 >= FEWEST_NULLS * cases as f64, "{counts:?}");
        }
    }

    #[test]
    fn too_few_nulls_are_refused() {
        let mut few = config(10);
        few.shares.null = 0.1;
        assert!(few.check().unwrap_err().to_string().contains("shares.null"));
    }

    #[test]
    fn every_effect_needs_a_level_and_room_for_nulls() {
        let every = |cases, level| ChallengeConfig { every: Some(level), ..config(cases) }.check();
        every(120, 0.8).unwrap();
        assert!(every(120, 1.5).unwrap_err().to_string().contains("every"));
        assert!(every(60, 0.8).unwrap_err().to_string().contains("cases"));
    }
}
