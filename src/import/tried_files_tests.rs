//! Every file of `../shared/fixtures/tried`, as its README says.

use std::path::PathBuf;

use super::tried_tests::{Point, Turn, apart, person, same, turns};
use super::written::JOINTS;
use super::{Bvh, BvhConfig, read_bvh_motion, read_motion};
use crate::data::UpAxis;
use crate::error::Result;
use crate::person::{BodyModel, JOINT_NAMES, Motion};
use crate::support::shared;

/// The folder of the files, and who moves.
struct Tried {
    folder: PathBuf,
    model: BodyModel,
}

impl Tried {
    fn open() -> Option<Self> {
        Some(Self { folder: shared("fixtures/tried")?, model: person() })
    }

    fn read(&self, name: &str) -> Result<(Motion, Vec<String>)> {
        read_motion(&self.folder.join(name), &self.model, &BvhConfig::default())
    }
}

fn noted(name: &str, notes: &[String], wanted: &[&str]) {
    for wanted in wanted {
        assert!(notes.iter().any(|note| note.contains(wanted)), "{name}: no `{wanted}` in {notes:#?}");
    }
}

#[test]
fn the_same_walk_comes_out_as_the_reference_has_it() {
    let Some(tried) = Tried::open() else { return };
    let model = &tried.model;
    let (reference, _) = tried.read("bvh/00-reference-t-pose.bvh").unwrap();
    let cases: [(&str, &[&str]); 5] = [
        ("10-biped-names", &["as 3ds Max Biped has them", "units: centimetres"]),
        ("11-mixamorig1-prefix", &["Mixamo"]),
        ("12-mixamorig-underscore", &["Mixamo"]),
        ("140-rest-zup-world-yup", &["up axis: y (from the feet to the head, where z was expected)"]),
        ("147-frame-time-0.033", &["30 Hz is likely"]),
    ];
    for (name, wanted) in cases {
        let (found, notes) = tried.read(&format!("bvh/{name}.bvh")).unwrap();
        noted(name, &notes, wanted);
        let apart = apart(model, &found, &reference);
        assert!(apart.0 < 1.0 && apart.1 < 1.0, "{name}: {apart:?}");
    }
    let first = |motion: &Motion, poses: usize| {
        let mut motion = motion.clone();
        motion.poses.truncate(poses);
        motion.translations.truncate(poses);
        motion
    };
    // Half the walk with one joint turned by next to nothing or by half a turn.
    for (name, joints) in [("14-ankle-turned-1e-6-deg", [7, 8].as_slice()), ("14-arm-turned-180-deg", &[16, 18, 20])] {
        let (found, _) = tried.read(&format!("bvh/{name}.bvh")).unwrap();
        let (found, reference) = (turns(model, &found), turns(model, &first(&reference, found.poses.len())));
        for joint in (0..JOINTS).filter(|joint| !joints.contains(joint) && !joints.contains(&model.parents[*joint].unwrap_or(0)))
        {
            let angle = |(a, b): (&Vec<Turn>, &Vec<Turn>)| a[joint].angle_to(&b[joint]).to_degrees();
            let most = found.iter().zip(&reference).map(angle).fold(0.0, f64::max);
            assert!(most < 1.0, "{name}: {} is off by {most}", JOINT_NAMES[joint]);
        }
    }
}

