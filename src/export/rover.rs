//! A trace of the red-rover project (`roverd`): the folder `NAME` with `config.yaml` and the sensor `radar`.
//!
//! Source: RadarML/red-rover, docs/roverd (channel, sensor, data set) and `roverd.types.XWRRadarIQ`; RadarML/xwr 0.5,
//! `xwr.capture.types.RadarFrame` for the order of the words: of every two samples Q first, then I. `iq`
//! `[frame, loop, tx, rx, word]` int16, `valid` `[frame]` uint8, `ts` `[frame]` float64 seconds, `meta.json` with their types and
//! shapes, `radar.json` with the resolutions.

use std::path::Path;

use serde_json::json;

use super::capture_files::words;
use super::codes::Codes;
use super::wiring::Wiring;
use super::{Source, not_carried};
use crate::data::arrays::Values;
use crate::data::atomic::{AtomicFile, write_file, write_text};
use crate::error::{Error, Result};
use crate::import::capture::lanes::Lanes;
use crate::radar::{Radar, Sampling};

pub fn write(source: &mut Source, folder: &Path) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    let radar = &source.recording.radar;
    let wiring = Wiring::of(radar, source.board, &mut notes)?;
    if wiring.lanes.interleaved {
        return Err(Error::Usage {
            message: format!("--board {}: four lanes, expected two, as all radars of roverd have", wiring.device),
            hint: Some("export to dca1000, or leave out --board".into()),
        });
    }
    let wiring = Wiring { lanes: Lanes { q_first: true, ..wiring.lanes }, ..wiring };
    notes.extend(not_carried(source.recording, &["chirp and antennas but for their resolutions", "room", "body and motion"]));
    notes.push("time stamps count from the start of the recording".into());
    let trace = folder.join(&source.name);
    let sensor = trace.join("radar");
    std::fs::create_dir_all(&sensor).map_err(|source| Error::write(&sensor, source))?;
    let frames = source.recording.frames();
    let mut codes = Codes::of(source, &mut notes)?;
    let path = sensor.join("iq");
    let mut file = AtomicFile::create(&path)?;
    for frame in 0..frames {
        let words = words(source, frame, &wiring, &mut codes)?;
        Values::I16(&words).write_to(&mut file).map_err(|source| Error::write(&path, source))?;
        source.done(frame + 1);
    }
    file.finish()?;
    codes.conclude(&mut notes);
    let times: Vec<f64> = (0..frames).map(|frame| radar.chirp_time_s(frame, 0, 0)).collect();
    write_file(sensor.join("ts"), |file| Values::F64(&times).write_to(file))?;
    let valid: Vec<u8> = (0..frames).map(|frame| source.recording.is_whole(frame).into()).collect();
    write_file(sensor.join("valid"), |file| std::io::Write::write_all(file, &valid))?;
    write_text(sensor.join("meta.json"), &meta(radar))?;
    let resolutions = json!({
        "shape": [radar.loops_per_frame, radar.tx_m.len(), radar.rx_m.len(), radar.samples_per_chirp],
        "range_resolution": radar.range_resolution_m(),
        "doppler_resolution": radar.velocity_resolution_mps(),
    });
    write_text(sensor.join("radar.json"), &format!("{resolutions:#}\n"))?;
    // JSON is YAML; a folder with this file is a trace.
    let config =
        json!({ "radar": serde_json::to_value(radar).expect("a radar is plain data"), "labels": source.recording.labels });
    write_text(trace.join("config.yaml"), &format!("{config:#}\n"))?;
    Ok(notes)
}

fn meta(radar: &Radar) -> String {
    let [_, tx, rx, loops, samples] = radar.dims();
    let complex = radar.sampling == Sampling::Complex;
    let order = if complex { "Raw I/Q stream, of every two samples Q before I." } else { "Raw stream without quadrature." };
    let meta = json!({
        "iq": { "format": "raw", "type": "i2", "shape": [loops, tx, rx, samples * if complex { 2 } else { 1 }], "desc": order },
        "valid": { "format": "raw", "type": "u1", "shape": [], "desc": "1 where the frame is complete." },
        "ts": { "format": "raw", "type": "f8", "shape": [], "desc": "Start of the frame, in seconds." },
    });
    format!("{meta:#}\n")
}
