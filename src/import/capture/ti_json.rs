//! `.mmwave.json` and `.setup.json` of mmWave Studio.
//!
//! Source: TI, "mmWave Studio JSON configuration" as shipped with mmWave Studio; key names carry their units.

use std::path::{Path, PathBuf};

use super::json::Json;
use super::lanes::Lanes;
use super::schedule::{Burst, Chirp, Profile, SHIFTED, SWITCHED, TiRadar, check_ramp, sampling_of};
use crate::error::{Error, Result};
use crate::radar::Sampling;

/// Devices of a cascade, and transmitters and receivers of each.
pub const CASCADED: usize = 4;
const TRANSMITTERS: usize = 3;
pub const RECEIVERS: usize = 4;

/// What `.setup.json` adds: the device, and which files hold the samples.
#[derive(Debug, Default)]
pub struct Setup {
    pub device: Option<String>,
    pub files: Vec<PathBuf>,
    /// The `.mmwave.json` of the capture.
    pub config: Option<PathBuf>,
}

pub fn read_setup(path: &Path) -> Result<Setup> {
    let json = Json::read(path)?;
    let device = json.find("mmWaveDevice").map(|device| device.text().map(str::to_string)).transpose()?;
    // The paths are of the machine that recorded; the file names are what travels.
    let beside = |name: &str| path.with_file_name(name.rsplit(['/', '\\']).next().unwrap_or_default());
    let config = json.find("configUsed").map(|name| name.text().map(beside)).transpose()?;
    let mut files = Vec::new();
    if let Some(captured) = json.find("capturedFiles").and_then(|captured| captured.find("files")) {
        for file in captured.items()? {
            let names = ["processedFileName", "rawFileName"].into_iter().filter_map(|key| file.find(key));
            let names = names.map(|name| name.text().map(str::to_string)).collect::<Result<Vec<_>>>()?;
            let named: Vec<PathBuf> = names.iter().filter(|name| !name.is_empty()).map(|name| beside(name)).collect();
            // What was processed may be left out of a copy: of both, the one that is there.
            files.extend(named.iter().find(|file| file.is_file()).or(named.first()).cloned());
        }
    }
    Ok(Setup { device, files, config })
}

/// Reads the radar of one device.
pub fn read_radar(path: &Path) -> Result<TiRadar> {
    let json = Json::read(path)?;
    let devices = json.get("mmWaveDevices")?.items()?;
    let [device] = &devices[..] else {
        let found = format!("{} devices", devices.len());
        return Err(Error::field(path, "mmWaveDevices", found, "one device")
            .with_hint("the files of a cascade are master_0000_data.bin, slave1_0000_data.bin, …: name their folder"));
    };
    let rf = device.get("rfConfig")?;
    in_phase(&rf)?;
    let profiles = profiles(&rf)?;
    let (bursts, frame_period_s, frames) = frame(&rf)?;
    let raw = device.get("rawDataCaptureConfig")?;
    let lanes = lanes(&rf, &raw)?;
    let rx_mask = rf.get("rlChanCfg_t")?.get("rxChannelEn")?.count()?;
    let notes = profiles.iter().filter_map(|profile| check_ramp(path, profile)).collect();
    TiRadar { file: path.into(), profiles, bursts, frame_period_s, frames, rx_mask, devices: 1, lanes, notes }.checked()
}

/// Reads the radar of a cascade: transmitters and receivers are numbered through the devices, master first.
///
/// # Errors
/// As [`read_radar`]; another number of devices, or devices that do not sample alike.
pub fn read_cascade(path: &Path) -> Result<TiRadar> {
    let json = Json::read(path)?;
    let listed = json.get("mmWaveDevices")?;
    let mut devices = listed.items()?;
    if devices.len() != CASCADED {
        let found = format!("{} devices", devices.len());
        return Err(Error::field(path, "mmWaveDevices", found, format!("{CASCADED}: master, slave 1, slave 2 and slave 3"))
            .with_hint("the description belongs to another capture"));
    }
    let number = |device: &Json| device.find("mmWaveDeviceId").map(|id| id.count()).transpose();
    let numbers = devices.iter().map(number).collect::<Result<Vec<_>>>()?;
    if numbers.iter().any(Option::is_some) {
        let mut order: Vec<usize> = (0..CASCADED).collect();
        order.sort_by_key(|&at| numbers[at]);
        if order.iter().enumerate().any(|(id, &at)| numbers[at] != Some(id)) {
            return Err(listed.wrong("mmWaveDeviceId 0, 1, 2 and 3, each once"));
        }
        devices = order.into_iter().map(|at| devices[at].clone()).collect();
    }
    let mut whole: Option<TiRadar> = None;
    for (id, device) in devices.iter().enumerate() {
        let own = of_cascade(path, device, id)?;
        match &mut whole {
            None => whole = Some(own),
            Some(whole) => joined(whole, &own, &device.get("rfConfig")?, id)?,
        }
    }
    let mut whole = whole.expect("there are four");
    whole.rx_mask = (1 << (RECEIVERS * CASCADED)) - 1;
    whole.checked()
}

