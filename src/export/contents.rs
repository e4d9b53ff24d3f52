//! What a file of IF samples holds, whatever its format: samples, their axes, the radar, and where it is known the body.

use std::ops::Range;

use num_complex::Complex32;

use super::Source;
use super::sink::{Layout, Sink};
use crate::data::Recording;
use crate::data::arrays::Values;
use crate::error::Result;
use crate::heatmap::{range_axis, velocity_axis};
use crate::radar::{Radar, Sampling};
use crate::recorder::Interpolation;
use crate::recorder::body::MovingBody;

/// Writes these frames into a sink and finishes it.
pub fn write(source: &mut Source, frames: Range<usize>, mut sink: Box<dyn Sink>, notes: &mut Vec<String>) -> Result<()> {
    let recording = source.recording;
    let radar = &recording.radar;
    let [_, tx, rx, loops, samples] = radar.dims();
    describe(recording, frames.clone(), &mut *sink)?;
    if let Some(valid) = recording.valid() {
        let shape = [frames.len(), tx, rx, loops];
        let chirps: Vec<bool> = frames.clone().flat_map(|frame| valid.chirps(frame).iter().copied()).collect();
        sink.array(Layout { name: "valid", axes: "frame tx rx loop", unit: "", shape: &shape }, Values::Bool(&chirps))?;
    }
    body(recording, frames.clone(), &mut *sink, notes)?;
    let shape = [frames.len(), tx, rx, loops, samples];
    let layout = Layout { name: "samples", axes: "frame tx rx loop sample", unit: "", shape: &shape };
    let complex = radar.sampling == Sampling::Complex;
    sink.begin(layout, if complex { Values::Complex64(&[]) } else { Values::F32(&[]) })?;
    for frame in frames {
        let samples = recording.frame(frame)?;
        match &samples.im {
            Some(im) => {
                let values: Vec<Complex32> = samples.re.iter().zip(im).map(|(&re, &im)| Complex32::new(re, im)).collect();
                sink.push(Values::Complex64(&values))?;
            }
            None => sink.push(Values::F32(&samples.re))?,
        }
        source.done(frame + 1);
    }
    sink.finish()
}

/// Times, axes of the transforms, antennas, and the texts.
pub fn describe(recording: &Recording, frames: Range<usize>, sink: &mut dyn Sink) -> Result<()> {
    let radar = &recording.radar;
    let [_, tx, rx, loops, samples] = radar.dims();
    let starts: Vec<f64> = frames.map(|frame| radar.chirp_time_s(frame, 0, 0)).collect();
    line(sink, "time_s", "frame", "s", &starts)?;
    let chirps: Vec<f64> = (0..tx).flat_map(|tx| (0..loops).map(move |index| radar.chirp_time_s(0, tx, index))).collect();
    sink.array(Layout { name: "chirp_time_s", axes: "tx loop", unit: "s", shape: &[tx, loops] }, Values::F64(&chirps))?;
    let times: Vec<f64> = (0..samples).map(|sample| radar.sample_time_s(sample)).collect();
    line(sink, "sample_time_s", "sample", "s", &times)?;
    line(sink, "range_m", "range", "m", &range_axis(radar).values)?;
    line(sink, "velocity_m_s", "doppler", "m/s", &velocity_axis(radar).values)?;
    let places = |count: usize, of: &dyn Fn(usize) -> [f64; 3]| (0..count).flat_map(of).collect::<Vec<f64>>();
    let transmitters = places(tx, &|index| radar.tx_position_m(index));
    let receivers = places(rx, &|index| radar.rx_position_m(index));
    sink.array(Layout { name: "tx_m", axes: "tx xyz", unit: "m", shape: &[tx, 3] }, Values::F64(&transmitters))?;
    sink.array(Layout { name: "rx_m", axes: "rx xyz", unit: "m", shape: &[rx, 3] }, Values::F64(&receivers))?;
    texts(recording, sink)
}

/// Radar, room and labels as JSON.
pub fn texts(recording: &Recording, sink: &mut dyn Sink) -> Result<()> {
    sink.text("radar", &radar_json(&recording.radar))?;
    if let Some(room) = &recording.room {
        sink.text("room", &serde_json::to_string(room).expect("a room is plain data"))?;
    }
    sink.text("labels", &serde_json::to_string(&recording.labels).expect("labels are texts"))
}

pub fn radar_json(radar: &Radar) -> String {
    serde_json::to_string(radar).expect("a radar is plain data")
}

/// `valid`: whether no chirp of a frame was lost, where that is stated.
pub fn whole_frames(recording: &Recording, axis: &str, sink: &mut dyn Sink) -> Result<()> {
    if recording.valid().is_none() {
        return Ok(());
    }
    let whole: Vec<bool> = (0..recording.frames()).map(|frame| recording.is_whole(frame)).collect();
    sink.array(Layout { name: "valid", axes: axis, unit: "", shape: &[whole.len()] }, Values::Bool(&whole))
}

/// An array of one axis.
pub fn line(sink: &mut dyn Sink, name: &str, axis: &str, unit: &str, values: &[f64]) -> Result<()> {
    sink.array(Layout { name, axes: axis, unit, shape: &[values.len()] }, Values::F64(values))
}

/// The body's vertices at the start of every frame, in the radar frame: what is to be learned from the samples.
pub fn body(recording: &Recording, frames: Range<usize>, sink: &mut dyn Sink, notes: &mut Vec<String>) -> Result<()> {
    let Some(person) = recording.person() else { return Ok(()) };
    let body = MovingBody::new(person, Interpolation::default())?;
    let weights: Option<Vec<_>> =
        frames.clone().map(|frame| body.weights(recording.radar.chirp_time_s(frame, 0, 0)).ok()).collect();
    let Some(weights) = weights else {
        notes.push("frames lie outside the motion: the body is not carried".into());
        return Ok(());
    };
    let count = body.rest().len();
    let layout = Layout { name: "vertices", axes: "frame vertex xyz", unit: "m", shape: &[frames.len(), count, 3] };
    sink.begin(layout, Values::F32(&[]))?;
    for weights in weights {
        let mut vertices = vec![[0f64; 3]; count];
        for (pose, weight) in weights {
            for (vertex, place) in vertices.iter_mut().zip(body.pose(pose)) {
                (0..3).for_each(|axis| vertex[axis] += weight * place[axis]);
            }
        }
        let values: Vec<f32> = vertices.as_flattened().iter().map(|&coordinate| coordinate as f32).collect();
        sink.push(Values::F32(&values))?;
    }
    let faces: Vec<i32> = body.faces.iter().flatten().map(|&corner| corner as i32).collect();
    sink.array(Layout { name: "faces", axes: "face corner", unit: "", shape: &[body.faces.len(), 3] }, Values::I32(&faces))
}
