//! Simulating a motion at a trained site.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use burn::tensor::Device;
use num_complex::Complex32;

use super::{
    Notice, Notify, heatmaps, notes, plausible,
    simulated::{self, Sequence},
};
use crate::{
    data::read_body,
    error::{Error, Result},
    evaluation::Simulation,
    import::{self, BvhConfig, UpAxis},
    person::{
        BodyModel, Motion, Person, Placement,
        actions::{self, Action, StyleConfig},
        procedural::{self, PersonConfig},
    },
    plausibility::Sources,
    radar::Radar,
    simulator::{Part, Scene, Simulator},
    training::{
        LoadedRecording,
        checkpoint::{self, CheckpointState},
    },
};

/// Frames that are simulated where nobody says how many.
const FRAMES: usize = 24;

/// Whose motion is simulated.
#[derive(Clone, Debug)]
pub enum What {
    /// BVH, or npz in AMASS layout. `config`: how to read it, as docs/motion.md has it.
    Motion {
        path: PathBuf,
        config: Option<PathBuf>,
        up: Option<UpAxis>,
    },
    Action(Action),
    /// A recording, whose motion is simulated again.
    Recording(PathBuf),
}

/// What is simulated, and how.
#[derive(Clone, Debug)]
pub struct Simulate {
    pub checkpoint: PathBuf,
    pub what: What,
    /// The body that moves, npz in SMPL layout; the embedded person where absent.
    pub body: Option<PathBuf>,
    /// Distance of the motion's origin in front of the radar, metres; the training person's place where absent.
    pub distance_m: Option<f64>,
    /// How much higher than its file says the motion is, metres.
    pub raise_m: Option<f64>,
    /// How far the motion is turned about the vertical through the middle of its path (of an embedded action: its origin), degrees
    /// counter-clockwise seen from above. Without it who faces +z of a file whose y is up (−y where z is up) faces the radar.
    pub turn_deg: Option<f64>,
    /// As many as the motion lasts, but at most 24, where absent.
    pub frames: Option<usize>,
    /// Whether the learned noise is left out.
    pub clean: bool,
    /// One part of the signal alone.
    pub only: Option<Part>,
    /// Which of the checkpoint's effects are left out.
    pub without: Without,
}

impl Simulate {
    /// Refuses what would change nothing, or nobody can mean.
    fn check(&self) -> Result<()> {
        let refused = |message: &str, hint: &str| Err(Error::Usage { message: message.into(), hint: Some(hint.into()) });
        let of_recording = "leave it out, or name a motion (--motion) or an action (--action)";
        let places = [
            ("distance", self.distance_m, "metres in front of the radar"),
            ("raise", self.raise_m, "metres upwards"),
            ("turn", self.turn_deg, "degrees, counter-clockwise seen from above"),
        ];
        for (name, value, expected) in places {
            match value {
                Some(value) if !value.is_finite() => return Err(Error::setting(name, value, expected)),
                Some(_) if matches!(self.what, What::Recording(_)) => {
                    return refused(&format!("--{name}: the person of a recording stays where it is"), of_recording);
                }
                _ => {}
            }
        }
        if self.body.is_some() && matches!(self.what, What::Recording(_)) {
            return refused("--body: a recording has a body of its own", of_recording);
        }
        if self.clean && self.only.is_some() {
            return refused("--clean: one part alone has noise only where that is asked for", "leave out --clean, or --only");
        }
        if self.frames == Some(0) {
            return Err(Error::setting("frames", 0, "at least 1"));
        }
        Ok(())
    }
}

/// Effects of a checkpoint that are left out.
#[derive(Clone, Debug, Default)]
pub struct Without {
    pub all: bool,
    pub ids: Vec<String>,
}

impl Without {
    /// # Errors
    /// An effect that the checkpoint does not have.
    pub fn switch_off(&self, simulator: &mut Simulator) -> Result<()> {
        if self.all {
            simulator.effects.switch_off(None);
        }
        for id in &self.ids {
            if !simulator.effects.switch_off(Some(id)) {
                let mut known: Vec<&str> = simulator.effects.list.iter().map(|effect| effect.id()).collect();
                known.dedup();
                let known = if known.is_empty() { "none".to_string() } else { known.join(", ") };
                return Err(Error::Usage {
                    message: format!("--without-effect {id}: the checkpoint has no such effect"),
                    hint: Some(format!("its effects: {known}")),
                });
            }
        }
        Ok(())
    }
}

/// A simulation whose parts are all read and looked at.
pub struct Ready {
    simulator: Simulator,
    state: CheckpointState,
    /// Of the frames that are simulated.
    pub radar: Radar,
    measured: Option<LoadedRecording>,
    /// Where nothing was measured.
    own: Option<(Scene, Person)>,
    labels: BTreeMap<String, String>,
    clean: bool,
    only: Option<Part>,
}

