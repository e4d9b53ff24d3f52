//! Motions: `.npz` with the axis-angle of every joint in every pose, in AMASS layout or as people's tools write it.

mod keys;
mod layout;
mod units;
mod upright;

use std::path::Path;

pub use units::RotationUnit;
pub use upright::{Figure, UpAxis, find_up};

use crate::data::arrays::{Member, Npz, Values, write_npz};
use crate::data::bodies::exactly_f32;
use crate::error::{Error, Result};
use crate::person::{BodyModel, Motion};
use keys::Raw;

/// What a file does not say about itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionOptions {
    /// Absent: recognised from how the person stands.
    pub up: Option<UpAxis>,
    /// Absent: radians, unless joints would turn as none can.
    pub angles: Option<RotationUnit>,
    /// Instead of the file's, or where it has none.
    pub rate_hz: Option<f64>,
    /// Metres per unit of the translation; absent: 1, unless nobody could be as high or as fast.
    pub scale_m: Option<f64>,
    /// Poses to leave out at the beginning.
    pub skip_poses: usize,
}

/// Poses per second of a file that does not say: most of those come from video.
const VIDEO_HZ: f64 = 30.0;

/// Reads a motion for a body of so many joints and shape parameters, and notes of what was fitted or is not as AMASS
/// writes it. The axes stay as the file has them: a recording says itself how they lie in the radar's frame.
///
/// Keys: `poses [pose, 3 J']` or `[pose, J', xyz]`, `trans [pose, xyz]`, `betas [B']`, `mocap_framerate`, and the names
/// that other tools give them. SMPL's 24 joints, SMPL-H's 52 and SMPL-X's 55 are matched by name where the body has one
/// of these numbers; otherwise joints are matched by number. More joints or betas than the body has are left out, fewer are
/// padded with zeros, and a note says so.
pub fn read_motion(path: impl AsRef<Path>, joints: usize, betas: usize) -> Result<(Motion, Vec<String>)> {
    let path = path.as_ref();
    let mut raw = open(path)?;
    let mut notes = std::mem::take(&mut raw.notes);
    let translations = raw
        .translations
        .take()
        .map(|(_, translations)| translations)
        .ok_or_else(|| Error::field(path, "trans", "missing", "real numbers [pose, xyz = 3]"))?;
    let rate_hz = raw
        .rate
        .map(|(_, rate)| rate)
        .ok_or_else(|| Error::field(path, keys::RATE[0], "missing", "a single number").with_hint("poses per second"))?;
    let (converted, note) = units::angles(&mut raw, None);
    notes.extend(converted.then_some(note));
    let poses = fit_joints(&raw, joints, &mut notes);
    let betas = fit_betas(raw.betas.as_deref(), betas, &mut notes);
    Ok((Motion { poses, translations, betas, rate_hz }, named(path, notes)))
}

/// Reads a motion for a body and makes it stand on y, in metres and radians. The notes say, a line each, what was assumed
/// and what was fitted.
pub fn read_motion_upright(path: impl AsRef<Path>, model: &BodyModel, options: &MotionOptions) -> Result<(Motion, Vec<String>)> {
    let path = path.as_ref();
    let mut raw = open(path)?;
    let count = raw.rotations.len();
    if options.skip_poses >= count {
        return Err(Error::setting("skip_frames", options.skip_poses, format!("fewer than the {count} poses of the file")));
    }
    raw.rotations.drain(..options.skip_poses);
    raw.translations.iter_mut().for_each(|(_, translations)| drop(translations.drain(..options.skip_poses)));
    let mut notes = std::mem::take(&mut raw.notes);
    notes.push(units::angles(&mut raw, options.angles).1);
    let rate_hz = rate(&raw, options, &mut notes)?;
    let poses = fit_joints(&raw, model.parents.len(), &mut notes);
    let betas = fit_betas(raw.betas.as_deref(), model.shape_directions.len(), &mut notes);
    let placed = raw.translations.is_some();
    let (key, translations) = raw.translations.unwrap_or_else(|| ("trans", vec![[0.0; 3]; poses.len()]));
    let mut motion = Motion { poses, translations, betas, rate_hz };
    let up = upright::stand(&motion, model, options.up, &mut notes);
    let height = units::Height { up, standing_m: upright::pelvis_height_m(model, &motion.betas) };
    notes.push(units::metres(path, key, &mut motion, height, options.scale_m)?);
    upright::turn(&mut motion, model, up);
    if !placed {
        let height = upright::on_the_floor(&mut motion, model);
        notes.push(format!("no translation: the person stays in one place, the pelvis {height:.2} m above the lowest joint"));
    }
    Ok((motion, named(path, notes)))
}

