//! Scores as text for people and as JSON for programs.

use std::fmt::Write;

use serde_json::json;

use crate::{
    evaluation::{Evaluation, ScoreSummary, SequenceSummary, over_sequences},
    lpips::Network,
    metrics::MOST_PSNR_DB,
    pictures::page::{Markup, html, table as page_table},
};

/// One recording's scores.
pub fn of_frames(found: &Evaluation) -> String {
    let Evaluation { frames, span_db, .. } = found;
    let title = format!("{}, decibels from {span_db:.0} dB below the strongest cell{}", counted(*frames), spread_of(*frames));
    table(&title, [&found.global, &found.moving, &found.person], found.lpips)
}

fn counted(frames: usize) -> String {
    if frames == 1 { "one frame".into() } else { format!("{frames} frames") }
}

/// What follows a ± is, where there is one.
fn spread_of(frames: usize) -> &'static str {
    if frames == 1 { "" } else { ", mean ± standard deviation over frames" }
}

/// The scores of several recordings.
pub fn of_sequences(found: &SequenceSummary) -> String {
    let SequenceSummary { sequences, frames, .. } = found;
    let title = match sequences {
        1 => format!("1 sequence of {frames} frames: too few for an interval"),
        _ => format!("{sequences} sequences, {frames} frames, mean ± half of its 95 % interval over sequences (Student's t)"),
    };
    table(&title, [&found.global, &found.moving, &found.person], found.lpips)
}

/// SSIM's window.
const TOO_SMALL: &str = "fewer than 11 velocities or ranges";

/// The cells that are scored, and why they may have no score.
const REGIONS: [[&str; 2]; 3] = [
    ["all cells", TOO_SMALL],
    ["static removed", TOO_SMALL],
    ["person's cells", "nobody is tracked, or no cell of the person's is 5 cells or more within the map"],
];

/// One recording's scores, for a page.
pub fn page_of_frames(found: &Evaluation) -> Markup {
    let regions = REGIONS.into_iter().zip([&found.global, &found.moving, &found.person]);
    let rows: Vec<Vec<Markup>> = regions
        .map(|([name, missing], scores)| {
            let numbers = match scores {
                Some(ScoreSummary { psnr_db, ssim, mean_absolute_error_db, lpips }) => [
                    format!("{psnr_db:.2}"),
                    format!("{ssim:.3}"),
                    format!("{mean_absolute_error_db:.2}"),
                    lpips.map_or("–".into(), |lpips| format!("{lpips:.3}")),
                ],
                None => [format!("not available: {missing}"), "–".into(), "–".into(), "–".into()],
            };
            std::iter::once(html! { (name) }).chain(numbers.map(|text| html! { (text) })).collect()
        })
        .collect();
    html! {
        p {
            (counted(found.frames)) ", decibels from " (format!("{:.0}", found.span_db))
            " dB below the strongest cell" (spread_of(found.frames)) "."
        }
        (page_table(&["", "PSNR, dB", "SSIM", "mean error, dB", "LPIPS"], &rows))
    }
}

fn table(title: &str, regions: [&Option<ScoreSummary>; 3], network: Option<Network>) -> String {
    let mut text = format!("  {title}\n");
    for ([name, missing], scores) in REGIONS.into_iter().zip(regions) {
        let line = match scores {
            Some(ScoreSummary { psnr_db, ssim, mean_absolute_error_db, lpips }) => {
                let lpips = lpips.map(|lpips| format!("   LPIPS {lpips:.3}")).unwrap_or_default();
                format!("PSNR {psnr_db:.2} dB   SSIM {ssim:.3}   mean error {mean_absolute_error_db:.2} dB{lpips}")
            }
            None => format!("not available: {missing}"),
        };
        writeln!(text, "  {name:<15} {line}").expect("text grows");
    }
    if regions.into_iter().flatten().any(|scores| scores.psnr_db.mean >= MOST_PSNR_DB) {
        writeln!(text, "  PSNR            {MOST_PSNR_DB:.0} dB is the most that is said: there are no errors to speak of")
            .expect("text grows");
    }
    if let Some(network) = network {
        writeln!(text, "  LPIPS           as seen by {}; the person's is of the box around the cells", network.name())
            .expect("text grows");
    }
    text
}

/// All recordings by name, and the means over them.
pub fn json(evaluations: &[(String, Evaluation)]) -> String {
    let recordings: serde_json::Map<String, serde_json::Value> = evaluations
        .iter()
        .map(|(name, evaluation)| (name.clone(), serde_json::to_value(evaluation).expect("plain data")))
        .collect();
    let together = summary(evaluations);
    let found = json!({ "recordings": recordings, "over_sequences": together });
    serde_json::to_string_pretty(&found).expect("plain data")
}

/// Means over the recordings; none without any.
///
/// # Panics
/// As [`over_sequences`].
pub fn summary(evaluations: &[(String, Evaluation)]) -> Option<SequenceSummary> {
    let evaluations: Vec<Evaluation> = evaluations.iter().map(|(_, evaluation)| evaluation.clone()).collect();
    over_sequences(&evaluations)
}
