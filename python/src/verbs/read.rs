//! Reading recordings.

use std::path::PathBuf;

use hybridsim::{
    data::{IfFrame, IfLayout},
    person::Person,
    radar::{Radar, Sampling},
};
use num_complex::Complex32;
use pyo3::{exceptions::PyIndexError, prelude::*};
use serde_json::{Value, json};

use crate::{
    buffer::Numbers,
    errors::{parsed, raised},
};

/// An open recording; its samples stay on the disk until they are asked for.
#[pyclass(frozen)]
pub struct Recording(hybridsim::data::Recording);

/// Opens a recording folder.
#[pyfunction]
pub fn read(py: Python<'_>, path: PathBuf) -> PyResult<Recording> {
    py.detach(|| hybridsim::data::Recording::open(path)).map(Recording).map_err(|error| raised(py, &error))
}

/// A radar as Python has it: its settings, and what follows from them.
pub fn radar_json(radar: &Radar) -> Value {
    json!({
        "settings": radar,
        "derived": {
            "wavelength_m": radar.wavelength_m(),
            "bandwidth_hz": radar.bandwidth_hz(),
            "range_resolution_m": radar.range_resolution_m(),
            "max_range_m": radar.max_range_m(),
            "velocity_resolution_mps": radar.velocity_resolution_mps(),
            "max_velocity_mps": radar.max_velocity_mps(),
            "loop_period_s": radar.loop_period_s(),
        },
    })
}

/// What a radar's settings (JSON) say and what follows from them, as JSON.
#[pyfunction]
pub fn radar(py: Python<'_>, settings: &str) -> PyResult<String> {
    let radar: Radar = parsed(py, settings, "radar")?;
    radar.check("radar").map_err(|error| raised(py, &error))?;
    Ok(radar_json(&radar).to_string())
}

#[pymethods]
impl Recording {
    /// Everything but samples and poses, as JSON.
    fn about(&self) -> String {
        let recording = &self.0;
        let about = json!({
            "folder": recording.folder,
            "radar": radar_json(&recording.radar),
            "room": recording.room,
            "labels": recording.labels,
            "notes": recording.notes,
            "samples_file": recording.folder.join(&recording.files.samples),
            "number_type": recording.number_type(),
            "layout": recording.layout(),
        });
        about.to_string()
    }

    /// `[frame, tx, rx, loop, sample]` of these frames: complex64, or float32 of a receiver without quadrature.
    fn samples(&self, py: Python<'_>, frames: Vec<usize>) -> PyResult<Numbers> {
        let recording = &self.0;
        if let Some(frame) = frames.iter().find(|&&frame| frame >= recording.frames()) {
            return Err(PyIndexError::new_err(format!("frame {frame} of a recording of {} frames", recording.frames())));
        }
        let read = || -> hybridsim::Result<Numbers> {
            let size = frames.len() * recording.radar.dims()[1..].iter().product::<usize>();
            match recording.radar.sampling {
                Sampling::Complex => gathered(recording, &frames, size, |frame, all: &mut Vec<Complex32>| {
                    let im = frame.im.expect("a quadrature receiver");
                    all.extend(frame.re.iter().zip(im).map(|(&re, im)| Complex32::new(re, im)));
                }),
                Sampling::Real => gathered(recording, &frames, size, |frame, all: &mut Vec<f32>| all.extend(frame.re)),
            }
        };
        py.detach(read).map_err(|error| raised(py, &error))
    }

    /// Whether the file holds integer codes.
    fn has_codes(&self) -> bool {
        matches!(self.0.layout(), IfLayout::Codes | IfLayout::RealCodes)
    }

    /// Of the person, as far as one is known: times `[pose]`, and either rotations `[pose, joint, 3]` and translations
    /// `[pose, 3]`, or vertices `[pose, vertex, 3]`, with the number of joints or vertices.
    #[allow(clippy::type_complexity)]
    fn poses(&self) -> Option<(Numbers, Option<Numbers>, Option<Numbers>, Option<Numbers>, usize)> {
        let person = self.0.person()?;
        let times = Numbers::from(person.pose_times_s());
        Some(match person {
            Person::Skinned { motion, .. } => {
                let rotations: Vec<f64> = motion.poses.iter().flatten().flatten().copied().collect();
                let translations: Vec<f64> = motion.translations.iter().flatten().copied().collect();
                let joints = motion.poses.first().map_or(0, Vec::len);
                (times, Some(rotations.into()), Some(translations.into()), None, joints)
            }
            Person::Meshes { vertices, .. } => {
                let positions: Vec<f64> = vertices.iter().flatten().flatten().copied().collect();
                (times, None, None, Some(positions.into()), vertices.first().map_or(0, Vec::len))
            }
        })
    }
}

/// Frames one after the other in one piece of memory.
fn gathered<T>(
    recording: &hybridsim::data::Recording,
    frames: &[usize],
    size: usize,
    add: impl Fn(IfFrame, &mut Vec<T>),
) -> hybridsim::Result<Numbers>
where
    Numbers: From<Vec<T>>,
{
    let mut all = Vec::with_capacity(size);
    for &frame in frames {
        add(recording.frame(frame)?, &mut all);
    }
    Ok(all.into())
}
