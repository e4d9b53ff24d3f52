//! The command line: verbs, their help, and what they say on the terminal.
//!
//! Results go to standard output, progress and warnings to standard error. Exit status: 0 done, 1 failed,
//! 2 wrong usage, configuration or input, 130 and 143 interrupted by SIGINT and SIGTERM.

/// A line on standard output.
macro_rules! say {
    ($($text:tt)*) => { $crate::cli::print(&format!("{}\n", format_args!($($text)*))) };
}

/// A line on standard error.
macro_rules! remark {
    ($($text:tt)*) => { $crate::cli::complain(&format!($($text)*)) };
}

mod align;
mod baseline;
mod calibrate;
mod cases;
mod catalogue;
mod challenge;
mod check;
mod compare;
mod conventions;
mod describe;
mod device;
mod diagnose;
mod effects;
mod evaluate;
mod export;
mod import;
mod infer;
mod interrupt;
mod motion;
mod plausible;
mod progress;
mod recognize;
mod record;
mod reproduce;
mod salt;
mod scores;
mod shell;
mod site;
mod train;

use std::{path::PathBuf, process::ExitCode};

use clap::{Args, Parser, Subcommand};

use crate::{
    data::{files, unfinished},
    error::{Error, Result},
    text::shown,
};

pub use device::{available, device, devices};

/// Text on standard output. Whoever reads may have closed the pipe: what was made is made.
fn print(text: &str) {
    if let Err(error) = std::io::Write::write_all(&mut std::io::stdout(), shown(text).as_bytes())
        && error.kind() != std::io::ErrorKind::BrokenPipe
    {
        remark!("error: standard output: {error}");
        unfinished::abandon();
        std::process::exit(1);
    }
}

/// A line on standard error; nobody may be there to read it.
fn complain(text: &str) {
    let _ = std::io::Write::write_all(&mut std::io::stderr(), format!("{}\n", shown(text)).as_bytes());
}

/// Simulate mmWave radar recordings of moving people, and learn the physics from recordings.
#[derive(Parser)]
#[command(name = "hybridsim", version, about, max_term_width = 100, arg_required_else_help = true)]
#[command(after_help = "Start with:  hybridsim train configs/quickstart.toml")]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    common: Common,
}

#[derive(Args, Clone)]
pub(crate) struct Common {
    /// Change one setting of what the verb reads, such as training.epochs=10 (train), record.frames=24 (record), radar.frames=100 (import),
    /// diagnosis.alarm=0.05 (diagnose), maps.farthest_m=6 (export); may be repeated
    #[arg(long, global = true, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// flex, auto (a real GPU if there is one, else flex), or of a build that has it: wgpu, wgpu-cpu, cuda:0, ndarray
    #[arg(long, global = true, value_name = "NAME", default_value = "auto")]
    pub device: String,
    /// Take radar, body, motion, place and the samples of a capture as they are stated, however implausible
    #[arg(long, global = true, visible_alias = "yes-as-stated")]
    pub as_stated: bool,
    /// Print results and errors only
    #[arg(short, long, global = true)]
    pub quiet: bool,
}

