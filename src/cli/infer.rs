//! `hybridsim infer`.

use std::path::PathBuf;

use clap::Args;

use super::{Common, Out, device, effects::WithoutEffects, motion::MotionReading, progress::Shown};
use crate::{
    data::atomic::AtomicFolder,
    error::Result,
    person::actions::Action,
    simulator::Part,
    verbs::simulate::{Ready, Simulate, What},
};

#[derive(Args)]
#[command(mut_arg("out", |out| out.help("Folder for the results [default: runs/inferred]")))]
#[command(group = clap::ArgGroup::new("what").required(true).args(["motion", "action", "recording"]))]
pub(crate) struct Arguments {
    /// A checkpoint folder, such as runs/x/best or models/quickstart
    #[arg(long, value_name = "DIR")]
    checkpoint: PathBuf,
    /// A motion: BVH, or npz in AMASS layout
    #[arg(long, value_name = "FILE")]
    motion: Option<PathBuf>,
    #[arg(long, value_name = "NAME", value_parser = parse_action, help = format!("One of the embedded actions: {}", actions()))]
    action: Option<Action>,
    /// A recording whose motion is simulated again and shown beside what was measured
    #[arg(long, value_name = "DIR")]
    recording: Option<PathBuf>,
    /// The body that moves, npz in SMPL layout; the embedded person by default
    #[arg(long, value_name = "FILE")]
    body: Option<PathBuf>,
    #[command(flatten)]
    reading: MotionReading,
    /// Distance of the motion's origin in front of the radar; the training person's place by default
    #[arg(long, value_name = "METRES")]
    distance: Option<f64>,
    /// Raise the motion by so much, such as 1.0 where its file is in the frame of a camera 1 m above the floor
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    raise: Option<f64>,
    /// Turn the motion about the vertical through the middle of its path, counter-clockwise seen from above; without it who faces +z in
    /// the file (y up; -y where z is up) faces the radar
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    turn: Option<f64>,
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

#[derive(Clone, Copy, clap::ValueEnum)]
enum Only {
    Direct,
    Indirect,
    Noise,
}

impl From<Only> for Part {
    fn from(only: Only) -> Self {
        match only {
            Only::Direct => Self::Direct,
            Only::Indirect => Self::Indirect,
            Only::Noise => Self::Noise,
        }
    }
}

fn actions() -> String {
    Action::every().map(Action::name).collect::<Vec<_>>().join(", ")
}

fn parse_action(name: &str) -> std::result::Result<Action, String> {
    Action::every().find(|action| action.name() == name).ok_or_else(|| format!("expected one of {}", actions()))
}

impl Arguments {
    fn asked(&self) -> Result<Simulate> {
        if self.motion.is_none() {
            self.reading.refused("name it with --motion")?;
        }
        let what = match (&self.motion, self.action, &self.recording) {
            (Some(path), ..) => {
                What::Motion { path: path.clone(), config: self.reading.motion_config.clone(), up: self.reading.up }
            }
            (None, Some(action), _) => What::Action(action),
            (None, None, Some(recording)) => What::Recording(recording.clone()),
            (None, None, None) => unreachable!("clap asks for one of them"),
        };
        Ok(Simulate {
            checkpoint: self.checkpoint.clone(),
            what,
            body: self.body.clone(),
            distance_m: self.distance,
            raise_m: self.raise,
            turn_deg: self.turn,
            frames: self.frames,
            clean: self.clean,
            only: self.only.map(Part::from),
            without: self.without.without(),
        })
    }
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let device = device(&common.device)?;
    let asked = arguments.asked()?;
    let out = arguments.out.out.clone().unwrap_or_else(|| "runs/inferred".into());
    let folder = AtomicFolder::create(&out)?;
    let mut shown = Shown::new(common.quiet);
    let ready = Ready::new(&asked, &device, common.as_stated, &mut |notice| shown.show(notice))?;
    ready.write(folder.path(), &mut |notice| shown.show(notice))?;
    shown.finish();
    folder.finish()?;
    say!("simulated {} frames: {}", ready.radar.frames, out.display());
    say!("  recording/   IF samples as a recording folder");
    say!("  *.png        heatmaps");
    say!("  report.html  all of them on one page");
    Ok(())
}