fn open(path: &Path) -> Result<Raw> {
    let mut npz = Npz::open(path)?;
    if npz.has("v_template") && !keys::is_motion(&npz) {
        return Err(Error::Parse {
            path: path.into(),
            message: "this is a body (it has `v_template`), expected a motion".into(),
        });
    }
    keys::read(&mut npz)
}

/// Every note after the file's name.
fn named(path: &Path, notes: Vec<String>) -> Vec<String> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    notes.into_iter().map(|note| format!("{name}: {note}")).collect()
}

fn rate(raw: &Raw, options: &MotionOptions, notes: &mut Vec<String>) -> Result<f64> {
    match (options.rate_hz, raw.rate) {
        (Some(rate), _) if rate.is_finite() && rate > 0.0 => Ok(rate),
        (Some(rate), _) => Err(Error::setting("frame_rate_hz", rate, "frames per second above zero")),
        (None, Some((key, rate))) => {
            notes.push(format!("frame rate: {rate} Hz (`{key}`)"));
            Ok(rate)
        }
        (None, None) => {
            notes.push(format!(
                "frame rate: {VIDEO_HZ} Hz is assumed, the file has none: every velocity is proportional to it; \
                 `frame_rate_hz` says another"
            ));
            Ok(VIDEO_HZ)
        }
    }
}

/// The file's joints as the body numbers its own.
fn fit_joints(raw: &Raw, joints: usize, notes: &mut Vec<String>) -> Vec<Vec<[f64; 3]>> {
    let found = raw.rotations[0].len();
    if let (Some((model, names)), Some((body, wanted))) = (&raw.layout, layout::names(joints))
        && *names != wanted
    {
        let from: Vec<Option<usize>> = wanted.iter().map(|name| names.iter().position(|known| known == name)).collect();
        let lost = names.iter().filter(|name| !wanted.contains(name)).count();
        let rest = wanted.iter().filter(|name| !names.contains(name)).count();
        notes.push(format!(
            "joints: {found} of {model} on the body's {joints} of {body}, by name: {lost} are left out, {rest} rest"
        ));
        let pose = |pose: &Vec<[f64; 3]>| from.iter().map(|from| from.map_or([0.0; 3], |from| pose[from])).collect();
        return raw.rotations.iter().map(pose).collect();
    }
    notes.extend(fit_note("joints", found, joints, "rest"));
    raw.rotations.iter().map(|pose| fit(pose, joints, [0.0; 3])).collect()
}

fn fit_betas(found: Option<&[f64]>, wanted: usize, notes: &mut Vec<String>) -> Vec<f64> {
    let Some(found) = found else {
        notes.push("no `betas`, the body's mean shape is used".into());
        return vec![0.0; wanted];
    };
    notes.extend(fit_note("betas", found.len(), wanted, "are zero"));
    fit(found, wanted, 0.0)
}

/// Writes a motion so that `read_motion` gives the same one.
pub fn write_motion(path: impl AsRef<Path>, motion: &Motion) -> Result<()> {
    let (poses, joints) = (motion.poses.len(), motion.poses.first().map_or(0, Vec::len));
    let rotations: Vec<f64> = motion.poses.iter().flatten().flatten().copied().collect();
    let real = [
        ("poses", vec![poses, 3 * joints], rotations),
        ("trans", vec![poses, 3], motion.translations.concat()),
        ("betas", vec![motion.betas.len()], motion.betas.clone()),
        (keys::RATE[0], vec![], vec![motion.rate_hz]),
    ];
    let narrow: Vec<_> = real.iter().map(|(_, _, values)| exactly_f32(values)).collect();
    let members: Vec<_> = real
        .iter()
        .zip(&narrow)
        .map(|((name, shape, values), narrow)| Member {
            name,
            shape: shape.clone(),
            values: narrow.as_ref().map_or(Values::F64(values), |narrow| Values::F32(narrow)),
        })
        .collect();
    write_npz(path, &members)
}

fn fit<T: Copy>(values: &[T], length: usize, padding: T) -> Vec<T> {
    (0..length).map(|index| values.get(index).copied().unwrap_or(padding)).collect()
}

fn fit_note(what: &str, found: usize, wanted: usize, padded: &str) -> Option<String> {
    match found {
        _ if found > wanted => Some(format!("{found} {what}, the body has {wanted}: the last {} are left out", found - wanted)),
        _ if found < wanted => Some(format!("{found} {what}, the body has {wanted}: the last {} {padded}", wanted - found)),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
