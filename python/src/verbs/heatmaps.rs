//! Heatmaps of samples.

use hybridsim::{
    heatmap::{Axis, HeatmapConfig, Map},
    radar::Radar,
    verbs::heatmaps::Pictures,
};
use num_complex::Complex32;
use pyo3::{buffer::PyBuffer, prelude::*};

use crate::{
    buffer::{Numbers, complex},
    errors::{parsed, raised, usage},
};

/// Name and unit of an axis, and its values.
type Named = (&'static str, &'static str, Numbers);

/// Name, title, rows, columns, and the values `[row, column]`.
type Drawn = (&'static str, &'static str, Named, Named, Numbers);

/// All heatmaps of `pairs`, the samples `[frame, tx, rx, loop, sample]` as pairs of float32. `radar`, `settings`: JSON.
#[pyfunction]
pub fn heatmaps(py: Python<'_>, radar: &str, settings: &str, pairs: PyBuffer<f32>, decibels: bool) -> PyResult<Vec<Drawn>> {
    let radar: Radar = parsed(py, radar, "radar")?;
    let settings: HeatmapConfig = parsed(py, settings, "settings")?;
    let samples: Vec<Complex32> = complex(py, &pairs)?;
    let per_frame: usize = radar.dims()[1..].iter().product();
    if samples.is_empty() || !samples.len().is_multiple_of(per_frame) {
        let message = format!("{} samples, expected whole frames of {per_frame} (tx x rx x loop x sample)", samples.len());
        return Err(usage(py, message, "give the radar that the samples are of"));
    }
    py.detach(|| {
        radar.check("radar")?;
        let pictures = Pictures::new(&radar, &settings);
        let drawn = pictures.maps(&samples).into_iter().map(|heatmap| {
            let map = if decibels { pictures.db(&heatmap.map, &heatmap.map) } else { heatmap.map };
            let Map { rows, columns, values } = map;
            (heatmap.name, heatmap.title, named(rows), named(columns), values.into())
        });
        Ok(drawn.collect())
    })
    .map_err(|error| raised(py, &error))
}

fn named(axis: Axis) -> Named {
    (axis.name, axis.unit, axis.values.into())
}