#[derive(Subcommand)]
enum Command {
    /// Read a config, a recording, a checkpoint, a body or a motion, and show what it describes
    ///
    /// Shows what follows from the radar's settings (resolutions, limits), holds its rules against the room, and says
    /// which parts are missing and what cannot be: units, speeds, places. A body (.npz) or a motion (.npz, .bvh) may be
    /// given by itself. With --out, draws the heatmaps of a recording.
    Check(check::Arguments),
    /// Turn a capture of a radar board into a recording
    ///
    /// Reads adc_data.bin of a DCA1000 with its .mmwave.json or .cfg, recording folders of the Infineon SDK, and arrays
    /// (NumPy, MATLAB, HDF5) whose axes --layout names. Holds the samples against what is stated of them, and writes a
    /// recording folder that every other verb reads; where they contradict it, nothing, unless --as-stated.
    /// --set radar.KEY=VALUE corrects what the files say.
    Import(import::Arguments),
    /// Write recordings in the layouts of others
    ///
    /// npz, hdf5: IF samples with their axes, radar and body. dca1000: _Raw_0.bin with .mmwave.json, as a capture of a TI
    /// board. rover: a trace of roverd. maps: range-Doppler-angle power. points: a CFAR point cloud, also as PLY. body: the
    /// posed body. A file for rerun: from Python. Of several recordings, or a site, also labels.csv and card.md, and with
    /// --split-by splits. --set KEY=VALUE: docs/export.md.
    Export(export::Arguments),
    /// Make a recording of a person in a room, in a world that shares nothing with the simulator
    ///
    /// Writes a recording folder (recording.toml, if.npy, body.npz, motion.npz, truth.json) from the [record] section
    /// of a config. Use it when you have no radar at hand.
    Record(record::Arguments),
    /// Record a site: several subjects and actions in one room, by one board
    ///
    /// Writes DIR/site.toml (resolved) and a recording folder per sequence. Killed runs go on where they stopped;
    /// --shard divides the work between processes. All that a process is to record is checked before its first sequence.
    Site(site::Arguments),
    /// Fit the simulator to recordings
    ///
    /// Reads recording folders (or makes one first from [record]), trains, and leaves a run folder: config.toml
    /// (resolved), metrics.json, loss curve and heatmaps as PNG, report.html, and the checkpoints `best` and `last`.
    /// Killed runs continue with --resume.
    Train(train::Arguments),
    /// Simulate a motion at a trained site
    ///
    /// Takes a checkpoint and a motion (BVH or AMASS-layout npz, or one of the embedded actions) and writes a
    /// recording folder with the simulated IF samples, and heatmaps as PNG.
    Infer(infer::Arguments),
    /// Simulate a recording's motion as others do, to compare with
    ///
    /// mmgpe: every visible vertex reflects with fixed lobes; mmgpe-surface: every visible facet, integrated.
    /// rf-genesis: rays through a pixel grid, one return for each hit; rf-genesis-released: the same with the errors
    /// of its released code. two-bounce: a checkpoint's direct path, with mirrors in place of its indirect path.
    /// Writes a recording folder as infer does, and baseline.json.
    Baseline(baseline::Arguments),
    /// Compare simulated with measured heatmaps
    ///
    /// PSNR, SSIM and dB error over all cells, with what is static removed, and on the cells that the person
    /// occupies, as mean and standard deviation over frames; of several recordings also the mean's 95 % interval.
    /// With --lpips also LPIPS. --out writes all of it as JSON.
    Evaluate(evaluate::Arguments),
    /// Compare two recordings, or two folders of them
    ///
    /// The same scores as `evaluate`, for simulations by whatever method that were written as recording folders. Of a
    /// truth that was recorded twice it gives the ceiling: no simulator can agree better than two noises do.
    Compare(compare::Arguments),
    /// Train a classifier of activities on some recordings, test it on others
    ///
    /// The label `action` is the class. Give simulated recordings to --train and measured ones to --test to see what
    /// simulation is worth; measured ones of other people to both for the ceiling.
    Recognize(recognize::Arguments),
    /// Find where the body is in the radar's frame, and when
    ///
    /// Estimates origin, turn about the vertical and start of a recording's motion from the recording itself, with
    /// intervals, or says what it cannot tell. Writes align.json, motion.toml and a picture before and after.
    Align(align::Arguments),
    /// Find out why a recording and the simulator disagree
    ///
    /// Says what physics was left out, where, how large and how sure, what it cannot tell apart, and how much better
    /// held-out data fit once it is modelled. Writes report.html for people and report.json for programs.
    Diagnose(diagnose::Arguments),
    /// Prove the diagnosis on concealed data: seal, run, score
    ///
    /// `seal` records cases by a secret and commits to their truths; `run` has each diagnosed by a process of its own
    /// that cannot see them; `score` opens them and holds the reports against them. `salt` plants effects into a recording of yours,
    /// to see what would be found in it; `calibrate` makes p-values right for your radar.
    Challenge(challenge::Arguments),
    /// Make the paper's experiments again, from nothing to tables
    ///
    /// Records a site, trains the simulator and its ablations, simulates by every method what was measured, scores it and
    /// trains classifiers on it. Stages are kept under the hash of all that they depend on: a run that was killed, or
    /// whose config has changed, does only what is missing. Leaves results.md, results.json and adaptation.png.
    Reproduce(reproduce::Arguments),
    /// List the effects that the library knows, or describe one
    ///
    /// What it is, its equation and parameters, its look-alikes and how to separate it from them. With --out, a page an effect
    /// with the picture of its signature.
    Effects(catalogue::Arguments),
    /// Print completions for a shell
    ///
    /// bash: hybridsim completions bash > ~/.local/share/bash-completion/completions/hybridsim
    Completions(shell::Completions),
    /// Write man pages
    Man(shell::Man),
}

