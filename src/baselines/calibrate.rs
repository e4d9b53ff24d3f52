//! One gain for a whole site: from a method's own unit to that of its recordings.
//!
//! The power of the moving person is matched: on static-removed range-Doppler maps, summed over the cells within 20 dB of
//! the strongest one, of measured and simulated maps each on their own, so that a method whose person is in the wrong cells
//! still has the power that it should have. What is measured is taken above the noise's floor.

use num_complex::Complex32;

use super::Baseline;
use crate::{
    data::Recording,
    error::{Error, Result},
    evaluation::measured_frame,
    heatmap::{Analysis, HeatmapConfig, Map, Samples, StaticRemoval, remove_static},
    metrics::{MetricsConfig, person_cells},
    radar::Radar,
};

/// Powers of the moving person, summed over frames of training recordings.
#[derive(Clone, Copy, Debug, Default)]
pub struct Calibration {
    measured: f64,
    simulated: f64,
}

/// σ of each component of a receiver's noise, mean over up to so many frames of every recording: from the median of their
/// static-removed range-Doppler maps, which neither the room nor the person fills.
///
/// # Errors
/// Samples that cannot be read.
pub fn noise_level<'a>(recordings: impl IntoIterator<Item = &'a Recording>, frames: usize) -> Result<f64> {
    let (mut variance, mut count) = (0.0, 0.0);
    for recording in recordings {
        let radar = &recording.radar;
        let moving = Moving::new(radar);
        for frame in spread(recording, frames) {
            variance +=
                moving.floor(&moving.map(&measured_frame(recording, frame)?)) / HeatmapConfig::default().noise_gain(radar);
            count += 1.0;
        }
    }
    Ok((variance / f64::max(count, 1.0)).sqrt())
}

/// Up to so many whole frames of a recording, evenly.
fn spread(recording: &Recording, frames: usize) -> impl Iterator<Item = usize> + use<> {
    let whole: Vec<usize> = recording.whole_frames().collect();
    let count = frames.clamp(1, whole.len().max(1)).min(whole.len());
    (0..count).map(move |part| whole[(2 * part + 1) * whole.len() / (2 * count)])
}

impl Calibration {
    /// Looks at up to `frames` frames of a recording, spread over it.
    ///
    /// # Errors
    /// Samples that cannot be read, or a frame outside the motion.
    pub fn add(&mut self, recording: &Recording, baseline: &dyn Baseline, frames: usize) -> Result<()> {
        let radar = baseline.radar();
        let moving = Moving::new(radar);
        for frame in spread(recording, frames) {
            let measured = moving.map(&measured_frame(recording, frame)?);
            let simulated = moving.map(&baseline.clean_signal(frame)?.to_host());
            self.measured += person_power(&measured, moving.floor(&measured));
            self.simulated += person_power(&simulated, 0.0);
        }
        Ok(())
    }

    /// Amplitude to multiply the method's signal by.
    ///
    /// # Errors
    /// When nothing moves, in the recordings or in what is simulated.
    pub fn gain(&self) -> Result<f64> {
        for (what, power) in [("measured", self.measured), ("simulated", self.simulated)] {
            if !(power.is_finite() && power > 0.0) {
                return Err(Error::Usage {
                    message: format!("the {what} power of the moving person is {power}: no gain can be calibrated on it"),
                    hint: Some("calibrate on recordings in which a person moves before the radar".into()),
                });
            }
        }
        Ok((self.measured / self.simulated).sqrt())
    }
}

/// Static-removed range-Doppler power of single frames.
struct Moving {
    analysis: Analysis,
    dims: [usize; 5],
}

impl Moving {
    fn new(radar: &Radar) -> Self {
        let [_, tx, rx, loops, samples] = radar.dims();
        Self { analysis: Analysis::new(radar, &HeatmapConfig::default()), dims: [1, tx, rx, loops, samples] }
    }

    fn map(&self, frame: &[Complex32]) -> Map {
        self.analysis.range_doppler(&remove_static(Samples::new(frame, self.dims), StaticRemoval::Loops))
    }