impl Ready {
    /// Reads what a simulation needs.
    ///
    /// # Errors
    /// A checkpoint, motion, body or recording that cannot be read, or cannot be meant; more frames than the motion lasts.
    pub fn new(asked: &Simulate, device: &Device, as_stated: bool, notify: &mut Notify<'_>) -> Result<Self> {
        asked.check()?;
        let (mut simulator, state) = checkpoint::open(&asked.checkpoint, device)?;
        asked.without.switch_off(&mut simulator)?;
        if let Some(part) = asked.only {
            refuse_effects(part, &simulator)?;
        }
        let (only, clean) = (asked.only, asked.clean);
        if let What::Recording(folder) = &asked.what {
            plausible::folder(folder, as_stated, notify)?;
            let loaded = LoadedRecording::open(folder, &state.simulator, false)?;
            heatmaps::same_radar(&loaded.folder, &loaded.scene.radar, &state.site.radar)?;
            notes::of(&loaded).iter().for_each(|note| notify(Notice::Note(note)));
            let mut radar = loaded.recording.radar.clone();
            radar.frames = count(asked.frames, radar.frames, radar.frames)?;
            let labels = loaded.recording.labels.clone();
            return Ok(Self { simulator, state, radar, measured: Some(loaded), own: None, labels, clean, only });
        }
        let (person, labels) = new_person(asked, &state, notify)?;
        let (mut radar, room) = (state.site.radar.clone(), state.site.room.as_ref());
        radar.frames = count(asked.frames, FRAMES, frames_within(&person, &radar)?)?;
        let file = |file: Option<&PathBuf>| file.unwrap_or(&asked.checkpoint).clone();
        let motion = match &asked.what {
            What::Motion { path, .. } => Some(path),
            _ => None,
        };
        let sources = Sources {
            body: file(asked.body.as_ref()),
            motion: file(motion),
            ..Sources::one(asked.checkpoint.join("checkpoint.toml"))
        };
        plausible::scene(Some(&radar), room, Some(&person), &sources, as_stated, notify)?;
        let scene = Scene::new(&radar, room, Some(&person), &state.simulator)?;
        Ok(Self { simulator, state, radar, measured: None, own: Some((scene, person)), labels, clean, only })
    }

    fn scene(&self) -> &Scene {
        match (&self.measured, &self.own) {
            (Some(loaded), _) => &loaded.scene,
            (None, Some((scene, _))) => scene,
            (None, None) => unreachable!("one of them is there"),
        }
    }

    fn simulation(&self) -> Simulation<'_> {
        let simulation = Simulation::new(&self.simulator, self.scene(), self.state.seed, !self.clean);
        match self.only {
            Some(part) => simulation.only(part),
            None => simulation,
        }
    }

    /// All frames, `[frame, tx, rx, loop, sample]`, in the units of the recordings that the simulator was trained on.
    ///
    /// # Errors
    /// A frame outside the motion.
    pub fn samples(&self, notify: &mut Notify<'_>) -> Result<Vec<Complex32>> {
        notify(Notice::Begun { what: "simulating", steps: self.radar.frames });
        let simulation = self.simulation();
        let mut samples = Vec::with_capacity(self.radar.dims().iter().product());
        for frame in 0..self.radar.frames {
            samples.extend(simulation.frame(frame)?);
            notify(Notice::Done(frame + 1));
        }
        Ok(samples)
    }

    /// Writes `folder/recording` and heatmaps beside it; of a recording's motion also what was measured.
    ///
    /// # Errors
    /// A frame outside the motion; a folder that cannot be written.
    pub fn write(&self, folder: &Path, notify: &mut Notify<'_>) -> Result<()> {
        let measured = self.measured.as_ref().map(|loaded| &loaded.recording);
        let sequence = Sequence {
            radar: &self.radar,
            room: measured.map_or(self.state.site.room.as_ref(), |recording| recording.room.as_ref()),
            person: measured.map_or(self.own.as_ref().map(|(_, person)| person), |recording| recording.person()),
            labels: self.labels.clone(),
            measured,
        };
        let simulation = self.simulation();
        simulated::write(folder, &sequence, &self.state.heatmap, notify, &mut |frame| simulation.frame(frame))
    }
}

/// # Errors
/// A checkpoint whose effects are on.
fn refuse_effects(part: Part, simulator: &Simulator) -> Result<()> {
    if simulator.effects.is_empty() {
        return Ok(());
    }
    Err(Error::Usage {
        message: format!("--only {}: the checkpoint has effects, which act on the sum of the parts", part.name()),
        hint: Some("leave them out with --without-effects".into()),
    })
}

