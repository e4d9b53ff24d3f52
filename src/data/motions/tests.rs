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
    let (_folder, path) = written(&[0.0; 3], 1, "speed", &[0.0]);
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
    for (path, poses, rate_hz) in [("motions/cmu/02_01_smpl24.npz", 172, 60.0), ("motions/procedural/lunge_s1.npz", 720, 60.0)] {
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
            "amass_like.npz: joints: 52 of SMPL-H on the body's 24 of SMPL, by name: 30 are left out, 2 rest",
            "amass_like.npz: 16 betas, the body has 10: the last 6 are left out"
        ]
    );
}
