//! Whether a recording's samples are whole and are what they are stated to be, before any physics is asked: packets of zeros, values
//! that stand still, copies, a stream that moved, numbers of another byte order or sign, chirps of another length, chirps and frames
//! that begin elsewhere, transmitters that were not separated or not counted, words in the wrong order, lanes, devices of a cascade and I and Q
//! exchanged.
//!
//! The checks know the converter's stream and the radar's schedule, and where it is stated the size of the room, nothing of a body.
//! Each has a law that says how often a recording that is as stated would look so; a check fails where that is rarer than [`ALARM`].
//! One frame is in memory at a time.

mod alternation;
mod boundary;
mod chirp_length;
mod copies;
mod devices;
mod exchange;
mod frame_length;
mod frame_parts;
mod iq_order;
mod lanes;
mod mean_loop;
mod numbers;
mod period;
mod runs;
mod shift;
mod side_lobes;
mod start;
mod still;
mod stream;
mod tails;
mod transmitters;
mod turns;
mod words;

use crate::data::Recording;
use crate::error::Result;
use crate::radar::Radar;
use stream::{Schedule, Stream};

/// Chance that one check fails on a recording that is whole and as stated, at most. Fifteen checks at this level add up to about the
/// family-wise 1 % that a diagnosis allows itself (`diagnosis.alarm`).
pub const ALARM: f64 = 1e-3;

/// What a check that fails says of the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Some were lost or repeated; the others are right.
    Lost,
    /// They were put together in another order, or as other numbers, than they were sent.
    Misread,
    /// They are right, but a convention is not the one that is stated.
    Convention,
}

/// What one check says.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    pub check: &'static str,
    pub kind: Kind,
    /// What is stated.
    pub expected: &'static str,
    /// Plain words: what, and in which frames, loops and samples.
    pub found: String,
    pub ok: bool,
    /// Whether the samples decide anything here; where not, `ok` is true and `found` says why not.
    pub decided: bool,
    /// Frames that are damaged; empty where nothing is, or where all are.
    pub frames: Vec<usize>,
    /// Chirps that were lost or repeated: frame, transmitter, receiver, loop.
    pub chirps: Vec<[usize; 4]>,
    /// A bound on the chance that a recording as stated looks like this; none where nothing was found.
    pub p_value: Option<f64>,
}

impl Finding {
    fn as_stated(check: &'static str, expected: &'static str, found: impl Into<String>) -> Self {
        let (frames, chirps) = (vec![], vec![]);
        Self { check, kind: Kind::Lost, expected, found: found.into(), ok: true, decided: true, frames, chirps, p_value: None }
    }

    fn undecided(check: &'static str, expected: &'static str, why: impl std::fmt::Display) -> Self {
        Self { decided: false, ..Self::as_stated(check, expected, format!("undecided: {why}")) }
    }

    fn wrong(kind: Kind, check: &'static str, expected: &'static str, found: String, log_p: f64) -> Self {
        Self { kind, ok: false, p_value: Some(log_p.min(0.0).exp()), ..Self::as_stated(check, expected, found) }
    }
}

/// Sees every frame once, in order.
trait Inspector {
    fn see(&mut self, stream: &Stream);
    /// None where the recording has not what the check looks at.
    fn conclude(self: Box<Self>) -> Option<Finding>;
}

