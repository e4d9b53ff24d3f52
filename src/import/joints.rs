//! Which joint of a BVH file plays the part of which SMPL joint.

use std::sync::OnceLock;

use serde::Deserialize;

use super::{bvh::Bvh, bvh_config::BvhConfig};
use crate::error::{Error, Result};
use crate::person::JOINT_NAMES;

/// `dialects.toml`: what programs call the joints.
#[derive(Deserialize)]
struct Table {
    dialect: Vec<Dialect>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Dialect {
    name: String,
    /// Left, right: what `*` stands for.
    sides: [String; 2],
    pelvis: Vec<String>,
    spine1: Vec<String>,
    spine2: Vec<String>,
    spine3: Vec<String>,
    neck: Vec<String>,
    head: Vec<String>,
    hip: Vec<String>,
    knee: Vec<String>,
    ankle: Vec<String>,
    foot: Vec<String>,
    collar: Vec<String>,
    shoulder: Vec<String>,
    elbow: Vec<String>,
    wrist: Vec<String>,
    #[serde(default)]
    hand: Vec<String>,
}

fn dialects() -> &'static [Dialect] {
    static TABLE: OnceLock<Table> = OnceLock::new();
    let read = || crate::data::settings::read_text(include_str!("dialects.toml")).expect("dialects.toml is tested");
    &TABLE.get_or_init(read).dialect
}

impl Dialect {
    /// The names of an SMPL joint, as they are compared.
    fn names(&self, joint: &str) -> Vec<String> {
        let side = ["left_", "right_"].iter().position(|side| joint.starts_with(side));
        let names = match joint.trim_start_matches("left_").trim_start_matches("right_") {
            "pelvis" => &self.pelvis,
            "spine1" => &self.spine1,
            "spine2" => &self.spine2,
            "spine3" => &self.spine3,
            "neck" => &self.neck,
            "head" => &self.head,
            "hip" => &self.hip,
            "knee" => &self.knee,
            "ankle" => &self.ankle,
            "foot" => &self.foot,
            "collar" => &self.collar,
            "shoulder" => &self.shoulder,
            "elbow" => &self.elbow,
            "wrist" => &self.wrist,
            _ => &self.hand,
        };
        let named = |name: &String| plain(&name.replace('*', side.map_or("", |side| &self.sides[side])));
        names.iter().map(named).collect()
    }

    /// `[SMPL joint]` → joint of a file with these plain names, all after the same `prefix`.
    fn fit(&self, names: &[String], prefix: &str) -> Vec<Option<usize>> {
        let find = |joint: &&str| {
            let wanted = self.names(joint).into_iter().map(|name| format!("{prefix}{name}"));
            wanted.filter(|name| !name.is_empty()).find_map(|wanted| names.iter().position(|name| *name == wanted))
        };
        JOINT_NAMES.iter().map(find).collect()
    }

    /// What a file may write before every name: what stands before the name of a neck or of a left hip.
    fn prefixes(&self, names: &[String]) -> Vec<String> {
        let ends: Vec<String> = ["neck", "left_hip"].into_iter().flat_map(|joint| self.names(joint)).collect();
        let before = |name: &String| ends.iter().filter_map(|end| name.strip_suffix(end.as_str())).map(str::to_string).collect();
        names.iter().flat_map::<Vec<String>, _>(before).collect()
    }
}

