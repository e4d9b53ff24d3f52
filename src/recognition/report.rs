//! The result for people, for programs, and as a picture.

use std::fmt::Write;

use super::config::RecognitionConfig;
use super::run::{Material, Recognition};
use crate::data::atomic::{AtomicFolder, write_text};
use crate::error::Result;
use crate::pictures;
use crate::text::shown;

/// The result as text (Markdown).
pub fn text(result: &Recognition) -> String {
    let mut text = String::new();
    let percent = |value: f64| format!("{:.1} %", 100.0 * value);
    let between = |[low, high]: [f64; 2]| format!("[{:.1}, {:.1}]", 100.0 * low, 100.0 * high);
    let of = |material: &Material| {
        format!("{} windows of {} sequences ({})", material.windows, material.sequences, material.subjects.join(", "))
    };
    let accuracy = &result.accuracy;
    let lines = [
        format!("trained on {}", of(&result.training)),
        format!("tested on {}", of(&result.test)),
        format!(
            "accuracy   {}  over sequences {}, as if windows were independent {}",
            percent(accuracy.value),
            between(accuracy.interval_sequences),
            between(accuracy.interval_windows)
        ),
        format!("macro-F1   {}  over sequences {}", percent(result.macro_f1.value), between(result.macro_f1.interval_sequences)),
        format!("sequences  {}  exact {}", percent(result.sequence_accuracy), between(result.sequence_interval)),
        format!("training windows {}; chance {}", percent(result.training_accuracy), percent(1.0 / result.actions.len() as f64)),
    ];
    lines.iter().for_each(|line| _ = writeln!(text, "{line}  "));
    text += "\n| action | windows | precision | recall | F1 |\n|---|---|---|---|---|\n";
    let share = |value: Option<f64>| value.map_or("–".into(), |value| format!("{value:.2}"));
    for class in &result.classes {
        let (precision, recall, f1) = (share(class.precision), share(class.recall), share(class.f1));
        _ = writeln!(text, "| {} | {} | {precision} | {recall} | {f1} |", class.action, class.windows);
    }
    result.notes.iter().for_each(|note| _ = write!(text, "\nnote: {note}\n"));
    text
}

/// Writes `config.toml` (resolved), `recognition.json`, `recognition.md`, `confusion.png` and `run.json` (what differs
/// between equal runs: the time) into a new folder.
pub fn write(result: &Recognition, config: &RecognitionConfig, folder: AtomicFolder) -> Result<()> {
    let within = |name: &str| folder.path().join(name);
    write_text(within("config.toml"), &config.to_toml())?;
    write_text(within("recognition.json"), &serde_json::to_string_pretty(result).expect("plain data"))?;
    write_text(within("recognition.md"), &shown(&text(result)))?;
    let run = serde_json::json!({ "version": env!("CARGO_PKG_VERSION"), "training_s": result.training_s });
    write_text(within("run.json"), &format!("{run:#}\n"))?;
    pictures::confusion(&within("confusion.png"), "recognised actions", &result.actions, &result.confusion)?;
    folder.finish()
}
