//! The results as Markdown, in the paper's layout with its numbers beside ours. Numbers only: what they mean is for people
//! to write.

use std::fmt::Write;

use super::cells::{GLOBAL, MOVING, PERSON, Table, cells, number, recognised, scores, with_paper};
use super::config::{BaselineName, Protocol};
use super::further;
use super::pairs::Behind;
use super::paper::{self, Paper};
use super::plan::Method;
use super::results::{MethodResults, Results};
use super::variants::Variant;
use crate::metrics::Spread;

/// All tables that the results have rows for.
pub fn tables(results: &Results) -> String {
    let mut text = String::new();
    text += &main_table(results);
    text += &regions(results);
    text += &behind(results);
    text += &further::pairs(results);
    text += &recognition(results);
    text += &behind_measured(results);
    text += &further::few(results);
    text += &further::additional(results);
    let variants = |list: &[Variant]| list.iter().map(|&variant| Method::Variant(variant)).collect::<Vec<_>>();
    text += &ablation(results, "Coupled Gaussian patches (paper, table 3)", "", &variants(&[Variant::Coupled, Variant::Ours]));
    let mut indirect = vec![Method::Baseline(BaselineName::TwoBounce), Method::ReceiverNoise(BaselineName::TwoBounce)];
    let paths = [Variant::WithoutIndirect, Variant::Ours, Variant::PhysicalDirect, Variant::Physical, Variant::Mirrored];
    indirect.extend(variants(&paths));
    text += &ablation(results, "Indirect path (paper, section 4.7)", "", &indirect);
    let noises = [Variant::WithoutNoise, Variant::FixedNoise, Variant::ThermalNoise, Variant::Ours];
    text += &ablation(results, "Noise (paper, table 4)", "", &variants(&noises));
    let scales = variants(&[Variant::LinearLoss, Variant::Likelihood, Variant::Ours]);
    text += &ablation(results, "Linear, likelihood or dB loss (paper, supplement 8, which shows maps alone)", "", &scales);
    text += &ablation(
        results,
        "Graph convolution (paper, table 5)",
        "",
        &variants(&[Variant::GcnAtInference, Variant::WithoutGcn, Variant::Ours]),
    );
    text += &arm_swing(results);
    text += &further::stability(results);
    let parts = results.figures.iter().find(|figure| figure.name == "decomposition");
    text += &further::decomposition(parts.map(|figure| &figure.levels));
    let mut surfaces = variants(&[Variant::Physical, Variant::DenseSurface, Variant::Ours]);
    surfaces.extend([BaselineName::MmgpeSurface, BaselineName::Mmgpe].map(Method::ReceiverNoise));
    text += &ablation(results, "Surface: vertices or all of it", "", &surfaces);
    let found = match &results.effects {
        Some(effects) if effects.is_empty() => "`diagnose` found nothing that was left out.".into(),
        Some(effects) => format!("Found in one training recording: {}.", effects.join(", ")),
        None => String::new(),
    };
    text +=
        &ablation(results, "With the effects that `diagnose` found", &found, &variants(&[Variant::WithEffects, Variant::Ours]));
    text += &further::second_scene(results);
    text += &second_room(results);
    text += &speed(results);
    text
}

fn of(results: &Results, method: Method) -> Option<&MethodResults> {
    results.methods.iter().find(|found| found.method == method)
}

/// Baselines, ours, and the ceiling.
fn compared(results: &Results) -> impl Iterator<Item = &MethodResults> {
    results.methods.iter().filter(|found| {
        use Method::{Again, Baseline, OtherMesh, ReceiverNoise};
        matches!(found.method, Baseline(_) | ReceiverNoise(_) | Method::Variant(Variant::Ours) | Again | OtherMesh)
    })
}

const UNITS: &str = "PSNR in dB; mean ± half the 95 % interval over recordings (paper)";

fn main_table(results: &Results) -> String {
    let columns = ["method", "PSNR, unseen frames", "SSIM", "LPIPS", "PSNR, unseen human", "SSIM", "LPIPS"];
    let mut table = Table::new("Range-Doppler maps (paper, table 1)", UNITS, &columns);
    for found in compared(results) {
        let intra = scores(found.intra.as_ref(), GLOBAL, paper::intra(found.method));
        let cross = scores(found.cross.as_ref(), GLOBAL, paper::cross(found.method));
        table.row(&cells(found.method.title(), intra.into_iter().chain(cross)));
    }
    table.end()
}