/// Looks at the first frames of a recording, at most so many; those with lost chirps are left out.
///
/// The checks come in the order in which one rests on another: of samples that were misread, nothing later is decided.
///
/// # Errors
/// Samples that cannot be read.
pub fn inspect(recording: &Recording, most_frames: usize) -> Result<Vec<Finding>> {
    let schedule = Schedule::of(&recording.radar, recording.room.as_ref());
    let mut inspectors: [Box<dyn Inspector>; 15] = [
        Box::new(runs::Runs::new(schedule)),
        Box::new(copies::Copies::new(schedule)),
        Box::new(numbers::Numbers::new(numbers::BYTE_ORDER)),
        Box::new(numbers::Numbers::new(numbers::SIGN)),
        Box::new(shift::Shift::new(schedule)),
        // Chirps and loops of another length, and chirps in the order of firing, repeat as longer loops do: special cases first.
        Box::new(chirp_length::ChirpLength::new(schedule)),
        Box::new(period::Period::new(schedule)),
        Box::new(transmitters::Transmitters::new(schedule)),
        Box::new(alternation::Alternation::new(schedule)),
        Box::new(start::Start::new(schedule)),
        Box::new(boundary::Boundary::new(schedule)),
        Box::new(words::Words::new(schedule)),
        Box::new(lanes::Lanes::new(schedule)),
        Box::new(devices::Devices::new(schedule, &recording.radar)),
        Box::new(iq_order::IqOrder::new(schedule)),
    ];
    for index in recording.whole_frames().take(most_frames) {
        let stream = Stream::of(schedule, index, &recording.frame(index)?);
        inspectors.iter_mut().for_each(|inspector| inspector.see(&stream));
    }
    let mut findings: Vec<Finding> = inspectors.into_iter().filter_map(Inspector::conclude).collect();
    if let Some(first) = findings.iter().position(|finding| !finding.ok && finding.kind == Kind::Misread) {
        let (misread, later) = findings.split_at_mut(first + 1);
        let name = misread[first].name();
        let rests = later.iter_mut().filter(|finding| finding.kind != Kind::Lost || finding.ok);
        rests.for_each(|finding| {
            *finding = Finding::undecided(finding.check, finding.expected, format!("first the {name} must be right"))
        });
    }
    Ok(findings)
}

/// Weighs what follows the only frame of a capture, as a share of a frame: frames may have more loops.
pub fn weigh_rest(findings: &mut [Finding], radar: &Radar, share: f64) {
    let is_misread = findings.iter().any(|finding| !finding.ok && finding.kind == Kind::Misread);
    if radar.frames > 1 || share <= 0.0 || is_misread {
        return;
    }
    let loops = share * radar.loops_per_frame as f64;
    let rest = if (loops - loops.round()).abs() < 1e-6 {
        let all = radar.loops_per_frame + loops.round() as usize;
        format!("what follows the only frame is {loops:.0} of its loops, and a frame of {all} loops would leave nothing")
    } else {
        format!(
            "what follows the only frame is {loops:.2} of its loops, which no number of loops explains: the capture was broken off or cut off"
        )
    };
    for finding in findings.iter_mut().filter(|finding| finding.check == boundary::CHECK && !finding.decided) {
        *finding = Finding::undecided(finding.check, finding.expected, &rest);
    }
}

/// Conventions that samples alone never decide, for tables of all that is stated.
pub fn never_decided(radar: &Radar) -> Vec<Finding> {
    let body = "a body whose motion is known decides it (`hybridsim diagnose`)";
    let mut undecided = vec![
        Finding::undecided("adc_start", "radar.adc_start_s", "it turns every return by a constant phase"),
        Finding::undecided("doppler_sign", "a receding body has a positive Doppler frequency", body),
    ];
    if radar.tx_m.len() > 1 {
        undecided.push(Finding::undecided("tx_order", "transmitters fire in the order of tx_m", body));
    }
    if radar.tx_m.len() * radar.rx_m.len() > 1 {
        undecided.push(Finding::undecided("left_and_right", "antennas on the sides that tx_m and rx_m state", body));
    }
    undecided
}

/// What becomes of a statement that the samples contradict.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Against {
    /// Nothing is decided: a recording is only looked at.
    Questioned,
    /// It is refused.
    Refused,
    /// The user keeps his word.
    Kept,
}

