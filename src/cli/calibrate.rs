//! `hybridsim challenge calibrate`.

use std::path::PathBuf;

use clap::Args;

use super::{
    Common,
    cases::{How, WITHOUT, claimed},
    progress::Progress,
};
use crate::{
    challenge::{
        calibrate::{self, Source, TABLE},
        secret::Secret,
    },
    config::Config,
    error::Result,
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// A config with a [record] section, or a recording folder whose radar and size are taken
    source: PathBuf,
    /// Folder for calibration.json, results.md, p_values.png and the nulls' reports; a run that was killed goes on there
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Recordings with nothing missing; no p-value is below 1/(N + 1)
    #[arg(long, value_name = "N", default_value_t = 99)]
    nulls: usize,
    /// Text that the nulls are drawn from
    #[arg(long, value_name = "TEXT", default_value = "calibration")]
    seed: String,
    #[command(flatten)]
    how: How,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let (out, how) = (&arguments.out, arguments.how.config_without(&WITHOUT, common)?);
    let sets: Vec<String> = WITHOUT.iter().map(|set| set.to_string()).chain(common.set.iter().cloned()).collect();
    let settings = Config::defaults(&sets)?.diagnosis;
    let source = Source::read(&arguments.source, &common.set)?;
    source.notes.iter().for_each(|note| remark!("note: {note}"));
    let _claim = claimed(out, how.shard, "nulls")?;
    let secret = Secret::new(Some(&arguments.seed));
    let progress = Progress::new("nulls", calibrate::waiting(out, arguments.nulls, &how), common.quiet);
    let done = calibrate::run(&source, arguments.nulls, &secret, out, &how, &mut |done| progress.set(done));
    progress.finish();
    done?;
    let Some(calibrated) = calibrate::gather(&source, arguments.nulls, &secret, out, &how, &settings)? else {
        let missing = calibrate::missing(out, arguments.nulls);
        say!("{missing} of {} nulls are missing yet: the same command goes on", arguments.nulls);
        return Ok(());
    };
    calibrated.write(out)?;
    say!("{}", calibrated.markdown());
    say!("use it with: hybridsim diagnose RECORDING --set diagnosis.calibration={}", out.join(TABLE).display());
    Ok(())
}
