//! What an effect does to a recording: the same scene without it, with it, and the difference.

use std::path::Path;

use num_complex::Complex32;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use crate::challenge::library::{Surroundings, graded};
use crate::effects::{EffectInfo, EffectSetting};
use crate::error::Result;
use crate::heatmap::{Analysis, Gate, HeatmapConfig, Map, Samples};
use crate::person::Placement;
use crate::person::actions::placement;
use crate::pictures::Grid;
use crate::radar::Radar;
use crate::recorder::effects::ClockOffset;
use crate::recorder::{EffectsConfig, RadarChoice, Recorder, RecorderConfig, Returns, World};

/// Of the scene and of what the effect draws.
const SEED: u64 = 7;
/// Before the first chirp and after the last the person moves for so long, so that clocks may be wrong and frames lost.
const SPARE_S: f64 = 0.8;
/// Colours begin so far below the scene's noise, dB: what an effect changes may be weaker than the noise.
const BELOW_NOISE_DB: f64 = 20.0;

/// What all effects are planted into.
pub(super) struct Scene {
    world: World,
    surroundings: Surroundings,
}

impl Scene {
    /// A person who walks in a room, before a small radar.
    ///
    /// # Errors
    /// What the recorder refuses.
    pub(super) fn new() -> Result<Self> {
        let radar = Radar { samples_per_chirp: 64, loops_per_frame: 32, ..Radar::small(16) };
        let mut config = RecorderConfig { radar: RadarChoice::Full(Box::new(radar)), seed: SEED, ..RecorderConfig::default() };
        config.surface.returns = Returns::Vertices;
        let floor_m = config.room.floor_m.unwrap_or(1.0);
        config.person.placement = Some(Placement { start_s: -SPARE_S, ..placement(floor_m, config.person.distance_m) });
        config.effects.clock_offset = Some(ClockOffset { offset_s: SPARE_S });
        let mut world = config.world(Path::new(""))?;
        world.effects = EffectsConfig::default();
        let surroundings = Surroundings::new(&world.radar, world.room.clone(), config.person.distance_m);
        Ok(Self { world, surroundings })
    }

    /// An effect at the strongest grade of the sealed challenges; none where the recorder has no such effect.
    ///
    /// # Errors
    /// What the recorder refuses.
    pub(super) fn signature(&self, info: &EffectInfo) -> Result<Option<Signature>> {
        let Some(graded) = graded(info.id) else {
            return Ok(None);
        };
        let mut world = self.world.clone();
        (graded.add)(&mut world.effects, graded.strength(1.0), &self.surroundings, &mut ChaCha8Rng::seed_from_u64(SEED));
        world.check()?;
        Ok(Some(Signature { title: info.title.into(), world }))
    }

    /// Its recording without any effect.
    ///
    /// # Errors
    /// What the recorder refuses.
    pub(super) fn recorded(&self) -> Result<Recording> {
        Recording::of(&self.world)
    }
}

/// A planted effect.
pub(super) struct Signature {
    title: String,
    world: World,
}

impl Signature {
    /// Of the plant: what the config of the recorder says.
    fn settings(&self) -> Value {
        let effects = serde_json::to_value(&self.world.effects).expect("plain data");
        let only = effects.as_object().and_then(|effects| effects.values().next()).cloned().unwrap_or_default();
        // Of effects that may be several, the one.
        only.get(0).cloned().unwrap_or(only)
    }

    /// What the picture shows, and of what.
    pub(super) fn caption(&self) -> String {
        let settings = self.settings();
        let said = |(name, value): (&String, &Value)| match value {
            Value::Number(_) | Value::String(_) => Some(format!("{name} = {value}")),
            Value::Array(values) if values.len() <= 4 && values.iter().all(Value::is_number) => Some(format!("{name} = {value}")),
            _ => None,
        };
        let given: Vec<String> = settings.as_object().into_iter().flatten().filter_map(said).collect();
        format!(
            "Recorded by the independent recorder: a person walks in a room; without the effect, with it, and the difference of the two \
             recordings, all in dB over the noise without it. Above: the middle frame over range (m) and velocity (m/s); below: power \
             over time (s) and velocity. Planted: {}.",
            given.join(", ").replace('"', "")
        )
    }