/// One device of a cascade, its transmitters numbered after those of the devices before it.
fn of_cascade(path: &Path, device: &Json, id: usize) -> Result<TiRadar> {
    let rf = device.get("rfConfig")?;
    in_phase(&rf)?;
    let profiles = profiles(&rf)?;
    let (mut bursts, frame_period_s, frames) = frame(&rf)?;
    for chirp in bursts.iter_mut().flat_map(|burst| &mut burst.chirps) {
        chirp.tx_mask <<= TRANSMITTERS * id;
    }
    let rx = rf.get("rlChanCfg_t")?.get("rxChannelEn")?;
    if rx.count()? != (1 << RECEIVERS) - 1 {
        return Err(rx.wrong("0xF: all four receivers of every device"));
    }
    let format = rf.get("rlAdcOutCfg_t")?.get("fmt")?;
    if format.get("b2AdcBits")?.count()? != 2 {
        return Err(format.get("b2AdcBits")?.wrong("2 (16 bits): samples of 12 and 14 bits are not read"));
    }
    if sampling_of(format.get("b2AdcOutFmt")?.count()?) != Some(Sampling::Complex) {
        return Err(format.get("b2AdcOutFmt")?.wrong("1 or 2 (complex), as cascades are captured"));
    }
    let swap = device.find("rawDataCaptureConfig").and_then(|raw| raw.find("rlDevDataFmtCfg_t")?.find("iqSwapSel"));
    let q_first = swap.map(|swap| swap.count()).transpose()? == Some(1);
    // Every sample of the four receivers in turn.
    let lanes = Lanes { count: RECEIVERS, interleaved: true, q_first, sampling: Sampling::Complex };
    let notes = profiles.iter().filter_map(|profile| check_ramp(path, profile)).collect();
    let (file, rx_mask) = (path.into(), 0);
    Ok(TiRadar { file, profiles, bursts, frame_period_s, frames, rx_mask, devices: CASCADED, lanes, notes })
}

/// Adds a device's transmitters; all else must be as it is.
fn joined(whole: &mut TiRadar, own: &TiRadar, at: &Json, id: usize) -> Result<()> {
    let timing = |radar: &TiRadar| {
        let chirps = |burst: &Burst| burst.chirps.iter().map(|chirp| (chirp.profile, chirp.extra_idle_s)).collect::<Vec<_>>();
        radar.bursts.iter().map(|burst| (burst.loops, burst.repeated, chirps(burst))).collect::<Vec<_>>()
    };
    let differ = [
        ("rlProfiles", whole.profiles != own.profiles),
        ("rlChirps", timing(whole) != timing(own)),
        ("rlFrameCfg_t", whole.frame_period_s != own.frame_period_s),
        ("iqSwapSel", whole.lanes != own.lanes),
    ];
    if let Some((what, _)) = differ.iter().find(|(_, differs)| *differs) {
        let found = format!("another one in device {id} than in device 0");
        return Err(Error::field(at.file(), *what, found, "devices that sample alike, but for their transmitters"));
    }
    let others = own.bursts.iter().flat_map(|burst| &burst.chirps);
    whole.bursts.iter_mut().flat_map(|burst| &mut burst.chirps).zip(others).for_each(|(all, own)| all.tx_mask |= own.tx_mask);
    Ok(())
}

