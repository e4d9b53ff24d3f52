//! What was refined, as a file beside a checkpoint.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::Judgement;
use crate::{
    body::PoseCorrection,
    data::{atomic, settings::read_toml},
    error::{Error, Result},
    person::Person,
    training::LoadedRecording,
};

/// Of a checkpoint folder; all keys carry their units.
pub const FILE: &str = "pose.toml";

/// One recording's correction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RefinedPose {
    /// The recording's folder.
    pub recording: PathBuf,
    pub correction: PoseCorrection,
    /// Why it is this one, in the order in which corrections were compared.
    #[serde(default)]
    pub judgements: Vec<Judgement>,
}

impl RefinedPose {
    /// One line for people: what was found, and why no more and no less.
    pub fn line(&self) -> String {
        let why: Vec<String> = self.judgements.iter().map(Judgement::clause).collect();
        let why = if why.is_empty() { String::new() } else { format!(" ({})", why.join("; ")) };
        format!("{}: {}{why}", self.recording.display(), self.found())
    }

    /// Whether anything of the motion is corrected.
    fn moves(&self) -> bool {
        let PoseCorrection { clock_s, heading_rad, shift_m: [x, y, z], betas, turns_rad, shifts_m, .. } = &self.correction;
        [*clock_s, *heading_rad, *x, *y, *z] != [0.0; 5] || !(betas.is_empty() && turns_rad.is_empty() && shifts_m.is_empty())
    }

    fn found(&self) -> String {
        let PoseCorrection { clock_s, heading_rad, shift_m: [x, y, z], turns_rad, shifts_m, .. } = &self.correction;
        if !self.moves() {
            return "the motion stays as it was given".into();
        }
        let mean = |squares: f64, count: usize| (squares / count.max(1) as f64).sqrt();
        let length = |vector: &[f64; 3]| vector.iter().map(|value| value * value).sum::<f64>();
        let turns: Vec<&[f64; 3]> = turns_rad.iter().flatten().collect();
        let turn = mean(turns.iter().map(|turn| length(turn)).sum(), turns.len()).to_degrees();
        let shift = mean(shifts_m.iter().map(length).sum(), shifts_m.len()) * 1e3;
        let single = if shifts_m.is_empty() {
            String::new()
        } else {
            format!("; single frames by {shift:.1} mm and their joints by {turn:.2} degrees, root mean square")
        };
        format!(
            "the motion was refined: later by {:.1} ms, turned by {:.2} degrees, shifted by ({:.1}, {:.1}, {:.1}) mm{single}",
            1e3 * clock_s,
            heading_rad.to_degrees(),
            1e3 * x,
            1e3 * y,
            1e3 * z,
        )
    }

    /// Refuses what does not belong to a motion of so many joints.
    fn check(&self, path: &Path, joints: usize) -> Result<()> {
        let correction = &self.correction;
        let knots = correction.knots_s.len();
        let ascend = correction.knots_s.windows(2).all(|pair| pair[0] < pair[1]);
        let turns = &correction.turns_rad;
        let fits = turns.iter().all(|turn| turn.len() == joints)
            && [turns.len(), correction.shifts_m.len()].iter().all(|&count| count == 0 || count == knots);
        let numbers = [correction.clock_s, correction.heading_rad];
        let vectors = turns.iter().flatten().chain(&correction.shifts_m).chain([&correction.pivot_m, &correction.shift_m]);
        let finite = numbers.iter().chain(vectors.flatten()).chain(&correction.betas).all(|value| value.is_finite());
        if ascend && fits && finite {
            return Ok(());
        }
        Err(Error::field(
            path.join(FILE),
            "refined.correction",
            format!("{knots} knots, {} turns, {} shifts", turns.len(), correction.shifts_m.len()),
            format!("finite numbers, knots that ascend, and for each a turn of {joints} joints and a shift, or none"),
        )
        .with_hint("remove the file to use the recording's own motion"))
    }
}

#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Contents {
    refined: Vec<RefinedPose>,
}

/// The text of the file.
pub fn text(refined: &[RefinedPose]) -> String {
    toml::to_string(&Contents { refined: refined.to_vec() }).expect("plain data")
}

/// Writes the file into a folder.
///
/// # Errors
/// A folder that cannot be written to.
pub fn write(folder: &Path, refined: &[RefinedPose]) -> Result<()> {
    atomic::write_text(folder.join(FILE), &text(refined))
}

/// What the file in a folder says; nothing where there is none.
///
/// # Errors
/// A file that is damaged.
pub fn read(folder: &Path) -> Result<Vec<RefinedPose>> {
    let path = folder.join(FILE);
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let refined = read_toml::<Contents>(&path)?.refined;
    for pose in &refined {
        // Of how many joints the motion has, only the recording knows.
        pose.check(folder, pose.correction.turns_rad.first().map_or(0, Vec::len))?;
    }
    Ok(refined)
}

/// A recording with its person as refined, where its folder is one of those whose motion was; else as it is. Also whether.
///
/// # Errors
/// A correction that does not belong to the recording's motion.
pub fn refined(recording: LoadedRecording, poses: &[RefinedPose]) -> Result<(LoadedRecording, bool)> {
    let real = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let own = real(&recording.folder);
    let (Some(pose), Some(person)) = (poses.iter().find(|pose| real(&pose.recording) == own), recording.recording.person())
    else {
        return Ok((recording, false));
    };
    if let Person::Skinned { motion, .. } = person
        && let Some(first) = motion.poses.first()
    {
        pose.check(&recording.folder, first.len())?;
    }
    if !pose.moves() {
        return Ok((recording, false));
    }
    let scene = recording.scene.corrected(person, pose.correction.clone())?;
    Ok((LoadedRecording { scene, ..recording }, true))
}
