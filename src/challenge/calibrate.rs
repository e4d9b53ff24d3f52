//! Nulls of somebody's own radar, and the table of what the diagnosis says of them.
//!
//! A null is recorded in the recorder's world, with the radar and the size that a config or a recording has, and nothing
//! beyond the baseline of docs/diagnosis.md. Each is diagnosed by a process of its own; what they say becomes `calibration.json`
//! ([`crate::diagnosis::calibration`]), by which the same program ranks the p-values of recordings of that structure.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::answer::{Failure, RunConfig, answered, diagnose};
use super::commitment::hash_file;
use super::config::Scenes;
use super::report::Report;
use super::salt::ground::ground;
use super::secret::Secret;
use super::table::{Aim, Row, markdown, share};
use super::uniformity;
use crate::bounds;
use crate::config::Config;
use crate::data::atomic::write_text;
use crate::data::files::read_json;
use crate::data::{Recording, RecordingContents, Scratch, Shard, write_recording};
use crate::diagnosis::DiagnosisConfig;
use crate::diagnosis::calibration::{Calibration, FORMAT, FalseAlarms, Structure, program};
use crate::diagnosis::detectors::DETECTORS;
use crate::diagnosis::statistics::{binomial_interval, uniform_chance};
use crate::error::{Error, Result};
use crate::pictures::{Chart, Series};
use crate::recorder::{EffectsConfig, RadarChoice, ReceiverConfig, Recorder, RecorderConfig, Returns, World};
use crate::room::Room;
use crate::text::shown;

/// Of the table.
pub const TABLE: &str = "calibration.json";
/// Folder of the nulls' reports.
const REPORTS: &str = "nulls";
/// The noise rarely goes so many deviations beyond the signal (a normal one in 1.7 million draws).
const DEVIATIONS: f64 = 5.0;
/// A room that nobody stated lies within this share of the farthest range.
const WITHIN: f64 = 0.9;

/// What all nulls are recorded from.
pub struct Source {
    world: World,
    /// Whether the diagnosis is given the room.
    room: bool,
    /// From a recording: how far the body's mesh and the skin are from what is handed out differs from null to null.
    drawn: bool,
    pub structure: Structure,
    /// What was taken from where, in words.
    pub notes: Vec<String>,
}

impl Source {
    /// Of a recorder config, or of a recording folder.
    ///
    /// # Errors
    /// What cannot be read or recorded.
    pub fn read(path: &Path, sets: &[String]) -> Result<Self> {
        let of_recording = path.is_dir() || path.ends_with(crate::data::recording::SETTINGS_FILE);
        if of_recording { Self::of_recording(&Recording::open(path)?) } else { Self::of_config(path, sets) }
    }

    fn of_config(path: &Path, sets: &[String]) -> Result<Self> {
        let config = Config::read(path, sets)?;
        let record = config.record(path)?;
        let mut null =
            RecorderConfig { effects: EffectsConfig::default(), furniture: vec![], antenna_exponent: 0.0, ..record.clone() };
        null.walls.images = 0;
        let notes = if null == *record { vec![] } else { vec!["what the config plants was left out".to_string()] };
        let world = null.world(path.parent().unwrap_or(Path::new("")))?;
        let room = !world.room.boundaries().is_empty();
        Ok(Self { room, drawn: false, structure: structure(&world, room), world, notes })
    }

