//! Motions in AMASS layout: `.npz` with the axis-angle of every joint in every pose.

use std::path::Path;

use crate::data::arrays::{Array, Member, Npz, Values, write_npz};
use crate::data::bodies::exactly_f32;
use crate::error::{Error, Result};
use crate::person::{JOINT_NAMES, Motion};

/// AMASS has written the rate under both names.
const RATE_KEYS: [&str; 2] = ["mocap_framerate", "mocap_frame_rate"];

/// Reads a motion for a body of so many joints and shape parameters, and notes of what was fitted.
///
/// Keys: `poses [pose, 3 J']`, `trans [pose, xyz]`, `betas [B']`, `mocap_framerate`. More joints or betas than the
/// body has are left out, fewer are padded with zeros, and a note says so.
pub fn read_motion(path: impl AsRef<Path>, joints: usize, betas: usize) -> Result<(Motion, Vec<String>)> {
    let path = path.as_ref();
    let mut npz = Npz::open(path)?;
    if npz.has("v_template") && !npz.has("poses") {
        return Err(Error::Parse {
            path: path.into(),
            message: "this is a body (it has `v_template`), expected a motion".into(),
        });
    }
    let mut notes = vec![];
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();

    let rotations: Array<f64> = npz.read_unchecked("poses", &[("pose", None), ("3 per joint", None)])?;
    let [count, width] = rotations.shape[..] else { unreachable!("two axes were asked for") };
    if count == 0 || width == 0 || width % 3 != 0 {
        let found = format!("{:?}", rotations.shape);
        return Err(Error::field(path, "poses", found, "[pose, 3 per joint], with at least one pose and joint"));
    }
    check_rotations(path, &rotations)?;
    let poses = rotations.values.chunks(width).map(|pose| fit(pose.as_chunks().0, joints, [0.0; 3])).collect();
    notes.extend(fit_note(&name, "joints", width / 3, joints, "rest"));

    let translations: Array<f64> = npz.read("trans", &[("pose", Some(count)), ("xyz", Some(3))])?;
    let shape: Vec<f64> = if npz.has("betas") {
        npz.read::<f64>("betas", &[("shape", None)])?.values
    } else {
        notes.push(format!("{name}: no `betas`, the body's mean shape is used"));
        vec![0.0; betas]
    };
    notes.extend(fit_note(&name, "betas", shape.len(), betas, "are zero"));

    let key = RATE_KEYS.into_iter().find(|key| npz.has(key)).unwrap_or(RATE_KEYS[0]);
    let rate_hz = npz.scalar(key)?;
    if !(rate_hz.is_finite() && rate_hz > 0.0) {
        return Err(Error::field(path, key, rate_hz.to_string(), "poses per second, above zero"));
    }
    Ok((Motion { poses, translations: translations.rows(), betas: fit(&shape, betas, 0.0), rate_hz }, notes))
}

