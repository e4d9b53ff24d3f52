//! `hybridsim baseline`.

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use burn::tensor::Device;
use clap::Args;
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Value, json};

use super::{
    Common, Out, device, plausible,
    progress::{Progress, Shown},
};
use crate::{
    baselines::{
        Baseline, BaselineNoise, Calibration, MmGpe, MmGpeConfig, NOISE_RATE, Rendering, RfGenesis, RfGenesisConfig, TwoBounce,
        TwoBounceConfig, noise_level,
    },
    data::{
        Recording,
        atomic::{self, AtomicFolder},
        settings,
    },
    error::{Error, Result},
    heatmap::HeatmapConfig,
    person::Person,
    verbs::{
        Notice,
        heatmaps::same_radar,
        simulated::{self, Sequence},
    },
};

#[derive(Args)]
#[command(mut_arg("out", |out| out.help("Folder for the results [default: runs/baseline]")))]
pub(crate) struct Arguments {
    /// How to simulate
    #[arg(value_enum, value_name = "METHOD")]
    method: Method,
    /// The recording whose motion is simulated
    #[arg(value_name = "RECORDING")]
    recording: PathBuf,
    /// two-bounce: the checkpoint whose direct path is kept, such as runs/x/best
    #[arg(long, value_name = "DIR")]
    checkpoint: Option<PathBuf>,
    /// Training recordings of the same radar that the method's one gain is found on
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with = "gain")]
    calibrate: Vec<PathBuf>,
    /// Frames of each training recording that are looked at
    #[arg(long, value_name = "COUNT", default_value_t = 4)]
    calibration_frames: usize,
    /// The gain, as an earlier baseline.json has it
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    gain: Option<f64>,
    /// Training recordings of the same radar whose receiver noise is added, in place of the paper's share of the signal
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with = "clean")]
    receiver_noise: Vec<PathBuf>,
    /// Of the noise
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Leave out the noise
    #[arg(long)]
    clean: bool,
    #[command(flatten)]
    out: Out,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
#[value(rename_all = "kebab-case")]
enum Method {
    /// Visible vertices with fixed reflectivity
    Mmgpe,
    /// The same over all of the surface
    MmgpeSurface,
    /// A grid of rays, corrected
    RfGenesis,
    /// A grid of rays, with the released code's errors
    RfGenesisReleased,
    /// Our direct path and mirrors
    TwoBounce,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let device = device(&common.device)?;
    let maker = Maker::new(arguments, common, device)?;
    let out = arguments.out.out.clone().unwrap_or_else(|| "runs/baseline".into());
    let folder = AtomicFolder::create(&out)?;
    let recording = open(&arguments.recording, common)?;
    let baseline = maker.make(&arguments.recording, &recording)?;
    let gain = gain(arguments, common, &maker, &recording)?;
    let noise = noise(arguments, common, &recording)?;
    let rendering = Rendering { baseline: &*baseline, gain, noise };
    let mut seconds = 0.0;
    let sequence = Sequence {
        radar: &recording.radar,
        room: recording.room.as_ref(),
        person: recording.person(),
        labels: recording.labels.clone(),
        measured: Some(&recording),
    };
    let mut shown = Shown::new(common.quiet);
    let mut notify = |notice: Notice<'_>| shown.show(notice);
    simulated::write(folder.path(), &sequence, &HeatmapConfig::default(), &mut notify, &mut |frame| {
        let start = Instant::now();
        let signal = rendering.frame(frame);
        seconds += start.elapsed().as_secs_f64();
        signal
    })?;
    shown.finish();
    let frames = recording.radar.frames;
    let seconds_per_frame = seconds / frames as f64;
    let about = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "method": arguments.method,
        "settings": maker.settings,
        "checkpoint": arguments.checkpoint,
        "gain": gain,
        "calibrated_on": arguments.calibrate,
        "noise_rate": matches!(noise, BaselineNoise::Rate { .. }).then_some(NOISE_RATE),
        "noise_level": if let BaselineNoise::Level { deviation, .. } = noise { Some(deviation) } else { None },
        "seed": arguments.seed,
        "frames": frames,
    });
    // What differs between equal runs.
    let run = json!({ "version": env!("CARGO_PKG_VERSION"), "seconds_per_frame": seconds_per_frame });
    for (name, value) in [("baseline.json", about), ("run.json", run)] {
        atomic::write_text(folder.path().join(name), &format!("{value:#}\n"))?;
    }
    folder.finish()?;
    say!("simulated {frames} frames, {seconds_per_frame:.3} s each: {}", out.display());
    say!("  recording/     IF samples as a recording folder");
    say!("  baseline.json  settings, gain");
    say!("  run.json       time");
    say!("  *.png          heatmaps");
    say!("  report.html    all of them on one page");
    Ok(())
}

fn open(folder: &Path, common: &Common) -> Result<Recording> {
    let recording = Recording::open(folder)?;
    plausible::recording(&recording, common)?;
    for note in &recording.notes {
        remark!("note: {}: {note}", folder.display());
    }
    Ok(recording)
}

/// Makes the chosen method for one recording after the other.
struct Maker {
    method: Method,
    checkpoint: Option<PathBuf>,
    settings: Value,
    device: Device,
}

