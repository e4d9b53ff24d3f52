//! Which joint of a BVH file plays the part of which SMPL joint.

use super::{bvh::Bvh, retarget::BvhConfig};
use crate::error::{Error, Result};
use crate::person::JOINT_NAMES;

/// Names in SMPL's order of joints; empty where the dialect has none. Compared without case and namespace.
type Dialect = [&'static str; 24];

const SMPL: Dialect = JOINT_NAMES;

const SMPL_SHORT: Dialect = [
    "pelvis",
    "l_hip",
    "r_hip",
    "spine1",
    "l_knee",
    "r_knee",
    "spine2",
    "l_ankle",
    "r_ankle",
    "spine3",
    "l_foot",
    "r_foot",
    "neck",
    "l_collar",
    "r_collar",
    "head",
    "l_shoulder",
    "r_shoulder",
    "l_elbow",
    "r_elbow",
    "l_wrist",
    "r_wrist",
    "l_hand",
    "r_hand",
];

/// Acclaim names, as in CMU's own skeletons. Their `lwrist` only twists the forearm; the hand hangs on `lhand`.
const ACCLAIM: Dialect = [
    "root",
    "lfemur",
    "rfemur",
    "lowerback",
    "ltibia",
    "rtibia",
    "upperback",
    "lfoot",
    "rfoot",
    "thorax",
    "ltoes",
    "rtoes",
    "lowerneck",
    "lclavicle",
    "rclavicle",
    "head",
    "lhumerus",
    "rhumerus",
    "lradius",
    "rradius",
    "lhand",
    "rhand",
    "lfingers",
    "rfingers",
];

/// MotionBuilder names with CMU's spine.
const MOTION_BUILDER_CMU: Dialect = [
    "hips",
    "leftupleg",
    "rightupleg",
    "lowerback",
    "leftleg",
    "rightleg",
    "spine",
    "leftfoot",
    "rightfoot",
    "spine1",
    "lefttoebase",
    "righttoebase",
    "neck",
    "leftshoulder",
    "rightshoulder",
    "head",
    "leftarm",
    "rightarm",
    "leftforearm",
    "rightforearm",
    "lefthand",
    "righthand",
    "",
    "",
];

/// MotionBuilder names as most programs write them.
const MOTION_BUILDER: Dialect = [
    "hips",
    "leftupleg",
    "rightupleg",
    "spine",
    "leftleg",
    "rightleg",
    "spine1",
    "leftfoot",
    "rightfoot",
    "spine2",
    "lefttoebase",
    "righttoebase",
    "neck",
    "leftshoulder",
    "rightshoulder",
    "head",
    "leftarm",
    "rightarm",
    "leftforearm",
    "rightforearm",
    "lefthand",
    "righthand",
    "",
    "",
];

const DIALECTS: [&Dialect; 5] = [&SMPL, &SMPL_SHORT, &ACCLAIM, &MOTION_BUILDER_CMU, &MOTION_BUILDER];

/// SMPL joints that a file must have; the others follow their parents if they are absent.
const REQUIRED: [usize; 14] = [0, 1, 2, 4, 5, 7, 8, 12, 16, 17, 18, 19, 20, 21];

/// `[SMPL joint]` → joint of the file, by the settings' map first and the best fitting dialect otherwise.
pub fn assign(bvh: &Bvh, config: &BvhConfig) -> Result<Vec<Option<usize>>> {
    let plain = |name: &str| name.rsplit(':').next().unwrap_or(name).to_lowercase();
    let names: Vec<String> = bvh.joints.iter().map(|joint| plain(&joint.name)).collect();
    let by_dialect = |dialect: &Dialect| -> Vec<Option<usize>> {
        dialect.iter().map(|wanted| names.iter().position(|name| !wanted.is_empty() && name == wanted)).collect()
    };
    // The first of those that fit best.
    let fits = DIALECTS.map(by_dialect);
    let known = |fit: &Vec<Option<usize>>| fit.iter().flatten().count();
    let most = fits.iter().map(known).max().unwrap_or(0);
    let mut assigned = fits.into_iter().find(|fit| known(fit) == most).unwrap_or_else(|| vec![None; 24]);

    for (wanted, name) in &config.joint_map {
        let key = format!("joint_map.{wanted}");
        let Some(joint) = JOINT_NAMES.iter().position(|known| known == wanted) else {
            return Err(Error::setting(key, name, format!("a joint of the body on the left: {}", JOINT_NAMES.join(", "))));
        };
        let Some(found) = bvh.joint(name) else {
            let nearest = bvh.joints.iter().max_by(|a, b| {
                let alike = |joint: &str| strsim::jaro_winkler(&plain(joint), &plain(name));
                alike(&a.name).total_cmp(&alike(&b.name))
            });
            let nearest = nearest.map_or("", |joint| &joint.name);
            return Err(Error::field(&bvh.source, key, format!("`{name}`"), "the name of a joint in this file")
                .with_hint(format!("the nearest name is `{nearest}`; the file has {}", list(bvh))));
        };
        assigned[joint] = Some(found);
    }
    let missing: Vec<&str> =
        REQUIRED.into_iter().filter(|&joint| assigned[joint].is_none()).map(|joint| JOINT_NAMES[joint]).collect();
    if !missing.is_empty() {
        return Err(Error::field(&bvh.source, missing.join(", "), "missing", "a joint for each of them")
            .with_hint(format!("name them in joint_map, such as left_knee = \"LeftLeg\"; the file has {}", list(bvh))));
    }
    Ok(assigned)
}

fn list(bvh: &Bvh) -> String {
    bvh.joints.iter().map(|joint| joint.name.as_str()).collect::<Vec<_>>().join(", ")
}