/// The person that is asked for, where the training person stood, and the labels that are true of the motion.
fn new_person(asked: &Simulate, state: &CheckpointState, notify: &mut Notify<'_>) -> Result<(Person, BTreeMap<String, String>)> {
    let model: BodyModel = match &asked.body {
        Some(path) => read_body(path)?,
        None => procedural::person(&PersonConfig::default())?,
    };
    // The training person's heading and axes are those of another file.
    let floor_m = state.site.room.as_ref().and_then(|room| room.floor_m);
    let [x, y, z] = state.site.placement.as_ref().map_or(actions::placement(1.0, 3.0).origin_m, |trained| trained.origin_m);
    let z = floor_m.map_or(z, |floor_m| -floor_m);
    let origin_m = [x, asked.distance_m.unwrap_or(y), z + asked.raise_m.unwrap_or(0.0)];
    let mut placement = Placement { origin_m, ..Placement::default() }.turned(asked.turn_deg.unwrap_or(0.0));
    let mut labels = BTreeMap::new();
    let motion = match &asked.what {
        What::Motion { path, config, up } => {
            let config = BvhConfig::read(config.as_deref(), *up)?;
            let (motion, notes) = import::read_motion(path, &model, &config)?;
            notes.iter().for_each(|note| notify(Notice::Note(note)));
            // A captured motion starts wherever its recorder's floor had its origin: its path is centred instead, with the
            // feet's height left as captured.
            recentre(&motion, &mut placement);
            motion
        }
        What::Action(action) => {
            labels.insert("action".to_string(), action.name().to_string());
            let seconds = asked.frames.unwrap_or(FRAMES) as f64 * state.site.radar.frame_period_s + 1.0;
            actions::motion(*action, &StyleConfig::default(), &model, &[], seconds, 60.0)?
        }
        What::Recording(_) => unreachable!("a recording has its own person"),
    };
    Ok((Person::Skinned { model, motion, placement }, labels))
}

/// Moves the origin so that the horizontal middle of the motion's path stands where the origin was.
fn recentre(motion: &Motion, placement: &mut Placement) {
    let count = motion.translations.len().max(1) as f64;
    let mean: [f64; 3] =
        std::array::from_fn(|axis| motion.translations.iter().map(|translation| translation[axis]).sum::<f64>() / count);
    for axis in 0..2 {
        let row = placement.radar_from_motion[axis];
        placement.origin_m[axis] -= (0..3).map(|column| row[column] * mean[column]).sum::<f64>();
    }
}

/// How many whole frames a motion lasts.
fn frames_within(person: &Person, radar: &Radar) -> Result<usize> {
    let end = person.pose_times_s().last().copied().unwrap_or(0.0);
    // Below zero, not even the first frame fits.
    let frames = ((end - radar.frame_duration_s()) / radar.frame_period_s + 1.0).floor().max(0.0) as usize;
    match frames {
        0 => Err(Error::Usage {
            message: "the motion is shorter than one frame of the radar".into(),
            hint: Some(format!("a frame lasts {:.1} ms; give a longer motion", radar.frame_duration_s() * 1e3)),
        }),
        _ => Ok(frames),
    }
}

/// How many frames are simulated, or what to say if too many were asked for.
fn count(asked: Option<usize>, usual: usize, limit: usize) -> Result<usize> {
    match asked {
        Some(asked) if asked > limit => Err(Error::Usage {
            message: format!("--frames {asked}: the motion lasts {limit} frames"),
            hint: Some("ask for fewer frames, or give a longer motion".into()),
        }),
        Some(asked) => Ok(asked),
        None => Ok(usual.min(limit)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_a_path_stays_where_the_origin_was_however_it_is_turned() {
        let translations = vec![[1.0, 0.9, 4.0], [3.0, 0.9, 6.0]];
        let motion = Motion { poses: vec![vec![[0.0; 3]; 24]; 2], translations, betas: vec![], rate_hz: 60.0 };
        for degrees in [0.0, 90.0, -130.0] {
            let mut placement = Placement { origin_m: [0.5, 3.0, -1.0], ..Placement::default() }.turned(degrees);
            recentre(&motion, &mut placement);
            let middle: [f64; 3] = std::array::from_fn(|axis| {
                let row = placement.radar_from_motion[axis];
                placement.origin_m[axis] + row[0] * 2.0 + row[1] * 0.9 + row[2] * 5.0
            });
            assert!((middle[0] - 0.5).abs() < 1e-12 && (middle[1] - 3.0).abs() < 1e-12, "{degrees}: {middle:?}");
            assert!((middle[2] + 0.1).abs() < 1e-12, "the feet's height is kept: {middle:?}");
        }
    }
}
