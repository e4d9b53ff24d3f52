//! Tables of what goes beyond the comparison on the first site: pairs, the additional subject, the second scene, stability,
//! the parts of the signal.

use std::collections::BTreeSet;

use super::cells::{GLOBAL, MOVING, PERSON, Table, cells, number, recognised, scores};
use super::config::Protocol;
use super::few::Material;
use super::figures::Levels;
use super::paper::{self, Paper};
use super::plan::Method;
use super::results::{MethodResults, Results, StabilityResults};
use super::variants::Variant;
use crate::evaluation::SequenceSummary;

/// Differences that are not between the full simulator and another method.
pub fn pairs(results: &Results) -> String {
    if results.pairs.is_empty() {
        return String::new();
    }
    let note = "PSNR of the first less that of the second, recording by recording, dB; mean ± half the 95 % interval over \
                recordings. An interval that holds zero decides nothing.";
    let columns = ["first", "second", "on", "all cells", "static removed", "person's cells"];
    let mut table = Table::new("Other pairs", note, &columns);
    for pair in &results.pairs {
        let difference = [pair.difference.global, pair.difference.moving, pair.difference.person];
        let names = [pair.methods.0.title(), pair.methods.1.title(), pair.on.title().into()];
        table.row(&names.into_iter().chain(difference.map(|found| number(found, 2, None))).collect::<Vec<_>>());
    }
    table.end()
}

/// Accuracy against the number of recordings of each action.
pub fn few(results: &Results) -> String {
    if results.few.is_empty() {
        return String::new();
    }
    let note = "Learned from so many recordings of each action by other subjects, tested on measured recordings of the unseen subject; \
                accuracy of windows, %, its 95 % interval the exact one of whole recordings. Every classifier visits as many windows. \
                `few_measured.png` is this table.";
    let columns: Vec<&str> = std::iter::once("recordings of each action").chain(Material::ALL.map(Material::title)).collect();
    let mut table = Table::new("Few measured recordings", note, &columns);
    let counts: BTreeSet<usize> = results.few.iter().map(|found| found.recordings).collect();
    for count in counts {
        let accuracy = Material::ALL.map(|material| {
            let found = results.few.iter().find(|found| (found.recordings, found.material) == (count, material));
            let [accuracy, _] = recognised(found.map(|found| &found.recognised), Paper::default());
            accuracy
        });
        table.row(&cells(count.to_string(), accuracy));
    }
    table.end() + "![Accuracy](few_measured.png)\n\n"
}

const COLUMNS: [&str; 8] =
    ["", "PSNR", "SSIM", "LPIPS", "PSNR, static removed", "PSNR, person's cells", "accuracy, %", "macro F1"];

fn row(title: String, summary: Option<&SequenceSummary>, recognition: [String; 2], paper: Paper) -> Vec<String> {
    let [moving, _, _] = scores(summary, MOVING, Paper::default());
    let [person, _, _] = scores(summary, PERSON, Paper::default());
    cells(title, scores(summary, GLOBAL, paper).into_iter().chain([moving, person]).chain(recognition))
}

/// One more person whom nobody learned from.
pub fn additional(results: &Results) -> String {
    let found: Vec<&MethodResults> = results.methods.iter().filter(|found| found.additional.is_some()).collect();
    if found.is_empty() {
        return String::new();
    }
    let note = "The full simulator on a second subject whom no simulator learned from; the classifier learned from simulations \
                of this subject's own motions. The embedded subjects have stature and proportions but no sex.";
    let mut table = Table::new("An additional unseen subject (paper, supplement 9)", note, &COLUMNS);
    for found in found {
        let paper = paper::additional(found.method);
        let recognition = recognised(found.additional_recognition.as_ref(), paper);
        table.row(&row(found.method.title(), found.additional.as_ref(), recognition, paper));
    }
    table.end()
}

