//! `hybridsim import`.

use std::{collections::BTreeMap, path::PathBuf};

use clap::Args;

use super::{Common, check, conventions, conventions::Against, progress::Progress};
use crate::{
    data::atomic::AtomicFolder,
    error::{Error, Result},
    import::capture::{self, Layout, Preset, Stated},
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// The capture: .bin files of one DCA1000 capture in their order, a folder of the Infineon SDK, or an array (.npy, .npz, .mat, .h5)
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
    /// The array of a file that holds several; RE,IM where real and imaginary parts are two arrays
    #[arg(long, value_name = "NAME")]
    variable: Option<String>,
    /// A public data set whose layout and radar are known, such as uw_raw_adc
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
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
        variable: arguments.variable.clone(),
        preset: arguments.preset.as_deref().map(Preset::named).transpose()?,
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
    let draft = capture::draft(capture, &arguments.out, labels, &mut |done, _| progress.set(done))?;
    progress.finish();
    let recording = draft.recording();
    check::tell(recording, common)?;
    let against = if common.as_stated { Against::Kept } else { Against::Refused };
    conventions::show(&recording.radar, &draft.findings, against);
    let told = recording.notes.clone();
    let recording = draft.publish(common.as_stated)?;
    recording.notes.iter().filter(|note| !told.contains(note)).for_each(|note| remark!("note: {note}"));
    say!("imported: {}", recording.folder.display());
    Ok(())
}