/// Walks of their own, whose joints swing about a T-pose: limbs point as in the file, and without a T-pose in the file
/// all are on average at rest.
#[test]
fn limbs_of_other_walks_point_as_in_their_files_and_joints_rest_on_average() {
    let Some(Tried { folder, model }) = Tried::open() else { return };
    for name in ["05-xsens-names-allpos-zup", "06-lafan-local-x", "07-lafan-local-x-names-smpl"] {
        let path = folder.join(format!("bvh/{name}.bvh"));
        let (bvh, config) = (Bvh::read(&path).unwrap(), BvhConfig::default());
        let (found, notes) = read_bvh_motion(&path, &model, &config).unwrap();
        println!("{name}: {notes:#?}");
        let assigned = super::joints::assign(&bvh, &config).unwrap().joints;
        let up = if name.starts_with("05") { UpAxis::Z } else { UpAxis::Y };
        let rest: Vec<Point> = model.rest_joints(&[]).into_iter().map(Point::from).collect();
        let found = turns(&model, &found);
        for (joint, end) in super::neutral::LIMBS {
            for (frame, turns) in found.iter().enumerate() {
                let places = bvh.pose(frame).places;
                let file = up.to_y() * (places[assigned[end].unwrap()] - places[assigned[joint].unwrap()]);
                let angle = (turns[joint] * (rest[end] - rest[joint])).angle(&file).to_degrees();
                assert!(angle < 1.0, "{name}: {} is off by {angle} degrees in frame {frame}", JOINT_NAMES[joint]);
            }
        }
        // 05 has a T-pose, from which nothing is averaged.
        for joint in (1..JOINTS).filter(|_| !name.starts_with("05")) {
            let parent = model.parents[joint].unwrap();
            let local = |turns: &Vec<Turn>| (turns[parent].inverse() * turns[joint]).scaled_axis();
            let mean = found.iter().map(local).sum::<Point>() / found.len() as f64;
            // Limbs also turn by what the two skeletons differ; only their twist is at rest.
            let limb = super::neutral::LIMBS.iter().find(|(start, _)| *start == joint);
            let twist = limb.map(|&(start, end)| mean.dot(&(rest[end] - rest[start]).normalize()).abs());
            let degrees = twist.unwrap_or(mean.norm()).to_degrees();
            println!("{:>16}: {degrees:.2} degrees from rest on average", JOINT_NAMES[joint]);
            assert!(degrees < 3.0, "{name}: {} is on average {degrees} degrees from rest", JOINT_NAMES[joint]);
        }
    }
}

/// With rest poses in which somebody stands.
#[test]
fn motions_captured_and_made_by_others_need_no_note_on_their_rest_pose() {
    let Some(tried) = Tried::open() else { return };
    for name in ["cmu/01_01", "cmu/02_01", "cmu/02_10", "procedural/arm_swing_s1", "procedural/walk_back_forth_armswing_s1"] {
        let (_, notes) = tried.read(&format!("../../motions/{name}.bvh")).unwrap();
        noted(name, &notes, &["up axis: y (from the feet to the head)", "frame rate"]);
        assert!(!notes.iter().any(|note| note.contains("rest pose")), "{name}: {notes:#?}");
    }
}

#[test]
fn every_form_of_npz_comes_out_as_the_same_walk() {
    let Some(tried) = Tried::open() else { return };
    let (walk, _) = tried.read("motions/31-betas-1x10.npz").unwrap();
    let cases: [(&str, &[&str]); 13] = [
        ("20-smplh-hands", &["52 of SMPL-H"]),
        ("21-smplx-jaw", &["55 of SMPL-X"]),
        ("22-zup-without-up", &["up axis: z"]),
        ("23-poses-3d", &[]),
        ("24-transl-key", &[]),
        ("25-romp-keys", &["30 Hz is assumed"]),
        ("26-root_orient-pose_body", &["by name"]),
        ("28-float16", &[]),
        ("31-betas-1x10", &["up axis: y", "units: metres", "angles: radians", "frame rate: 60 Hz"]),
        ("32-betas-Tx10", &["a shape for each of 121 poses"]),
        ("35-trans-cm", &["units: centimetres"]),
        ("36-camera-y-down", &["up axis: -y"]),
        ("39-degrees", &["angles: degrees"]),
    ];
    for (name, wanted) in cases {
        let (found, notes) = tried.read(&format!("motions/{name}.npz")).unwrap();
        noted(name, &notes, wanted);
        same(name, &tried.model, &found, &walk);
    }
    let error = tried.read("motions/40-69-columns-no-root.npz").unwrap_err().to_string();
    assert!(error.contains("the 23 joints of SMPL without the root"), "{error}");
}
