//! `hybridsim import`.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    str::FromStr,
};

use clap::Args;

use super::{
    Common, check, conventions,
    progress::{Progress, notes},
};
use crate::{
    data::atomic::AtomicFolder,
    error::{Error, Result},
    import::capture::{self, Layout, Preset, Stated},
    integrity::Against,
    verbs::{
        Notice, Notify,
        import::{Import, Seen, import},
    },
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// The capture: .bin files of one DCA1000 capture in their order, the folder of a cascade, of roverd or of the Infineon SDK, or
    /// arrays (.npy, .npz, .mat, .h5, .bin; several or a folder: a frame each)
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// What describes the radar: .mmwave.json, .setup.json or .cfg of TI, TOML with [radar], or ColoRadar's .txt; may be repeated
    #[arg(long, value_name = "FILE")]
    config: Vec<PathBuf>,
    /// The board, whose antenna positions are then known, such as IWR6843ISK
    #[arg(long, value_name = "NAME")]
    board: Option<String>,
    /// The order of an array's axes, outer to inner, of frame, tx, rx, loop, chirp, antenna, sample, lane, iq; at the end, of a .bin
    /// that holds no 16-bit words, the type of its numbers: float32, float64, complex64, complex128
    #[arg(long, value_name = "AXES")]
    layout: Option<Layout>,
    /// The array of a file that holds several; RE,IM where real and imaginary parts are two arrays
    #[arg(long, value_name = "NAME")]
    variable: Option<String>,
    /// A public data set whose layout and radar are known, such as uw_raw_adc
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
    /// Which chirp profile, where a frame has several; all: a recording of each, DIR/profile0 and so on
    #[arg(long, value_name = "ID|all")]
    profile: Option<Profile>,
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

/// Which profiles of a frame.
#[derive(Clone, Copy)]
enum Profile {
    One(usize),
    All,
}

impl FromStr for Profile {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "all" => Ok(Self::All),
            _ => text.parse().map(Self::One).map_err(|_| "expected the number of a profile, or all".into()),
        }
    }
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let stated = Stated {
        configs: arguments.config.clone(),
        board: arguments.board.clone(),
        layout: arguments.layout.clone(),
        variable: arguments.variable.clone(),
        preset: arguments.preset.as_deref().map(Preset::named).transpose()?,
        profile: match arguments.profile {
            Some(Profile::One(id)) => Some(id),
            Some(Profile::All) | None => None,
        },
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
    if !matches!(arguments.profile, Some(Profile::All)) {
        one(&arguments.sources, &stated, labels, &arguments.out, common)?;
        say!("imported: {}", arguments.out.display());
        return Ok(());
    }
    // All appear together: one that is refused leaves nothing of the others.
    let folder = AtomicFolder::create(&arguments.out)?;
    let profiles = capture::profiles(&arguments.sources, &stated)?;
    let name = |id: usize| format!("profile{id}");
    for &id in &profiles {
        let stated = Stated { profile: Some(id), ..stated.clone() };
        say!("profile {id}:");
        one(&arguments.sources, &stated, labels.clone(), &folder.path().join(name(id)), common)?;
    }
    folder.finish()?;
    profiles.iter().for_each(|&id| say!("imported: {}", arguments.out.join(name(id)).display()));
    Ok(())
}

/// One recording.
fn one(sources: &[PathBuf], stated: &Stated, labels: BTreeMap<String, String>, out: &Path, common: &Common) -> Result<()> {
    let what = Import { sources, stated, labels, as_stated: common.as_stated, out };
    let against = if common.as_stated { Against::Kept } else { Against::Refused };
    let mut show = |seen: Seen<'_>, _: &mut Notify<'_>| match seen {
        Seen::Written(recording) => check::describe(recording),
        Seen::Looked(recording, findings) => conventions::show(&recording.radar, findings, against),
    };
    let (mut bar, mut length) = (None, 0);
    import(what, &mut show, &mut |notice| match notice {
        Notice::Begun { what, steps } => (bar, length) = (Some(Progress::new(what, steps, common.quiet)), steps),
        Notice::Done(steps) if steps == length => bar.take().into_iter().for_each(Progress::finish),
        Notice::Done(steps) => bar.iter().for_each(|bar| bar.set(steps)),
        notice => notes(notice),
    })?;
    Ok(())
}
