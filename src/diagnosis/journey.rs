//! From a recording to a diagnosis: read, audit, explain in rounds, report.

use std::collections::BTreeMap;

use super::audit::{self, Check};
use super::calibration::Table;
use super::config::DiagnosisConfig;
use super::cube::{Loaded, most_frames};
use super::detectors::paths::body_rms;
use super::evidence::Evidence;
use super::finding::Correction;
use super::limits::limits;
use super::misfit::Misfit;
use super::null::Null;
use super::prediction::BodyPrediction;
use super::report::{
    Effect, FORMAT, Findings, Fit, HeldOut, Location, NotDetectable, Report, Verdict, moving_energy, never_detectable,
    probability_of_nothing,
};
use super::residual::{is_added, is_filter};
use super::select::{Accepted, Explanation, explain};
use crate::data::Recording;
use crate::effects::EffectSetting;
use crate::error::{Error, Result};
use crate::integrity;
use crate::person::Person;
use crate::radar::Radar;

/// The answer, and what pictures of it need.
pub struct Diagnosis {
    pub report: Report,
    pub radar: Radar,
    /// The recording as it was read.
    pub original: Evidence,
    /// Absent when nothing could be decided.
    pub explanation: Option<Explanation>,
}

impl Diagnosis {
    /// What was found, as settings of the simulator in its own units.
    pub fn effects(&self) -> Vec<EffectSetting> {
        let Some(explanation) = &self.explanation else { return vec![] };
        // Levels are relative to the signal without what was added to it.
        let reference = explanation.evidence.peak();
        let (radar, body_rms) = (&explanation.evidence.radar, body_rms(&explanation.evidence).unwrap_or(reference));
        explanation.accepted.iter().filter_map(|effect| effect.candidate.setting(reference, body_rms, radar)).collect()
    }
}

/// Looks at a recording; `progress` receives what happens, in plain words.
///
/// # Errors
/// A recording that cannot be read, is too short to hold anything out, or whose motion does not cover its frames.
pub fn diagnose(recording: &Recording, config: &DiagnosisConfig, progress: &mut dyn FnMut(&str)) -> Result<Diagnosis> {
    let settings = recording.folder.join("recording.toml");
    recording.radar.refuse_falling("radar", "the diagnosis knows no falling ones").map_err(|error| error.in_file(settings))?;
    let most_frames = most_frames(&recording.radar);
    let table = Table::named(config)?;
    if let (Some(table), Some(path)) = (&table, &config.calibration) {
        table.check(recording, path)?;
    }
    let mut notes = notes(recording, most_frames)?;
    config.check()?;
    progress("reading");
    let integrity = integrity::inspect(recording, most_frames)?;
    let damage = integrity::damage(&integrity);
    let loaded = Loaded::read(recording, most_frames)?;
    let whole = recording.person().filter(|_| damage.is_none());
    let body = whole.map(|person| prediction(recording, person, &loaded)).transpose()?;
    if damage.is_none() {
        notes.extend(audit::limits(&loaded, body.is_some(), recording.room.is_some()));
    }
    let radar = loaded.radar.clone();
    let held_out = HeldOut::of(&loaded.split);
    let mut original = Evidence::new(loaded, recording.room.clone(), body);
    original.library = config.library();
    let mut report = Report {
        audit: integrity.into_iter().map(Check::from).collect(),
        notes,
        settings: config.fingerprint(&table.iter().map(Table::shaping).collect::<Vec<_>>()),
        ..undecided(recording, held_out)
    };
    if let Some(damage) = damage {
        // Physics fitted to what no receiver sent would be a fiction.
        (report.verdict, report.reason) = (Verdict::Damaged, damage);
        return Ok(Diagnosis { report, radar, original, explanation: None });
    }
    if let Some(reason) = first_to_be_mended(recording, &original, config, &mut report.audit, progress) {
        report.reason = reason;
        return Ok(Diagnosis { report, radar, original, explanation: None });
    }
    progress("locating the residual");
    report.located = Location::of(&original);
    progress("asking whether anything is missing at all");
    report.null = Null::of(&original, config.seed);
    progress("looking for what was left out");
    let explanation = explain(original.clone(), config, progress);
    conclude(&mut report, &original, &explanation, config, table.as_ref(), progress);
    Ok(Diagnosis { report, radar, original, explanation: Some(explanation) })
}

