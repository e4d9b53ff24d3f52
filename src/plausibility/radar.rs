//! The radar's numbers: whether they can be in the units that their keys say.
//!
//! The bands are wide: from 24 GHz Doppler modules with a sound card as converter to 0.3 THz arrays. What they tell apart are
//! units, which differ by a thousand.

use super::units::{Unit, likely};
use super::{Facts, Finding, Kind, Part};
use crate::radar::{Radar, SPEED_OF_LIGHT};

/// 1 GHz (L band) to 1 THz.
const START_HZ: [f64; 2] = [1e9, 1e12];
/// From 1 kHz/us (150 MHz in 150 ms) to 1000 MHz/us; chips reach 266 (TI AWR2243) and 400 MHz/us (Infineon BGT60).
const SLOPE_HZ_PER_S: [f64; 2] = [1e9, 1e15];
/// From a sound card to an oscilloscope.
const SAMPLE_RATE_HZ: [f64; 2] = [1e4, 1e10];
const CHIRP_PERIOD_S: [f64; 2] = [1e-7, 1.0];
const FRAME_PERIOD_S: [f64; 2] = [1e-6, 10.0];
const ADC_START_S: [f64; 2] = [0.0, 1e-3];
/// A sweep of 10 MHz resolves 15 m, more than a room.
const LEAST_BANDWIDTH_HZ: f64 = 10e6;

