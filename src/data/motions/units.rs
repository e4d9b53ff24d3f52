//! Units that a file does not state: of angles, and of the way.

use std::f64::consts::PI;
use std::path::Path;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::keys::Raw;
use super::upright::UpAxis;
use crate::error::{Error, Result};
use crate::person::Motion;

/// What an axis-angle's length is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RotationUnit {
    Radians,
    Degrees,
}

/// A joint's angle counts as what it is in all but this share of the poses.
const OUTLIERS: f64 = 0.05;

/// Nobody has run faster: Usain Bolt between 60 and 80 m in Berlin (Graubner & Nixdorf, 2011).
const FASTEST_MPS: f64 = 12.4;

/// Whose pelvis is this far above or below the motion's origin is not in a room.
const HIGHEST_M: f64 = 10.0;

/// Units of a translation that is not in metres.
const UNITS_M: [(f64, &str); 3] = [(0.01, "centimetres"), (0.001, "millimetres"), (0.0254, "inches")];

/// Makes radians of the angles, and says so; whether they were something else.
///
/// Half a turn is the most that any rotation needs, and joints turn less. So where most of the joints that move at all
/// turn by more, the numbers are degrees. (The root may count turns, so it is not looked at; nor are joints of no known
/// model.)
pub fn angles(raw: &mut Raw, unit: Option<RotationUnit>) -> (bool, String) {
    let joints = raw.rotations[0].len();
    let usual = |joint: usize| {
        let norm = |pose: &Vec<[f64; 3]>| pose[joint].iter().map(|angle| angle * angle).sum::<f64>().sqrt();
        quantile(raw.rotations.iter().map(norm).collect(), 1.0 - OUTLIERS)
    };
    let usual: Vec<f64> = (1..joints).map(usual).filter(|angle| *angle > 1e-3).collect();
    let beyond = usual.iter().filter(|angle| **angle > PI).count();
    let note = match unit {
        Some(RotationUnit::Radians) => return (false, "angles: radians, by angles".into()),
        None if 2 * beyond <= usual.len() || raw.layout.is_none() => return (false, "angles: radians".into()),
        Some(RotationUnit::Degrees) => "angles: degrees, by angles".into(),
        None => format!(
            "angles: degrees, made radians ({beyond} of the {} joints that move would turn by more than half a turn); \
             `angles = \"radians\"` keeps them",
            usual.len()
        ),
    };
    raw.rotations.iter_mut().flatten().flatten().for_each(|angle| *angle = angle.to_radians());
    (true, note)
}

/// The value below which this share of all lies.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(((values.len() as f64 * share) as usize).min(values.len().saturating_sub(1))).copied().unwrap_or(0.0)
}

/// What heights are judged by.
#[derive(Clone, Copy)]
pub struct Height {
    pub up: UpAxis,
    /// Of the pelvis above the lowest joint of the body at rest.
    pub standing_m: f64,
}

/// Makes metres of the translations, and says what they were.
///
/// # Errors
/// When nobody could be as high and as fast, in no unit.
pub fn metres(path: &Path, key: &str, motion: &mut Motion, height: Height, scale_m: Option<f64>) -> Result<String> {
    let (scale, note) = match scale_m {
        Some(scale) if scale.is_finite() && scale > 0.0 => (scale, format!("units: {scale} m, by scale_m")),
        Some(scale) => return Err(Error::setting("scale_m", scale, "metres per unit of the file, above zero")),
        None => unit(path, key, motion, height)?,
    };
    motion.translations.iter_mut().flatten().for_each(|value| *value *= scale);
    Ok(note)
}

fn unit(path: &Path, key: &str, motion: &Motion, Height { up, standing_m }: Height) -> Result<(f64, String)> {
    let step = |pair: &[[f64; 3]]| (Vector3::from(pair[1]) - Vector3::from(pair[0])).norm();
    let speed = motion.rate_hz * quantile(motion.translations.windows(2).map(step).collect(), 1.0 - OUTLIERS);
    let above = |place: &[f64; 3]| up.direction().dot(&Vector3::from(*place)).abs();
    let height = quantile(motion.translations.iter().map(above).collect(), 0.5);
    let possible = |unit: f64| unit * speed <= FASTEST_MPS && unit * height <= HIGHEST_M;
    if possible(1.0) {
        return Ok((1.0, "units: metres".into()));
    }
    let found = format!("{height:.1} above the origin and {speed:.1} a second fast");
    // A file's origin is mostly on the floor: the pelvis is as high as in a person who stands.
    let off = |unit: f64| (unit * height / standing_m).ln().abs();
    let fits = UNITS_M.into_iter().filter(|(unit, _)| possible(*unit));
    let likely = fits.min_by(|a, b| off(a.0).total_cmp(&off(b.0)));
    let Some((unit, name)) = likely else {
        let expected = format!("metres, at most {FASTEST_MPS} m/s and {HIGHEST_M} m high");
        return Err(Error::field(path, key, found, expected).with_hint("set scale_m, the metres per unit of the file"));
    };
    Ok((unit, format!("units: {name}, made metres ({key} is {found}); `scale_m` names another")))
}