/// A name as it is compared: without namespace, case, blanks and punctuation.
fn plain(name: &str) -> String {
    let name = name.rsplit([':', '|']).next().unwrap_or(name);
    name.chars().filter(|letter| letter.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// SMPL joints that a file must have; the others follow their parents if they are absent.
const REQUIRED: [usize; 14] = [0, 1, 2, 4, 5, 7, 8, 12, 16, 17, 18, 19, 20, 21];

/// Who is who.
pub struct Assigned {
    /// `[SMPL joint]` → joint of the file.
    pub joints: Vec<Option<usize>>,
    /// How that was found, for people.
    pub note: String,
}

/// By the settings' map first and the best fitting dialect otherwise.
pub fn assign(bvh: &Bvh, config: &BvhConfig) -> Result<Assigned> {
    let names: Vec<String> = bvh.joints.iter().map(|joint| plain(&joint.name)).collect();
    let mut best = (0, vec![None; JOINT_NAMES.len()], "none");
    for dialect in dialects() {
        for prefix in dialect.prefixes(&names) {
            let fit = dialect.fit(&names, &prefix);
            let known = fit.iter().flatten().count();
            if known > best.0 {
                best = (known, fit, &dialect.name);
            }
        }
    }
    let (known, mut joints, dialect) = best;
    for (wanted, name) in &config.joint_map {
        let (joint, found) = mapped(bvh, wanted, name)?;
        joints[joint] = Some(found);
    }
    let missing: Vec<&str> =
        REQUIRED.into_iter().filter(|&joint| joints[joint].is_none()).map(|joint| JOINT_NAMES[joint]).collect();
    if !missing.is_empty() {
        return Err(Error::field(&bvh.source, missing.join(", "), "missing", "a joint for each of them")
            .with_hint(format!("name them in joint_map, such as left_knee = \"LeftLeg\"; the file has {}", list(bvh))));
    }
    let mapped = match config.joint_map.len() {
        0 => String::new(),
        count => format!(", {count} by joint_map"),
    };
    let rest = joints.iter().enumerate().filter(|(_, found)| found.is_none()).map(|(joint, _)| JOINT_NAMES[joint]);
    let rest = rest.collect::<Vec<_>>().join(", ");
    let rest = if rest.is_empty() { rest } else { format!("; {rest} rest") };
    let note = format!("joint names: {known} of 24 as {dialect} has them{mapped}{rest}");
    Ok(Assigned { joints, note })
}

/// One entry of the settings' map: joint of the body, joint of the file.
fn mapped(bvh: &Bvh, wanted: &str, name: &str) -> Result<(usize, usize)> {
    let key = format!("joint_map.{wanted}");
    let Some(joint) = JOINT_NAMES.iter().position(|known| *known == wanted) else {
        return Err(Error::setting(key, name, format!("a joint of the body on the left: {}", JOINT_NAMES.join(", "))));
    };
    let Some(found) = bvh.joint(name) else {
        let alike = |joint: &str| strsim::jaro_winkler(&plain(joint), &plain(name));
        let nearest = bvh.joints.iter().max_by(|a, b| alike(&a.name).total_cmp(&alike(&b.name)));
        let nearest = nearest.map_or("", |joint| &joint.name);
        return Err(Error::field(&bvh.source, key, format!("`{name}`"), "the name of a joint in this file")
            .with_hint(format!("the nearest name is `{nearest}`; the file has {}", list(bvh))));
    };
    Ok((joint, found))
}

fn list(bvh: &Bvh) -> String {
    bvh.joints.iter().map(|joint| joint.name.as_str()).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file that has these names and nothing else.
    fn named(names: &[String]) -> Bvh {
        let mut text = "HIERARCHY\n".to_string();
        for (index, name) in names.iter().enumerate() {
            let kind = if index == 0 { "ROOT" } else { "JOINT" };
            let channels = if index == 0 { "1 Xrotation" } else { "0" };
            text += &format!("{kind} {name}\n{{\nOFFSET 0 1 0\nCHANNELS {channels}\n");
        }
        text += &"}\n".repeat(names.len());
        Bvh::parse(&format!("{text}MOTION\nFrames: 1\nFrame Time: 0.1\n0\n")).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Its first names as they stand in the table, in SMPL's order of joints.
    fn spelt(dialect: &Dialect) -> Vec<(usize, String)> {
        let spell = |(joint, name): (usize, &&str)| {
            let side = usize::from(name.starts_with("right_"));
            let short = name.trim_start_matches("left_").trim_start_matches("right_");
            let lists = [
                ("pelvis", &dialect.pelvis),
                ("spine1", &dialect.spine1),
                ("spine2", &dialect.spine2),
                ("spine3", &dialect.spine3),
                ("neck", &dialect.neck),
                ("head", &dialect.head),
                ("hip", &dialect.hip),
                ("knee", &dialect.knee),
                ("ankle", &dialect.ankle),
                ("foot", &dialect.foot),
                ("collar", &dialect.collar),
                ("shoulder", &dialect.shoulder),
                ("elbow", &dialect.elbow),
                ("wrist", &dialect.wrist),
                ("hand", &dialect.hand),
            ];
            let list = lists.iter().find(|(known, _)| *known == short).expect("a joint of SMPL").1;
            list.first().map(|name| (joint, name.replace('*', &dialect.sides[side])))
        };
        JOINT_NAMES.iter().enumerate().filter_map(spell).collect()
    }

    #[test]
    fn every_dialect_is_recognised_before_any_prefix() {
        for dialect in dialects() {
            for prefix in ["", "mixamorig:", "mixamorig1:", "mixamorig1", "mixamorig_", "Bip01 ", "Character1_"] {
                let names = spelt(dialect);
                let written: Vec<String> = names.iter().map(|(_, name)| format!("{prefix}{name}")).collect();
                let assigned = assign(&named(&written), &BvhConfig::default()).unwrap();
                let wanted: Vec<Option<usize>> =
                    (0..24).map(|joint| names.iter().position(|(known, _)| *known == joint)).collect();
                assert_eq!(assigned.joints, wanted, "{} after `{prefix}`", dialect.name);
                assert!(assigned.note.contains(&format!("as {} has them", dialect.name)), "{}", assigned.note);
            }
        }
    }

    #[test]
    fn a_biped_without_a_pelvis_hangs_on_its_root() {
        let biped = dialects().iter().find(|dialect| dialect.name == "3ds Max Biped").unwrap();
        let mut written: Vec<String> = spelt(biped).iter().map(|(_, name)| format!("Bip001 {name}")).collect();
        written[0] = "Bip001".into();
        assert_eq!(assign(&named(&written), &BvhConfig::default()).unwrap().joints[0], Some(0));
    }
}
