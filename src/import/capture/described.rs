//! What the numbers of a TI radar's description can be.

use super::schedule::TiRadar;
use crate::error::{Error, Result};
use crate::radar::Sampling;

/// Loops of a frame and samples of a chirp are 16-bit numbers of the radar's interface (rlFrameCfg_t, rlProfileCfg_t).
const MOST: usize = 65_535;

impl TiRadar {
    /// The same, if samples of it can be found in a stream.
    ///
    /// # Errors
    /// No receiver, no subframe, no chirp, no loop or no sample, more of them than the radar can be told, samples that last longer than
    /// their chirp or that do not fill the lanes.
    pub fn checked(self) -> Result<Self> {
        let refuse = |field: &str, found: String, expected: String| {
            Err(Error::field(&self.file, field, found, expected).with_hint("take the description that was sent to the radar"))
        };
        if self.rx_mask == 0 {
            return refuse("receivers", "none".into(), "at least one receiver".into());
        }
        if self.bursts.is_empty() {
            return refuse("subframes", "none".into(), "at least one subframe".into());
        }
        for burst in &self.bursts {
            if burst.chirps.is_empty() {
                return refuse("chirps", "a frame of none".into(), "at least one chirp".into());
            }
            if !(1..=MOST).contains(&burst.loops) {
                return refuse("number of loops", burst.loops.to_string(), format!("1 to {MOST}"));
            }
            for chirp in &burst.chirps {
                let profile = self.profile(chirp.profile)?;
                let samples = profile.samples;
                if !(1..=MOST).contains(&samples) {
                    return refuse("samples of a chirp", samples.to_string(), format!("1 to {MOST}"));
                }
                let sampled_s = profile.adc_start_s + samples as f64 / profile.sample_rate_hz;
                let period_s = profile.idle_s + chirp.extra_idle_s + profile.ramp_end_s;
                if !(sampled_s <= period_s && period_s.is_finite()) {
                    let found = format!("{samples} in {:.2} us", 1e6 * sampled_s);
                    return refuse("samples of a chirp", found, format!("as many as a chirp of {:.2} us has", 1e6 * period_s));
                }
                let group = self.lanes.count;
                if self.lanes.sampling == Sampling::Complex && !self.lanes.interleaved && !samples.is_multiple_of(group) {
                    let expected = format!("a multiple of {group}: the samples go out in groups, one a lane");
                    return refuse("samples of a chirp", samples.to_string(), expected);
                }
            }
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::capture::lanes::Lanes;
    use crate::import::capture::schedule::{Burst, Chirp, Profile};

    /// One transmitter, four receivers, two lanes.
    fn radar(loops: usize, samples: usize, rx_mask: usize) -> TiRadar {
        let profile = Profile {
            id: 0,
            start_frequency_hz: 77e9,
            slope_hz_per_s: 60e12,
            sample_rate_hz: 4e6,
            samples,
            idle_s: 1e-5,
            adc_start_s: 6e-6,
            ramp_end_s: 6e-5,
        };
        TiRadar {
            file: "radar.cfg".into(),
            profiles: vec![profile],
            bursts: vec![Burst::of(vec![Chirp { profile: 0, tx_mask: 1, extra_idle_s: 0.0 }], loops, 1, 0.0)],
            frame_period_s: 0.1,
            frames: None,
            rx_mask,
            devices: 1,
            lanes: Lanes { count: 2, interleaved: false, q_first: false, sampling: Sampling::Complex },
            notes: vec![],
        }
    }

    #[test]
    fn samples_longer_than_their_chirp_and_frames_without_subframes_are_refused() {
        // 6 us and 256 samples at 4 MHz, of a chirp of 70 us.
        let error = radar(128, 257, 15).checked().unwrap_err().to_string();
        assert!(
            error.contains("`samples of a chirp` is 257 in 70.25 us, expected as many as a chirp of 70.00 us has"),
            "{error}"
        );
        let error = TiRadar { bursts: vec![], ..radar(128, 256, 15) }.checked().unwrap_err().to_string();
        assert!(error.contains("`subframes` is none, expected at least one subframe"), "{error}");
        let error = TiRadar { profiles: vec![], ..radar(128, 256, 15) }.checked().unwrap_err().to_string();
        assert!(error.contains("expected a profile that is described: there is none"), "{error}");
    }

    #[test]
    fn descriptions_of_nothing_and_of_too_much_are_refused_by_name() {
        assert!(radar(128, 256, 15).checked().is_ok());
        for (loops, samples, rx_mask, message) in [
            (0, 256, 15, "`number of loops` is 0, expected 1 to 65535"),
            (999_999_999, 256, 15, "`number of loops` is 999999999, expected 1 to 65535"),
            (128, 0, 15, "`samples of a chirp` is 0, expected 1 to 65535"),
            (128, 255, 15, "`samples of a chirp` is 255, expected a multiple of 2"),
            (128, 256, 0, "`receivers` is none, expected at least one receiver"),
        ] {
            let error = radar(loops, samples, rx_mask).checked().unwrap_err().to_string();
            assert!(error.starts_with("radar.cfg") && error.contains(message), "{error}");
        }
    }
}
