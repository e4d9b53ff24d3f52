//! From folders to scores.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Instant;

use burn::tensor::Device;
use serde::Serialize;

use super::config::RecognitionConfig;
use super::maps::{Sequence, sequence, windows};
use super::scores::{Accuracy, ClassScores, Judgement, MacroF1, accuracy_of, class_scores, confusion, scores};
use super::training::{judge, train};
use crate::data::{Recording, entries};
use crate::diagnosis::statistics::binomial_interval;
use crate::error::{Error, Result};
use crate::radar::Radar;

/// What was learned from, or tested on.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Material {
    pub sequences: usize,
    pub windows: usize,
    pub subjects: Vec<String>,
}

/// What was judged of one test sequence by the mean probability of its windows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Answer {
    pub recording: String,
    pub action: String,
    pub judged: String,
    pub probability: f64,
}

/// The result of one training and one test.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Recognition {
    /// The classes, in the order of all lists.
    pub actions: Vec<String>,
    pub training: Material,
    pub test: Material,
    /// Mean cross-entropy of the last epoch, nats, augmentation included.
    pub training_loss: f64,
    /// Share of the training windows that are judged rightly.
    pub training_accuracy: f64,
    /// Differs between equal runs: not among the results.
    #[serde(skip)]
    pub training_s: f64,
    pub accuracy: Accuracy,
    pub macro_f1: MacroF1,
    /// Whole sequences judged by the mean of their windows: share and exact interval.
    pub sequence_accuracy: f64,
    pub sequence_interval: [f64; 2],
    pub classes: Vec<ClassScores>,
    /// Windows, `[action][judged]`.
    pub confusion: Vec<Vec<usize>>,
    pub answers: Vec<Answer>,
    /// What a reader must know.
    pub notes: Vec<String>,
}

/// How far a run is: what, how many of how many are done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    Reading { done: usize, of: usize },
    Training { done: usize, of: usize, loss: f64 },
}

/// Trains on the recordings of `train` and tests on those of `test`: recording folders, or folders of recording folders.
/// The class is the label `action`.
///
/// # Errors
/// A folder without recordings, a recording without the label or with another radar than the first, a test action that was
/// never trained, fewer than two actions, a recording that is in both.
pub fn run(
    config: &RecognitionConfig,
    train_folders: &[PathBuf],
    test_folders: &[PathBuf],
    device: &Device,
    progress: &mut dyn FnMut(Stage),
) -> Result<Recognition> {
    config.check()?;
    let (training, test) = (open_all(train_folders)?, open_all(test_folders)?);
    let actions = check(&training, &test)?;
    let of = training.len() + test.len();
    let mut done = 0;
    let mut read = |recordings: &[Labelled]| -> Result<Vec<Sequence>> {
        let maps = recordings.iter().map(|labelled| {
            let class = actions.iter().position(|action| *action == labelled.action).expect("checked before");
            let maps = sequence(&labelled.recording, class, config)?;
            done += 1;
            progress(Stage::Reading { done, of });
            Ok(maps)
        });
        maps.collect()
    };
    let (training_maps, test_maps) = (read(&training)?, read(&test)?);
    let begun = Instant::now();
    let mut training_loss = 0.0;
    let network = train(&training_maps, actions.len(), config, device, &mut |done, loss| {
        training_loss = loss;
        progress(Stage::Training { done, of: config.epochs, loss });
    })?;
    let training_s = begun.elapsed().as_secs_f64();
    let (known, _) = judgements(&judge(&network, &training_maps, config, device), &training_maps, config);
    let (found, means) = judgements(&judge(&network, &test_maps, config, device), &test_maps, config);
    let counts = confusion(&found, actions.len());
    let (accuracy, macro_f1) = scores(&found, actions.len(), config.confidence, config.resamplings, config.seed);
    let answers: Vec<Answer> = test.iter().zip(&means).map(|(labelled, mean)| labelled.answer(mean, &actions)).collect();
    let right = answers.iter().filter(|answer| answer.action == answer.judged).count();
    Ok(Recognition {
        notes: notes(&training, &test, &actions),
        training: material(&training, &training_maps, config),
        test: material(&test, &test_maps, config),
        training_loss,
        training_accuracy: accuracy_of(&confusion(&known, actions.len())),
        training_s,
        accuracy,
        macro_f1,
        sequence_accuracy: right as f64 / answers.len() as f64,
        sequence_interval: binomial_interval(right, answers.len(), config.confidence),
        classes: class_scores(&counts, &actions),
        confusion: counts,
        answers,
        actions,
    })
}

/// A recording with what it says about itself.
struct Labelled {
    recording: Recording,
    action: String,
    subject: Option<String>,
}

impl Labelled {
    fn answer(&self, probabilities: &[f64], actions: &[String]) -> Answer {
        let judged = best(probabilities);
        Answer {
            recording: self.recording.folder.display().to_string(),
            action: self.action.clone(),
            judged: actions[judged].clone(),
            probability: probabilities[judged],
        }
    }
}

/// Recordings of the folders, in the order given and by name within a folder.
fn open_all(folders: &[PathBuf]) -> Result<Vec<Labelled>> {
    let mut all = Vec::new();
    for folder in folders {
        for folder in recordings_in(folder)? {
            let recording = Recording::open(&folder)?;
            let Some(action) = recording.labels.get("action").cloned() else {
                let file = folder.join("recording.toml");
                return Err(Error::field(file, "labels.action", "missing", "what the person does")
                    .with_hint("add [labels] with action = \"…\""));
            };
            let subject = recording.labels.get("subject").cloned();
            all.push(Labelled { recording, action, subject });
        }
    }
    Ok(all)
}

