//! What descriptions of TI's radars say that is not read: phases of transmitters, times below zero, texts of another encoding.

use std::path::Path;

use super::tests::{CFG, capture_folder, mmwave_json, two_lane_words};
use super::{Capture, Layout, Stated, open};
use crate::error::Result;

fn opened(config: &str, text: &str) -> Result<Capture> {
    let (_folder, bin) = capture_folder(&two_lane_words(), config, text);
    open(&[bin], &Stated { board: Some("IWR6843ISK".into()), ..Stated::default() })
}

/// The description with other settings of its transmitters' phases.
fn json(profile: &str, lists: &str) -> String {
    let json = mmwave_json().replacen(r#""profileId": 0, "startFreq"#, &format!(r#"{profile}"profileId": 0, "startFreq"#), 1);
    json.replacen(r#""waveformType""#, &format!(r#"{lists}"waveformType""#), 1)
}

#[test]
fn transmitters_out_of_phase_are_refused_by_field() {
    let shifts = |phase: u32| {
        format!(
            r#""rlRfPhaseShiftCfgs": [{{"rlRfPhaseShiftCfg_t": {{"chirpStartIdx": 0, "chirpEndIdx": 0, "tx0PhaseShift": 0,
            "tx1PhaseShift": {phase}, "tx2PhaseShift": 0}}}}], "#
        )
    };
    let switches =
        |value: &str| format!(r#""rlBpmChirps": [{{"rlBpmChirpCfg_t": {{"chirpStartIdx": 1, "constBpmVal": "{value}"}}}}], "#);
    for (json, field) in [
        (json(r#""txPhaseShifter": "0x40", "#, ""), "rlProfileCfg_t.txPhaseShifter` is \"0x40\""),
        (json("", &shifts(32)), "rlRfPhaseShiftCfg_t.tx1PhaseShift` is 32"),
        (json("", &switches("0x10")), "rlBpmChirpCfg_t.constBpmVal` is \"0x10\""),
    ] {
        let error = opened("a.mmwave.json", &json).err().unwrap();
        assert!(error.to_string().contains(field) && error.hint().unwrap().contains("--layout"), "{error}");
    }
    for json in [json(r#""txPhaseShifter": "0x0", "#, &shifts(0)), json("", &switches("0x0")), json("", r#""rlBpmChirps": [], "#)]
    {
        opened("a.mmwave.json", &json).unwrap();
    }
    let error = opened("a.cfg", &CFG.replace("20 0 0 100", "20 0 4202512 100")).err().unwrap();
    assert!(error.to_string().contains("profileCfg` is phase shifters of 4202512 at place 7"), "{error}");
}

#[test]
fn times_below_zero_are_refused_by_field() {
    for (from, to, part) in [
        ("profileCfg 0 60 30 6 20", "profileCfg 0 60 -7 6 20", "profileCfg` is -7 at place 3"),
        ("profileCfg 0 60 30 6 20", "profileCfg 0 60 30 -6 20", "profileCfg` is -6 at place 4"),
        ("chirpCfg 1 1 0 0 0 0", "chirpCfg 1 1 0 0 0 -10", "chirpCfg` is -10 at place 6"),
        ("frameCfg 0 2 4 2 50", "frameCfg 0 2 4 2 -50", "frameCfg` is -50 at place 5"),
    ] {
        let error = opened("a.cfg", &CFG.replace(from, to)).err().unwrap().to_string();
        assert!(error.contains(part) && error.contains("a number of at least 0"), "{error}");
    }
    let json = mmwave_json().replace(r#""idleTimeConst_usec": 30.0"#, r#""idleTimeConst_usec": -30.0"#);
    let error = opened("a.mmwave.json", &json).err().unwrap().to_string();
    assert!(error.contains("idleTimeConst_usec` is -30.0, expected a number of at least 0"), "{error}");
}

/// Comments of another encoding say nothing; a whole text of one is named.
#[test]
fn a_cfg_of_another_encoding_is_read_or_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("radar.cfg");
    let write = |bytes: &[u8]| std::fs::write(&path, bytes).unwrap();
    let read = |path: &Path| super::ti_cfg::read_radar(path);
    write(&[&b"% 25 \xb0C\n"[..], CFG.as_bytes()].concat());
    assert_eq!(read(&path).unwrap().bursts[0].loops, 4);
    write(&["\u{feff}".as_bytes(), CFG.trim_start().as_bytes()].concat());
    assert_eq!(read(&path).unwrap().bursts[0].loops, 4);
    write(&"\u{feff}".encode_utf16().chain(CFG.encode_utf16()).flat_map(u16::to_le_bytes).collect::<Vec<u8>>());
    let error = read(&path).err().unwrap();
    assert!(error.to_string().contains("`encoding` is UTF-16") && error.hint().unwrap().contains("UTF-8"), "{error}");
}

#[test]
fn a_missing_field_says_where_it_comes_from() {
    let error = opened("a.mmwave.json", &mmwave_json().replace("rlDevLaneEnable_t", "rlOther_t")).err().unwrap();
    assert!(error.to_string().contains("rawDataCaptureConfig.rlDevLaneEnable_t` is missing"), "{error}");
    assert!(error.hint().unwrap().contains("the whole file"), "{:?}", error.hint());
}

#[test]
fn a_description_of_a_capture_card_describes_no_array() {
    for (config, text) in [("radar.cfg", CFG.to_string()), ("a.mmwave.json", mmwave_json())] {
        let (folder, bin) = capture_folder(&two_lane_words(), config, &text);
        let layout = Some(Layout::parse("frame loop tx rx sample iq lane").unwrap());
        let error =
            open(&[bin], &Stated { configs: vec![folder.path().join(config)], layout, ..Stated::default() }).err().unwrap();
        assert!(error.to_string().contains("expected TOML with [radar]"), "{error}");
        assert!(error.hint().unwrap().contains("leave --layout out"), "{:?}", error.hint());
    }
}