    /// The planted effect as a config states it, as far as the library has the same parameters.
    pub(super) fn setting(&self, info: &EffectInfo) -> EffectSetting {
        let settings = self.settings();
        let mut setting = EffectSetting::neutral(info.id);
        for parameter in info.parameters {
            let values: Vec<f64> = match &settings[parameter.name] {
                Value::Number(value) => value.as_f64().into_iter().collect(),
                Value::Array(values) => values.iter().filter_map(Value::as_f64).collect(),
                _ => vec![],
            };
            if !values.is_empty() && values.iter().all(|value| (parameter.least..=parameter.most).contains(value)) {
                setting = setting.with(parameter.name, values);
            }
        }
        let choices = [&settings["boundary"], &settings["body_part"], &settings["body_parts"][0]];
        match choices.into_iter().find_map(Value::as_str) {
            Some(choice) => setting.choosing(choice),
            None => setting,
        }
    }

    /// Records it and writes the picture as PNG: without it, with it, and the power of the difference, over range and velocity in the
    /// middle frame, and over time and velocity.
    ///
    /// # Errors
    /// What the recorder refuses; a file that cannot be written.
    pub(super) fn save(&self, without: &Recording, path: &Path) -> Result<()> {
        let with = Recording::of(&self.world)?;
        let samples = [without.samples.clone(), with.samples.clone(), without.difference(&with)];
        let radar = &self.world.radar;
        let analysis = Analysis::new(radar, &HeatmapConfig::default());
        let frame = |samples: &Vec<Complex32>| analysis.range_doppler(without.shaped(samples).frame(radar.frames / 2));
        let over_time = |samples: &Vec<Complex32>| analysis.spectrogram(without.shaped(samples), &Gate::default());
        let maps = [samples.iter().map(frame).collect(), samples.iter().map(over_time).collect()].map(relative);
        let columns = ["without", "with", "difference"].map(String::from);
        let rows = ["one frame", "all frames"].map(String::from);
        let high = maps.iter().flatten().map(Map::max).fold(0.0, f64::max);
        let unit = Some("dB over the noise");
        let grid = Grid { title: &self.title, columns: &columns, rows: &rows, low: -BELOW_NOISE_DB, high, unit };
        grid.save(path, &maps)
    }
}

/// In dB of the noise of the first, the median of its cells: most hold nothing else.
fn relative(maps: Vec<Map>) -> Vec<Map> {
    let mut cells = maps[0].values.clone();
    let middle = cells.len() / 2;
    let noise = cells.select_nth_unstable_by(middle, f64::total_cmp).1.max(f64::MIN_POSITIVE);
    maps.iter().map(|map| map.with_values(map.values.iter().map(|power| power / noise).collect()).db(0.0)).collect()
}

/// Samples in units of the transmitted wave, so that recordings with gains of their own can be compared.
pub(super) struct Recording {
    dims: [usize; 5],
    samples: Vec<Complex32>,
}

impl Recording {
    fn of(world: &World) -> Result<Self> {
        let recorder = Recorder::new(world)?;
        let scale = recorder.level().gain.recip() as f32;
        let mut samples = vec![];
        for frame in recorder.frames() {
            samples.extend(frame?.complex().map(|value| value * scale));
        }
        Ok(Self { dims: world.radar.dims(), samples })
    }

    fn difference(&self, other: &Self) -> Vec<Complex32> {
        self.samples.iter().zip(&other.samples).map(|(without, with)| with - without).collect()
    }

    fn shaped<'a>(&self, samples: &'a [Complex32]) -> Samples<'a> {
        Samples::new(samples, self.dims)
    }
}
