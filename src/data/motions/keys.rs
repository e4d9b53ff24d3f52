//! The keys under which people's tools write a motion, and the shapes their arrays have.

use std::path::Path;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

use super::layout;
use crate::data::arrays::{Array, Npz};
use crate::error::{Error, Result};

/// All joints in one array: AMASS and SMPL; VIBE and WHAM; SMPL-X and GRAB; ROMP; AIST++.
const POSES: [&str; 8] = ["poses", "pose", "full_pose", "fullpose", "smpl_thetas", "thetas", "smpl_poses", "smpl_pose"];
/// The root alone: the smplx package; AMASS in SMPL-X and human_body_prior.
const ROOT: [&str; 2] = ["global_orient", "root_orient"];
/// All other joints of the body.
const BODY: [&str; 2] = ["body_pose", "pose_body"];
/// `trans` of AMASS, `transl` of smplx, ROMP's place in the camera's frame, AIST++.
const TRANSLATION: [&str; 5] = ["trans", "transl", "translation", IN_CAMERA, "smpl_trans"];
const IN_CAMERA: &str = "cam_trans";
const BETAS: [&str; 5] = ["betas", "smpl_betas", "shape", "pred_betas", "beta"];
/// AMASS has written the rate under the first two names.
pub const RATE: [&str; 6] = ["mocap_framerate", "mocap_frame_rate", "mocap_fps", "fps", "framerate", "frame_rate"];
/// The place of a person in a picture: no place in metres.
const IN_PICTURE: [&str; 4] = ["pred_cam", "orig_cam", "cam", "camera"];