impl Maker {
    fn new(arguments: &Arguments, common: &Common, device: Device) -> Result<Self> {
        let method = arguments.method;
        if (method == Method::TwoBounce) != arguments.checkpoint.is_some() {
            return Err(Error::Usage {
                message: "--checkpoint belongs to two-bounce, which cannot do without".into(),
                hint: Some("two-bounce keeps the direct path of a trained simulator; the other methods learn nothing".into()),
            });
        }
        if method == Method::TwoBounce && (arguments.gain.is_some() || !arguments.calibrate.is_empty()) {
            return Err(Error::Usage {
                message: "two-bounce needs no gain: its checkpoint is in the recordings' units".into(),
                hint: Some("leave out --calibrate and --gain".into()),
            });
        }
        let settings = match method {
            Method::Mmgpe => with_sets(MmGpeConfig::default(), &common.set)?,
            Method::MmgpeSurface => with_sets(MmGpeConfig::over_the_surface(), &common.set)?,
            Method::RfGenesis => with_sets(RfGenesisConfig::default(), &common.set)?,
            Method::RfGenesisReleased => with_sets(RfGenesisConfig::released(), &common.set)?,
            Method::TwoBounce => with_sets(TwoBounceConfig::default(), &common.set)?,
        };
        Ok(Self { method, checkpoint: arguments.checkpoint.clone(), settings, device })
    }

    /// # Errors
    /// A recording without a person, or of another radar than the checkpoint's.
    fn make(&self, folder: &Path, recording: &Recording) -> Result<Box<dyn Baseline>> {
        let radar = &recording.radar;
        let person = || -> Result<&Person> {
            recording.person().ok_or_else(|| {
                Error::field(folder.join("recording.toml"), "motion", "missing", "a body with its motion, or meshes")
                    .with_hint("this method simulates the person and nothing else")
            })
        };
        Ok(match self.method {
            Method::Mmgpe | Method::MmgpeSurface => Box::new(MmGpe::new(radar, person()?, &self.config(), &self.device)?),
            Method::RfGenesis | Method::RfGenesisReleased => {
                Box::new(RfGenesis::new(radar, person()?, &self.config(), &self.device)?)
            }
            Method::TwoBounce => {
                let checkpoint = self.checkpoint.as_deref().expect("checked when made");
                let room = recording.room.as_ref();
                let (baseline, state) =
                    TwoBounce::open(checkpoint, radar, room, recording.person(), &self.config(), &self.device)?;
                same_radar(folder, radar, &state.site.radar)?;
                Box::new(baseline)
            }
        })
    }

    fn config<T: DeserializeOwned>(&self) -> T {
        serde_json::from_value(self.settings.clone()).expect("read from this kind of settings")
    }
}

/// Settings changed by `--set`.
fn with_sets<T: Serialize + DeserializeOwned>(config: T, sets: &[String]) -> Result<Value> {
    let table = toml::Table::try_from(config).expect("plain data");
    let config: T = settings::settings_from_table(table, "the method's settings", sets)?;
    Ok(serde_json::to_value(config).expect("plain data"))
}

/// The method's amplitude unit in the recordings'.
fn gain(arguments: &Arguments, common: &Common, maker: &Maker, simulated: &Recording) -> Result<f64> {
    if let Some(gain) = arguments.gain {
        if !(gain.is_finite() && gain > 0.0) {
            return Err(Error::Usage { message: format!("--gain {gain}: expected a factor above zero"), hint: None });
        }
        return Ok(gain);
    }
    if arguments.calibrate.is_empty() {
        if maker.method != Method::TwoBounce {
            remark!("note: without --calibrate or --gain the level is arbitrary");
        }
        return Ok(1.0);
    }
    let progress = Progress::new("calibrating", arguments.calibrate.len(), common.quiet);
    let mut calibration = Calibration::default();
    for (done, folder) in arguments.calibrate.iter().enumerate() {
        let recording = of_same_radar(folder, arguments, common, simulated)?;
        calibration.add(&recording, &*maker.make(folder, &recording)?, arguments.calibration_frames)?;
        progress.set(done + 1);
    }
    progress.finish();
    calibration.gain()
}

fn of_same_radar(folder: &Path, arguments: &Arguments, common: &Common, simulated: &Recording) -> Result<Recording> {
    let recording = open(folder, common)?;
    if !recording.radar.is_same_board(&simulated.radar) {
        let expected = format!("that of {}", arguments.recording.display());
        return Err(Error::field(folder.join("recording.toml"), "radar", "another radar", expected)
            .with_hint("calibrate on recordings of the radar that is simulated"));
    }
    Ok(recording)
}

fn noise(arguments: &Arguments, common: &Common, simulated: &Recording) -> Result<BaselineNoise> {
    let seed = arguments.seed;
    if arguments.clean {
        return Ok(BaselineNoise::None);
    }
    if arguments.receiver_noise.is_empty() {
        return Ok(BaselineNoise::Rate { seed });
    }
    let recordings: Vec<Recording> = arguments
        .receiver_noise
        .iter()
        .map(|folder| of_same_radar(folder, arguments, common, simulated))
        .collect::<Result<_>>()?;
    Ok(BaselineNoise::Level { seed, deviation: noise_level(&recordings, arguments.calibration_frames)? })
}
