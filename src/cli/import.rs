//! `hybridsim import`.

use std::{collections::BTreeMap, path::PathBuf};

use clap::Args;

use super::{
    Common, check, conventions,
    progress::{Progress, notes},
};
use crate::{
    error::{Error, Result},
    import::capture::{Layout, Preset, Stated},
    integrity::Against,
    verbs::{
        Notice, Notify,
        import::{Import, Profiles, Seen, import, import_profiles},
    },
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// The capture: .bin files of one DCA1000 capture, in whatever order, the folder of a cascade, of roverd or of the Infineon SDK, or
    /// arrays (.npy, .npz, .mat, .h5, .bin; several or a folder: a frame each)
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// What describes the radar: .mmwave.json, .setup.json or .cfg of TI for .bin files without --layout; TOML with [radar], or
    /// ColoRadar's .txt, for arrays with --layout; may be repeated
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
    profile: Option<Profiles>,
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
    let stated = Stated {
        configs: arguments.config.clone(),
        board: arguments.board.clone(),
        layout: arguments.layout.clone(),
        variable: arguments.variable.clone(),
        preset: arguments.preset.as_deref().map(Preset::named).transpose()?,
        profile: arguments.profile.and_then(Profiles::one),
        subframe: arguments.subframe,
        tx: arguments.tx,
        sets: common.set.clone(),
    };
    let labels = labels(&arguments.label)?;
    let what = Import { sources: &arguments.sources, stated: &stated, labels, as_stated: common.as_stated, out: &arguments.out };
    let against = if common.as_stated { Against::Kept } else { Against::Refused };
    let mut show = |seen: Seen<'_>, _: &mut Notify<'_>| match seen {
        Seen::Written(recording) => check::describe(recording),
        Seen::Looked(recording, findings) => conventions::show(&recording.radar, findings, against),
    };
    let (mut bar, mut length) = (None, 0);
    let mut notify = |notice: Notice<'_>| match notice {
        Notice::Begun { what, steps } => (bar, length) = (Some(Progress::new(what, steps, common.quiet)), steps),
        Notice::Done(steps) if steps == length => bar.take().into_iter().for_each(Progress::finish),
        Notice::Done(steps) => bar.iter().for_each(|bar| bar.set(steps)),
        Notice::Line(text) => say!("{text}"),
        notice => notes(notice),
    };
    let made = match arguments.profile {
        Some(Profiles::All) => {
            import_profiles(&what, &mut show, &mut notify)?.into_iter().map(|(name, _)| arguments.out.join(name)).collect()
        }
        _ => import(what, &mut show, &mut notify).map(|_| vec![arguments.out.clone()])?,
    };
    made.iter().for_each(|folder| say!("imported: {}", folder.display()));
    Ok(())
}

/// Labels as they are written, `name=text`.
fn labels(written: &[String]) -> Result<BTreeMap<String, String>> {
    let mut labels = BTreeMap::new();
    for label in written {
        let (name, text) = label.split_once('=').ok_or_else(|| Error::Usage {
            message: format!("`--label {label}` is no label"),
            hint: Some("write --label name=text, such as --label action=walk".into()),
        })?;
        let (name, text) = (name.trim().to_string(), text.trim().to_string());
        if let Some(earlier) = labels.insert(name.clone(), text) {
            return Err(Error::Usage {
                message: format!("`--label {label}` follows `--label {name}={earlier}`, expected one text for each name"),
                hint: Some("leave one of them out, or give them two names".into()),
            });
        }
    }
    Ok(labels)
}

#[cfg(test)]
mod tests {
    use super::labels;

    #[test]
    fn a_name_of_a_label_stands_once() {
        let of = |written: &[&str]| labels(&written.iter().map(|label| label.to_string()).collect::<Vec<_>>());
        let two = of(&["action=walk", "subject = s1"]).unwrap();
        assert_eq!((two["action"].as_str(), two["subject"].as_str()), ("walk", "s1"));
        let error = of(&["action=walk", "action=run"]).unwrap_err();
        let said = "`--label action=run` follows `--label action=walk`, expected one text for each name";
        assert!(error.to_string().ends_with(said) && error.hint().is_some(), "{error}");
        assert!(of(&["action"]).unwrap_err().to_string().contains("is no label"));
    }
}