/// Where results go.
#[derive(Args, Clone)]
pub(crate) struct Out {
    /// Folder for the results
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Parses, runs, reports. Every error is printed once, here, with its hint.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            show_usage(&error);
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    interrupt::watch();
    match run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // What failed because everything is ended has not failed.
            unfinished::wait_if_ending();
            remark!("error: {error}");
            if let Some(hint) = error.hint() {
                remark!("hint: {hint}");
            }
            ExitCode::from(status(&error))
        }
    }
}

/// What clap says: in colour, unless a terminal would obey words that were typed, which clap repeats.
fn show_usage(error: &clap::Error) {
    let obeyed = |word: std::ffi::OsString| matches!(shown(&word.to_string_lossy()), std::borrow::Cow::Owned(_));
    match std::env::args_os().any(obeyed) {
        true => complain(error.render().to_string().trim_end()),
        false => drop(error.print()),
    }
}

fn run(cli: &Cli) -> Result<()> {
    refuse_idle_settings(cli)?;
    refuse_unknown_device(&cli.common.device)?;
    match &cli.command {
        Command::Check(arguments) => check::run(arguments, &cli.common),
        Command::Import(arguments) => import::run(arguments, &cli.common),
        Command::Export(arguments) => export::run(arguments, &cli.common),
        Command::Record(arguments) => record::run(arguments, &cli.common),
        Command::Recognize(arguments) => recognize::run(arguments, &cli.common),
        Command::Site(arguments) => site::run(arguments, &cli.common),
        Command::Train(arguments) => train::run(arguments, &cli.common),
        Command::Infer(arguments) => infer::run(arguments, &cli.common),
        Command::Baseline(arguments) => baseline::run(arguments, &cli.common),
        Command::Evaluate(arguments) => evaluate::run(arguments, &cli.common),
        Command::Compare(arguments) => compare::run(arguments, &cli.common),
        Command::Align(arguments) => align::run(arguments, &cli.common),
        Command::Diagnose(arguments) => diagnose::run(arguments, &cli.common),
        Command::Challenge(arguments) => challenge::run(arguments, &cli.common),
        Command::Reproduce(arguments) => reproduce::run(arguments, &cli.common),
        Command::Effects(arguments) => catalogue::run(arguments, &cli.common),
        Command::Completions(arguments) => shell::completions(arguments),
        Command::Man(arguments) => shell::man(arguments),
    }
}

/// Settings and reports are text and must be able to name every path. A checkpoint keeps the settings it was trained with:
/// changing some would change nothing.
fn refuse_idle_settings(cli: &Cli) -> Result<()> {
    std::env::args_os().skip(1).try_for_each(files::utf8)?;
    let (message, hint) = match cli.command {
        _ if cli.common.set.is_empty() => return Ok(()),
        Command::Infer(_) | Command::Evaluate(_) => {
            ("--set: a checkpoint keeps the settings it was trained with", "give --set to train or record")
        }
        Command::Align(_) => ("--set: align has no settings", "`hybridsim align --help` lists its options"),
        Command::Check(ref arguments) if !arguments.reads_settings() => (
            "--set: what is checked here has no settings to override",
            "--set changes a config (.toml); what a recording states is in its recording.toml",
        ),
        Command::Effects(_) | Command::Completions(_) | Command::Man(_) => {
            ("--set: this verb reads no settings", "leave --set out")
        }
        _ => return Ok(()),
    };
    Err(Error::Usage { message: message.into(), hint: Some(hint.into()) })
}

/// Of verbs that compute on none, too. What is always there is not looked for.
fn refuse_unknown_device(names: &str) -> Result<()> {
    if names == "auto" { Ok(()) } else { devices(names).map(drop) }
}

/// 1: the work failed; 2: what was asked for cannot be done as asked.
fn status(error: &Error) -> u8 {
    match error {
        Error::NonFinite { .. } | Error::Write { .. } => 1,
        _ => 2,
    }
}

#[cfg(test)]
mod docs_tests;
