//! A radar as mmWave Studio describes it.
//!
//! Source: TI, "mmWave Studio JSON configuration" as shipped with mmWave Studio; key names carry their units. Only what
//! `import::capture::ti_json` reads, and what other readers ask for beside it, is written.

use serde_json::{Value, json};

use super::wiring::Wiring;
use crate::radar::{Radar, Sampling};

/// Start frequencies come back in steps of 100 Hz, slopes in steps of 1 MHz/s: finer than the chip's registers.
const FREQUENCY_STEP_HZ: f64 = 100.0;
const SLOPE_STEP_HZ_PER_S: f64 = 1e6;
/// Times are written to the picosecond, a ten-thousandth of the chip's step.
const PICOSECONDS: f64 = 1e12;

/// What is written of a radar.
pub struct Described {
    rf: Value,
    capture: Value,
}

/// To the picosecond.
fn microseconds(seconds: f64) -> f64 {
    (seconds * PICOSECONDS).round() / (PICOSECONDS / 1e6)
}

/// The shape of all chirps.
fn profile(radar: &Radar) -> Value {
    let window_s = radar.adc_start_s + radar.samples_per_chirp as f64 / radar.sample_rate_hz;
    // The chip's times are in steps of 10 ns.
    let ramp_s = ((window_s * 1e8 - 1e-6).ceil() * 1e-8).min(radar.chirp_period_s);
    json!({ "rlProfileCfg_t": {
        "profileId": 0,
        "pfVcoSelect": "0x2",
        "pfCalLutUpdate": "0x0",
        "startFreqConst_GHz": radar.start_frequency_hz / 1e9,
        "idleTimeConst_usec": microseconds(microseconds(radar.chirp_period_s) * 1e-6 - microseconds(ramp_s) * 1e-6),
        "adcStartTimeConst_usec": microseconds(radar.adc_start_s),
        "rampEndTime_usec": microseconds(ramp_s),
        "txOutPowerBackoffCode": "0x0",
        "txPhaseShifter": "0x0",
        "freqSlopeConst_MHz_usec": radar.slope_hz_per_s / 1e12,
        "txStartTime_usec": 0.0,
        "numAdcSamples": radar.samples_per_chirp,
        "digOutSampleRate": whole(radar.sample_rate_hz / 1e3),
        "hpfCornerFreq1": 0,
        "hpfCornerFreq2": 0,
        "rxGain_dB": "0x1E",
    }})
}

impl Described {
    /// The notes say what cannot be expressed.
    pub fn of(radar: &Radar, wiring: &Wiring, notes: &mut Vec<String>) -> Self {
        say_what_changes(radar, notes);
        let mask = |numbers: &[usize]| format!("0x{:X}", numbers.iter().fold(0, |mask, number| mask | 1_usize << number));
        let chirp = |(index, tx): (usize, &usize)| {
            json!({ "rlChirpCfg_t": {
                "chirpStartIdx": index,
                "chirpEndIdx": index,
                "profileId": 0,
                "startFreqVar_MHz": 0.0,
                "freqSlopeVar_KHz_usec": 0.0,
                "idleTimeVar_usec": 0.0,
                "adcStartTimeVar_usec": 0.0,
                "txEnable": mask(&[*tx]),
            }})
        };
        let rf = json!({
            "waveformType": "legacyFrameChirp",
            "MIMOScheme": "TDM",
            "rlCalibrationDataFile": "",
            "rlChanCfg_t": {
                "rxChannelEn": mask(&wiring.rx), "txChannelEn": mask(&wiring.tx), "cascading": 0, "cascadingPinoutCfg": "0x0",
            },
            "rlAdcOutCfg_t": { "fmt": {
                "b2AdcBits": 2, "b8FullScaleReducFctr": 0, "b2AdcOutFmt": u8::from(radar.sampling == Sampling::Complex),
            }},
            "rlLowPowerModeCfg_t": { "lpAdcMode": 0 },
            "rlProfiles": [profile(radar)],
            "rlChirps": wiring.tx.iter().enumerate().map(chirp).collect::<Vec<_>>(),
            "rlFrameCfg_t": {
                "chirpStartIdx": 0,
                "chirpEndIdx": wiring.tx.len() - 1,
                "numLoops": radar.loops_per_frame,
                "numFrames": radar.frames,
                "framePeriodicity_msec": microseconds(radar.frame_period_s) / 1e3,
                "triggerSelect": 1,
                "numDummyChirpsAtEnd": 0,
                "frameTriggerDelay": 0.0,
            },
        });
        let lanes = wiring.lanes;
        let capture = json!({
            "rlDevDataFmtCfg_t": { "iqSwapSel": u8::from(lanes.q_first), "chInterleave": u8::from(!lanes.interleaved) },
            "rlDevDataPathCfg_t": { "intfSel": 1, "transferFmtPkt0": "0x1", "transferFmtPkt1": "0x0", "cqConfig": 2 },
            "rlDevLaneEnable_t": { "laneEn": mask(&(0..lanes.count).collect::<Vec<_>>()) },
            "rlDevDataPathClkCfg_t": { "laneClkCfg": 1, "dataRate_Mbps": 600 },
            "rlDevLvdsLaneCfg_t": { "laneFmtMap": 0, "laneParamCfg": "0x1" },
        });
        Self { rf, capture }
    }

