//! `hybridsim check`.

use std::path::{Path, PathBuf};

use burn::tensor::Device;
use clap::Args;

use super::{
    Common, Out, conventions, describe,
    motion::{MotionReading, READING_HINT},
    plausible,
};
use crate::{
    challenge::ChallengeConfig,
    config::Config,
    data::{Recording, atomic::AtomicFolder, recording::SETTINGS_FILE, settings},
    error::{Error, Result},
    evaluation,
    experiments::ReproduceConfig,
    heatmap::HeatmapConfig,
    integrity::{self, Against},
    plausibility::Sources,
    radar::{self, Radar},
    room::Room,
    site::SiteConfig,
    training::checkpoint,
    verbs::{heatmaps::Pictures, plausible::of_recording},
};

#[derive(Args)]
#[command(mut_arg("out", |out| out.help("Folder for the heatmaps of a recording [default: none are drawn]")))]
pub(crate) struct Arguments {
    /// A config file, a recording folder, a checkpoint folder, a body (.npz), a motion (.npz, .bvh) or a mesh
    /// (vertices .npy, .obj)
    path: PathBuf,
    #[command(flatten)]
    reading: MotionReading,
    #[command(flatten)]
    out: Out,
}

impl Arguments {
    /// Whether it is a config, which settings may override.
    pub(super) fn reads_settings(&self) -> bool {
        !self.path.is_dir() && !describe::knows(&self.path) && !describe::is_pickle(&self.path)
    }
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let path = &arguments.path;
    if !path.is_dir() && describe::knows(path) {
        return describe::run(path, &arguments.reading, common);
    }
    refuse_others(path)?;
    arguments.reading.refused(READING_HINT)?;
    if path.join("checkpoint.toml").is_file() {
        return show_checkpoint(path, common);
    }
    if path.is_dir() && !path.join(SETTINGS_FILE).exists() {
        let expected = "a recording (recording.toml) or a checkpoint (checkpoint.toml)";
        return Err(Error::Usage {
            message: format!(
                "{}: neither recording.toml nor checkpoint.toml is in this folder, expected {expected}",
                path.display()
            ),
            hint: Some("a run folder has its checkpoints in best and last, a site its recordings in folders below it".into()),
        });
    }
    if path.is_dir() {
        let out = arguments.out.out.as_ref().map(AtomicFolder::create).transpose()?;
        let (recording, is_whole) = show_recording(path, common)?;
        if let (Some(folder), Some(out)) = (out, &arguments.out.out) {
            draw(&recording, folder)?;
            say!("  heatmaps           {}", out.display());
        }
        return if is_whole { Ok(()) } else { Err(damaged(&recording)) };
    }
    show_config(path, common)
}

/// # Errors
/// A file that is none of those that can be checked.
fn refuse_others(path: &Path) -> Result<()> {
    if describe::is_pickle(path) {
        return Err(Error::field(path, "type", "a Python pickle", "a body as .npz, or a config (.toml)")
            .with_hint("convert a body model of SMPL, SMPL-H or SMPL-X with python scripts/smpl_to_npz.py MODEL.pkl BODY.npz"));
    }
    if path.is_file() && describe::ending(path) != "toml" {
        let expected = "a config (.toml), a body or a motion (.npz, .bvh), or a mesh (.obj, .npy)";
        return Err(Error::field(path, "type", format!("`.{}`", describe::ending(path)), expected).with_hint(
            "other meshes are written as .obj by Blender or meshio; captures of radars are read by `hybridsim import`",
        ));
    }
    Ok(())
}

fn show_checkpoint(path: &Path, common: &Common) -> Result<()> {
    let (simulator, state) = checkpoint::open(path, &Device::flex())?;
    say!(
        "checkpoint of hybridsim {}, {} epochs, best in epoch {}",
        state.version,
        state.progress.epochs_done,
        state.progress.best_epoch + 1
    );
    show_radar(&state.site.radar, state.site.room.as_ref());
    plausible::scene(
        Some(&state.site.radar),
        state.site.room.as_ref(),
        None,
        &Sources::one(path.join("checkpoint.toml")),
        common,
    )?;
    for effect in simulator.effects.settings() {
        let values = effect.parameters.iter().map(|(name, values)| format!("{name} {values:.4?}"));
        let values: Vec<String> = effect.choice.iter().cloned().chain(values).collect();
        let off = if effect.enabled { "" } else { " (switched off)" };
        say!("effect {}{off}: {}", effect.id, values.join(", "));
    }
    Ok(())
}