    fn of_recording(recording: &Recording) -> Result<Self> {
        let settings = recording.folder.join(crate::data::recording::SETTINGS_FILE);
        let structure = Structure::of(recording)?;
        let mut radar = recording.radar.clone();
        radar.frames = structure.radar.frames;
        let ground = ground(recording)?;
        let noise = ground.sigma;
        let room = recording.room.clone().unwrap_or_else(|| unstated(radar.max_range_m()));
        let receiver = ReceiverConfig { adc: recording.holds_codes(), ..ReceiverConfig::default() };
        let mut world = World { radar: radar.clone(), room, person: recording.person().cloned(), receiver, ..World::default() };
        world.check().map_err(|error| error.in_file(&settings))?;
        let full_scale = radar.full_scale_codes.unwrap_or(f64::from(i16::MAX)).min(i16::MAX.into());
        // The peak holds noise; codes have a full scale that a null stays below, other samples any unit.
        let signal = (ground.largest_component - DEVIATIONS * noise).max(noise);
        let unit =
            if world.receiver.adc { 1.0 } else { world.receiver.peak_fraction * full_scale / signal.max(f64::MIN_POSITIVE) };
        world.receiver.peak_fraction = (unit * signal / full_scale).clamp(f64::MIN_POSITIVE, 1.0);
        let mut level = Recorder::new(&world)?.level();
        level.noise_codes = unit * noise;
        world.receiver.level = Some(level);
        let mut notes = vec![format!(
            "from the recording: its peak of {:.4e} and its noise of {noise:.4e} per component, about a static room",
            ground.largest_component
        )];
        if recording.room.is_none() {
            notes.push(
                "it states no room: static returns are those of walls within its farthest range, which the diagnosis is not given"
                    .into(),
            );
        }
        let (room, drawn) = (recording.room.is_some(), true);
        Ok(Self { room, drawn, structure, world, notes })
    }

    /// The world of one null.
    fn null(&self, secret: &Secret, index: usize) -> World {
        let mut world = World { seed: secret.world_seed(index), ..self.world.clone() };
        if self.drawn {
            use rand::RngExt;
            // As much as the sealed challenge draws.
            let (scenes, mut random) = (Scenes::default(), secret.random("null", index));
            let mut between = |[low, high]: [f64; 2]| low + (high - low) * random.random::<f64>();
            world.mesh_error_m = between(scenes.mesh_error_m);
            world.surface.variation_db = between(scenes.variation_db);
            world.surface.returns = if between([0.0, 1.0]) < 0.5 { Returns::Vertices } else { Returns::Random };
        }
        world
    }

    fn record(&self, secret: &Secret, index: usize, folder: &Path) -> Result<()> {
        let world = self.null(secret, index);
        let recorder = Recorder::new(&world)?;
        let contents = RecordingContents {
            radar: &world.radar,
            room: self.room.then_some(&world.room),
            person: world.person.as_ref(),
            body_file: None,
            labels: BTreeMap::new(),
            layout: recorder.layout(),
            truth: None,
        };
        let mut frames = recorder.frames();
        write_recording(folder, &contents, &mut |_| frames.next().expect("as many frames as the radar has"))?;
        Ok(())
    }
}

fn structure(world: &World, room: bool) -> Structure {
    let frames = world.radar.frames.min(crate::diagnosis::cube::most_frames(&world.radar));
    let radar = crate::radar::Radar { frames, full_scale_codes: None, ..world.radar.clone() };
    Structure { radar, room, person: world.person.is_some() }
}

/// The recorder's default room as far as the radar sees it; where it sees none of it, a wall ahead within its farthest range.
fn unstated(max_range_m: f64) -> Room {
    let RecorderConfig { room, .. } = RecorderConfig { radar: RadarChoice::Preset("small".into()), ..RecorderConfig::default() };
    let farthest = WITHIN * max_range_m;
    let seen = |distance: Option<f64>| distance.filter(|distance| *distance <= farthest);
    Room {
        left_m: seen(room.left_m),
        right_m: seen(room.right_m),
        front_m: room.front_m.map(|front| front.min(farthest)),
        back_m: seen(room.back_m),
        floor_m: seen(room.floor_m),
        ceiling_m: seen(room.ceiling_m),
    }
}

fn folder(out: &Path, index: usize) -> PathBuf {
    out.join(REPORTS).join(format!("{index:05}"))
}

/// Nulls of a part that have no report yet.
fn open(out: &Path, nulls: usize, shard: Shard) -> impl Iterator<Item = usize> + '_ {
    (0..nulls).filter(move |&index| shard.holds(index) && !answered(&folder(out, index)))
}

/// How many of a part are to be done now.
pub fn waiting(out: &Path, nulls: usize, how: &RunConfig) -> usize {
    open(out, nulls, how.shard).take(how.most.unwrap_or(usize::MAX)).count()
}

/// How many have no report yet, whoever is to do them.
pub fn missing(out: &Path, nulls: usize) -> usize {
    open(out, nulls, Shard::ALL).count()
}