/// What is to be known of how a recording is read.
fn notes(recording: &Recording, most_frames: usize) -> Result<Vec<String>> {
    let mut notes = recording.notes.clone();
    let stretch = recording.whole_stretch()?;
    if stretch.len() < recording.radar.frames {
        let (first, last) = (stretch.start, stretch.end - 1);
        notes.push(format!(
            "the frames {first} to {last} were looked at, the longest stretch without lost chirps; frames are counted from frame {first}"
        ));
    }
    if stretch.len() > most_frames {
        notes.push(format!("the first {most_frames} of {} frames were looked at", stretch.len()));
    }
    Ok(notes)
}

/// The report before anything is known.
fn undecided(recording: &Recording, held_out: HeldOut) -> Report {
    Report {
        format: FORMAT,
        recording: recording.folder.display().to_string(),
        held_out,
        verdict: Verdict::Undecided,
        reason: String::new(),
        probability_nothing_missing: 0.5,
        p_value: None,
        null: Null::default(),
        calibration: None,
        detectors: BTreeMap::new(),
        audit: vec![],
        effects: vec![],
        unexplained: vec![],
        not_detectable: vec![],
        fit: Fit { before: Misfit::default(), after: Misfit::default() },
        located: Location::default(),
        notes: vec![],
        simulator: None,
        settings: String::new(),
    }
}

/// Why no physics can be fitted yet: what the audit cannot decide on, or a convention that is wrong. `checks` receives what the audit
/// found.
fn first_to_be_mended(
    recording: &Recording,
    original: &Evidence,
    config: &DiagnosisConfig,
    checks: &mut Vec<Check>,
    progress: &mut dyn FnMut(&str),
) -> Option<String> {
    progress("checking conventions");
    checks.extend(audit::audit(original, recording.person().and_then(Person::origin_m)));
    if let Some(reason) = audit::undecidable(original, checks) {
        return Some(reason);
    }
    observed_once_unmasked(original, config, checks, progress);
    let wrong = audit::wrong_conventions(checks);
    let (first, others) = wrong.split_first()?;
    // Physics fitted under a wrong convention would only imitate it.
    let mut reason =
        format!("a convention, or the scene as it is stated, is wrong, which comes before any physics: {}", first.found);
    if !others.is_empty() {
        let found: Vec<&str> = others.iter().map(|check| check.found.as_str()).collect();
        reason += &format!(". What else is wrong, perhaps because of it: {}", found.join("; "));
    }
    Some(reason)
}

/// Verdict, effects, limits and probabilities, by what the rounds left.
fn conclude(
    report: &mut Report,
    original: &Evidence,
    explanation: &Explanation,
    config: &DiagnosisConfig,
    table: Option<&Table>,
    progress: &mut dyn FnMut(&str),
) {
    let findings = Findings::of(explanation, moving_energy(original));
    report.verdict = findings.verdict;
    report.reason = findings.reason;
    report.effects = findings.effects;
    report.unexplained = findings.unexplained;
    report.not_detectable = never_detectable(original.body.is_some());
    if config.limits {
        progress("putting in what was not found, to see how strong it can be");
        let taken: Vec<&str> = report.effects.iter().flat_map(Effect::names).collect();
        let limits = limits(&explanation.evidence, &taken, moving_energy(original), config);
        report.not_detectable.extend(limits.into_iter().map(NotDetectable::at_most));
    }
    let is_found = |id: &str| report.effects.iter().any(|effect| effect.id == id);
    report.not_detectable.retain(|limit| original.info(&limit.id).is_some() && !is_found(&limit.id));
    report.null.bound = Some(explanation.bound);
    report.detectors = explanation.detectors.clone();
    report.p_value = report.null.p_value();
    if let (Some(table), Some(raw)) = (table, report.p_value) {
        let calibrated = table.calibrated(raw, &report.detectors);
        report.p_value = Some(calibrated.p_value());
        report.calibration = Some(calibrated);
    }
    doubt(report, explanation, config);
    let nothing = probability_of_nothing(report.p_value.unwrap_or(1.0));
    report.probability_nothing_missing = match report.verdict {
        Verdict::NoMismatch => 1.0 - 0.5 * (1.0 - nothing),
        _ => nothing,
    };
    report.fit = Fit { before: explanation.before, after: explanation.after };
}

