//! What a verb says, on its way from the thread that works to the one that asked.

use hybridsim::{experiments::Event as Stage, training::Event, verbs::Notice};
use pyo3::{prelude::*, types::PyTuple};
use serde_json::json;

/// The same without borrows.
pub enum Message {
    Note(String),
    Begun {
        what: String,
        steps: usize,
    },
    Done(usize),
    Line(String),
    /// JSON.
    Epoch(String),
}

impl Message {
    /// What Python gets of it; `None`: nothing.
    pub fn of(notice: &Notice<'_>) -> Vec<Self> {
        match notice {
            Notice::Note(text) => vec![Self::Note((*text).into())],
            Notice::Begun { what, steps } => vec![Self::Begun { what: (*what).into(), steps: *steps }],
            Notice::Done(steps) => vec![Self::Done(*steps)],
            Notice::Line(text) | Notice::At(text) => vec![Self::Line((*text).into())],
            Notice::Run { .. } | Notice::Still => vec![],
            Notice::Stage(event) => of_stage(event),
            Notice::Training(event) => of_training(event),
        }
    }

    /// `notify(kind, text, number)`
    pub fn call(self, py: Python<'_>, notify: &Bound<'_, PyAny>) -> PyResult<()> {
        let (kind, text, number) = match self {
            Self::Note(text) => ("note", text, 0),
            Self::Begun { what, steps } => ("begun", what, steps),
            Self::Done(steps) => ("done", String::new(), steps),
            Self::Line(text) => ("line", text, 0),
            Self::Epoch(text) => ("epoch", text, 0),
        };
        notify.call1(PyTuple::new(
            py,
            [kind.into_pyobject(py)?.into_any(), text.into_pyobject(py)?.into_any(), number.into_pyobject(py)?.into_any()],
        )?)?;
        Ok(())
    }
}

fn of_stage(event: &Stage<'_>) -> Vec<Message> {
    match event {
        Stage::Stage { index, of, name, .. } => {
            let begun = (*index == 0).then(|| Message::Begun { what: "stages".into(), steps: *of });
            begun.into_iter().chain([Message::Line((*name).into()), Message::Done(*index)]).collect()
        }
        Stage::Step { .. } => vec![],
        Stage::Done { name, seconds } => vec![Message::Line(format!("{seconds:.1} s  {name}"))],
    }
}

fn of_training(event: &Event) -> Vec<Message> {
    match event {
        Event::Refined(pose) => vec![Message::Line(pose.line())],
        Event::Started { steps, first_step, training_frames, validation_frames, .. } => vec![
            Message::Begun { what: "training".into(), steps: *steps },
            Message::Line(format!("{training_frames} frames to train on, {validation_frames} held out")),
            Message::Done(*first_step),
        ],
        Event::Step { step, .. } => vec![Message::Done(*step)],
        Event::Epoch(metrics) => vec![Message::Epoch(json!(metrics).to_string())],
        Event::Saved(_) => vec![],
        Event::StoppedEarly { epoch, best_epoch } => {
            vec![Message::Line(format!("stopped after epoch {}: none was better since epoch {}", epoch + 1, best_epoch + 1))]
        }
    }
}
