//! Progress on standard error: a bar on a terminal, a line per epoch elsewhere, or silence.

use std::{io::IsTerminal, time::Duration};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::{experiments::Event as StageEvent, loss::Scale, text::shown, training::Event, verbs::Notice};

/// Shows how far a task is, with the time that remains.
pub struct Progress {
    bar: ProgressBar,
    quiet: bool,
    terminal: bool,
}

impl Progress {
    pub fn new(what: &str, length: usize, quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let target = if quiet || !terminal { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(Some(length as u64), target);
        let style = ProgressStyle::with_template("{prefix} [{bar:30}] {pos}/{len}  {msg}  {elapsed} elapsed, {eta} left")
            .expect("a constant template")
            .progress_chars("=> ");
        bar.set_style(style);
        bar.set_prefix(what.to_string());
        bar.enable_steady_tick(Duration::from_millis(500));
        if !quiet && !terminal {
            remark!("{what}: {length} steps");
        }
        Self { bar, quiet, terminal }
    }

    pub fn set(&self, position: usize) {
        self.bar.set_position(position as u64);
    }

    pub fn message(&self, text: String) {
        self.bar.set_message(shown(&text).into_owned());
    }

    /// A line that stays, above the bar.
    pub fn line(&self, text: &str) {
        if self.quiet {
            return;
        }
        if self.terminal { self.bar.println(shown(text)) } else { remark!("{text}") }
    }

    pub fn finish(self) {
        self.bar.finish_and_clear();
    }
}

/// Shows the events of a training run.
pub struct TrainingProgress {
    progress: Option<Progress>,
    /// Of the loss.
    scale: Scale,
    quiet: bool,
}

impl TrainingProgress {
    pub fn new(quiet: bool) -> Self {
        Self { progress: None, scale: Scale::default(), quiet }
    }

    pub fn show(&mut self, event: &Event) {
        match event {
            Event::Refined(pose) => {
                if !self.quiet {
                    remark!("{}", pose.line());
                }
            }
            Event::Started { steps, first_step, training_frames, validation_frames, scale } => {
                self.scale = *scale;
                let progress = Progress::new("training", *steps, self.quiet);
                progress.line(&format!("{training_frames} frames to train on, {validation_frames} held out"));
                if *first_step > 0 {
                    progress.line(&format!("resuming after step {first_step}"));
                }
                progress.set(*first_step);
                self.progress = Some(progress);
            }
            Event::Step { step, loss, .. } => {
                if let Some(progress) = &self.progress {
                    progress.set(*step);
                    progress.message(format!("loss {}", self.scale.with_unit(*loss)));
                }
            }
            Event::Epoch(metrics) => {
                if let Some(progress) = &self.progress {
                    let held_out = metrics.validation_loss.map(|loss| format!(", held out {}", self.scale.with_unit(loss)));
                    let (trained, held_out) = (self.scale.with_unit(metrics.training_loss), held_out.unwrap_or_default());
                    progress.line(&format!("epoch {}: loss {trained}{held_out}", metrics.epoch + 1));
                }
            }
            Event::Saved(_) => {}
            Event::StoppedEarly { epoch, best_epoch } => {
                if let Some(progress) = &self.progress {
                    progress.line(&format!("stopped after epoch {}: none was better since epoch {}", epoch + 1, best_epoch + 1));
                }
            }
        }
    }

    pub fn finish(self) {
        if let Some(progress) = self.progress {
            progress.finish();
        }
    }
}

/// Notes of a verb on standard error; all else that it says is for [`Shown`].
pub fn notes(notice: Notice<'_>) {
    if let Notice::Note(note) = notice {
        remark!("note: {note}");
    }
}

/// Shows what a verb says.
pub struct Shown {
    progress: Option<Progress>,
    training: TrainingProgress,
    quiet: bool,
}

impl Shown {
    pub fn new(quiet: bool) -> Self {
        Self { progress: None, training: TrainingProgress::new(quiet), quiet }
    }

    pub fn show(&mut self, notice: Notice<'_>) {
        match notice {
            Notice::Note(_) => notes(notice),
            Notice::Begun { what, steps } => self.progress = Some(Progress::new(what, steps, self.quiet)),
            Notice::Done(steps) => self.progress.iter().for_each(|progress| progress.set(steps)),
            Notice::Line(text) => self.progress.iter().for_each(|progress| progress.line(text)),
            Notice::At(text) => self.progress.iter().for_each(|progress| progress.message(text.into())),
            // Whatever was made to train on is made.
            Notice::Run { .. } => self.progress.take().into_iter().for_each(Progress::finish),
            Notice::Training(event) => self.training.show(event),
            // A reproduction shows its own.
            Notice::Stage(_) | Notice::Still => {}
        }
    }

    pub fn finish(self) {
        self.progress.into_iter().for_each(Progress::finish);
        self.training.finish();
    }
}

/// Shows the stages of a reproduction: one bar over all of them and one within the stage.
pub struct StageProgress {
    stages: ProgressBar,
    within: ProgressBar,
    quiet: bool,
    terminal: bool,
    known: usize,
}

impl StageProgress {
    pub fn new(quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let bars = MultiProgress::with_draw_target(if quiet || !terminal {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        });
        let bar = |length: u64, template: &str| {
            let style = ProgressStyle::with_template(template).expect("a constant template").progress_chars("=> ");
            let bar = bars.add(ProgressBar::new(length).with_style(style));
            bar.enable_steady_tick(Duration::from_millis(500));
            bar
        };
        Self {
            stages: bar(0, "stages [{bar:30}] {pos}/{len}  {elapsed} elapsed, {eta} left"),
            within: bar(0, "       [{bar:30}] {pos}/{len}  {msg}"),
            quiet,
            terminal,
            known: 0,
        }
    }

    pub fn show(&mut self, event: &StageEvent) {
        match event {
            StageEvent::Stage { index, of, name, known } => {
                if *index == 0 && !self.quiet && !self.terminal {
                    remark!("reproducing: {of} stages");
                }
                self.stages.set_length(*of as u64);
                self.stages.set_position(*index as u64);
                self.within.set_position(0);
                self.within.set_length(0);
                self.within.set_message(shown(name).into_owned());
                self.known += usize::from(*known);
            }
            StageEvent::Step { done, of } => {
                self.within.set_length(*of as u64);
                self.within.set_position(*done as u64);
            }
            StageEvent::Done { name, seconds } if !self.quiet => {
                let text = format!("{seconds:8.1} s  {name}");
                if self.terminal { self.stages.println(shown(&text)) } else { remark!("{text}") }
            }
            StageEvent::Done { .. } => {}
        }
    }

    pub fn finish(self) {
        self.within.finish_and_clear();
        self.stages.finish_and_clear();
        if !self.quiet && self.known > 0 {
            remark!("{} stages had been done before", self.known);
        }
    }
}