/// Other actions in another room.
pub fn second_scene(results: &Results) -> String {
    let there = |method: Method| matches!(method, Method::SceneOurs | Method::SceneUnadapted | Method::SceneAgain);
    let found: Vec<&MethodResults> = results.methods.iter().filter(|found| there(found.method)).collect();
    if found.is_empty() {
        return String::new();
    }
    let note = "Smaller actions on the spot in another room: trained on some, scored on all frames of others, which the classifier \
                tells apart. That it learned from simulations of the very motions it is tested on, as in the paper's section 4.5, is our \
                reading; which twelve actions the paper has, it does not say.";
    let mut table = Table::new("Second scene with other actions (paper, section 4.8)", note, &COLUMNS);
    for found in found {
        let paper = paper::second_scene(found.method);
        let recognition = recognised(found.recognition.get(&Protocol::SameMotions), paper);
        table.row(&row(found.method.title(), found.cross.as_ref(), recognition, paper));
    }
    table.end()
}

/// What a long training does with the graph convolution and without it.
pub fn stability(results: &Results) -> String {
    if results.stability.is_empty() {
        return String::new();
    }
    let note = "Long trainings at a constant learning rate, gradients not clipped. A gradient is the largest absolute derivative of a \
                step's loss by any number that learns. The paper's training without GCN breaks, \"typically around epoch 7400\"; it \
                does not say how many steps an epoch has. `stability.csv` and the two pictures have the curves.";
    let columns = [
        "",
        "steps",
        "broke",
        "loss, first and last epoch, dB²",
        "largest loss of a step, dB²",
        "largest gradient, median over epochs",
        "largest gradient",
    ];
    let mut table = Table::new("Stability without graph convolution (paper, supplement 10)", note, &columns);
    for found in &results.stability {
        table.row(&stability_row(found));
    }
    table.end() + "![Largest loss of a step](stability_loss.png)\n\n![Largest gradient](stability_gradient.png)\n\n"
}

fn stability_row(found: &StabilityResults) -> Vec<String> {
    let history = &found.run.history;
    let loss = match (history.first(), history.last()) {
        (Some(first), Some(last)) => format!("{:.1}, {:.1}", first.training_loss, last.training_loss),
        _ => "–".into(),
    };
    let broke = match &found.run.broke {
        Some(broke) => format!("at step {}: {}", broke.step, broke.stage),
        None => "no".into(),
    };
    let sorted = |of: &dyn Fn(&crate::training::EpochMetrics) -> Option<f64>| {
        let mut values: Vec<f64> = history.iter().filter_map(of).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let (losses, gradients) = (sorted(&|epoch| epoch.largest_loss), sorted(&|epoch| epoch.largest_gradient));
    let shown = |value: Option<&f64>| value.map_or("–".into(), |value| format!("{value:.3e}"));
    vec![
        if found.variant == Variant::WithoutGcn { "without GCN".into() } else { "with GCN".into() },
        found.run.steps.to_string(),
        broke,
        loss,
        losses.last().map_or("–".into(), |value| format!("{value:.1}")),
        shown(gradients.get(gradients.len() / 2)),
        shown(gradients.last()),
    ]
}

/// How strong the parts of the signal are.
pub fn decomposition(levels: Option<&Levels>) -> String {
    let Some(levels) = levels else { return String::new() };
    let note = "Power of the middle frame over that of the measured one, dB: all of it, and with the static part removed from both. \
                `decomposition.png` shows the maps.";
    let columns: Vec<&str> = std::iter::once("action").chain(levels.columns.iter().map(String::as_str)).collect();
    let mut table = Table::new("Parts of the signal (paper, supplement 13)", note, &columns);
    for (row, action) in levels.rows.iter().enumerate() {
        let shown = |value: Option<f64>| value.map_or("none".into(), |db| format!("{db:.1}"));
        let pairs = levels.all_db[row].iter().zip(&levels.moving_db[row]);
        table.row(&cells(action.clone(), pairs.map(|(&all, &moving)| format!("{}; {}", shown(all), shown(moving)))));
    }
    table.end() + "![Parts of the signal](decomposition.png)\n\n"
}