/// What the verdict leaves out where the rounds found nothing more, and the recording, or what is left of it, is improbable all the same.
fn doubt(report: &mut Report, explanation: &Explanation, config: &DiagnosisConfig) {
    if let (Verdict::NoMismatch, Some(p_value)) = (report.verdict, report.p_value.filter(|p_value| *p_value < config.alarm)) {
        report.reason = format!(
            "a recording like this is improbable where nothing is missing (p = {p_value:.1e}): something may be that no detector locates"
        );
    }
    // Of a mover limbs are left, a law of the noise is no part of what is taken out, and to undo a filter amplifies side lobes.
    let leaves_nothing = |Accepted { candidate, .. }: &Accepted| {
        is_added(candidate) || matches!(candidate.correction, Correction::Inverse(..)) && !is_filter(candidate)
    };
    if report.verdict == Verdict::Explained && explanation.accepted.iter().all(leaves_nothing) {
        let left = Null::of(&explanation.evidence, config.seed).of_held_out().p_value();
        if let Some(p_value) = left.filter(|p_value| *p_value < config.alarm) {
            report.verdict = Verdict::PartlyExplained;
            report.reason = format!(
                "what was found has names, but what they leave is improbable where nothing else is missing (p = {p_value:.1e}): something may \
                 be that no detector locates"
            );
        }
    }
}

/// A body that is not observed may be masked by what needs no body to be found (a phase noise spreads the static clutter over all
/// velocities): where it is observed once that is undone, nothing is wrong with the scene.
fn observed_once_unmasked(original: &Evidence, config: &DiagnosisConfig, checks: &mut [Check], progress: &mut dyn FnMut(&str)) {
    let Some(silent) = checks.iter_mut().find(|check| audit::is_silent(check)) else { return };
    progress("no body is observed: looking for what masks it");
    let mut alone = original.clone();
    alone.body = None;
    let explained = explain(alone.changed(), config, &mut |_| {});
    if explained.accepted.is_empty() {
        return;
    }
    let mut restored = explained.evidence;
    restored.body = original.body.clone();
    if let Some(check) = audit::body_place(&restored.changed()).filter(|check| check.ok) {
        *silent = Check { found: format!("{}; but {} once what masks it is undone", silent.found, check.found), ..check };
    }
}

fn prediction(recording: &Recording, person: &Person, loaded: &Loaded) -> Result<BodyPrediction> {
    let times = person.pose_times_s();
    let (first, last) = (times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(0.0));
    let start = loaded.starts_s.first().copied().unwrap_or(0.0);
    let end = loaded.starts_s.last().copied().unwrap_or(0.0) + loaded.radar.frame_duration_s();
    if start < first - 1e-9 || end > last + 1e-9 {
        return Err(Error::field(
            recording.folder.join("recording.toml"),
            "motion",
            format!("from {first:.3} s to {last:.3} s"),
            format!("a motion over all frames, from {start:.3} s to {end:.3} s"),
        )
        .with_hint("give a longer motion, or shift it with motion.start_s (no sequence of meshes has one), which `hybridsim align` finds"));
    }
    BodyPrediction::new(person, &loaded.radar, &loaded.starts_s)
}