/// Where the person is, which the paper does not report.
fn regions(results: &Results) -> String {
    let columns = ["method", "PSNR, unseen frames", "SSIM", "LPIPS", "PSNR, unseen human", "SSIM", "LPIPS"];
    let mut text = String::new();
    for (title, region) in [("The same, static removed", MOVING), ("The same, on the person's cells", PERSON)] {
        let mut table = Table::new(title, "", &columns);
        for found in compared(results) {
            let intra = scores(found.intra.as_ref(), region, Paper::default());
            let cross = scores(found.cross.as_ref(), region, Paper::default());
            table.row(&cells(found.method.title(), intra.into_iter().chain(cross)));
        }
        text += &table.end();
    }
    text
}

/// Recordings differ more than methods do: paired, less of that is in the way.
fn behind(results: &Results) -> String {
    let note = "PSNR of HybridSim less that of the method, recording by recording of the unseen human, dB; mean ± half the 95 % \
                interval over recordings. An interval that holds zero decides nothing.";
    let columns = ["method", "all cells", "static removed", "person's cells"];
    let mut table = Table::new("HybridSim's lead, paired", note, &columns);
    let others = results.methods.iter().filter(|found| found.method != Method::Variant(Variant::Ours));
    let leads: Vec<(Method, Behind)> = others.filter_map(|found| Some((found.method, found.behind?))).collect();
    if leads.is_empty() {
        return String::new();
    }
    for (method, lead) in leads {
        table.row(&cells(method.title(), [lead.global, lead.moving, lead.person].map(|lead| number(lead, 2, None))));
    }
    table.end()
}

fn recognition(results: &Results) -> String {
    let columns = ["learned from", "accuracy, %", "macro F1", "accuracy, %", "macro F1"];
    let note = "Tested on measured recordings of the unseen subject (paper). Accuracy is that of windows, its 95 % interval the \
                exact one of whole recordings judged by their windows' mean; that of F1 is over recordings drawn again. First two \
                columns: the classifier learned from simulations of the unseen subject's own motions, as in the paper; last two: of \
                the other subjects' motions.";
    if results.methods.iter().all(|found| found.recognition.is_empty()) {
        return String::new();
    }
    let mut table = Table::new("Recognition (paper, table 2)", note, &columns);
    for found in compared(results) {
        let same = recognised(found.recognition.get(&Protocol::SameMotions), paper::cross(found.method));
        let others = recognised(found.recognition.get(&Protocol::OtherSubjects), Paper::default());
        table.row(&cells(found.method.title(), same.into_iter().chain(others)));
    }
    table.end()
}

/// What learning from simulations costs.
fn behind_measured(results: &Results) -> String {
    let note = "Whole recordings of the unseen subject that are judged rightly after learning from measured recordings, less those after \
                learning from the method's simulations of the same motions, recording by recording, points of a hundred; mean ± half \
                the 95 % interval over recordings.";
    let found: Vec<&MethodResults> = results.methods.iter().filter(|found| !found.behind_measured.is_empty()).collect();
    if found.is_empty() {
        return String::new();
    }
    let mut table =
        Table::new("Recognition behind measured recordings, paired", note, &["learned from", "own motions", "others' motions"]);
    for found in found {
        let points = Protocol::ALL.map(|protocol| {
            let share = found.behind_measured.get(&protocol);
            let hundred = |share: &Spread| Spread {
                mean: 100.0 * share.mean,
                deviation: 100.0 * share.deviation,
                interval: share.interval.map(|half| 100.0 * half),
                ..*share
            };
            number(share.map(hundred), 1, None)
        });
        table.row(&cells(found.method.title(), points));
    }
    table.end()
}

/// Scores and recognition of a few methods on the unseen subject.
fn ablation(results: &Results, title: &str, note: &str, methods: &[Method]) -> String {
    let found: Vec<&MethodResults> = methods.iter().filter_map(|&method| of(results, method)).collect();
    if found.len() < 2 {
        return String::new();
    }
    let columns = [
        "unseen human",
        "PSNR",
        "SSIM",
        "LPIPS",
        "PSNR, static removed",
        "PSNR, person's cells",
        "accuracy, %",
        "macro F1",
        "accuracy, other subjects, %",
        "s a frame",
    ];
    let mut table = Table::new(title, note, &columns);
    for found in found {
        let paper = paper::cross(found.method);
        let cross = found.cross.as_ref();
        let [moving, _, _] = scores(cross, MOVING, Paper::default());
        let [person, _, _] = scores(cross, PERSON, Paper::default());
        let [others, _] = recognised(found.recognition.get(&Protocol::OtherSubjects), Paper::default());
        let seconds =
            found.speed.map_or("–".into(), |speed| format!("{:.3}", (speed.geometry_s + speed.signal_s) / speed.frames as f64));
        let seconds = with_paper(seconds, paper.seconds_per_frame.map(String::from));
        let row = scores(cross, GLOBAL, paper)
            .into_iter()
            .chain([moving, person])
            .chain(recognised(found.recognition.get(&Protocol::SameMotions), paper))
            .chain([others, seconds]);
        table.row(&cells(found.method.title(), row));
    }
    table.end()
}

