//! `hybridsim import`.

use std::{collections::BTreeMap, path::PathBuf};

use clap::Args;

use super::{Common, check, progress::Progress};
use crate::{
    data::atomic::AtomicFolder,
    error::{Error, Result},
    import::capture::{self, Layout, Stated},
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// The capture: .bin files of one DCA1000 capture in their order, a folder of the Infineon SDK, or a .npy array
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// What describes the radar: .mmwave.json, .setup.json or .cfg of TI, or TOML with [radar]; may be repeated
    #[arg(long, value_name = "FILE")]
    config: Vec<PathBuf>,
    /// The board, whose antenna positions are then known, such as IWR6843ISK
    #[arg(long, value_name = "NAME")]
    board: Option<String>,
    /// The order of an array's axes, outer to inner, of frame, tx, rx, loop, chirp, sample, iq
    #[arg(long, value_name = "AXES")]
    layout: Option<Layout>,
    /// Which chirp profile, where a frame has several
    #[arg(long, value_name = "ID")]
    profile: Option<usize>,
    /// Which subframe of an advanced frame
    #[arg(long, value_name = "INDEX")]
    subframe: Option<usize>,
    /// Keep the chirps of one transmitter alone
    #[arg(long, value_name = "INDEX")]
    tx: Option<usize>,
    /// A label, such as action=walk; may be repeated
    #[arg(long, value_name = "NAME=TEXT")]
    label: Vec<String>,
    /// Folder of the recording
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    // What cannot be written is said before anything is read.
    AtomicFolder::create(&arguments.out).map(drop)?;
    let stated = Stated {
        configs: arguments.config.clone(),
        board: arguments.board.clone(),
        layout: arguments.layout.clone(),
        profile: arguments.profile,
        subframe: arguments.subframe,
        tx: arguments.tx,
        sets: common.set.clone(),
    };
    let labels = arguments.label.iter().map(|label| {
        let (name, text) = label.split_once('=').ok_or_else(|| Error::Usage {
            message: format!("`--label {label}` is no label"),
            hint: Some("write --label name=text, such as --label action=walk".into()),
        })?;
        Ok((name.trim().to_string(), text.trim().to_string()))
    });
    let labels = labels.collect::<Result<BTreeMap<_, _>>>()?;
    let capture = capture::open(&arguments.sources, &stated)?;
    let progress = Progress::new("importing", capture.radar.frames, common.quiet);
    let recording = capture::import(capture, &arguments.out, labels, &mut |done, _| progress.set(done))?;
    progress.finish();
    check::show(&recording, common)
}
