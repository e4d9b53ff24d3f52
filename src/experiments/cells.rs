//! Tables in Markdown, and what stands in their cells.

use std::fmt::Write;

use super::paper::Paper;
use super::results::{Recognised, Share};
use crate::evaluation::{ScoreSummary, SequenceSummary};
use crate::metrics::Spread;

/// A table that grows row by row.
pub(super) struct Table {
    text: String,
}

impl Table {
    pub(super) fn new(title: &str, note: &str, columns: &[&str]) -> Self {
        let mut text = format!("### {title}\n\n");
        if !note.is_empty() {
            text += &format!("{note}\n\n");
        }
        text += &format!("| {} |\n|{}\n", columns.join(" | "), "---|".repeat(columns.len()));
        Self { text }
    }

    pub(super) fn row(&mut self, cells: &[String]) {
        writeln!(self.text, "| {} |", cells.join(" | ")).expect("text grows");
    }

    pub(super) fn end(self) -> String {
        self.text + "\n"
    }
}

/// A number with its interval, and the paper's in brackets.
pub(super) fn number(found: Option<Spread>, places: usize, paper: Option<f64>) -> String {
    let ours = match found {
        None => "–".into(),
        Some(Spread { mean, interval: Some(interval), .. }) => format!("{mean:.places$} ± {interval:.places$}"),
        Some(Spread { mean, .. }) => format!("{mean:.places$}"),
    };
    with_paper(ours, paper.map(|value| format!("{value:.places$}")))
}

pub(super) fn with_paper(ours: String, paper: Option<String>) -> String {
    match paper {
        Some(paper) => format!("{ours} ({paper})"),
        None => ours,
    }
}

pub(super) type Region = fn(&SequenceSummary) -> Option<&ScoreSummary>;

pub(super) const GLOBAL: Region = |summary| summary.global.as_ref();
pub(super) const MOVING: Region = |summary| summary.moving.as_ref();
pub(super) const PERSON: Region = |summary| summary.person.as_ref();

/// PSNR, SSIM and LPIPS of a region.
pub(super) fn scores(summary: Option<&SequenceSummary>, region: Region, paper: Paper) -> [String; 3] {
    let found = summary.and_then(region);
    let lpips = match (found, found.and_then(|found| found.lpips)) {
        (Some(_), None) => with_paper("not available".into(), paper.lpips.map(|value| format!("{value:.3}"))),
        (_, lpips) => number(lpips, 3, paper.lpips),
    };
    [number(found.map(|found| found.psnr_db), 2, paper.psnr_db), number(found.map(|found| found.ssim), 3, paper.ssim), lpips]
}

/// Accuracy in per cent, and macro F1.
pub(super) fn recognised(found: Option<&Recognised>, paper: Paper) -> [String; 2] {
    let share = |share: Share, interval: [f64; 2], factor: f64, places: usize| {
        let [low, high] = interval.map(|limit| factor * limit);
        format!("{:.places$} [{low:.places$}, {high:.places$}]", factor * share.value)
    };
    let accuracy = found.map_or("–".into(), |found| share(found.accuracy, found.sequence_interval, 100.0, 1));
    let f1 = found.map_or("–".into(), |found| share(found.macro_f1, found.macro_f1.interval_sequences, 1.0, 3));
    [
        with_paper(accuracy, paper.accuracy.map(|value| format!("{value:.1}"))),
        with_paper(f1, paper.f1.map(|value| format!("{value:.3}"))),
    ]
}

pub(super) fn cells(first: String, rest: impl IntoIterator<Item = String>) -> Vec<String> {
    std::iter::once(first).chain(rest).collect()
}