/// Writes a motion so that `read_motion` gives the same one.
pub fn write_motion(path: impl AsRef<Path>, motion: &Motion) -> Result<()> {
    let (poses, joints) = (motion.poses.len(), motion.poses.first().map_or(0, Vec::len));
    let rotations: Vec<f64> = motion.poses.iter().flatten().flatten().copied().collect();
    let real = [
        ("poses", vec![poses, 3 * joints], rotations),
        ("trans", vec![poses, 3], motion.translations.concat()),
        ("betas", vec![motion.betas.len()], motion.betas.clone()),
        (RATE_KEYS[0], vec![], vec![motion.rate_hz]),
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

fn fit_note(file: &str, what: &str, found: usize, wanted: usize, padded: &str) -> Option<String> {
    match found {
        _ if found > wanted => {
            Some(format!("{file}: {found} {what}, the body has {wanted}: the last {} are left out", found - wanted))
        }
        _ if found < wanted => {
            Some(format!("{file}: {found} {what}, the body has {wanted}: the last {} {padded}", wanted - found))
        }
        _ => None,
    }
}

/// Refuses NaN and infinity by pose and joint.
fn check_rotations(path: &Path, rotations: &Array<f64>) -> Result<()> {
    let Some(position) = rotations.values.iter().position(|value| !value.is_finite()) else { return Ok(()) };
    let what = if rotations.values[position].is_nan() { "NaN" } else { "infinite" };
    let (pose, joint) = (position / rotations.shape[1], position % rotations.shape[1] / 3);
    let name = JOINT_NAMES.get(joint).map(|name| format!(" ({name})")).unwrap_or_default();
    Err(Error::field(path, "poses", format!("{what} at pose {pose}, joint {joint}{name}"), "finite angles in radians")
        .with_hint("interpolate the pose from its neighbours, or cut the motion there"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::test_support::{shared, small_motion};

    fn written(poses: &[f64], joints: usize, rate_key: &str, betas: &[f64]) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("motion.npz");
        let count = poses.len() / (3 * joints);
        let member = |name, shape: &[usize], values| Member { name, shape: shape.to_vec(), values };
        let translations = vec![0.5; 3 * count];
        let members = [
            member("poses", &[count, 3 * joints], Values::F64(poses)),
            member("trans", &[count, 3], Values::F64(&translations)),
            member("betas", &[betas.len()], Values::F64(betas)),
            member(rate_key, &[], Values::I64(&[60])),
        ];
        write_npz(&path, &members).unwrap();
        (folder, path)
    }

    #[test]
    fn a_motion_comes_back_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("motion.npz");
        let motion = small_motion(5);
        write_motion(&path, &motion).unwrap();
        assert_eq!(read_motion(&path, 2, 1).unwrap(), (motion, vec![]));
    }

    #[test]
    fn more_is_left_out_fewer_is_padded_and_both_are_noted() {
        let (_folder, path) = written(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 2, "mocap_frame_rate", &[7.0, 8.0]);
        let (motion, notes) = read_motion(&path, 1, 1).unwrap();
        assert_eq!((motion.poses, motion.betas, motion.rate_hz), (vec![vec![[1.0, 2.0, 3.0]]], vec![7.0], 60.0));
        assert_eq!(
            notes,
            [
                "motion.npz: 2 joints, the body has 1: the last 1 are left out",
                "motion.npz: 2 betas, the body has 1: the last 1 are left out"
            ]
        );
        let (motion, notes) = read_motion(&path, 3, 3).unwrap();
        assert_eq!(motion.poses, [[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [0.0; 3]]]);
        assert_eq!(motion.betas, [7.0, 8.0, 0.0]);
        assert_eq!(
            notes,
            ["motion.npz: 2 joints, the body has 3: the last 1 rest", "motion.npz: 2 betas, the body has 3: the last 1 are zero"]
        );
    }

    #[test]
    fn a_pose_that_is_not_a_number_is_named_with_its_joint() {
        let mut poses = vec![0.0; 4 * 72];
        poses[2 * 72 + 3 * 18 + 1] = f64::NAN;
        let (_folder, path) = written(&poses, 24, "mocap_framerate", &[0.0]);
        let error = read_motion(&path, 24, 1).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!("{}: `poses` is NaN at pose 2, joint 18 (left_elbow), expected finite angles in radians", path.display())
        );
        assert_eq!(error.hint().unwrap(), "interpolate the pose from its neighbours, or cut the motion there");
    }

    #[test]
    fn a_motion_without_a_rate_is_refused() {
        let (_folder, path) = written(&[0.0; 3], 1, "fps", &[0.0]);
        let message = read_motion(&path, 1, 1).unwrap_err().to_string();
        assert_eq!(message, format!("{}: `mocap_framerate` is missing, expected a single number", path.display()));
    }

    #[test]
    fn a_body_is_not_taken_for_a_motion() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("body.npz");
        crate::data::write_body(&path, &crate::data::test_support::small_body()).unwrap();
        let message = read_motion(&path, 1, 1).unwrap_err().to_string();
        assert_eq!(message, format!("{}: this is a body (it has `v_template`), expected a motion", path.display()));
    }

    #[test]
    fn the_shared_motions_are_read() {
        for (path, poses, rate_hz) in
            [("motions/cmu/02_01_smpl24.npz", 172, 60.0), ("motions/procedural/lunge_s1.npz", 720, 60.0)]
        {
            let Some(path) = shared(path) else { return };
            let (motion, notes) = read_motion(path, 24, 10).unwrap();
            assert_eq!((motion.poses.len(), motion.translations.len(), motion.rate_hz), (poses, poses, rate_hz));
            assert!(motion.poses.iter().all(|pose| pose.len() == 24) && motion.betas.len() == 10 && notes.is_empty());
        }
        let Some(path) = shared("fixtures/smpl_formats/amass_like.npz") else { return };
        let (motion, notes) = read_motion(path, 24, 10).unwrap();
        assert_eq!((motion.poses.len(), motion.poses[0].len(), motion.betas.len()), (12, 24, 10));
        assert_eq!(
            notes,
            [
                "amass_like.npz: 52 joints, the body has 24: the last 28 are left out",
                "amass_like.npz: 16 betas, the body has 10: the last 6 are left out"
            ]
        );
    }
}
