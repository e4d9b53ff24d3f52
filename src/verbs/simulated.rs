//! What simulations leave behind: a recording folder of simulated samples, and heatmaps.

use std::{collections::BTreeMap, path::Path};

use num_complex::Complex32;

use super::{Tell, Told, heatmaps::Pictures};
use crate::{
    data::{IfFrame, IfLayout, Recording, RecordingContents, write_recording},
    error::Result,
    evaluation::measured_frame,
    heatmap::HeatmapConfig,
    person::Person,
    radar::{Radar, Sampling},
    room::Room,
};

/// What is simulated.
pub struct Sequence<'a> {
    pub radar: &'a Radar,
    pub room: Option<&'a Room>,
    pub person: Option<&'a Person>,
    pub labels: BTreeMap<String, String>,
    /// To be shown beside it.
    pub measured: Option<&'a Recording>,
}

/// Writes `folder/recording`, asking `frame` for `[tx, rx, loop, sample]` one after the other, and the heatmaps.
pub fn write(
    folder: &Path,
    sequence: &Sequence<'_>,
    heatmap: &HeatmapConfig,
    tell: &mut Tell<'_>,
    frame: &mut dyn FnMut(usize) -> Result<Vec<Complex32>>,
) -> Result<()> {
    let radar = sequence.radar;
    tell(Told::Begun { what: "simulating", steps: radar.frames });
    let contents = RecordingContents {
        radar,
        room: sequence.room,
        person: sequence.person,
        body_file: None,
        labels: sequence.labels.clone(),
        layout: if radar.sampling == Sampling::Real { IfLayout::Real } else { IfLayout::Complex },
        truth: None,
    };
    let [_, tx, rx, loops, samples] = radar.dims();
    let mut simulated: Vec<Complex32> = Vec::new();
    write_recording(folder.join("recording"), &contents, &mut |index| {
        let signal = frame(index)?;
        simulated.extend_from_slice(&signal);
        tell(Told::Done(index + 1));
        let im = (radar.sampling == Sampling::Complex).then(|| signal.iter().map(|value| value.im).collect());
        Ok(IfFrame::new([tx, rx, loops, samples], signal.iter().map(|value| value.re).collect(), im))
    })?;
    let mut pictures = Pictures::new(radar, heatmap);
    match sequence.measured {
        Some(recording) => {
            recording.whole_stretch()?;
            let whole: Vec<usize> = recording.whole_frames().take_while(|frame| *frame < radar.frames).collect();
            let measured = whole.iter().map(|&frame| measured_frame(recording, frame)).collect::<Result<Vec<_>>>()?.concat();
            let length = tx * rx * loops * samples;
            let simulated: Vec<_> =
                whole.iter().flat_map(|frame| &simulated[frame * length..(frame + 1) * length]).copied().collect();
            pictures.compare(folder, &measured, &simulated)
        }
        None => pictures.show(folder, &simulated),
    }
}