impl Finding {
    /// What was kept of what is stated.
    pub fn kept(&self, against: Against) -> &'static str {
        match (self.ok, self.kind, against) {
            (true, ..) if self.decided => "as stated",
            (true, ..) => "as stated, undecided",
            (false, Kind::Lost, Against::Questioned) => "questioned",
            (false, Kind::Lost, _) => "what was lost is left out",
            (false, _, Against::Questioned) => "questioned",
            (false, _, Against::Refused) => "refused",
            (false, _, Against::Kept) => "as stated, against the data",
        }
    }

    /// Of the check, as people read it: `byte order`.
    pub fn name(&self) -> String {
        self.check.trim_start_matches("integrity_").replace('_', " ")
    }

    /// What was found, as what a field "is".
    pub fn contradiction(&self) -> String {
        format!("contradicted by the samples ({})", self.found)
    }

    /// Whether the samples cannot be used as they are, nor in part.
    pub fn is_refusal(&self) -> bool {
        !self.ok && self.kind != Kind::Lost
    }
}

/// What is damaged, in one sentence; none where all is whole. A convention is no damage.
pub fn damage(findings: &[Finding]) -> Option<String> {
    let damaged = findings.iter().filter(|finding| !finding.ok && finding.kind != Kind::Convention);
    let found: Vec<&str> = damaged.map(|finding| finding.found.as_str()).collect();
    (!found.is_empty()).then(|| found.join("; "))
}

/// `3, 4, 7 and 12 more`
fn listed(numbers: &[usize]) -> String {
    const SHOWN: usize = 8;
    let shown: Vec<String> = numbers.iter().take(SHOWN).map(usize::to_string).collect();
    let more = numbers.len().saturating_sub(SHOWN);
    if more == 0 { shown.join(", ") } else { format!("{} and {more} more", shown.join(", ")) }
}

/// `frame 3` or `frames 3, 4`
fn frames_listed(frames: &[usize]) -> String {
    format!("{} {}", if frames.len() == 1 { "frame" } else { "frames" }, listed(frames))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After a row that is wrong or not.
    fn weighed(is_misread: bool, frames: usize, share: f64) -> Finding {
        let radar = Radar { loops_per_frame: 64, frames, ..Radar::mmmesh(frames) };
        let before = match is_misread {
            true => Finding::wrong(Kind::Misread, "chirp_length", "", String::new(), -9.0),
            false => Finding::as_stated("chirp_length", "", ""),
        };
        let mut findings = [before, Finding::undecided(boundary::CHECK, "", "one frame alone shows no boundary")];
        weigh_rest(&mut findings, &radar, share);
        let [_, finding] = findings;
        finding
    }

    #[test]
    fn what_follows_the_only_frame_is_weighed() {
        let third = 21.0 / 64.0;
        assert!(weighed(false, 1, third).found.contains("is 21 of its loops, and a frame of 85 loops"));
        assert!(weighed(false, 1, 0.4).found.contains("is 25.60 of its loops, which no number"));
        for (is_misread, frames, share) in [(false, 1, 0.0), (false, 2, third), (true, 1, third)] {
            assert!(weighed(is_misread, frames, share).found.contains("one frame alone"));
        }
    }

    /// What samples never decide has a row wherever there is anything to decide.
    #[test]
    fn sides_and_order_have_a_row_where_there_are_several_antennas() {
        let radar = Radar::mmmesh(1);
        let rows = |radar: &Radar| never_decided(radar).iter().map(Finding::name).collect::<Vec<_>>();
        assert_eq!(rows(&radar), ["adc start", "doppler sign", "tx order", "left and right"]);
        let one = Radar { tx_m: radar.tx_m[..1].to_vec(), rx_m: radar.rx_m[..1].to_vec(), ..radar };
        assert_eq!(rows(&one), ["adc start", "doppler sign"]);
    }

    #[test]
    fn a_refusal_is_a_sentence() {
        let finding = Finding::wrong(Kind::Misread, "integrity_stream", "", "from frame 0 on, samples come earlier".into(), -9.0);
        assert_eq!(
            format!("`{}` is {}", finding.name(), finding.contradiction()),
            "`stream` is contradicted by the samples (from frame 0 on, samples come earlier)"
        );
    }
}
