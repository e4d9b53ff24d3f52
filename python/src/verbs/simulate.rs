//! Simulating a motion at a trained site.

use std::path::PathBuf;

use hybridsim::{
    Error,
    cli::device,
    data::atomic::AtomicFolder,
    import::UpAxis,
    person::actions::Action,
    radar::Sampling,
    simulator::Part,
    verbs::simulate::{Ready, Simulate, What, Without},
};
use num_complex::Complex32;
use pyo3::prelude::*;

use crate::{buffer::Numbers, errors::raised, verbs::read::radar_json, work::run};

/// Simulates; into `out` if it is given, else the samples `[frame, tx, rx, loop, sample]` are returned. With them the radar, as
/// JSON.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn simulate(
    py: Python<'_>,
    checkpoint: PathBuf,
    motion: Option<PathBuf>,
    motion_config: Option<PathBuf>,
    up: Option<String>,
    action: Option<String>,
    recording: Option<PathBuf>,
    body: Option<PathBuf>,
    distance_m: Option<f64>,
    raise_m: Option<f64>,
    turn_deg: Option<f64>,
    frames: Option<usize>,
    clean: bool,
    only: Option<String>,
    without_effects: bool,
    without: Vec<String>,
    out: Option<PathBuf>,
    device_name: String,
    as_stated: bool,
    notify: &Bound<'_, PyAny>,
) -> PyResult<(String, Option<Numbers>)> {
    let asked = || -> hybridsim::Result<Simulate> {
        let what = what(motion, motion_config, up, action, recording)?;
        let only = only.map(|name| named("only", &name, Part::ALL, |part: &Part| part.name())).transpose()?;
        let without = Without { all: without_effects, ids: without };
        Ok(Simulate { checkpoint, what, body, distance_m, raise_m, turn_deg, frames, clean, only, without })
    };
    let asked = asked().map_err(|error| raised(py, &error))?;
    run(py, notify, move |notify| {
        let device = device(&device_name)?;
        // What cannot be written is said before anything is worked out.
        let folder = out.map(AtomicFolder::create).transpose()?;
        let ready = Ready::new(&asked, &device, as_stated, notify)?;
        let radar = radar_json(&ready.radar).to_string();
        match folder {
            Some(folder) => {
                ready.write(folder.path(), notify)?;
                folder.finish()?;
                Ok((radar, None))
            }
            None => {
                let samples: Vec<Complex32> = ready.samples(notify)?;
                let numbers = match ready.radar.sampling {
                    Sampling::Complex => samples.into(),
                    Sampling::Real => samples.iter().map(|sample| sample.re).collect::<Vec<f32>>().into(),
                };
                Ok((radar, Some(numbers)))
            }
        }
    })
}

/// The one of motion, action and recording that is given.
fn what(
    motion: Option<PathBuf>,
    motion_config: Option<PathBuf>,
    up: Option<String>,
    action: Option<String>,
    recording: Option<PathBuf>,
) -> hybridsim::Result<What> {
    if motion.is_none() && (up.is_some() || motion_config.is_some()) {
        return Err(Error::Usage {
            message: "up, motion_config: no motion's file is read".into(),
            hint: Some("name it with motion, or leave them out".into()),
        });
    }
    match (motion, action, recording) {
        (Some(path), None, None) => {
            let up = up.map(|name| named("up", &name, UpAxis::ALL, |axis: &UpAxis| axis.name())).transpose()?;
            Ok(What::Motion { path, config: motion_config, up })
        }
        (None, Some(name), None) => Ok(What::Action(named("action", &name, Action::every(), |action: &Action| action.name())?)),
        (None, None, Some(recording)) => Ok(What::Recording(recording)),
        _ => Err(Error::Usage {
            message: "what is to be simulated: expected one of motion, action and recording".into(),
            hint: None,
        }),
    }
}

/// The one of this name, or which there are.
fn named<T>(key: &str, name: &str, all: impl IntoIterator<Item = T>, of: impl Fn(&T) -> &'static str) -> hybridsim::Result<T> {
    let mut known = vec![];
    for one in all {
        if of(&one) == name {
            return Ok(one);
        }
        known.push(of(&one));
    }
    Err(Error::setting(key, format!("`{name}`"), format!("one of {}", known.join(", "))))
}