fn arm_swing(results: &Results) -> String {
    let methods = [Variant::GcnAtInference, Variant::Ours].map(Method::Variant);
    let found: Vec<&MethodResults> = methods.iter().filter_map(|&method| of(results, method)).collect();
    if found.len() < 2 || found.iter().all(|found| found.arm_swing.is_none()) {
        return String::new();
    }
    let title = "Graph convolution on walking with arm swing, static removed (paper, table 6)";
    let mut table = Table::new(title, "", &["unseen human", "PSNR", "SSIM", "LPIPS"]);
    for found in found {
        table.row(&cells(found.method.title(), scores(found.arm_swing.as_ref(), MOVING, paper::arm_swing(found.method))));
    }
    table.end()
}

fn second_room(results: &Results) -> String {
    let of_room = |found: &&MethodResults| matches!(found.method, Method::Adapted(_) | Method::FromScratch(_));
    if !results.methods.iter().any(|found| of_room(&found)) {
        return String::new();
    }
    let note = "Held-out frames of the training subject in another room, the same actions as in the first; every training takes the same \
                number of steps. `adaptation.png` is this table as curves.";
    let columns = ["", "PSNR", "SSIM", "LPIPS", "PSNR, static removed", "PSNR, person's cells"];
    let mut table = Table::new("Second room, the same actions", note, &columns);
    for found in results.methods.iter().filter(of_room) {
        let [moving, _, _] = scores(found.intra.as_ref(), MOVING, Paper::default());
        let [person, _, _] = scores(found.intra.as_ref(), PERSON, Paper::default());
        let row = scores(found.intra.as_ref(), GLOBAL, Paper::default()).into_iter().chain([moving, person]);
        table.row(&cells(found.method.title(), row));
    }
    table.end()
}

fn speed(results: &Results) -> String {
    let note = "Wall clock. Poses and visibility are worked out once for every geometry; every simulator that shares it is charged \
                what it took. A baseline's are in the next column.";
    let columns = ["method", "training, s", "poses and visibility, s a frame", "paths, sum and noise, s a frame", "command"];
    let mut table = Table::new("Times and commands", note, &columns);
    for found in &results.methods {
        let a_frame = |seconds: f64, frames: usize| format!("{:.4}", seconds / frames as f64);
        let (geometry, signal) = found.speed.map_or(("–".into(), "–".into()), |speed| {
            (a_frame(speed.geometry_s, speed.frames), a_frame(speed.signal_s, speed.frames))
        });
        let training = found
            .training
            .as_ref()
            .map_or("–".into(), |training| format!("{}{:.0}", if training.resumed { "over " } else { "" }, training.seconds));
        let command = match (&found.training, found.method) {
            (_, Method::Baseline(name)) => format!("`{}`", baseline_command(name)),
            (_, Method::ReceiverNoise(name)) => format!("`{} --receiver-noise TRAINING…`", baseline_command(name)),
            (Some(training), Method::Variant(Variant::GcnAtInference)) => {
                format!("`hybridsim train OUT/{}/config.toml`, then graph.at_inference = true", training.folder)
            }
            (Some(training), _) => format!("`hybridsim train OUT/{}/config.toml`", training.folder),
            (None, _) => "–".into(),
        };
        table.row(&[found.method.title(), training, geometry, signal, command]);
    }
    let mut text = table.end();
    text += "| stages | s |\n|---|---|\n";
    for (kind, seconds) in &results.seconds {
        writeln!(text, "| {kind} | {seconds:.0} |").expect("text grows");
    }
    let all: f64 = results.seconds.values().sum();
    writeln!(text, "| all | {all:.0} |").expect("text grows");
    text
}

fn baseline_command(name: BaselineName) -> String {
    let level = if name == BaselineName::TwoBounce { "--checkpoint CHECKPOINT" } else { "--calibrate TRAINING…" };
    format!("hybridsim baseline {} RECORDING {level}", name.id())
}

#[cfg(test)]
#[path = "tables_tests.rs"]
mod tests;