/// Refuses transmitters whose phases are switched or shifted: by a profile, or from chirp to chirp.
fn in_phase(rf: &Json) -> Result<()> {
    let refuse_other_than_zero = |value: Option<Json>, hint: &str| match value {
        Some(value) if value.number()? != 0.0 => Err(value.wrong("0: transmitters in phase").with_hint(hint)),
        _ => Ok(()),
    };
    let listed = |list: &str| rf.find(list).map(|list| list.items()).transpose().map(Option::unwrap_or_default);
    for profile in listed("rlProfiles")?.iter().filter_map(|entry| entry.find("rlProfileCfg_t")) {
        refuse_other_than_zero(profile.find("txPhaseShifter"), SHIFTED)?;
    }
    for chirp in listed("rlRfPhaseShiftCfgs")?.iter().filter_map(|entry| entry.find("rlRfPhaseShiftCfg_t")) {
        for key in ["tx0PhaseShift", "tx1PhaseShift", "tx2PhaseShift"] {
            refuse_other_than_zero(chirp.find(key), SHIFTED)?;
        }
    }
    for chirp in listed("rlBpmChirps")?.iter().filter_map(|entry| entry.find("rlBpmChirpCfg_t")) {
        refuse_other_than_zero(chirp.find("constBpmVal"), SWITCHED)?;
    }
    Ok(())
}

/// Every profile; a later one of the same number takes the earlier one's place, as on the radar.
fn profiles(rf: &Json) -> Result<Vec<Profile>> {
    let read = |profile: &Json| {
        let profile = profile.get("rlProfileCfg_t")?;
        let scaled = |key: &str, scale: f64| Ok::<_, Error>(profile.get(key)?.number()? * scale);
        let time = |key: &str| Ok::<_, Error>(profile.get(key)?.amount()? * 1e-6);
        Ok(Profile {
            id: profile.get("profileId")?.count()?,
            // The tool stores what its register holds: 60 GHz comes out as 60.0000000044704.
            start_frequency_hz: (scaled("startFreqConst_GHz", 1e9)? / 100.0).round() * 100.0,
            slope_hz_per_s: (scaled("freqSlopeConst_MHz_usec", 1e12)? / 1e6).round() * 1e6,
            sample_rate_hz: scaled("digOutSampleRate", 1e3)?,
            samples: profile.get("numAdcSamples")?.count()?,
            idle_s: time("idleTimeConst_usec")?,
            adc_start_s: time("adcStartTimeConst_usec")?,
            ramp_end_s: time("rampEndTime_usec")?,
        })
    };
    let mut all: Vec<Profile> = Vec::new();
    for entry in rf.get("rlProfiles")?.items()? {
        let profile = read(&entry)?;
        // An unused place of the list has no samples.
        if profile.samples == 0 && all.iter().any(|other| other.id == profile.id) {
            continue;
        }
        all.retain(|other| other.id != profile.id);
        all.push(profile);
    }
    Ok(all)
}

/// Every chirp by its index. A later entry of the same chirp takes the earlier one's place, as on the radar.
fn chirps(rf: &Json) -> Result<Vec<(usize, Chirp)>> {
    let mut all: Vec<(usize, Chirp)> = Vec::new();
    for entry in rf.get("rlChirps")?.items()? {
        let chirp = entry.get("rlChirpCfg_t")?;
        for key in ["startFreqVar_MHz", "freqSlopeVar_KHz_usec", "adcStartTimeVar_usec"] {
            if let Some(change) = chirp.find(key)
                && change.number()? != 0.0
            {
                return Err(change.wrong("0: chirps that differ from their profile are not read"));
            }
        }
        let extra_idle_s = chirp.find("idleTimeVar_usec").map(|extra| extra.amount()).transpose()?.unwrap_or(0.0) * 1e-6;
        let content = Chirp { profile: chirp.get("profileId")?.count()?, tx_mask: chirp.get("txEnable")?.count()?, extra_idle_s };
        let (first, last) = (chirp.get("chirpStartIdx")?.count()?, chirp.get("chirpEndIdx")?.count()?.min(511));
        // An unused place of the list is a chirp 0 that nobody sends.
        let is_unused = (first, last, content.tx_mask) == (0, 0, 0) && all.iter().any(|(index, _)| *index == 0);
        for index in (first..=last).filter(|_| !is_unused) {
            all.retain(|(other, _)| *other != index);
            all.push((index, content.clone()));
        }
    }
    Ok(all)
}

/// The chirps from `first` to `last`.
fn chosen(all: &[(usize, Chirp)], first: usize, last: usize, at: &Json) -> Result<Vec<Chirp>> {
    let chirp = |index| all.iter().find(|(own, _)| *own == index).map(|(_, chirp)| chirp.clone());
    (first..=last)
        .map(|index| chirp(index).ok_or_else(|| at.wrong(&format!("chirps that are described; {index} is not"))))
        .collect()
}