/// Records and diagnoses the nulls of a part that have no report yet; `progress` receives how many are done.
///
/// # Errors
/// A folder that was begun with another source or seed; what the recorder refuses.
pub fn run(
    source: &Source,
    nulls: usize,
    secret: &Secret,
    out: &Path,
    how: &RunConfig,
    progress: &mut dyn FnMut(usize),
) -> Result<()> {
    if nulls == 0 {
        return Err(Error::setting("nulls", nulls, "1 or more"));
    }
    bounds::count("nulls", nulls, 1_000_000)?;
    settle(source, secret, out, how)?;
    for (done, index) in open(out, nulls, how.shard).take(how.most.unwrap_or(usize::MAX)).enumerate() {
        let workplace = Scratch::new()?;
        let case = workplace.path().join("null");
        source.record(secret, index, &case)?;
        diagnose(&case, &folder(out, index), how, &mut || progress(done))?;
        progress(done + 1);
    }
    Ok(())
}

/// What the reports in a folder are of: begun once, the same ever after.
fn settle(source: &Source, secret: &Secret, out: &Path, how: &RunConfig) -> Result<()> {
    let path = out.join("source.json");
    let value = serde_json::json!({
        "structure": source.structure,
        "noise_codes": source.world.receiver.level.map(|level| level.noise_codes),
        "seed": secret.seed,
        "program": hash_file(&how.program)?,
    });
    let text = format!("{value:#}\n");
    if path.exists() {
        if crate::data::files::read_text(&path)? != text {
            return Err(Error::Usage {
                message: format!("{}: the nulls there are of another source, seed or program", out.display()),
                hint: Some("calibrate into another folder".into()),
            });
        }
        return Ok(());
    }
    std::fs::create_dir_all(out).map_err(|source| Error::write(out, source))?;
    write_text(path, &text)
}

/// A table and what people read of it.
pub struct Calibrated {
    pub table: Calibration,
    pub rows: Vec<Row>,
    failures: Vec<String>,
    notes: Vec<String>,
}

/// Gathers the reports; none where some are missing yet.
///
/// # Errors
/// Not one null that came to an answer.
pub fn gather(
    source: &Source,
    nulls: usize,
    secret: &Secret,
    out: &Path,
    how: &RunConfig,
    settings: &DiagnosisConfig,
) -> Result<Option<Calibrated>> {
    if missing(out, nulls) > 0 {
        return Ok(None);
    }
    let (reports, seeds, failures) = reports(nulls, secret, out)?;
    let p_values = ascending(reports.iter().filter_map(|report| report.p_value));
    if p_values.is_empty() {
        let first = failures.first().cloned().or_else(|| reports.first().map(|report| report.reason.clone())).unwrap_or_default();
        return Err(Error::Usage {
            message: format!("not one of {nulls} nulls came to an answer: {first}"),
            hint: Some("such a radar is not diagnosed, so there is nothing to calibrate".into()),
        });
    }
    let alarms = reports.iter().filter(|report| report.claims()).count();
    let mut rows =
        vec![share("nulls on which anything is claimed (false alarms)", reports.iter().map(Report::claims), Aim::None)];
    rows.push(share(
        "nulls that came to no answer",
        reports.iter().map(|report| report.p_value.is_none()).chain(failures.iter().map(|_| true)),
        Aim::None,
    ));
    rows.extend(uniformity::rows(reports.iter()));
    let table = Calibration {
        format: FORMAT,
        program: program(),
        executable_sha256: hash_file(&how.program)?,
        structure: source.structure.clone(),
        settings: toml::to_string(settings).expect("plain data"),
        nulls: reports.len(),
        answered: p_values.len(),
        seeds,
        bounds: ascending(reports.iter().filter_map(|report| report.null.get("suspicion").copied().flatten())),
        detectors: families(&reports),
        false_alarms: FalseAlarms {
            level: settings.alarm,
            alarms,
            of: reports.len(),
            share: alarms as f64 / reports.len() as f64,
            interval: binomial_interval(alarms, reports.len(), 0.95),
        },
        uniform_chance: uniform_chance(&p_values),
        p_values,
    };
    Ok(Some(Calibrated { table, rows, failures, notes: source.notes.clone() }))
}