/// What a config names: recordings that there are, and the one that it makes.
fn show_config(path: &Path, common: &Common) -> Result<()> {
    if let Some((verb, resolved)) = of_another_verb(path, &common.set)? {
        say!("a config of `hybridsim {verb}`; resolved:\n\n{resolved}");
        return Ok(());
    }
    let config = Config::read(path, &common.set)?;
    let mut first_damaged = None;
    for recording in &config.data.recordings {
        let (recording, is_whole) = show_recording(recording, common)?;
        first_damaged = first_damaged.or((!is_whole).then(|| damaged(&recording)));
    }
    if let Some(record) = &config.record {
        let world = record.world(path.parent().unwrap_or(Path::new("")))?;
        say!("a recording to be made:");
        show_radar(&world.radar, Some(&world.room));
        for note in record.motion_notes(path.parent().unwrap_or(Path::new("")))? {
            remark!("note: {note}");
        }
        plausible::scene(Some(&world.radar), Some(&world.room), world.person.as_ref(), &Sources::one(path), common)?;
    }
    say!("resolved configuration:\n\n{}", config.to_toml());
    first_damaged.map_or(Ok(()), Err)
}

/// The verb that reads a config, where that is another one than `train`, and what the config says in full. A key that only such a config
/// has says which it is.
fn of_another_verb(path: &Path, sets: &[String]) -> Result<Option<(&'static str, String)>> {
    let table = settings::resolve(path, sets)?;
    let has = |keys: &[&str]| keys.iter().any(|key| table.contains_key(*key));
    Ok(Some(if has(&["cases", "shares", "structures"]) {
        ("challenge seal", in_full(&ChallengeConfig::read(path, sets)?))
    } else if has(&["site", "variants", "second_room", "second_scene"]) {
        ("reproduce", in_full(&ReproduceConfig::read(path, sets)?))
    } else if has(&["subjects", "actions", "repetitions", "unseen", "again"]) {
        ("site", SiteConfig::read(path, sets)?.to_toml())
    } else {
        return Ok(None);
    }))
}

fn in_full(config: &impl serde::Serialize) -> String {
    toml::to_string_pretty(config).expect("settings are plain data")
}

/// Heatmaps of what was measured, for `--out`.
fn draw(recording: &Recording, folder: AtomicFolder) -> Result<()> {
    let frames = recording.whole_stretch()?.take(MOST_DRAWN);
    let samples = frames.map(|frame| evaluation::measured_frame(recording, frame)).collect::<Result<Vec<_>>>()?.concat();
    Pictures::new(&recording.radar, &HeatmapConfig::default()).show(folder.path(), &samples)?;
    folder.finish()
}

/// Frames that pictures over time show at most: they are held in memory together.
const MOST_DRAWN: usize = 600;

/// A recording, and whether its samples are whole.
fn show_recording(folder: &Path, common: &Common) -> Result<(Recording, bool)> {
    let recording = Recording::open(folder)?;
    let is_whole = show(&recording, common)?;
    Ok((recording, is_whole))
}

/// What scripts are to notice.
fn damaged(recording: &Recording) -> Error {
    Error::field(recording.folder.join("recording.toml"), "files.if", "samples that are damaged, misread or of another convention, see above", "whole samples, as stated")
        .with_hint(
            "what was lost is marked in valid.npy; what was misread is imported again with its right description; --as-stated keeps your word",
        )
}

/// What a recording is, that all of its samples can be read, and what they say of themselves: whether they are whole.
fn show(recording: &Recording, common: &Common) -> Result<bool> {
    report(recording, common)?;
    // Every whole frame is read once, so that a truncated or lying file shows here.
    let findings = integrity::inspect(recording, recording.radar.frames)?;
    say!("  samples            {}, all {} frames can be read", recording.number_type(), recording.whole_frames().count());
    conventions::show(&recording.radar, &findings, Against::Questioned);
    Ok(common.as_stated || findings.iter().all(|finding| finding.ok))
}

