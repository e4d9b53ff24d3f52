//! `hybridsim effects`.

use std::path::PathBuf;
use std::sync::Mutex;

use clap::Args;

use super::{Common, progress::Shown};
use crate::{catalogue, effects, error::Result, verbs::Notice};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Id of an effect, such as if_highpass
    #[arg(conflicts_with = "out")]
    id: Option<String>,
    /// Folder for a page an effect, in Markdown with pictures
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    match (&arguments.id, &arguments.out) {
        (Some(id), _) => say!("{}", catalogue::described(id)?.trim_end()),
        (None, None) => say!("{}", catalogue::table().trim_end()),
        (None, Some(folder)) => {
            let mut shown = Shown::new(common.quiet);
            shown.show(Notice::Begun { what: "recording signatures", steps: effects::library().len() });
            let shown = Mutex::new((0, shown));
            catalogue::write(folder, &|| {
                let mut shown = shown.lock().expect("nothing panics while it is shown");
                shown.0 += 1;
                let done = shown.0;
                shown.1.show(Notice::Done(done));
            })?;
            shown.into_inner().expect("nothing panics while it is shown").1.finish();
            say!("pages: {}", folder.join("index.md").display());
        }
    }
    Ok(())
}