    /// The text of `NAME.mmwave.json`.
    pub fn mmwave_json(&self) -> String {
        let version = |major: u32, minor: u32| json!({ "major": major, "minor": minor, "patch": 0 });
        let all = json!({
            "configGenerator": { "createdBy": format!("hybridsim {}", env!("CARGO_PKG_VERSION")), "isConfigIntermediate": 1 },
            "currentVersion": { "jsonCfgVersion": version(0, 4) },
            "mmWaveDevices": [{ "mmWaveDeviceId": 0, "rfConfig": self.rf, "rawDataCaptureConfig": self.capture }],
        });
        format!("{all:#}\n")
    }
}

/// The text of `NAME.setup.json`: the device, the description and the files of the capture.
pub fn setup_json(device: &str, config: &str, files: &[String]) -> String {
    let files: Vec<Value> = files.iter().map(|name| json!({ "processedFileName": name, "rawFileName": name })).collect();
    let all = json!({
        "createdBy": format!("hybridsim {}", env!("CARGO_PKG_VERSION")),
        "configUsed": config,
        "captureHardware": "DCA1000",
        "mmWaveDevice": device,
        "operatingFreq": if device == "iwr6843" { 60 } else { 77 },
        "capturedFiles": { "numFilesCollected": files.len(), "fileBasePath": "", "files": files },
    });
    format!("{all:#}\n")
}

/// A whole number as one: programs read `4400`, and some refuse `4400.0`.
fn whole(number: f64) -> Value {
    let rounded = number.round();
    if (number - rounded).abs() < 1e-9 * rounded.abs() { json!(rounded as u64) } else { json!(number) }
}

fn say_what_changes(radar: &Radar, notes: &mut Vec<String>) {
    for (key, value, step, unit) in [
        ("start_frequency_hz", radar.start_frequency_hz, FREQUENCY_STEP_HZ, "Hz"),
        ("slope_hz_per_s", radar.slope_hz_per_s, SLOPE_STEP_HZ_PER_S, "Hz/s"),
    ] {
        let change = ((value / step).round() * step - value).abs();
        if change > 1e-12 * value.abs() {
            notes.push(format!("{key} is read back in steps of {step:e} {unit}: {change:.3e} {unit} off"));
        }
    }
    let times =
        [("adc_start_s", radar.adc_start_s), ("chirp_period_s", radar.chirp_period_s), ("frame_period_s", radar.frame_period_s)];
    for (key, value) in times {
        let change = ((value * PICOSECONDS).round() / PICOSECONDS - value).abs();
        if change > 1e-15 {
            notes.push(format!("{key} is carried to the picosecond: {change:.1e} s off"));
        }
    }
    if radar.position_m != [0.0; 3] {
        notes.push(format!("position_m {:?} is not carried: the import puts the radar at the origin", radar.position_m));
    }
    if let Some(rail) = radar.full_scale_codes.filter(|&rail| rail != f64::from(i16::MAX)) {
        notes.push(format!("full_scale_codes {rail} is not carried: the import says 32767"));
    }
}