    /// Mean power of a cell of noise, from the median. The mean of N exponential powers, one for each antenna pair, has
    /// its median at (1 − 1/9N)³ of its mean (Wilson and Hilferty).
    fn floor(&self, map: &Map) -> f64 {
        let antennas = (self.dims[1] * self.dims[2]) as f64;
        map.median() / (1.0 - 1.0 / (9.0 * antennas)).powi(3)
    }
}

/// Power above the floor in the person's cells.
fn person_power(map: &Map, floor: f64) -> f64 {
    let cells = person_cells(&map.db(0.0), MetricsConfig::default().person_db);
    let above = map.values.iter().zip(cells).filter(|(_, is_person)| *is_person).map(|(power, _)| power - floor);
    above.sum::<f64>().max(0.0)
}

#[cfg(test)]
mod tests {
    use burn::tensor::Device;

    use super::*;
    use crate::{
        baselines::{BaselineNoise, MmGpe, MmGpeConfig, Rendering, RfGenesis, RfGenesisConfig, test_support::*},
        data::{IfFrame, IfLayout, RecordingContents, write_recording},
        person::Person,
    };

    /// A recording of what a baseline itself makes, so many times louder.
    fn louder(baseline: &dyn Baseline, person: &Person, gain: f64, noise: BaselineNoise, folder: &std::path::Path) -> Recording {
        let radar = baseline.radar();
        let contents = RecordingContents {
            radar,
            room: None,
            person: Some(person),
            body_file: None,
            labels: Default::default(),
            layout: IfLayout::Complex,
            truth: None,
        };
        let rendering = Rendering { baseline, gain, noise };
        let [_, tx, rx, loops, samples] = radar.dims();
        write_recording(folder, &contents, &mut |frame| {
            let signal = rendering.frame(frame)?;
            let (re, im) = signal.iter().map(|value| (value.re, value.im)).unzip();
            Ok(IfFrame::new([tx, rx, loops, samples], re, Some(im)))
        })
        .unwrap()
    }

    #[test]
    fn a_known_scale_is_found_again_through_the_noise() {
        let radar = Radar { frames: 3, ..radar() };
        let person = moving_ball([0.2, 2.5, 0.0], 0.1, [0.3, 1.2, 0.0]);
        let device = Device::flex();
        let mmgpe = MmGpe::new(&radar, &person, &MmGpeConfig::default(), &device).unwrap();
        let released = RfGenesis::new(&radar, &person, &RfGenesisConfig::released(), &device).unwrap();
        for (baseline, gain) in [(&mmgpe as &dyn Baseline, 730.0), (&released as &dyn Baseline, 4e7)] {
            let folder = tempfile::tempdir().unwrap();
            let noise = BaselineNoise::Rate { seed: 1 };
            let recording = louder(baseline, &person, gain, noise, &folder.path().join("recording"));
            let mut calibration = Calibration::default();
            calibration.add(&recording, baseline, 2).unwrap();
            let found = calibration.gain().unwrap();
            assert!((found / gain - 1.0).abs() < 0.01, "{found}, wanted {gain}");
        }
    }

    #[test]
    fn a_known_noise_is_found_again_beside_the_person() {
        let radar = Radar { frames: 3, ..radar() };
        let person = moving_ball([0.2, 2.5, 0.0], 0.1, [0.3, 1.2, 0.0]);
        let mmgpe = MmGpe::new(&radar, &person, &MmGpeConfig::default(), &Device::flex()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let noise = BaselineNoise::Level { seed: 4, deviation: 3.0 };
        let recording = louder(&mmgpe, &person, 1e5, noise, &folder.path().join("recording"));
        let found = noise_level([&recording], 3).unwrap();
        assert!((found / 3.0 - 1.0).abs() < 0.05, "{found}");
    }

    #[test]
    fn silence_has_no_gain() {
        let error = Calibration { measured: 1.0, simulated: 0.0 }.gain().unwrap_err();
        assert!(error.to_string().contains("simulated power of the moving person is 0"), "{error}");
    }
}
