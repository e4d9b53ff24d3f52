//! How a motion's file is read.

use std::path::PathBuf;

use clap::Args;

use crate::error::{Error, Result};
use crate::import::UpAxis;

/// What to do where options about a motion meet another file.
pub(super) const READING_HINT: &str = "check the motion's file by itself";

#[derive(Args)]
pub(super) struct MotionReading {
    /// How to read the motion: a TOML file with joint map, units, up axis and frame rate, as docs/motion.md has them
    #[arg(long, value_name = "FILE")]
    pub(super) motion_config: Option<PathBuf>,
    /// Up axis of the motion's file: x, y, z, -x, -y or -z; recognised from how the person stands by default
    #[arg(long, value_name = "AXIS", value_parser = parse_up, allow_hyphen_values = true)]
    pub(super) up: Option<UpAxis>,
}

impl MotionReading {
    /// Refuses what was given, where no motion's file is read.
    pub(super) fn refused(&self, hint: &str) -> Result<()> {
        let given = self.motion_config.as_ref().map(|_| "--motion-config").or(self.up.map(|_| "--up"));
        match given {
            Some(given) => Err(Error::Usage { message: format!("{given}: no motion's file is read"), hint: Some(hint.into()) }),
            None => Ok(()),
        }
    }
}

fn parse_up(name: &str) -> std::result::Result<UpAxis, String> {
    let names = UpAxis::ALL.map(UpAxis::name).join(", ");
    UpAxis::ALL.into_iter().find(|axis| axis.name() == name).ok_or_else(|| format!("expected one of {names}"))
}
