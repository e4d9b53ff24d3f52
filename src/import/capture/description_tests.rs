//! What descriptions of TI's radars say beside the usual: bursts, forced profiles, entries that replace others, logs, and what is not read
//! (phases of transmitters, times below zero, texts of another encoding, commands of other SDKs).

use std::path::Path;

use super::tests::{CFG, FRAMES, RX, SAMPLES, TX, assert_frames, capture_folder, code, mmwave_json, two_lane_words};
use super::{Capture, Layout, Stated, open};
use crate::error::Result;

fn opened(config: &str, text: &str) -> Result<Capture> {
    let (_folder, bin) = capture_folder(&two_lane_words(), config, text);
    open(&[bin], &Stated { board: Some("IWR6843ISK".into()), ..Stated::default() })
}

/// A capture whose samples are read, and the folder that holds them.
fn held(config: &str, text: &str) -> (tempfile::TempDir, Capture) {
    let (folder, bin) = capture_folder(&two_lane_words(), config, text);
    let capture = open(&[bin], &Stated { board: Some("IWR6843ISK".into()), ..Stated::default() }).unwrap();
    (folder, capture)
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

/// The description of a frame of `bursts` bursts, one each `period_ms`, of so many loops: as a `.cfg` and as JSON.
fn in_bursts(loops: usize, bursts: usize, period_ms: f64) -> [(&'static str, String); 2] {
    let subframe = format!("advFrameCfg 1 0 2 1 0\nsubFrameCfg 0 0 0 3 {loops} {period_ms} 0 1 {bursts} 50\n");
    let cfg = CFG.replace("frameCfg 0 2 4 2 50 1 0\n", &subframe);
    [
        ("a.cfg", cfg),
        (
            "a.mmwave.json",
            advanced_json(
                0,
                &format!(r#""numLoops": {loops}, "numOfBurstLoops": {bursts}, "burstPeriodicity_msec": {period_ms}"#),
            ),
        ),
    ]
}

/// An advanced frame of one subframe.
fn advanced_json(forced: usize, settings: &str) -> String {
    let advanced = format!(
        r#""rlAdvFrameCfg_t": {{"frameSeq": {{"numOfSubFrames": 1, "forceProfile": {forced}, "numFrames": 2, "subFrameCfg": [
        {{"rlSubFrameCfg_t": {{"chirpStartIdx": 0, "numOfChirps": 3, "numOfBurst": 1, "subFramePeriodicity_msec": 50.0, {settings}}}}}]}}}},
        "rlFrameCfg_t""#
    );
    mmwave_json().replacen("legacyFrameChirp", "advancedFrameChirp", 1).replacen(r#""rlFrameCfg_t""#, &advanced, 1)
}

/// A loop of three chirps takes 150 us.
#[test]
fn loops_that_pause_between_bursts_are_refused_and_others_are_read() {
    for (config, text) in in_bursts(2, 2, 0.3) {
        let (_folder, mut capture) = held(config, &text);
        assert_eq!(capture.radar.dims(), [FRAMES, TX, RX, 4, SAMPLES], "{config}");
        assert!((capture.radar.chirp_period_s - 50e-6).abs() < 1e-12 && (capture.radar.frame_period_s - 0.05).abs() < 1e-12);
        assert_frames(&mut capture, code);
    }
    for (config, text) in [in_bursts(2, 2, 5.0), in_bursts(2, 2, 0.30002), in_bursts(2, 2, 0.2)].concat() {
        let error = opened(config, &text).err().unwrap();
        assert!(error.to_string().contains("`burst period` is "), "{error}");
        assert!(
            error.to_string().ends_with("expected 300.000 us, as long as its 2 loops last, or one burst a subframe"),
            "{error}"
        );
        assert!(error.hint().unwrap().contains("pause between bursts"), "{error}");
    }
    // One burst is one train, whatever its period; bursts of one loop are as far apart as their period says.
    for (config, text) in in_bursts(4, 1, 7.0) {
        assert!((opened(config, &text).unwrap().radar.chirp_period_s - 50e-6).abs() < 1e-12);
    }
    for (config, text) in in_bursts(1, 4, 5.0) {
        let error = opened(config, &text).err().unwrap();
        assert!(error.to_string().contains("even steps") && error.hint().unwrap().contains("--tx 0"), "{error}");
        let (_folder, bin) = capture_folder(&two_lane_words(), config, &text);
        let capture = open(&[bin], &Stated { board: Some("IWR6843ISK".into()), tx: Some(0), ..Stated::default() }).unwrap();
        assert_eq!((capture.radar.loops_per_frame, capture.radar.chirp_period_s), (4, 5e-3), "{config}");
    }
}

