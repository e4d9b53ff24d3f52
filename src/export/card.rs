//! `card.md`: what a data set holds, how it was made, and what its user must know.

use std::collections::{BTreeMap, BTreeSet};

use super::dataset::Dataset;

pub fn text(dataset: &Dataset, notes: &[String]) -> String {
    let shards = &dataset.shards;
    let seconds: f64 = shards.iter().map(|shard| shard.recording.frames() as f64 * shard.recording.radar.frame_period_s).sum();
    let first = &shards[0].recording.radar;
    let others = shards.iter().filter(|shard| !shard.recording.radar.is_same_board(first)).count();
    let mut text = format!(
        "# Data set card\n\n{} recordings, {} frames, {seconds:.1} s. Each is a folder of the name in `labels.csv`, \
         written for the target `{}`: {}. Axes and units: docs/export.md of HybridSim.\n\n",
        shards.len(),
        dataset.frames(),
        dataset.target.name,
        dataset.target.writes
    );
    text += "## How it was made\n\n";
    text += &format!("Exported by hybridsim {}.", env!("CARGO_PKG_VERSION"));
    text += match dataset.from_site {
        true => " The recordings are simulated: those of a site, whose settings are in its `site.toml`.\n\n",
        false => " Whether the recordings are measured or simulated, where and of whom: (to be filled in).\n\n",
    };
    let keys: BTreeSet<&String> = shards.iter().flat_map(|shard| shard.recording.labels.keys()).collect();
    text += if keys.is_empty() { "## Labels\n\nNone.\n" } else { "## Labels\n\n| label | values (recordings) |\n|---|---|\n" };
    for key in keys {
        let values = shards.iter().map(|shard| shard.recording.labels.get(key).map_or("(none)", String::as_str));
        text += &format!("| {} | {} |\n", cell(key), counted(values));
    }
    if let Some(key) = &dataset.split_by {
        let config = &dataset.config.split;
        text += &format!(
            "\n## Splits\n\nBy the label `{key}`: no value of it is in two splits (seed {}). {}\n",
            config.seed,
            counted(shards.iter().map(|shard| shard.split.unwrap_or_default()))
        );
    }
    text += "\n## Radar\n\nUnits are those in the keys. ";
    if others > 0 {
        text += &format!("Of the first recording; {others} recordings have another. ");
    }
    text += &format!("\n\n```toml\n{}```\n", toml::to_string(first).expect("a radar is plain data"));
    if !notes.is_empty() {
        text += "\n## Notes\n\n";
        notes.iter().for_each(|note| text += &format!("- {note}\n"));
    }
    text + "\n## Licence\n\n(to be filled in by whoever publishes it)\n"
}

/// `walk (3), sit (1)`
fn counted<'a>(values: impl Iterator<Item = &'a str>) -> String {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    values.for_each(|value| *counts.entry(value).or_default() += 1);
    counts.into_iter().map(|(value, count)| format!("{} ({count})", cell(value))).collect::<Vec<_>>().join(", ")
}

/// A text that stays within its cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace(['\n', '\r'], " ")
}
