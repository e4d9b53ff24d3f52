//! What simulations leave behind: a recording folder of simulated samples, heatmaps, and a page that shows them.

use std::{collections::BTreeMap, path::Path};

use num_complex::Complex32;

use super::{
    Notice, Notify,
    heatmaps::{Drawn, Pictures},
};
use crate::{
    data::{IfFrame, IfLayout, Recording, RecordingContents, atomic, write_recording},
    error::Result,
    evaluation::measured_frame,
    heatmap::HeatmapConfig,
    person::Person,
    pictures::page::{Markup, html, page, picture, shown, table},
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

/// Writes `folder/recording`, asking `frame` for `[tx, rx, loop, sample]` one after the other, the heatmaps, and `folder/report.html` with
/// all of them.
pub fn write(
    folder: &Path,
    sequence: &Sequence<'_>,
    heatmap: &HeatmapConfig,
    notify: &mut Notify<'_>,
    frame: &mut dyn FnMut(usize) -> Result<Vec<Complex32>>,
) -> Result<()> {
    let radar = sequence.radar;
    notify(Notice::Begun { what: "simulating", steps: radar.frames });
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
        notify(Notice::Done(index + 1));
        let im = (radar.sampling == Sampling::Complex).then(|| signal.iter().map(|value| value.im).collect());
        Ok(IfFrame::new([tx, rx, loops, samples], signal.iter().map(|value| value.re).collect(), im))
    })?;
    let pictures = Pictures::new(radar, heatmap);
    let drawn = match sequence.measured {
        Some(recording) => {
            recording.whole_stretch()?;
            let whole: Vec<usize> = recording.whole_frames().take_while(|frame| *frame < radar.frames).collect();
            let measured = whole.iter().map(|&frame| measured_frame(recording, frame)).collect::<Result<Vec<_>>>()?.concat();
            let length = tx * rx * loops * samples;
            let simulated: Vec<_> =
                whole.iter().flat_map(|frame| &simulated[frame * length..(frame + 1) * length]).copied().collect();
            pictures.compare(folder, &measured, &simulated)?
        }
        None => pictures.show(folder, &simulated)?,
    };
    atomic::write_text(folder.join("report.html"), &report(sequence, &drawn)?)
}

/// The page of a simulation.
fn report(sequence: &Sequence<'_>, drawn: &[Drawn]) -> Result<String> {
    let radar = sequence.radar;
    let [frames, tx, rx, loops, samples] = radar.dims();
    let mut facts = vec![
        ("frames", format!("{frames}, {:.1} ms apart", 1e3 * radar.frame_period_s)),
        ("transmitters, receivers, loops, samples", format!("{tx}, {rx}, {loops}, {samples}")),
        ("carrier, bandwidth", format!("{:.2} GHz, {:.2} GHz", 1e-9 * radar.carrier_hz(), 1e-9 * radar.bandwidth_hz())),
        ("range resolution, unambiguous range", format!("{:.3} m, {:.2} m", radar.range_resolution_m(), radar.max_range_m())),
        (
            "velocity resolution, unambiguous velocity",
            format!("{:.3} m/s, ±{:.2} m/s", radar.velocity_resolution_mps(), radar.max_velocity_mps()),
        ),
    ];
    facts.extend(sequence.labels.iter().map(|(name, value)| (name.as_str(), value.clone())));
    let rows: Vec<Vec<Markup>> =
        facts.iter().map(|(name, value)| vec![html! { (shown(name)) }, html! { (shown(value)) }]).collect();
    let pictures = drawn.iter().map(|(title, file)| picture(file, title)).collect::<Result<Vec<_>>>()?;
    let content = html! {
        h1 { "Simulated recording" }
        p.lead {
            @match sequence.measured {
                Some(recording) => {
                    "The motion of " code { (shown(&recording.folder.display().to_string())) }
                    " simulated again, beside what was measured, on one scale of colours."
                }
                None => { "The samples are in " code { "recording/" } ", a recording folder like one that was measured." }
            }
        }
        (table(&["", ""], &rows))
        p.small { "Colours begin at the noise floor (the median cell), at most 60 dB below the strongest cell." }
        @for picture in &pictures { p { (picture) } }
    };
    Ok(page("Simulated recording", &content))
}