#[test]
fn a_forced_profile_is_that_of_the_chirps() {
    let second = "profileCfg 1 61 30 6 20 0 0 50 1 8 1000 0 0 30\n";
    let cfg = |forced: usize| {
        let frame = format!("{second}advFrameCfg 1 {forced} 2 1 0\nsubFrameCfg 0 1 0 3 4 10 0 1 1 50\n");
        CFG.replace("frameCfg 0 2 4 2 50 1 0\n", &frame)
    };
    let json = |forced: usize| {
        let text = advanced_json(forced, r#""numLoops": 4, "forceProfileIdx": 1"#);
        let start = text.find(r#"{"rlProfileCfg_t""#).unwrap();
        let end = start + text[start..].find("}}").unwrap() + 2;
        let other = text[start..end].replace(r#""profileId": 0"#, r#""profileId": 1"#).replace("60.0000000044704", "61.0");
        format!("{}, {other}{}", &text[..end], &text[end..])
    };
    for (config, texts) in [("a.cfg", [cfg(0), cfg(1)]), ("a.mmwave.json", [json(0), json(1)])] {
        let [own, forced] = texts.map(|text| opened(config, &text).unwrap().radar.start_frequency_hz);
        assert_eq!((own, forced), (60e9, 61e9), "{config}");
    }
    for (config, text, part) in
        [("a.cfg", cfg(2), "advFrameCfg` is 2 at place 2"), ("a.mmwave.json", json(2), "frameSeq.forceProfile` is 2")]
    {
        let error = opened(config, &text).err().unwrap().to_string();
        assert!(error.contains(part), "{error}");
    }
}

/// As the radar is sent them; what only fills the tool's list replaces nothing.
#[test]
fn a_later_chirp_or_profile_of_a_description_takes_the_place_of_an_earlier_one() {
    let chirp = |index: usize, mask: usize| {
        format!(
            r#"{{"rlChirpCfg_t": {{"chirpStartIdx": {index}, "chirpEndIdx": {index}, "profileId": 0, "txEnable": "0x{mask:X}"}}}}"#
        )
    };
    let with = |later: &[String]| {
        let text = mmwave_json();
        let end = text.find("],\n        \"rlFrameCfg_t\"").unwrap();
        format!("{}, {}{}", &text[..end], later.join(", "), &text[end..])
    };
    let tx_m = |text: &str| opened("a.mmwave.json", text).unwrap().radar.tx_m;
    let whole = tx_m(&mmwave_json());
    assert_eq!(tx_m(&with(&[chirp(1, 4), chirp(2, 2)])), [whole[0], whole[2], whole[1]]);
    assert_eq!(tx_m(&with(&[chirp(0, 0), chirp(0, 0)])), whole);
    let text = mmwave_json();
    let start = text.find(r#"{"rlProfileCfg_t""#).unwrap();
    let end = start + text[start..].find("}}").unwrap() + 2;
    let again = |from: &str, to: &str| format!("{}, {}{}", &text[..end], text[start..end].replace(from, to), &text[end..]);
    let start_hz = |text: &str| opened("a.mmwave.json", text).unwrap().radar.start_frequency_hz;
    assert_eq!(start_hz(&again("60.0000000044704", "61.0")), 61e9);
    assert_eq!(start_hz(&again(r#""numAdcSamples": 8"#, r#""numAdcSamples": 0"#)), 60e9);
}

#[test]
fn a_log_of_commands_is_read_from_its_last_flush_on_and_without_its_prompts() {
    let advanced =
        "advFrameCfg 2 0 2 1 0\nsubFrameCfg 0 0 0 3 2 10 0 1 1 25\nsubFrameCfg 1 0 0 3 2 10 0 1 1 25\nbpmCfg -1 1 0 1\n";
    let old = format!("{advanced}chirpCfg 3 3 0 0 0 0 0 4\n");
    let prompted: String = CFG.trim().lines().map(|line| format!("mmwDemo:/>{line}\nDone\n")).collect();
    let log = format!("{}{old}flushCfg\n{prompted}", CFG.replace("% a comment", ""));
    let (_folder, mut capture) = held("a.cfg", &log);
    assert_eq!(capture.radar.dims(), [FRAMES, TX, RX, 4, SAMPLES]);
    assert_frames(&mut capture, code);
    // What the flush cleared is missing, and what it leaves is not.
    let buffer = "adcbufCfg -1 0 0 1 1\n";
    opened("a.cfg", &format!("{buffer}flushCfg{}", CFG.replace(buffer, ""))).unwrap();
    let error = opened("a.cfg", &format!("{CFG}flushCfg\n")).err().unwrap();
    assert!(error.to_string().ends_with("`frameCfg` is missing, expected a line of that command"), "{error}");
}

#[test]
fn the_period_of_a_frame_of_the_mcu_plus_sdk_follows_its_samples() {
    let capture = opened("a.cfg", &CFG.replace("frameCfg 0 2 4 2 50 1 0", "frameCfg 0 2 4 2 16 50 1 0")).unwrap();
    assert!((capture.radar.frame_period_s - 0.05).abs() < 1e-12, "{}", capture.radar.frame_period_s);
}

#[test]
fn commands_of_what_is_not_read_are_refused_by_name() {
    let low_power = "sensorStop 0\nchannelCfg 7 3 0\nchirpComnCfg 19 0 0 128 4 40 0\nchirpTimingCfg 6 28 0 70 59.75\nframeCfg 8 0 250 64 100 0\n";
    for (text, part, hint) in [
        (low_power.to_string(), "`line 3: chirpComnCfg` is a command of the MMWAVE-L SDK", "--layout"),
        (format!("{CFG}ddmPhaseShiftAntOrder 0 2 3 1\n"), "ddmPhaseShiftAntOrder` is transmitters that send together", "Doppler"),
        (
            format!("{CFG}bpmCfg -1 1 0 1\n"),
            "bpmCfg` is transmitters that send together with switched phases",
            "sums and differences",
        ),
    ] {
        let error = opened("a.cfg", &text).err().unwrap();
        assert!(error.to_string().contains(part) && error.hint().unwrap().contains(hint), "{error}");
    }
}
