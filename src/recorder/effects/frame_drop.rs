//! Lost frames.

use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::{Error, Result};

settings! {
    /// Before frame `at`, so many frames are lost.
    #[derive(Copy)]
    FrameDrop { at: usize [1.0, 1.0e9], count: usize [1.0, 1000.0] }
}

impl Effect for FrameDrop {
    fn check(&self, context: &Context, key: &str) -> Result<()> {
        if self.at >= context.radar.frames {
            let wanted = format!("a frame below {}", context.radar.frames);
            return Err(Error::setting(format!("{key}.at"), self.at, wanted));
        }
        Ok(())
    }
}

impl FrameDrop {
    /// Frames lost before one.
    pub fn lost(&self, frame: usize) -> usize {
        if frame >= self.at { self.count } else { 0 }
    }
}
