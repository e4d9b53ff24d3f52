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
use crate::import::capture::INVERTED_RX;
use crate::import::capture::lanes::Lanes;
use crate::radar::{Radar, Sampling};

pub fn write(source: &mut Source, folder: &Path) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    let radar = &source.recording.radar;
    let wiring = Wiring::of(radar, source.board, true, &mut notes)?;
    if wiring.lanes.interleaved {
        return Err(Error::Usage {
            message: format!("--board {}: four lanes, expected two, as all radars of roverd have", wiring.device),
            hint: Some("export to dca1000, or leave out --board".into()),
        });
    }
    let wiring = Wiring { lanes: Lanes { q_first: true, ..wiring.lanes }, ..wiring };
    notes.extend(not_carried(source.recording, &["room", "body and motion"]));
    notes.push("radar and labels are in config.yaml; radar.json, as roverd has it, holds the radar's resolutions alone".into());
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
    let inverted: Vec<usize> = (0..radar.rx_m.len()).filter(|&rx| wiring.inverted[rx]).collect();
    let config = json!({
        "radar": serde_json::to_value(radar).expect("a radar is plain data"),
        INVERTED_RX: inverted,
        "labels": source.recording.labels,
    });
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::{IfFrame, IfLayout, Recording, RecordingContents, write_recording};
    use crate::export::ExportConfig;
    use crate::import::capture::boards::Board;
    use crate::import::capture::{Stated, open};

    const FRAMES: usize = 2;

    fn frame(radar: &Radar, index: usize) -> IfFrame {
        let [_, tx, rx, loops, samples] = radar.dims();
        let count = tx * rx * loops * samples;
        let part = |step: usize| (0..count).map(|at| (((index * count + at) * step) % 4001) as f32 - 2000.0).collect();
        IfFrame::new([tx, rx, loops, samples], part(37), Some(part(53)))
    }

    fn recorded(folder: &Path, board: &Board) -> Recording {
        let places = |count: usize, of: &dyn Fn(usize) -> Option<[f64; 3]>| (0..count).map_while(of).collect::<Vec<_>>();
        let radar = Radar {
            start_frequency_hz: 60e9,
            tx_m: places(3, &|tx| board.tx_m(tx)),
            rx_m: places(4, &|rx| board.rx_m(rx)),
            ..Radar::small(FRAMES)
        };
        let (labels, layout) = ([("action".to_string(), "walk".to_string())].into(), IfLayout::Codes);
        let contents =
            RecordingContents { radar: &radar, room: None, person: None, body_file: None, labels, layout, truth: None };
        write_recording(folder, &contents, &mut |index| Ok(frame(&radar, index))).unwrap();
        Recording::open(folder).unwrap()
    }

    /// Which receivers are turned is carried: samples and antennas come back, whichever board is named where.
    #[test]
    fn a_trace_of_a_board_with_inverted_receivers_comes_back_whatever_board_is_named() {
        for name in ["IWR6843AOP", "IWR6843ODS"] {
            let folder = tempfile::tempdir().unwrap();
            let board = Board::named(name).unwrap();
            let recording = recorded(&folder.path().join("walk"), board);
            for exported in [None, Some(board)] {
                let out = folder.path().join(format!("out_{}", exported.is_some()));
                let config = ExportConfig::default();
                let mut source = Source {
                    recording: &recording,
                    name: "walk".into(),
                    board: exported,
                    config: &config,
                    progress: &mut |_| {},
                };
                let notes = write(&mut source, &out).unwrap().join("\n");
                assert!(notes.contains("radar and labels are in config.yaml"), "{notes}");
                assert!(!notes.contains("not carried") && !notes.contains("come back"), "{notes}");
                for imported in [None, Some(name), Some("IWR6843ISK")] {
                    let stated = Stated { board: imported.map(String::from), ..Stated::default() };
                    let mut capture = open(&[out.join("walk")], &stated).unwrap();
                    let said = capture.notes.iter().any(|note| note.contains("config.yaml says, whatever the board"));
                    assert_eq!(said, exported.is_some(), "{:?}", capture.notes);
                    assert_eq!(capture.radar.rx_m, recording.radar.rx_m);
                    for index in 0..FRAMES {
                        let found = (capture.frame)(index).unwrap();
                        assert_eq!(found, recording.frame(index).unwrap(), "{name}: {imported:?}");
                    }
                }
            }
        }
    }
}