/// The folder itself, or the recording folders in it.
fn recordings_in(folder: &Path) -> Result<Vec<PathBuf>> {
    if entries::is_recording(folder) {
        return Ok(vec![folder.into()]);
    }
    let found = entries::recordings_in(folder)?;
    if found.is_empty() {
        return Err(Error::Usage {
            message: format!("{}: neither a recording nor a folder of recordings", folder.display()),
            hint: Some("a site keeps its recordings in its folder `recordings`".into()),
        });
    }
    Ok(found)
}

/// The trained actions, sorted, once everything fits together.
fn check(training: &[Labelled], test: &[Labelled]) -> Result<Vec<String>> {
    for (name, list) in [("--train", training), ("--test", test)] {
        if list.is_empty() {
            return Err(Error::Usage { message: format!("{name}: no recordings"), hint: None });
        }
    }
    let actions: BTreeSet<&String> = training.iter().map(|labelled| &labelled.action).collect();
    if actions.len() < 2 {
        return Err(Error::setting("--train", format!("recordings of {} action", actions.len()), "at least two actions"));
    }
    let names: Vec<&str> = actions.iter().map(|action| action.as_str()).collect();
    let first = &training[0].recording;
    for labelled in training.iter().chain(test) {
        let file = labelled.recording.folder.join("recording.toml");
        if !actions.contains(&labelled.action) {
            let expected = format!("an action that was trained: {}", names.join(", "));
            return Err(Error::field(file, "labels.action", &labelled.action, expected));
        }
        if comparable(&labelled.recording.radar) != comparable(&first.radar) {
            let expected = format!("the radar of {}", first.folder.display());
            return Err(Error::field(file, "radar", "another one", expected)
                .with_hint("maps of different radars have different axes; only `frames` and `full_scale_codes` may differ"));
        }
    }
    let place = |labelled: &Labelled| labelled.recording.folder.canonicalize().unwrap_or(labelled.recording.folder.clone());
    let trained: BTreeSet<PathBuf> = training.iter().map(place).collect();
    if let Some(both) = test.iter().find(|labelled| trained.contains(&place(labelled))) {
        let message = format!("{}: is trained on and tested", both.recording.folder.display());
        return Err(Error::Usage { message, hint: Some("give --train and --test different recordings".into()) });
    }
    Ok(actions.into_iter().cloned().collect())
}

/// What decides about the axes of the maps.
fn comparable(radar: &Radar) -> Radar {
    Radar { frames: 1, full_scale_codes: None, ..radar.clone() }
}

fn subjects(list: &[Labelled]) -> BTreeSet<&str> {
    list.iter().filter_map(|labelled| labelled.subject.as_deref()).collect()
}

fn notes(training: &[Labelled], test: &[Labelled], actions: &[String]) -> Vec<String> {
    let mut notes = Vec::new();
    let both: Vec<&str> = subjects(training).intersection(&subjects(test)).copied().collect();
    if !both.is_empty() {
        notes.push(format!("not cross-subject: {} trained on and tested", both.join(", ")));
    }
    if training.iter().chain(test).any(|labelled| labelled.subject.is_none()) {
        notes.push("some recordings do not say who is in them (labels.subject)".into());
    }
    let tested: BTreeSet<&String> = test.iter().map(|labelled| &labelled.action).collect();
    let untested: Vec<&str> = actions.iter().filter(|action| !tested.contains(action)).map(String::as_str).collect();
    if !untested.is_empty() {
        notes.push(format!("never tested: {}", untested.join(", ")));
    }
    let mut counts: BTreeMap<&String, usize> = BTreeMap::new();
    training.iter().for_each(|labelled| *counts.entry(&labelled.action).or_default() += 1);
    if counts.values().min() != counts.values().max() {
        notes.push("some actions have more training recordings than others".into());
    }
    notes
}

fn material(list: &[Labelled], maps: &[Sequence], config: &RecognitionConfig) -> Material {
    Material {
        sequences: list.len(),
        windows: windows(maps, config).len(),
        subjects: subjects(list).into_iter().map(String::from).collect(),
    }
}

fn best(probabilities: &[f64]) -> usize {
    (0..probabilities.len()).max_by(|a, b| probabilities[*a].total_cmp(&probabilities[*b])).unwrap_or(0)
}

/// Every window's judgement, and the mean probabilities of every sequence.
fn judgements(probabilities: &[Vec<f64>], sequences: &[Sequence], config: &RecognitionConfig) -> (Vec<Judgement>, Vec<Vec<f64>>) {
    let all = windows(sequences, config);
    let mut means: Vec<Vec<f64>> = vec![vec![0.0; probabilities[0].len()]; sequences.len()];
    let mut counts = vec![0.0; sequences.len()];
    for (window, row) in all.iter().zip(probabilities) {
        means[window.sequence].iter_mut().zip(row).for_each(|(sum, value)| *sum += value);
        counts[window.sequence] += 1.0;
    }
    means.iter_mut().zip(counts).for_each(|(mean, count)| mean.iter_mut().for_each(|value| *value /= count));
    let judged = all.iter().zip(probabilities).map(|(window, row)| Judgement {
        sequence: window.sequence,
        class: sequences[window.sequence].class,
        judged: best(row),
    });
    (judged.collect(), means)
}

#[cfg(test)]
mod tests;
