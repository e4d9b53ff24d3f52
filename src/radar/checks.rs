//! Rules that a radar must keep, each with its formula, its reason and a three-valued result.

use super::Radar;
use crate::bounds;
use crate::error::{Error, Result};

/// One rule held against one radar.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// What must hold, as a formula.
    pub rule: &'static str,
    /// Why.
    pub reason: &'static str,
    /// Left-hand side and right-hand side with their unit, as found.
    pub found: String,
    /// `None`: does not apply.
    pub passed: Option<bool>,
}

/// A Fourier matrix over so many samples or loops has [`bounds::MOST_NUMBERS`] entries.
const MOST_TRANSFORMED: usize = 1 << 14;

/// A day at a hundred frames a second, and some.
const MOST_FRAMES: usize = 10_000_000;

/// The rules that are advice: a recording that breaks one can still be read.
pub fn checks(radar: &Radar, farthest_m: Option<f64>) -> Vec<Check> {
    let window_s = radar.samples_per_chirp as f64 / radar.sample_rate_hz;
    let ramp_s = radar.adc_start_s + window_s;
    vec![
        Check {
            rule: "adc_start_s + samples_per_chirp / sample_rate_hz <= chirp_period_s",
            reason: "the last sample must be taken before the next ramp starts",
            found: format!("{:.2} us against {:.2} us", ramp_s * 1e6, radar.chirp_period_s * 1e6),
            passed: Some(ramp_s <= radar.chirp_period_s * (1.0 + 1e-9)),
        },
        Check {
            rule: "loops_per_frame * tx * chirp_period_s <= frame_period_s",
            reason: "a frame must end before the next one starts",
            found: format!("{:.2} ms against {:.2} ms", radar.frame_duration_s() * 1e3, radar.frame_period_s * 1e3),
            passed: radar.frames_are_apart(),
        },
        Check {
            rule: "farthest range <= max range",
            reason: "a farther echo folds back to a wrong range",
            found: format!(
                "{} against {:.2} m",
                farthest_m.map_or("unknown".into(), |range| format!("{range:.2} m")),
                radar.max_range_m()
            ),
            passed: farthest_m.map(|range| range <= radar.max_range_m()),
        },
    ]
}

/// The same of how fast something is.
pub fn fastest(radar: &Radar, fastest_mps: f64) -> Check {
    Check {
        rule: "fastest velocity <= max velocity",
        reason: "a faster echo folds back to a wrong velocity",
        found: format!("{fastest_mps:.2} m/s against {:.2} m/s", radar.max_tracked_velocity_mps()),
        passed: Some(fastest_mps <= radar.max_tracked_velocity_mps()),
    }
}

impl Radar {
    /// Whether a frame ends before the next one starts; none of a single frame.
    pub fn frames_are_apart(&self) -> Option<bool> {
        (self.frames > 1).then_some(self.frame_duration_s() <= self.frame_period_s * (1.0 + 1e-9))
    }

