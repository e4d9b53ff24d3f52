//! `hybridsim infer`.

use std::path::PathBuf;

use clap::Args;

use super::{
    Common, Out, device,
    effects::WithoutEffects,
    plausible, report,
    simulated::{self, Sequence},
};
use crate::{
    data::{atomic::AtomicFolder, read_body, settings::read_settings},
    error::{Error, Result},
    evaluation::Simulation,
    import::{self, BvhConfig, UpAxis},
    person::{
        BodyModel, Person, Placement,
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

#[derive(Args)]
#[command(group = clap::ArgGroup::new("what").required(true).args(["motion", "action", "recording"]))]
pub(crate) struct Arguments {
    /// A checkpoint folder, such as runs/x/best or models/quickstart
    #[arg(long, value_name = "DIR")]
    checkpoint: PathBuf,
    /// A motion: BVH, or npz in AMASS layout
    #[arg(long, value_name = "FILE")]
    motion: Option<PathBuf>,
    /// One of the embedded actions, such as walk_back_forth
    #[arg(long, value_name = "NAME", value_parser = parse_action)]
    action: Option<Action>,
    /// A recording whose motion is simulated again and shown beside what was measured
    #[arg(long, value_name = "DIR")]
    recording: Option<PathBuf>,
    /// The body that moves, npz in SMPL layout; the embedded person by default
    #[arg(long, value_name = "FILE")]
    body: Option<PathBuf>,
    /// How to read the motion: a TOML file with joint map, units, up axis and frame rate, as docs/motion.md has them
    #[arg(long, value_name = "FILE", requires = "motion")]
    motion_config: Option<PathBuf>,
    /// Up axis of the motion's file: x, y, z, -x, -y or -z; recognised from how the person stands by default
    #[arg(long, value_name = "AXIS", value_parser = parse_up, allow_hyphen_values = true, requires = "motion")]
    up: Option<UpAxis>,
    /// Distance of the motion's origin in front of the radar; the training person's place by default
    #[arg(long, value_name = "METRES")]
    distance: Option<f64>,
    /// Frames to simulate; as many as the motion lasts, but at most 24, by default
    #[arg(long, value_name = "COUNT")]
    frames: Option<usize>,
    /// Leave out the learned noise
    #[arg(long)]
    clean: bool,
    /// One part of the signal alone; the three add up to the whole
    #[arg(long, value_enum, value_name = "PART", conflicts_with = "clean")]
    only: Option<Only>,
    #[command(flatten)]
    without: WithoutEffects,
    #[command(flatten)]
    out: Out,
}

fn parse_up(name: &str) -> std::result::Result<UpAxis, String> {
    let names = UpAxis::ALL.map(UpAxis::name).join(", ");
    UpAxis::ALL.into_iter().find(|axis| axis.name() == name).ok_or_else(|| format!("expected one of {names}"))
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Only {
    Direct,
    Indirect,
    Noise,
}

impl Only {
    /// # Errors
    /// A checkpoint whose effects are on.
    fn part(self, simulator: &Simulator) -> Result<Part> {
        let part = match self {
            Self::Direct => Part::Direct,
            Self::Indirect => Part::Indirect,
            Self::Noise => Part::Noise,
        };
        if !simulator.effects.is_empty() {
            return Err(Error::Usage {
                message: format!("--only {}: the checkpoint has effects, which act on the sum of the parts", part.name()),
                hint: Some("leave them out with --without-effects".into()),
            });
        }
        Ok(part)
    }
}

fn parse_action(name: &str) -> std::result::Result<Action, String> {
    Action::every().find(|action| action.name() == name).ok_or_else(|| {
        let names: Vec<&str> = Action::every().map(Action::name).collect();
        format!("expected one of {}", names.join(", "))
    })
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let device = device(&common.device)?;
    let (mut simulator, state) = checkpoint::open(&arguments.checkpoint, &device)?;
    arguments.without.switch_off(&mut simulator)?;
    let only = arguments.only.map(|only| only.part(&simulator)).transpose()?;
    let out = arguments.out.out.clone().unwrap_or_else(|| "runs/inferred".into());
    let folder = AtomicFolder::create(&out)?;

    let measured = match &arguments.recording {
        Some(recording) => {
            plausible::folder(recording, common)?;
            let recording = LoadedRecording::open(recording, &state.simulator, false)?;
            report::same_radar(&recording.folder, &recording.scene.radar, &state.site.radar)?;
            report::tell_notes(&recording);
            Some(recording)
        }
        None => None,
    };
    let (mut radar, room, person) = match &measured {
        Some(recording) => {
            (recording.recording.radar.clone(), recording.recording.room.clone(), recording.recording.person().cloned())
        }
        None => (state.site.radar.clone(), state.site.room.clone(), Some(new_person(arguments, &state)?)),
    };
    radar.frames = frames(arguments, &radar, person.as_ref(), measured.is_some())?;
    if measured.is_none() {
        let file = |file: &Option<PathBuf>| file.clone().unwrap_or_else(|| arguments.checkpoint.clone());
        let sources = Sources {
            body: file(&arguments.body),
            motion: file(&arguments.motion),
            ..Sources::one(arguments.checkpoint.join("checkpoint.toml"))
        };
        plausible::scene(Some(&radar), room.as_ref(), person.as_ref(), &sources, common)?;
    }
    let own_scene;
    let scene = match &measured {
        Some(recording) => &recording.scene,
        None => {
            own_scene = Scene::new(&radar, room.as_ref(), person.as_ref(), &state.simulator)?;
            &own_scene
        }
    };

    // A recording's labels stay true of what is simulated from its motion.
    let labels = match (&measured, arguments.action) {
        (Some(recording), _) => recording.recording.labels.clone(),
        (None, Some(action)) => [("action".to_string(), action.name().to_string())].into(),
        (None, None) => Default::default(),
    };
    let sequence = Sequence {
        radar: &radar,
        room: room.as_ref(),
        person: person.as_ref(),
        labels,
        measured: measured.as_ref().map(|loaded| &loaded.recording),
    };
    let simulation = Simulation::new(&simulator, scene, state.seed, !arguments.clean);
    let simulation = match only {
        Some(part) => simulation.only(part),
        None => simulation,
    };
    simulated::write(folder.path(), &sequence, &state.heatmap, common.quiet, &mut |frame| simulation.frame(frame))?;
    folder.finish()?;
    say!("simulated {} frames: {}", radar.frames, out.display());
    say!("  recording/   IF samples as a recording folder");
    say!("  *.png        heatmaps");
    Ok(())
}

/// The person that the arguments describe, where the training person stood.
fn new_person(arguments: &Arguments, state: &CheckpointState) -> Result<Person> {
    let model: BodyModel = match &arguments.body {
        Some(path) => read_body(path)?,
        None => procedural::person(&PersonConfig::default())?,
    };
    let motion = match (&arguments.motion, arguments.action) {
        (Some(path), _) => {
            let mut config: BvhConfig = match &arguments.motion_config {
                Some(config) => read_settings(config, &[])?,
                None => BvhConfig::default(),
            };
            config.up = arguments.up.or(config.up);
            let (motion, notes) = import::read_motion(path, &model, &config)?;
            for note in notes {
                remark!("note: {note}");
            }
            motion
        }
        (None, Some(action)) => {
            let radar = &state.site.radar;
            let count = arguments.frames.unwrap_or(24);
            let seconds = count as f64 * radar.frame_period_s + 1.0;
            actions::motion(action, &StyleConfig::default(), &model, &[], seconds, 60.0)?
        }
        (None, None) => unreachable!("clap asks for one of them"),
    };
    let mut placement = state.site.placement.clone().unwrap_or_else(|| {
        let floor = state.site.room.as_ref().and_then(|room| room.floor_m).unwrap_or(1.0);
        actions::placement(floor, 3.0)
    });
    placement.start_s = 0.0;
    if let Some(distance) = arguments.distance {
        placement.origin_m[1] = distance;
    }
    // A captured motion starts wherever its recorder's floor had its origin: its path is centred instead, with the
    // feet's height left as captured.
    if arguments.motion.is_some() {
        recentre(&motion, &mut placement);
    }
    Ok(Person::Skinned { model, motion, placement })
}

/// Moves the origin so that the horizontal middle of the motion's path stands where the origin was.
fn recentre(motion: &crate::person::Motion, placement: &mut Placement) {
    let count = motion.translations.len().max(1) as f64;
    let mean: [f64; 3] =
        std::array::from_fn(|axis| motion.translations.iter().map(|translation| translation[axis]).sum::<f64>() / count);
    for axis in 0..2 {
        let row = placement.radar_from_motion[axis];
        placement.origin_m[axis] -= (0..3).map(|column| row[column] * mean[column]).sum::<f64>();
    }
}

/// How many frames fit into the motion, or what to say if too many were asked for.
fn frames(arguments: &Arguments, radar: &Radar, person: Option<&Person>, recorded: bool) -> Result<usize> {
    let wanted = arguments.frames.unwrap_or(if recorded { radar.frames } else { 24 });
    let limit = match person {
        _ if recorded => radar.frames,
        Some(person) => {
            let end = person.pose_times_s().last().copied().unwrap_or(0.0);
            // Below zero, not even the first frame fits.
            ((end - radar.frame_duration_s()) / radar.frame_period_s + 1.0).floor().max(0.0) as usize
        }
        None => wanted,
    };
    if limit == 0 {
        return Err(Error::Usage {
            message: "the motion is shorter than one frame of the radar".into(),
            hint: Some(format!("a frame lasts {:.1} ms; give a longer motion", radar.frame_duration_s() * 1e3)),
        });
    }
    match arguments.frames {
        Some(asked) if asked > limit => Err(Error::Usage {
            message: format!("--frames {asked}: the motion lasts {limit} frames"),
            hint: Some("ask for fewer frames, or give a longer motion".into()),
        }),
        _ => Ok(wanted.min(limit)),
    }
}
