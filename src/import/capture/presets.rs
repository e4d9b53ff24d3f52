//! Public data sets by name: a table of what their pages say (`presets.toml`).

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Table;

use super::Layout;
use crate::error::{Error, Result};

const TABLE: &str = include_str!("presets.toml");

/// What the page of a data set says of its samples.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Preset {
    pub title: String,
    /// Where it says so.
    pub page: String,
    layout: String,
    pub board: Option<String>,
    /// Which of the board's transmitters send, in firing order; all where it is absent.
    pub transmitters: Option<Vec<usize>>,
    /// Settings of the radar.
    #[serde(default)]
    pub radar: Table,
}

impl Preset {
    /// # Errors
    /// A name that the table has not.
    pub fn named(name: &str) -> Result<Self> {
        let mut all = Self::all();
        let known = all.keys().cloned().collect::<Vec<_>>().join(", ");
        all.remove(name).ok_or_else(|| Error::Usage {
            message: format!("no data set `{name}`"),
            hint: Some(format!("known are {known}; describe others with --layout, --board and --set radar.KEY=VALUE")),
        })
    }

    fn all() -> BTreeMap<String, Self> {
        toml::from_str(TABLE).expect("the table is tested")
    }

    pub fn layout(&self) -> Result<Layout> {
        Layout::parse(&self.layout)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::capture::boards::Board;

    #[test]
    fn every_preset_can_be_used_and_says_where_it_comes_from() {
        for (name, preset) in Preset::all() {
            preset.layout().unwrap();
            assert!(preset.page.starts_with("https://"), "{name}");
            let board = preset.board.as_deref().map(|board| Board::named(board).unwrap());
            for tx in preset.transmitters.iter().flatten() {
                assert!(board.and_then(|board| board.tx_m(*tx)).is_some(), "{name}");
            }
        }
        assert!(Preset::named("nothing").unwrap_err().hint().unwrap().contains("uw_raw_adc"));
    }
}