/// A motion as a file has it.
#[derive(Debug)]
pub struct Raw {
    /// What the file calls its joints: a model, and the name of each; `None` for a number of joints that no model has.
    pub layout: Option<(&'static str, Vec<String>)>,
    /// `[pose][joint of the file]`, axis-angle in the file's unit.
    pub rotations: Vec<Vec<[f64; 3]>>,
    /// The key, and `[pose]` in the file's unit.
    pub translations: Option<(&'static str, Vec<[f64; 3]>)>,
    pub betas: Option<Vec<f64>>,
    /// The key, and poses per second.
    pub rate: Option<(&'static str, f64)>,
    /// What was found that is not as AMASS writes it.
    pub notes: Vec<String>,
}

/// Whether a file holds a motion.
pub fn is_motion(npz: &Npz) -> bool {
    first(npz, &POSES).or_else(|| first(npz, &BODY)).is_some()
}

fn first(npz: &Npz, keys: &[&'static str]) -> Option<&'static str> {
    keys.iter().copied().find(|key| npz.has(key))
}

pub fn read(npz: &mut Npz) -> Result<Raw> {
    let mut notes = Vec::new();
    let (layout, rotations) = rotations(npz, &mut notes)?;
    let poses = rotations.len();
    let translations = match first(npz, &TRANSLATION) {
        Some(key) => {
            if key != TRANSLATION[0] {
                let frame = if key == IN_CAMERA { ", the root in the camera's frame" } else { "" };
                notes.push(format!("translation: from `{key}`{frame}"));
            }
            Some((key, translation(npz, key, poses)?))
        }
        None => {
            notes.extend(
                first(npz, &IN_PICTURE).map(|key| format!("no translation: `{key}` is a place in a picture, not in metres")),
            );
            None
        }
    };
    let betas = match first(npz, &BETAS) {
        Some(key) => Some(betas(npz, key, &mut notes)?),
        None => None,
    };
    let rate = match first(npz, &RATE) {
        Some(key) => Some((key, npz.scalar(key)?)),
        None => None,
    };
    if let Some((key, rate)) = rate.filter(|(_, rate)| !(rate.is_finite() && *rate > 0.0)) {
        return Err(Error::field(npz.path(), key, rate.to_string(), "poses per second, above zero"));
    }
    Ok(Raw { layout, rotations, translations, betas, rate, notes })
}

type Layout = Option<(&'static str, Vec<String>)>;

/// All joints, from one array or from the root's and the body's and the hands'.
fn rotations(npz: &mut Npz, notes: &mut Vec<String>) -> Result<(Layout, Vec<Vec<[f64; 3]>>)> {
    let path = npz.path().to_path_buf();
    let root = first(npz, &ROOT);
    let Some(key) = first(npz, &POSES).or_else(|| first(npz, &BODY)) else {
        return Err(Error::field(&path, POSES[0], "missing", "real numbers [pose, 3 per joint]").with_hint(format!(
            "other names that are known: {}, or {} with {}; the file holds: {}",
            POSES[1..].join(", "),
            BODY.join(" or "),
            ROOT.join(" or "),
            npz.names().join(", ")
        )));
    };
    if key != POSES[0] {
        notes.push(format!("poses: from `{key}`{}", root.map_or(String::new(), |root| format!(" and `{root}`"))));
    }
    let array = npz.read_any(key)?;
    let mut body = joints(&path, key, array, false, notes)?;
    let count = body[0].len();
    if let Some(layout) = layout::names(count)
        && !BODY.contains(&key)
    {
        check(&path, key, &body, Some(&layout.1))?;
        return Ok((Some(layout), body));
    }
    // The body without its root: 21 joints of SMPL-H and SMPL-X, 23 of SMPL, 51 and 54 with the fingers.
    if ![21, 23, 51, 54].contains(&count) {
        check(&path, key, &body, None)?;
        return Ok((None, body));
    }
    let Some(root) = root else {
        let (model, _) = layout::names(count + 1).expect("each is one less than a model's");
        let found = format!("{} columns, the {count} joints of {model} without the root", 3 * count);
        return Err(Error::field(&path, key, found, "a root orientation beside them").with_hint(
            "save it as global_orient [pose, 3]; without it nobody knows which way the person faces \
             (zeros say: along the same axis throughout)",
        ));
    };
    let array = npz.read_any(root)?;
    let orientation = joints(&path, root, array, true, notes)?;
    same_length(&path, root, orientation.len(), body.len())?;
    body.iter_mut().zip(orientation).for_each(|(pose, root)| pose.insert(0, root[0]));
    let (mut model, mut names) = layout::names(count + 1).expect("each is one less than a model's");
    if count == 21 {
        hands(npz, &mut body, &mut names, notes)?;
        if names.len() > count + 1 {
            model = "SMPL-X or SMPL-H, in parts";
        }
    }
    check(&path, key, &body, Some(&names))?;
    Ok((Some((model, names)), body))
}

/// Appends what stands in arrays of its own: both hands, jaw and eyes.
fn hands(npz: &mut Npz, body: &mut [Vec<[f64; 3]>], names: &mut Vec<String>, notes: &mut Vec<String>) -> Result<()> {
    let path = npz.path().to_path_buf();
    let both: Vec<String> = layout::hand("left").into_iter().chain(layout::hand("right")).collect();
    let eyes = || vec!["left_eye".to_string(), "right_eye".to_string()];
    let parts = [
        ("pose_hand", both),
        ("left_hand_pose", layout::hand("left")),
        ("right_hand_pose", layout::hand("right")),
        ("pose_jaw", vec!["jaw".into()]),
        ("jaw_pose", vec!["jaw".into()]),
        ("pose_eye", eyes()),
        ("leye_pose", eyes()[..1].to_vec()),
        ("reye_pose", eyes()[1..].to_vec()),
    ];
    for (key, part) in parts {
        if !npz.has(key) {
            continue;
        }
        let array: Array<f64> = npz.read_any(key)?;
        if array.values.len() != body.len() * 3 * part.len() {
            notes.push(format!("`{key}` {:?} is no {} rotations a pose and is left out", array.shape, part.len()));
            continue;
        }
        let found = joints(&path, key, Array { shape: vec![body.len(), 3 * part.len()], values: array.values }, false, notes)?;
        body.iter_mut().zip(found).for_each(|(pose, part)| pose.extend(part));
        names.extend(part);
    }
    Ok(())
}

/// How rotations lie in an array: poses, joints, and numbers a rotation (3: axis-angle, 9: a matrix, row by row).
///
/// A person may have an axis of its own, of length 1. `one`: the rotation of a single joint.
fn arrangement(shape: &[usize], one: bool) -> std::result::Result<[usize; 3], &'static str> {
    Ok(match (shape, one) {
        (&[poses, 3] | &[poses, 1, 3] | &[1, poses, 3], true) => [poses, 1, 3],
        (&[poses, 3, 3] | &[poses, 1, 3, 3] | &[1, poses, 3, 3], true) => [poses, 1, 9],
        (_, true) => return Err("expected the rotation of one joint"),
        (&[poses, joints, 3], _) => [poses, joints, 3],
        (&[poses, joints, 3, 3] | &[1, poses, joints, 3, 3], _) => [poses, joints, 9],
        (&[1, poses, joints, 3], _) => [poses, joints, 3],
        (&[poses, joints, 9], _) => [poses, joints, 9],
        (&[_, _, 4], _) => return Err("quaternions are written in two orders; save axis-angles"),
        (&[_, _, 6], _) => return Err("save axis-angles instead of six numbers a rotation"),
        (&[poses, width] | &[poses, 1, width] | &[1, poses, width], _) if width % 3 == 0 => [poses, width / 3, 3],
        (&[_, _, _] | &[_, _, _, _], _) => return Err("several persons? save each in a file of its own"),
        _ => return Err(""),
    })
}

/// `[pose][joint]`, axis-angle.
fn joints(path: &Path, key: &str, array: Array<f64>, one: bool, notes: &mut Vec<String>) -> Result<Vec<Vec<[f64; 3]>>> {
    let refuse = |hint: &str| {
        let found = format!("{:?}", array.shape);
        let error = Error::field(path, key, found, "[pose, 3 per joint], with at least one pose and joint");
        if hint.is_empty() { error } else { error.with_hint(hint) }
    };
    let [poses, joints, numbers] = arrangement(&array.shape, one).map_err(refuse)?;
    if poses == 0 || joints == 0 {
        return Err(refuse(""));
    }
    if numbers == 3 {
        return Ok(array.values.chunks(3 * joints).map(|pose| pose.as_chunks().0.to_vec()).collect());
    }
    notes.push(format!("`{key}` holds matrices"));
    let poses = array.values.chunks(9 * joints).enumerate();
    poses.map(|(pose, values)| values.as_chunks().0.iter().map(|matrix| axis_angle(path, key, pose, matrix)).collect()).collect()
}

/// Of a rotation matrix, row by row.
fn axis_angle(path: &Path, key: &str, pose: usize, rows: &[f64; 9]) -> Result<[f64; 3]> {
    let matrix = Matrix3::from_row_slice(rows);
    // Half the precision that float16 has for a number near 1, nine times.
    let rotation = (matrix * matrix.transpose() - Matrix3::identity()).norm() < 1e-2 && matrix.determinant() > 0.0;
    if !rotation {
        return Err(Error::field(path, key, format!("no rotation at pose {pose}"), "rotation matrices, row by row"));
    }
    let rotation = Rotation3::from_matrix_unchecked(matrix);
    Ok(UnitQuaternion::from_rotation_matrix(&rotation).scaled_axis().into())
}

fn same_length(path: &Path, key: &str, found: usize, wanted: usize) -> Result<()> {
    if found == wanted {
        return Ok(());
    }
    Err(Error::field(path, key, format!("of {found} poses"), format!("{wanted} poses, as the other arrays have")))
}

/// Refuses NaN and infinity by pose and joint.
fn check(path: &Path, key: &str, poses: &[Vec<[f64; 3]>], names: Option<&Vec<String>>) -> Result<()> {
    for (pose, joints) in poses.iter().enumerate() {
        if let Some(joint) = joints.iter().position(|angles| !angles.iter().all(|angle| angle.is_finite())) {
            let what = if joints[joint].iter().any(|angle| angle.is_nan()) { "NaN" } else { "infinite" };
            let name = names.and_then(|names| names.get(joint)).map(|name| format!(" ({name})")).unwrap_or_default();
            return Err(Error::field(
                path,
                key,
                format!("{what} at pose {pose}, joint {joint}{name}"),
                "finite angles in radians",
            )
            .with_hint("interpolate the pose from its neighbours, or cut the motion there"));
        }
    }
    Ok(())
}

/// `[pose, xyz]`, perhaps with a person's own axis.
fn translation(npz: &mut Npz, key: &str, poses: usize) -> Result<Vec<[f64; 3]>> {
    let array: Array<f64> = npz.read_any(key)?;
    let own: Vec<usize> = array.shape.iter().copied().filter(|&length| length != 1).collect();
    let wanted = if poses == 1 { vec![3] } else { vec![poses, 3] };
    if own == wanted && array.shape.len() >= 2 {
        array.finite(&vec![("axis", None); array.shape.len()]).map_err(|problem| problem.at(npz.path(), key))?;
        return Ok(array.rows());
    }
    // The message of an array of another shape.
    npz.read::<f64>(key, &[("pose", Some(poses)), ("xyz", Some(3))]).map(|array| array.rows())
}

/// One body's shape from `[shape]`, `[1, shape]` or a shape for every pose.
fn betas(npz: &mut Npz, key: &str, notes: &mut Vec<String>) -> Result<Vec<f64>> {
    let array: Array<f64> = npz.read_any(key)?;
    let axes = vec![("axis", None); array.shape.len()];
    array.finite(&axes).map_err(|problem| problem.at(npz.path(), key))?;
    let Some(&count) = array.shape.last() else {
        return Err(Error::field(npz.path(), key, "a single number", "real numbers [shape]"));
    };
    if array.values.is_empty() {
        return Ok(vec![0.0; count]);
    }
    let rows: Vec<&[f64]> = array.values.chunks(count).collect();
    let mean: Vec<f64> = (0..count).map(|beta| rows.iter().map(|row| row[beta]).sum::<f64>() / rows.len() as f64).collect();
    let differs = rows.iter().flat_map(|row| row.iter().zip(&mean)).map(|(value, mean)| (value - mean).abs()).fold(0.0, f64::max);
    if rows.len() > 1 {
        let spread = if differs > 1e-6 {
            format!("; their mean is used, they differ by up to {differs:.2} from it")
        } else {
            String::new()
        };
        notes.push(format!("`{key}` has a shape for each of {} poses{spread}", rows.len()));
    }
    Ok(if differs > 1e-6 { mean } else { rows[0].to_vec() })
}