/// What the nulls' processes left: reports, the worlds' seeds, and why there is no report.
fn reports(nulls: usize, secret: &Secret, out: &Path) -> Result<(Vec<Report>, Vec<u64>, Vec<String>)> {
    let (mut reports, mut seeds, mut failures) = (vec![], vec![], vec![]);
    for index in 0..nulls {
        let folder = folder(out, index);
        if folder.join("report.json").is_file() {
            reports.push(Report::read(&folder.join("report.json"))?);
            seeds.push(secret.world_seed(index));
        } else {
            failures.push(format!("null {index}: {}", read_json::<Failure>(&folder.join("failure.json"))?.reason));
        }
    }
    Ok((reports, seeds, failures))
}

fn ascending(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Of all families, those too that had nothing to say.
fn families(reports: &[Report]) -> BTreeMap<String, Vec<f64>> {
    let of = |name: &str| ascending(reports.iter().filter_map(|report| report.detectors.get(name).copied()).filter(|p| *p < 1.0));
    DETECTORS.iter().map(|detector| (detector.name.to_string(), of(detector.name))).collect()
}

impl Calibrated {
    /// `calibration.json`, `results.md` and `p_values.png`.
    pub fn write(&self, out: &Path) -> Result<()> {
        write_text(out.join("results.md"), &shown(&self.markdown()))?;
        self.chart().save(&out.join("p_values.png"))?;
        // Last: who finds the table finds all.
        let value = serde_json::to_value(&self.table).expect("plain data");
        write_text(out.join(TABLE), &format!("{value:#}\n"))
    }

    /// The table of p-values, in Markdown, with notes, families of detectors and failures.
    pub fn markdown(&self) -> String {
        let Calibration { nulls, structure, program, false_alarms, .. } = &self.table;
        let radar = &structure.radar;
        let mut text = format!(
            "## P-values where nothing is missing\n\n{nulls} nulls of {} frames × {} transmitters × {} receivers × {} loops × {} samples, \
             {} room, {} person; {program}. False alarms at the configured level of {}: {} of {}.\n\n",
            radar.frames,
            radar.tx_m.len(),
            radar.rx_m.len(),
            radar.loops_per_frame,
            radar.samples_per_chirp,
            if structure.room { "a" } else { "no" },
            if structure.person { "a" } else { "no" },
            false_alarms.level,
            false_alarms.alarms,
            false_alarms.of,
        );
        for note in &self.notes {
            let _ = writeln!(text, "- {note}");
        }
        let _ = write!(text, "\n{}\n![Share of nulls below a p-value](p_values.png)\n", markdown(&self.rows));
        text.push_str("\n### Families of detectors\n\nSmallest p-values, corrected within a family alone.\n\n");
        text.push_str("| family | nulls with a detection | smallest | below 0.01 | below 0.1 |\n|---|---|---|---|---|\n");
        for (name, values) in &self.table.detectors {
            let below = |level: f64| values.iter().filter(|value| **value < level).count();
            let smallest = values.first().map_or("–".into(), |value| format!("{value:.2e}"));
            let _ = writeln!(text, "| {name} | {} | {smallest} | {} | {} |", values.len(), below(0.01), below(0.1));
        }
        if !self.failures.is_empty() {
            text.push_str("\n### Nulls without a report\n\n");
            for failure in &self.failures {
                let _ = writeln!(text, "- {failure}");
            }
        }
        text
    }

    fn chart(&self) -> Chart {
        let count = self.table.p_values.len() as f64;
        let step = |(rank, &value): (usize, &f64)| [[value, rank as f64 / count], [value, (rank + 1) as f64 / count]];
        let found = std::iter::once([0.0, 0.0]).chain(self.table.p_values.iter().enumerate().flat_map(step)).chain([[1.0, 1.0]]);
        Chart {
            title: "p-values of nulls".into(),
            x_label: "p-value".into(),
            y_label: "share of nulls at most there".into(),
            series: vec![
                Series { name: "nulls".into(), points: found.collect() },
                Series { name: "uniform".into(), points: vec![[0.0, 0.0], [1.0, 1.0]] },
            ],
            ..Chart::default()
        }
    }
}
