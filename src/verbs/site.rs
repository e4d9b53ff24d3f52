//! Recording a site: several subjects and actions in one room.

use std::path::{Path, PathBuf};

use super::{Notice, Notify, plausible};
use crate::{
    data::{Claim, Shard},
    error::Result,
    site::{self, SiteConfig},
};

/// Which site is recorded, and how much of it.
pub struct Site<'a> {
    /// A site's config.
    pub config: &'a Path,
    /// `key=value` of its settings.
    pub sets: &'a [String],
    pub out: &'a Path,
    /// Of its sequences.
    pub shard: Shard,
}

/// Records what is not there yet. How many recordings there were, and were made.
///
/// # Errors
/// Settings that cannot be a site, or a sequence of the shard that cannot be; a recording that was made with others; a folder that
/// cannot be written.
pub fn record(what: &Site<'_>, as_stated: bool, notify: &mut Notify<'_>) -> Result<site::Site> {
    let config = SiteConfig::read(what.config, what.sets)?;
    let _claim = Claim::part(what.out, what.shard)?;
    plausible::sequences(&config, what.config, as_stated, what.shard, notify)?;
    let (mut begun, mut at_hand) = (false, String::new());
    let mut progress = |done: usize, of: usize, name: &str| {
        if !std::mem::replace(&mut begun, true) {
            notify(Notice::Begun { what: "recording", steps: of });
        }
        if name != at_hand {
            at_hand = name.into();
            notify(Notice::At(name));
        }
        notify(Notice::Done(done));
    };
    site::record(&config, what.config.parent().unwrap_or(Path::new("")), what.out, what.shard, &mut progress)
}

/// Looks at all sequences, and records nothing: what would be refused is refused, what is odd is said. Their recordings, in
/// the order of the shards.
///
/// # Errors
/// Settings that cannot be a site, or a sequence that cannot be.
pub fn look(what: &Site<'_>, as_stated: bool, notify: &mut Notify<'_>) -> Result<Vec<PathBuf>> {
    let config = SiteConfig::read(what.config, what.sets)?;
    plausible::sequences(&config, what.config, as_stated, Shard::ALL, notify)?;
    let sequences = site::sequences(&config, what.config.parent().unwrap_or(Path::new("")))?;
    Ok(sequences.into_iter().map(|sequence| what.out.join("recordings").join(sequence.name)).collect())
}

/// The recordings of a shard's sequences.
///
/// # Errors
/// Settings that cannot be a site.
pub fn recordings(what: &Site<'_>) -> Result<Vec<PathBuf>> {
    let sequences = site::drawn(&SiteConfig::read(what.config, what.sets)?)?.into_iter().enumerate();
    let mine = sequences.filter(|(index, _)| what.shard.holds(*index));
    Ok(mine.map(|(_, sequence)| what.out.join("recordings").join(sequence.name)).collect())
}