    /// Refuses numbers that no radar can have. `key` is what names this radar in messages, such as `radar`.
    pub fn check(&self, key: &str) -> Result<()> {
        let positive = [
            ("start_frequency_hz", self.start_frequency_hz),
            ("sample_rate_hz", self.sample_rate_hz),
            ("chirp_period_s", self.chirp_period_s),
            ("frame_period_s", self.frame_period_s),
            ("samples_per_chirp", self.samples_per_chirp as f64),
            ("loops_per_frame", self.loops_per_frame as f64),
            ("frames", self.frames as f64),
        ];
        for (field, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::setting(format!("{key}.{field}"), value, "a positive number"));
            }
        }
        if !(self.slope_hz_per_s.is_finite() && self.slope_hz_per_s != 0.0) {
            let expected = "a positive number, or a negative one for a falling chirp";
            return Err(Error::setting(format!("{key}.slope_hz_per_s"), self.slope_hz_per_s, expected));
        }
        if !(self.adc_start_s.is_finite() && self.adc_start_s >= 0.0) {
            return Err(Error::setting(format!("{key}.adc_start_s"), self.adc_start_s, "zero or a positive number"));
        }
        if let Some(codes) = self.full_scale_codes.filter(|codes| !(codes.is_finite() && *codes >= 1.0)) {
            return Err(Error::setting(format!("{key}.full_scale_codes"), codes, "the converter's largest code, 1 or more"));
        }
        for (field, count, most) in [
            ("samples_per_chirp", self.samples_per_chirp, MOST_TRANSFORMED),
            ("loops_per_frame", self.loops_per_frame, MOST_TRANSFORMED),
            ("frames", self.frames, MOST_FRAMES),
        ] {
            bounds::count(format!("{key}.{field}"), count, most)?;
        }
        let frame = [self.tx_m.len(), self.rx_m.len(), self.loops_per_frame, self.samples_per_chirp];
        bounds::numbers(format!("{key}.samples_per_chirp"), "tx x rx x loops x samples of a frame", &frame)?;
        for (field, antennas) in [("tx_m", &self.tx_m), ("rx_m", &self.rx_m)] {
            if antennas.is_empty() {
                return Err(Error::setting(format!("{key}.{field}"), "empty", "at least one antenna position"));
            }
            if antennas.iter().flatten().chain(&self.position_m).any(|coordinate| !coordinate.is_finite()) {
                return Err(Error::setting(format!("{key}.{field}"), "not finite", "finite positions in metres"));
            }
        }
        Ok(())
    }

    /// Refuses a falling chirp where `what` knows rising ones only.
    pub fn refuse_falling(&self, key: &str, what: &str) -> Result<()> {
        if self.slope_hz_per_s > 0.0 {
            return Ok(());
        }
        Err(Error::setting(format!("{key}.slope_hz_per_s"), self.slope_hz_per_s, format!("a rising chirp (above zero): {what}"))
            .with_hint(
                "check, compare and recognize read falling chirps; with the samples of every chirp in reverse order, the slope \
                 positive and the start at the last sample's frequency, the recording is that of a rising chirp, but for what \
                 moves within a chirp",
            ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mmmesh_radar_keeps_every_rule() {
        let radar = Radar::mmmesh(10);
        radar.check("radar").unwrap();
        let all = checks(&radar, Some(7.0)).into_iter().chain([fastest(&radar, 2.0)]);
        assert!(all.into_iter().all(|check| check.passed == Some(true)));
    }

    #[test]
    fn a_room_beyond_the_unambiguous_range_is_noticed() {
        let radar = Radar::mmmesh(10);
        let broken: Vec<_> = checks(&radar, Some(12.0)).into_iter().filter(|check| check.passed == Some(false)).collect();
        assert_eq!(broken.len(), 1);
        assert_eq!(broken[0].rule, "farthest range <= max range");
    }

    #[test]
    fn a_falling_chirp_is_a_radar_with_the_limits_of_a_rising_one_and_refused_where_it_is_not_known() {
        let rising = Radar::mmmesh(1);
        let falling = Radar { slope_hz_per_s: -rising.slope_hz_per_s, ..rising.clone() };
        falling.check("radar").unwrap();
        assert_eq!(falling.max_range_m(), rising.max_range_m());
        assert_eq!(falling.range_resolution_m(), rising.range_resolution_m());
        rising.refuse_falling("radar", "nothing").unwrap();
        let error = falling.refuse_falling("radar", "the simulator knows no other").unwrap_err();
        assert_eq!(
            error.to_string(),
            "`radar.slope_hz_per_s` is -60012000000000, expected a rising chirp (above zero): the simulator knows no other"
        );
        for slope in [0.0, f64::NAN, f64::INFINITY] {
            assert!(Radar { slope_hz_per_s: slope, ..rising.clone() }.check("radar").is_err(), "{slope}");
        }
    }

    #[test]
    fn chirps_that_are_alone_in_their_frame_measure_slow_velocities_only() {
        let many = Radar::mmmesh(10);
        assert_eq!(many.max_tracked_velocity_mps(), many.max_velocity_mps());
        let one = Radar { loops_per_frame: 1, ..many };
        assert!((one.max_tracked_velocity_mps() - one.wavelength_m() / 0.4).abs() < 1e-12);
    }

    #[test]
    fn a_radar_without_receivers_is_refused_by_name() {
        let radar = Radar { rx_m: vec![], ..Radar::mmmesh(1) };
        assert_eq!(
            radar.check("radar").unwrap_err().to_string(),
            "`radar.rx_m` is empty, expected at least one antenna position"
        );
    }
}
