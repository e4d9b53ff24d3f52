//! `hybridsim check` of a body, a motion or a mesh by itself: what the file says it is.

use std::path::Path;

use super::{
    Common,
    motion::{MotionReading, READING_HINT},
    plausible,
};
use crate::{
    data::{arrays::Npz, read_body, read_meshes},
    error::Result,
    import::{self, Bvh, BvhConfig},
    person::{
        BodyModel, Motion, Person, Placement,
        procedural::{self, PersonConfig},
    },
    plausibility::{BodyFacts, Facts, Sources},
};

/// Name's ending in small letters, without the dot.
pub(super) fn ending(path: &Path) -> String {
    path.extension().map(|extension| extension.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Whether a file is described by itself, by its name.
pub(super) fn knows(path: &Path) -> bool {
    ["npz", "bvh", "npy", "obj"].contains(&ending(path).as_str())
}

/// Whether a file is a pickle of Python's, by its name, as body models are published.
pub(super) fn is_pickle(path: &Path) -> bool {
    path.is_file() && ["pkl", "pickle"].contains(&ending(path).as_str())
}

/// Describes a body, a motion or a mesh.
///
/// # Errors
/// A file that is none of them, or cannot be read, or cannot be meant.
pub(super) fn run(path: &Path, reading: &MotionReading, common: &Common) -> Result<()> {
    match ending(path).as_str() {
        "bvh" => return describe_bvh(path, reading, common),
        "npy" | "obj" => {
            reading.refused(READING_HINT)?;
            return describe_meshes(path, common);
        }
        _ => {}
    }
    let archive = Npz::open(path)?;
    if archive.has("v_template") {
        reading.refused(READING_HINT)?;
        return describe_body(path, common);
    }
    say!("motion: {}", path.display());
    say!("  arrays             {}", archive.names().join(", "));
    describe_motion(path, reading, common)
}

fn describe_body(path: &Path, common: &Common) -> Result<()> {
    let model = read_body(path)?;
    say!("body: {}", path.display());
    say!("  vertices x faces   {} x {}", model.template.len(), model.faces.len());
    let blend = if model.pose_directions.is_empty() { "none" } else { "yes" };
    say!(
        "  joints             {}, {} shape parameters, pose blend shapes: {blend}",
        model.parents.len(),
        model.shape_directions.len()
    );
    show_extent("rest pose", &model.template);
    let facts = BodyFacts::of_mesh(&model.template, &model.faces);
    show_surface(&facts);
    plausible::report(Facts { body: Some(facts), ..Facts::default() }, &Sources::one(path), common)
}

fn describe_meshes(path: &Path, common: &Common) -> Result<()> {
    let meshes = read_meshes(path)?;
    let first = &meshes.vertices[0];
    let poses = if meshes.vertices.len() == 1 { "one pose".into() } else { format!("{} poses", meshes.vertices.len()) };
    say!("mesh: {}", path.display());
    say!("  vertices x faces   {} x {}, {poses}", first.len(), meshes.faces.len());
    for note in &meshes.notes {
        remark!("note: {note}");
    }
    show_extent("first pose", first);
    let facts = BodyFacts::of_meshes(&meshes.vertices, &meshes.faces);
    if !meshes.faces.is_empty() {
        show_surface(&facts);
    }
    plausible::report(Facts { body: Some(facts), ..Facts::default() }, &Sources::one(path), common)
}

fn show_surface(facts: &BodyFacts) {
    let surface = facts.open.as_ref().map_or("closed".to_string(), |why| format!("open: {why}"));
    say!("  surface            {surface}, volume {:.4} m3", facts.volume_m3);
}

/// The box around points, and the axis that it is longest along.
fn show_extent(what: &str, points: &[[f64; 3]]) {
    let size: [f64; 3] = std::array::from_fn(|axis| {
        let along = || points.iter().map(|point| point[axis]);
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    });
    say!("  {what:<18} {:.3} x {:.3} x {:.3} m (x, y, z)", size[0], size[1], size[2]);
}

fn describe_bvh(path: &Path, reading: &MotionReading, common: &Common) -> Result<()> {
    let bvh = Bvh::read(path)?;
    say!("motion: {}", path.display());
    let names: Vec<&str> = bvh.joints.iter().map(|joint| joint.name.as_str()).collect();
    say!("  joints             {}: {}", names.len(), names.join(", "));
    say!("  frame time         {} s ({:.3} Hz)", bvh.frame_time_s, 1.0 / bvh.frame_time_s);
    describe_motion(path, reading, common)
}

/// What becomes of the motion on the embedded person.
fn describe_motion(path: &Path, reading: &MotionReading, common: &Common) -> Result<()> {
    let model = procedural::person(&PersonConfig::default())?;
    let (motion, notes) = import::read_motion(path, &model, &BvhConfig::read(reading.motion_config.as_deref(), reading.up)?)?;
    for note in notes {
        remark!("note: {note}");
    }
    show_motion(&motion, &model);
    let placement = Placement::default();
    let person = Person::Skinned { model, motion, placement };
    let facts = plausible::facts(None, None, Some(&person))?;
    show_course(&facts);
    plausible::report(facts, &Sources::one(path), common)
}

fn show_motion(motion: &Motion, model: &BodyModel) {
    let count = motion.poses.len();
    say!("  poses              {count} at {:.3} Hz, {:.2} s", motion.rate_hz, (count.max(1) - 1) as f64 / motion.rate_hz);
    say!("  read as            a motion of the embedded person's {} joints, y up", model.parents.len());
    show_extent("path of the root", &motion.translations);
}

/// Speeds and what is up, of all poses.
fn show_course(facts: &Facts) {
    let looks = facts.course.iter().flat_map(|course| &course.looks);
    let fastest = looks.clone().filter_map(|look| look.speed_mps).fold(0.0, |fastest, [speed, _]| f64::max(fastest, speed));
    if let Some(root) = &facts.root {
        let steps: Vec<f64> = root
            .positions_m
            .windows(2)
            .zip(root.times_s.windows(2))
            .map(|(place, time)| {
                (0..3).map(|axis| (place[1][axis] - place[0][axis]).powi(2)).sum::<f64>().sqrt() / (time[1] - time[0])
            })
            .collect();
        let mean = steps.iter().sum::<f64>() / steps.len().max(1) as f64;
        let most = steps.iter().copied().fold(0.0, f64::max);
        say!("  speed              root {mean:.2} m/s in the mean, {most:.2} m/s at most; fastest part {fastest:.2} m/s");
    }
    let mut angles: Vec<f64> =
        looks.filter_map(|look| look.upright).map(|cosine| cosine.clamp(-1.0, 1.0).acos().to_degrees()).collect();
    angles.sort_by(f64::total_cmp);
    if let Some(angle) = angles.get(angles.len() / 2) {
        say!("  trunk              {angle:.0} deg from y in the median pose");
    }
}
