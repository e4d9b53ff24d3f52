//! A data set as it is written: a shard for each recording, `labels.csv` and `card.md`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use super::{
    Source, card,
    dataset::{Dataset, Shard},
};
use crate::data::atomic::write_text;
use crate::error::{Error, Result};

/// Writes a data set into a folder that is there: a recording's files alone, or `NAME/` for every recording with `labels.csv` and
/// `card.md`. `progress` receives how many frames are done, and of which recording. The notes name the recordings that they are of.
///
/// # Errors
/// What the target refuses, samples that cannot be read, files that cannot be written.
pub fn write_dataset(dataset: &Dataset, folder: &Path, progress: &mut dyn FnMut(usize, &str)) -> Result<Vec<String>> {
    let mut notes: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    let mut before = 0;
    for shard in &dataset.shards {
        let place = if dataset.is_set() { folder.join(&shard.name) } else { folder.to_path_buf() };
        fs::create_dir_all(&place).map_err(|source| Error::write(&place, source))?;
        let mut source = Source {
            recording: &shard.recording,
            name: shard.name.clone(),
            board: dataset.board,
            config: &dataset.config,
            progress: &mut |done| progress(before + done, &shard.name),
        };
        let file = shard.recording.folder.join("recording.toml");
        let found = dataset.target.write(&mut source, &place).map_err(|error| match &error {
            Error::Setting { key, .. } if key.starts_with("radar.") => error.in_file(file),
            _ => error,
        })?;
        found.into_iter().for_each(|note| notes.entry(note).or_default().push(&shard.name));
        before += shard.recording.frames();
    }
    let all = dataset.shards.len();
    let told: Vec<String> = notes
        .into_iter()
        .map(|(note, of)| match of.len() {
            count if count == all => note,
            1 => format!("{}: {note}", of[0]),
            count => format!("{} and {} more recordings: {note}", of[0], count - 1),
        })
        .collect();
    if dataset.is_set() {
        write_text(folder.join("labels.csv"), &labels_csv(dataset))?;
        write_text(folder.join("card.md"), &card::text(dataset, &told))?;
    }
    Ok(told)
}

/// One line for each recording; texts are quoted as RFC 4180 has it.
fn labels_csv(dataset: &Dataset) -> String {
    const OWN: [&str; 4] = ["recording", "split", "frames", "duration_s"];
    let keys: BTreeSet<&String> = dataset.shards.iter().flat_map(|shard| shard.recording.labels.keys()).collect();
    let title = |key: &&String| if OWN.contains(&key.as_str()) { format!("label_{key}") } else { key.to_string() };
    let mut rows = vec![OWN.iter().map(ToString::to_string).chain(keys.iter().map(title)).collect::<Vec<_>>()];
    for Shard { name, recording, split } in &dataset.shards {
        let duration_s = recording.frames() as f64 * recording.radar.frame_period_s;
        let mut row =
            vec![name.clone(), split.unwrap_or_default().into(), recording.frames().to_string(), format!("{duration_s:.6}")];
        row.extend(keys.iter().map(|key| recording.labels.get(*key).cloned().unwrap_or_default()));
        rows.push(row);
    }
    let line = |row: Vec<String>| row.iter().map(|field| quoted(field)).collect::<Vec<_>>().join(",") + "\r\n";
    rows.into_iter().map(line).collect()
}

fn quoted(field: &str) -> String {
    match field.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", field.replace('"', "\"\"")),
        false => field.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_with_a_comma_or_a_quote_is_quoted() {
        assert_eq!(quoted("walk"), "walk");
        assert_eq!(quoted("sit, \"slowly\""), "\"sit, \"\"slowly\"\"\"");
    }
}