fn frame(rf: &Json) -> Result<(Vec<Burst>, f64, Option<usize>)> {
    let all = chirps(rf)?;
    let waveform = rf.find("waveformType").map(|kind| kind.text().map(str::to_string)).transpose()?;
    if waveform.as_deref() == Some("advancedFrameChirp") {
        return advanced_frame(rf, &all);
    }
    let frame = rf.get("rlFrameCfg_t")?;
    let count = |key: &str| frame.get(key)?.count();
    let chirps = chosen(&all, count("chirpStartIdx")?, count("chirpEndIdx")?, &frame)?;
    let bursts = vec![Burst::of(chirps, count("numLoops")?, 1, 0.0)];
    let frames = count("numFrames")?;
    Ok((bursts, frame.get("framePeriodicity_msec")?.amount()? * 1e-3, (frames > 0).then_some(frames)))
}

fn advanced_frame(rf: &Json, all: &[(usize, Chirp)]) -> Result<(Vec<Burst>, f64, Option<usize>)> {
    let frame = rf.get("rlAdvFrameCfg_t")?;
    let sequence = frame.get("frameSeq")?;
    let is_forced = match sequence.find("forceProfile") {
        None => false,
        Some(forced) => match forced.count()? {
            number @ 0..=1 => number == 1,
            _ => return Err(forced.wrong("1: a profile for each subframe, or 0: those of the chirps")),
        },
    };
    let (mut bursts, mut period_s) = (Vec::new(), 0.0);
    for entry in sequence.get("subFrameCfg")?.items()?.iter().take(sequence.get("numOfSubFrames")?.count()?) {
        let subframe = entry.find("rlSubFrameCfg_t").unwrap_or_else(|| entry.clone());
        let count = |key: &str| subframe.get(key)?.count();
        let first = count("chirpStartIdx")?;
        let of_one = |key: &str| Ok::<_, Error>(subframe.find(key).map(|value| value.count()).transpose()?.unwrap_or(1).max(1));
        if of_one("numOfBurst")? > 1 {
            return Err(subframe.wrong("one burst a subframe: several bursts are not read"));
        }
        let last = (first + count("numOfChirps")?).checked_sub(1).ok_or_else(|| subframe.wrong("at least one chirp"))?;
        let number = of_one("numOfBurstLoops")?;
        let burst_s = if number > 1 { subframe.get("burstPeriodicity_msec")?.amount()? * 1e-3 } else { 0.0 };
        let burst = Burst::of(chosen(all, first, last, &subframe)?, count("numLoops")?, number, burst_s);
        bursts.push(if is_forced { burst.forced(count("forceProfileIdx")?) } else { burst });
        period_s += subframe.get("subFramePeriodicity_msec")?.amount()? * 1e-3;
    }
    let frames = sequence.get("numFrames")?.count()?;
    Ok((bursts, period_s, (frames > 0).then_some(frames)))
}

fn lanes(rf: &Json, raw: &Json) -> Result<Lanes> {
    let format = rf.get("rlAdcOutCfg_t")?.get("fmt")?;
    let bits = format.get("b2AdcBits")?;
    if bits.count()? != 2 {
        return Err(bits.wrong("2 (16 bits): samples of 12 and 14 bits are not read"));
    }
    let kind = format.get("b2AdcOutFmt")?;
    let sampling = sampling_of(kind.count()?).ok_or_else(|| kind.wrong("0 to 3"))?;
    if let Some(packet) = raw.find("rlDevDataPathCfg_t").and_then(|path| path.find("transferFmtPkt0"))
        && packet.count()? != 1
    {
        return Err(packet.wrong("0x1 (samples only): chirp parameters and quality words between the samples are not read"));
    }
    let layout = raw.get("rlDevDataFmtCfg_t")?;
    let mask = raw.get("rlDevLaneEnable_t")?.get("laneEn")?;
    let count = mask.count()?.count_ones() as usize;
    if count == 0 {
        return Err(mask.wrong("at least one lane"));
    }
    Ok(Lanes {
        count,
        interleaved: layout.get("chInterleave")?.count()? == 0,
        q_first: layout.get("iqSwapSel")?.count()? == 1,
        sampling,
    })
}