/// What is stated of a recording, and whether it can be.
fn report(recording: &Recording, common: &Common) -> Result<()> {
    describe(recording);
    for note in &recording.notes {
        remark!("note: {note}");
    }
    let (facts, sources) = of_recording(recording)?;
    // Where it does not hold, a note says so.
    let of_body = facts.fastest_radial_mps().map(|fastest_mps| radar::fastest(&recording.radar, fastest_mps));
    of_body.iter().filter(|check| check.passed == Some(true)).for_each(show_rule);
    plausible::report(facts, &sources, common)
}

/// What is stated of a recording.
pub(super) fn describe(recording: &Recording) {
    say!("recording: {}", recording.folder.display());
    show_radar(&recording.radar, recording.room.as_ref());
    match recording.person() {
        Some(person) => {
            let times = person.pose_times_s();
            say!(
                "  person             {} faces, {} poses from {:.2} s to {:.2} s",
                person.faces().len(),
                times.len(),
                times[0],
                times[times.len() - 1]
            );
        }
        None => say!("  person             none: only what needs no tracked body will work"),
    }
}

fn show_radar(radar: &Radar, room: Option<&Room>) {
    let [frames, tx, rx, loops, samples] = radar.dims();
    say!("  frames x tx x rx x loops x samples   {frames} x {tx} x {rx} x {loops} x {samples}");
    let middle_ghz = (radar.carrier_hz() + 0.5 * radar.bandwidth_hz()) / 1e9;
    say!("  carrier            {:.3} GHz at the first sample", radar.carrier_hz() / 1e9);
    say!("  wavelength         {:.3} mm at the middle of the band, {middle_ghz:.3} GHz", radar.wavelength_m() * 1e3);
    let falling = if radar.slope_hz_per_s < 0.0 { ", falling" } else { "" };
    say!("  bandwidth          {:.3} GHz{falling}", radar.bandwidth_hz().abs() / 1e9);
    say!("  range              {:.3} m resolution, up to {:.2} m", radar.range_resolution_m(), radar.max_range_m());
    if loops > 1 {
        let (resolution, most) = (radar.velocity_resolution_mps(), radar.max_velocity_mps());
        say!("  velocity           {resolution:.3} m/s resolution, up to {most:.2} m/s");
    } else {
        let most = radar.max_tracked_velocity_mps();
        say!("  velocity           one chirp a frame measures none; from frame to frame up to {most:.4} m/s without ambiguity");
    }
    match room {
        Some(room) => say!(
            "  room               {}",
            room.boundaries()
                .into_iter()
                .map(|boundary| format!("{} {:.2} m", boundary.name(), room.distance_m(boundary).expect("it exists")))
                .collect::<Vec<_>>()
                .join(", ")
        ),
        None => say!("  room               none: only what needs no walls will work"),
    }
    radar::checks(radar, room.and_then(Room::farthest_wall_m)).iter().for_each(show_rule);
}

fn show_rule(check: &radar::Check) {
    match check.passed {
        Some(true) => say!("  ok       {} ({})", check.rule, check.found),
        Some(false) => remark!("warning: {} does not hold ({}): {}", check.rule, check.found, check.reason),
        None => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_config_that_ships_is_known_by_the_verb_that_reads_it() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs");
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            if path.extension().is_none_or(|end| end != "toml") {
                continue;
            }
            let verb = of_another_verb(&path, &[]).unwrap_or_else(|error| panic!("{name}: {error}")).map(|(verb, _)| verb);
            let wanted = match name.split('_').next().unwrap() {
                "site" => Some("site"),
                "reproduce" => Some("reproduce"),
                "challenge" => Some("challenge seal"),
                _ => None,
            };
            assert_eq!(verb, wanted, "{name}");
        }
    }

    #[test]
    fn a_folder_that_is_neither_recording_nor_checkpoint_is_called_that() {
        let folder = tempfile::tempdir().unwrap();
        let arguments = <Only as clap::Parser>::parse_from(["check".as_ref(), folder.path().as_os_str()]);
        let error = run(&arguments.check, &arguments.common).unwrap_err().to_string();
        assert!(error.contains("neither recording.toml nor checkpoint.toml"), "{error}");
    }

    #[derive(clap::Parser)]
    struct Only {
        #[command(flatten)]
        check: Arguments,
        #[command(flatten)]
        common: Common,
    }
}
