//! `hybridsim train`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{Common, Out, devices, interrupt, progress::Shown, scores};
use crate::{
    data::files,
    error::Result,
    verbs::{self, Notice, train::Start},
};

#[derive(Args)]
#[command(mut_arg("out", |out| out.help("The run folder [default: runs/ and the name of the config, then runs/NAME-2]")))]
pub(crate) struct Arguments {
    /// The experiment, such as configs/quickstart.toml; with --resume it may be left out
    #[arg(required_unless_present = "resume")]
    config: Option<PathBuf>,
    /// Continue a run folder that was interrupted
    #[arg(long, value_name = "RUN", conflicts_with_all = ["config", "out"])]
    resume: Option<PathBuf>,
    /// Diagnose the first recording, and train with the effects that were found
    #[arg(long, conflicts_with = "resume")]
    diagnose: bool,
    #[command(flatten)]
    out: Out,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let sets = &common.set;
    let start = match (&arguments.resume, &arguments.config) {
        (Some(run), _) => Start::Resume { run, sets },
        (None, Some(path)) => {
            Start::Config { path, sets, out: arguments.out.out.as_deref(), go_on: false, diagnose: arguments.diagnose }
        }
        (None, None) => unreachable!("clap asks for one of them"),
    };
    let devices = devices(&common.device)?;
    let mut shown = Shown::new(common.quiet);
    let trained = verbs::train::train(&start, &devices, common.as_stated, &mut |notice| {
        if let Notice::Run { folder, epochs } = notice {
            print_how_to_go_on(folder, epochs, common);
        }
        shown.show(notice);
    })?;
    shown.finish();
    for (folder, evaluation) in &trained.evaluations {
        say!("{}", folder.display());
        super::print(&scores::of_frames(evaluation));
    }
    say!("report: {}", trained.folder.join("report.html").display());
    Ok(())
}

/// If it is interrupted: which epoch the checkpoint is of, and the command that goes on from it.
fn print_how_to_go_on(run_folder: &Path, epochs: usize, common: &Common) {
    let (folder, device) = (run_folder.to_path_buf(), common.device.clone());
    let as_stated = if common.as_stated { " --as-stated" } else { "" };
    interrupt::kept(move || {
        let done = files::read_text(folder.join("last/checkpoint.toml"))
            .ok()
            .and_then(|text| text.parse::<toml::Table>().ok()?.get("progress")?.get("epochs_done")?.as_integer())
            .unwrap_or(0);
        let program = std::env::args().next().unwrap_or_else(|| "hybridsim".into());
        let words = [&program, "train", "--resume", &folder.to_string_lossy(), "--device", &device].map(interrupt::quoted);
        let kept = format!("{done} of {epochs} epochs are kept in {}", folder.display());
        format!("{kept}; go on with: {}{as_stated}", words.join(" "))
    });
}