const FREQUENCIES: [Unit; 3] = [("GHz", 1e9), ("MHz", 1e6), ("kHz", 1e3)];
const SLOPES: [Unit; 3] = [("MHz/us", 1e12), ("kHz/us", 1e9), ("MHz/s", 1e6)];
const RATES: [Unit; 2] = [("ksps", 1e3), ("Msps", 1e6)];
const TIMES: [Unit; 3] = [("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
/// Times of a chirp are written in microseconds before they are in milliseconds.
const CHIRP_TIMES: [Unit; 3] = [("us", 1e-6), ("ms", 1e-3), ("ns", 1e-9)];

/// A refusal where `value` lies outside of its band, with the unit that it is likely to be in.
fn within(key: &str, value: f64, band: [f64; 2], units: &[Unit], si: &str) -> Option<Finding> {
    if (band[0]..=band[1]).contains(&value.abs()) {
        return None;
    }
    let expected = format!("{:e} to {:e} {si}", band[0], band[1]);
    let finding = Finding::new(Kind::Refuse, Part::Settings, &format!("radar.{key}"), format!("{value}"), expected);
    Some(match likely(value, units, band) {
        Some((unit, factor)) => {
            finding.with_hint(format!("in {unit} it would be {:e} {si}: multiply by {factor:e}", value * factor))
        }
        None => finding.with_hint(format!("the key is in {si}")),
    })
}

/// Frequencies are in Hz.
pub fn frequencies(facts: &Facts) -> Vec<Finding> {
    let Some(radar) = &facts.radar else { return vec![] };
    [
        within("start_frequency_hz", radar.start_frequency_hz, START_HZ, &FREQUENCIES, "Hz"),
        within("slope_hz_per_s", radar.slope_hz_per_s, SLOPE_HZ_PER_S, &SLOPES, "Hz/s"),
        within("sample_rate_hz", radar.sample_rate_hz, SAMPLE_RATE_HZ, &RATES, "Hz"),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Times are in seconds.
pub fn times(facts: &Facts) -> Vec<Finding> {
    let Some(radar) = &facts.radar else { return vec![] };
    // Of a single frame the period says nothing.
    let frame = (radar.frames > 1).then(|| within("frame_period_s", radar.frame_period_s, FRAME_PERIOD_S, &TIMES, "s")).flatten();
    [
        within("chirp_period_s", radar.chirp_period_s, CHIRP_PERIOD_S, &CHIRP_TIMES, "s"),
        within("adc_start_s", radar.adc_start_s, ADC_START_S, &CHIRP_TIMES, "s"),
        frame,
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// The samples of a chirp fit into it, and what is swept meanwhile is a part of the carrier that resolves a room.
pub fn sweep(facts: &Facts) -> Vec<Finding> {
    let Some(radar) = &facts.radar else { return vec![] };
    if !(frequencies(facts).is_empty() && times(facts).is_empty()) {
        return vec![];
    }
    window(radar).or_else(|| bandwidth(radar)).into_iter().collect()
}

/// A frame ends before the next one starts.
pub fn frame(facts: &Facts) -> Vec<Finding> {
    let Some(radar) = facts.radar.as_ref().filter(|radar| radar.frames_are_apart() == Some(false)) else { return vec![] };
    let found = format!("{}, so that a frame's chirps take {:.4} ms", radar.chirp_period_s, 1e3 * radar.frame_duration_s());
    let expected = format!("a frame within its {:.4} ms", 1e3 * radar.frame_period_s);
    let finding = Finding::new(Kind::Note, Part::Settings, "radar.chirp_period_s", found, expected);
    vec![
        finding.with_hint(
            "chirp_period_s is from one ramp's start to the next, whoever transmits; frame_period_s from frame to frame",
        ),
    ]
}

fn window(radar: &Radar) -> Option<Finding> {
    let window_s = radar.samples_per_chirp as f64 / radar.sample_rate_hz;
    if window_s <= radar.chirp_period_s {
        return None;
    }
    let found = format!("{}, so that a chirp's samples take {:.4} ms", radar.sample_rate_hz, 1e3 * window_s);
    let expected = format!("samples within the chirp's {:.4} ms", 1e3 * radar.chirp_period_s);
    let finding = Finding::new(Kind::Refuse, Part::Settings, "radar.sample_rate_hz", found, expected);
    let least = radar.samples_per_chirp as f64 / radar.chirp_period_s;
    Some(match likely(radar.sample_rate_hz, &RATES, [least, SAMPLE_RATE_HZ[1]]) {
        Some((unit, factor)) => {
            finding.with_hint(format!("in {unit} it would be {:e} Hz: multiply by {factor:e}", radar.sample_rate_hz * factor))
        }
        None => finding.with_hint("chirp_period_s is from one ramp's start to the next"),
    })
}

fn bandwidth(radar: &Radar) -> Option<Finding> {
    let (swept, most) = (radar.bandwidth_hz().abs(), 0.5 * radar.start_frequency_hz);
    if (LEAST_BANDWIDTH_HZ..=most).contains(&swept) {
        return None;
    }
    let resolution = SPEED_OF_LIGHT / (2.0 * swept);
    let found =
        format!("{}, which sweeps {:.4} GHz while sampling (ranges of {resolution:.2e} m)", radar.slope_hz_per_s, swept / 1e9);
    let expected = format!("a sweep from {} GHz to half of the start frequency", LEAST_BANDWIDTH_HZ / 1e9);
    let finding = Finding::new(Kind::Refuse, Part::Settings, "radar.slope_hz_per_s", found, expected);
    Some(finding.with_hint("slope_hz_per_s is in Hz/s: 60 MHz/us are 60e12"))
}

#[cfg(test)]
mod tests {
    use super::*;

    type Check = fn(&Facts) -> Vec<Finding>;

    fn with(change: impl Fn(&mut Radar)) -> Facts {
        let mut radar = Radar::mmmesh(10);
        change(&mut radar);
        Facts { radar: Some(radar), ..Facts::default() }
    }

    /// Refused with this key and hint.
    fn told(check: Check, facts: &Facts, key: &str, hint: &str) {
        let found = check(facts);
        assert_eq!((found.len(), found[0].kind, found[0].field.as_str()), (1, Kind::Refuse, key), "{found:?}");
        assert!(found[0].hint.as_ref().unwrap().contains(hint), "{found:?}");
    }

    #[test]
    fn radars_that_people_have_pass() {
        for change in [
            (|_| {}) as fn(&mut Radar),
            |radar| radar.slope_hz_per_s = -radar.slope_hz_per_s,
            |radar| radar.loops_per_frame = 1,
            // Infineon's, at 60 GHz.
            |radar| (radar.start_frequency_hz, radar.slope_hz_per_s, radar.sample_rate_hz) = (58e9, 171.9e12, 2e6),
            // A 24 GHz module on a sound card: 150 MHz in 10 ms.
            |radar| {
                (radar.start_frequency_hz, radar.slope_hz_per_s, radar.sample_rate_hz) = (24e9, 15e9, 44.1e3);
                (radar.chirp_period_s, radar.loops_per_frame, radar.frame_period_s) = (12e-3, 1, 12e-3);
            },
            |radar| (radar.frames, radar.frame_period_s) = (1, 100.0),
        ] {
            let mut facts = with(change);
            if let Some(radar) = &mut facts.radar
                && radar.chirp_period_s < 1e-3
            {
                radar.chirp_period_s = 1e-3;
            }
            for check in [frequencies as Check, times, sweep] {
                assert!(check(&facts).is_empty(), "{:?}", check(&facts));
            }
        }
    }

    #[test]
    fn units_are_recognised() {
        let slope = "radar.slope_hz_per_s";
        told(frequencies, &with(|radar| radar.slope_hz_per_s = 60.012), slope, "in MHz/us it would be 6.0012e13 Hz/s");
        told(frequencies, &with(|radar| radar.slope_hz_per_s = 60012.0), slope, "in kHz/us it would be 6.0012e13");
        told(frequencies, &with(|radar| radar.slope_hz_per_s = -60.012), slope, "in MHz/us it would be -6.0012e13");
        told(
            frequencies,
            &with(|radar| radar.start_frequency_hz = 77.0),
            "radar.start_frequency_hz",
            "in GHz it would be 7.7e10 Hz",
        );
        told(frequencies, &with(|radar| radar.sample_rate_hz = 4400.0), "radar.sample_rate_hz", "in ksps it would be 4.4e6 Hz");
        told(frequencies, &with(|radar| radar.sample_rate_hz = 4.4), "radar.sample_rate_hz", "in Msps it would be 4.4e6 Hz");
        told(times, &with(|radar| radar.chirp_period_s = 72.0), "radar.chirp_period_s", "in us it would be 7.2e-5 s");
        told(times, &with(|radar| radar.adc_start_s = 6.0), "radar.adc_start_s", "in us it would be 6e-6 s");
        told(times, &with(|radar| radar.frame_period_s = 100.0), "radar.frame_period_s", "in ms it would be 1e-1 s");
    }

    #[test]
    fn frames_that_overlap_are_said() {
        assert!(frame(&with(|radar| radar.frame_period_s = radar.frame_duration_s())).is_empty());
        let found = &frame(&with(|radar| radar.chirp_period_s *= 1000.0))[0];
        assert!(found.kind == Kind::Note && found.field == "radar.chirp_period_s", "{found:?}");
        assert!(found.found.contains("a frame's chirps take") && found.expected.contains("100.0000 ms"), "{found:?}");
    }

    #[test]
    fn samples_must_fit_into_their_chirp_and_a_sweep_into_its_carrier() {
        told(sweep, &with(|radar| radar.sample_rate_hz = 10000.0), "radar.sample_rate_hz", "in ksps it would be 1e7 Hz");
        told(sweep, &with(|radar| radar.slope_hz_per_s = 60e9), "radar.slope_hz_per_s", "60 MHz/us are 60e12");
        assert!(sweep(&with(|radar| radar.slope_hz_per_s = 60.012)).is_empty(), "said by another check");
    }
}
