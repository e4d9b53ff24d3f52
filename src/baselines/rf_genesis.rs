//! An RF-Genesis-like simulator: rays from the radar through a pixel grid onto the body, one return for each hit.
//!
//! Chen and Zhang, "RF Genesis" (SenSys 2023), read together with its public code (Asixa/RF-Genesis, `pathtracer.py`,
//! `radar.py` and `signal_generator.py`; written anew here). What it does:
//!
//! - A camera at the radar looks along boresight through 128 × 128 pixels. The body is lit from the camera and diffuse, so
//!   a hit at distance d under the angle θ has the intensity cos θ/d².
//! - Images are traced 30 times a second. In between, position and intensity of each *pixel* are interpolated linearly;
//!   where only one of the two images has a hit, it stands still.
//! - A hit's amplitude is its intensity times (λ/4πD)², with D the way out and back; its phase f₀τ + Stτ − Sτ²/2, still
//!   within a chirp. All transmitters send at once (no TDM).
//! - Its room is a picture that a diffusion model draws. There is none here, as there is no such picture of a given room.
//!
//! The released code departs from that in three places, which [`RfGenesisConfig::released`] keeps and the default corrects:
//! chirps are spread over the whole frame period, which multiplies every Doppler shift by frame period over chirping time;
//! the image's distance is used as echo strength in place of its intensity; and images are overwritten while they are
//! interpolated, so that a pixel which the body left keeps its last hit for the rest of the recording.
//!
//! Our reading: the camera's 60° are widened where the body would leave them; the light's cone and the image's blur (a
//! Gaussian of half a pixel, 32 samples) are left out; at the end of the motion the body stands still.

mod image;

use std::sync::Mutex;

use burn::tensor::{DType, Device, Tensor, TensorData};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Baseline, check_range, mmgpe::transmitters};
use crate::{
    body::{Displacement, Interpolation, PosedBody, SurfaceConfig},
    complex::Complex,
    error::{Error, Result},
    if_signal::{SumForm, direct_signal},
    paths::{Amplitude, Dechirp, Points},
    person::Person,
    radar::{Radar, SPEED_OF_LIGHT},
};
use image::{Camera, Hit, Images};

/// When the chirps of a frame happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Schedule {
    /// When the first transmitter of each loop sends.
    True,
    /// Evenly over the frame period (released code).
    WholeFrame,
}

/// What of an image is a hit's strength.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Strength {
    Intensity,
    /// Released code.
    Distance,
}

/// Settings of [`RfGenesis`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RfGenesisConfig {
    /// Along each side of the image.
    pub pixels: usize,
    /// Of the camera; wider where the body would leave it.
    pub fov_deg: f64,
    /// Images in a second.
    pub image_rate_hz: f64,
    pub schedule: Schedule,
    pub strength: Strength,
    /// Whether a pixel that the body left keeps its last hit (released code).
    pub trails: bool,
}

impl Default for RfGenesisConfig {
    /// Corrected.
    fn default() -> Self {
        Self {
            pixels: 128,
            fov_deg: 60.0,
            image_rate_hz: 30.0,
            schedule: Schedule::True,
            strength: Strength::Intensity,
            trails: false,
        }
    }
}

impl RfGenesisConfig {
    /// As its code was released.
    pub fn released() -> Self {
        Self { schedule: Schedule::WholeFrame, strength: Strength::Distance, trails: true, ..Self::default() }
    }

    /// Refuses what no camera has.
    pub fn check(&self) -> Result<()> {
        check_range("pixels", self.pixels as f64, 1.0, 4096.0)?;
        check_range("fov_deg", self.fov_deg, 1.0, 160.0)?;
        check_range("image_rate_hz", self.image_rate_hz, 1.0, 1e5)
    }
}

/// The RF-Genesis-like simulator of one person in front of one radar.
pub struct RfGenesis {
    config: RfGenesisConfig,
    radar: Radar,
    images: Mutex<Images>,
    /// First and last time that the motion knows.
    span_s: (f64, f64),
    device: Device,
}

/// Hits as the coherent sum takes them; lists are `[point, chirp]`.
struct Returns {
    reference_m: Vec<[f64; 3]>,
    displacement_m: [Vec<f32>; 3],
    re: Vec<f32>,
    im: Vec<f32>,
}

impl RfGenesis {
    /// # Errors
    /// Settings that cannot work, or a person who cannot be posed or has no faces to hit.
    pub fn new(radar: &Radar, person: &Person, config: &RfGenesisConfig, device: &Device) -> Result<Self> {
        config.check()?;
        radar.refuse_falling("radar", "the baselines make no falling ones")?;
        if person.faces().is_empty() {
            return Err(Error::Usage {
                message: "the person has no faces: there is nothing for rays to hit".into(),
                hint: Some("give a body or meshes with faces".into()),
            });
        }
        let body = PosedBody::new(person, &SurfaceConfig::vertices(), Interpolation::default())?;
        let span_s = body.span_s();
        let camera = Camera::covering(radar.centre_m(), &body, person.pose_times_s().len(), config);
        let images = Mutex::new(Images::new(body, camera, config));
        Ok(Self { config: config.clone(), radar: radar.clone(), images, span_s, device: device.clone() })
    }

    /// `[chirp]`: radar time at which each loop of a frame sees the body, seconds.
    fn chirp_times_s(&self, frame: usize, schedule: Schedule) -> Vec<f64> {
        let radar = &self.radar;
        let loops = radar.loops_per_frame;
        let time = |index: usize| match schedule {
            // The middle of the sampling window is where the body stands still for this chirp.
            Schedule::True => radar.chirp_time_s(frame, 0, index) + radar.sample_time_s(radar.samples_per_chirp / 2),
            Schedule::WholeFrame => (frame as f64 + index as f64 / loops as f64) * radar.frame_period_s,
        };
        (0..loops).map(time).collect()
    }

    fn refuse_outside_the_motion(&self, frame: usize) -> Result<()> {
        let times = self.chirp_times_s(frame, Schedule::True);
        let (first, last) = (times[0], times[times.len() - 1]);
        let (start, end) = self.span_s;
        if first >= start - 1e-9 && last <= end + 1e-9 {
            return Ok(());
        }
        Err(Error::Usage {
            message: format!(
                "frame {frame} from {first:.4} s to {last:.4} s lies outside the motion, which lasts from {start:.4} s to {end:.4} s"
            ),
            hint: Some("give a longer motion, or shift it with motion.start_s".into()),
        })
    }

    fn returns(&self, frame: usize) -> Result<Returns> {
        self.refuse_outside_the_motion(frame)?;
        let times = self.chirp_times_s(frame, self.config.schedule);
        // Place of each chirp between the images.
        let places: Vec<f64> = times.iter().map(|time| (time - self.span_s.0).max(0.0) * self.config.image_rate_hz).collect();
        let (low, high) = (places[0].floor() as usize, places[places.len() - 1].floor() as usize + 1);
        let images = self.images.lock().expect("no panic while locked").range(low..high + 1)?;
        let pixels: Vec<usize> =
            (0..self.config.pixels.pow(2)).filter(|&pixel| images.iter().any(|image| image[pixel].is_some())).collect();
        let path = Path::new(&self.radar);
        let rows: Vec<([f64; 3], Vec<[f32; 5]>)> = pixels
            .into_par_iter()
            .map(|pixel| {
                let reference = images.iter().find_map(|image| image[pixel]).expect("chosen for its hit").position_m;
                let at_chirp = |place: &f64| {
                    let image = place.floor() as usize - low;
                    let hit = Hit::between(images[image][pixel], images[image + 1][pixel], place.fract())?;
                    let strength = match self.config.strength {
                        Strength::Intensity => hit.intensity,
                        Strength::Distance => hit.distance_m,
                    };
                    let [re, im] = path.amplitude(hit.position_m, strength);
                    let moved = |axis: usize| (hit.position_m[axis] - reference[axis]) as f32;
                    Some([moved(0), moved(1), moved(2), re as f32, im as f32])
                };
                // A pixel without a hit at this chirp is silent.
                (reference, places.iter().map(|place| at_chirp(place).unwrap_or_default()).collect())
            })
            .collect();
        let column = |which: usize| rows.iter().flat_map(|(_, row)| row.iter().map(move |chirp| chirp[which])).collect();
        Ok(Returns {
            reference_m: rows.iter().map(|(reference, _)| *reference).collect(),
            displacement_m: [column(0), column(1), column(2)],
            re: column(3),
            im: column(4),
        })
    }
}

impl Baseline for RfGenesis {
    fn radar(&self) -> &Radar {
        &self.radar
    }

    fn clean_signal(&self, frame: usize) -> Result<Complex<4>> {
        let Returns { reference_m, displacement_m, re, im } = self.returns(frame)?;
        let dims = [reference_m.len(), self.radar.loops_per_frame];
        let tensor = |values: Vec<f32>| Tensor::<2>::from_data(TensorData::new(values, dims), (&self.device, DType::F32));
        let [x, y, z] = displacement_m.map(tensor);
        let displacement = Displacement { x, y, z };
        let amplitude = Amplitude { re: tensor(re), im: Some(tensor(im)) };
        Ok(transmitters(&self.radar, |tx| {
            let points = Points { reference_m: &reference_m, displacement: &displacement, amplitude: &amplitude };
            // The residual video phase is in the amplitude: the exact form would add motion within a chirp.
            direct_signal(points, &self.radar, tx, Dechirp::Paper, SumForm::Auto)
        }))
    }
}

/// Path loss and residual video phase, the same for all antennas: they stand together to within centimetres.
struct Path {
    antennas_m: [[f64; 3]; 2],
    wavelength_m: f64,
    slope_hz_per_s: f64,
}

impl Path {
    fn new(radar: &Radar) -> Self {
        Self {
            antennas_m: radar.antenna_centres_m(),
            wavelength_m: SPEED_OF_LIGHT / radar.start_frequency_hz,
            slope_hz_per_s: radar.slope_hz_per_s,
        }
    }

    /// strength · (λ/4πD)² · exp(−jπSτ²), times the legs' lengths, by which the coherent sum divides.
    fn amplitude(&self, position_m: [f64; 3], strength: f64) -> [f64; 2] {
        let [out, back] = self.antennas_m.map(|antenna| crate::paths::distance(antenna, position_m));
        let whole_m = out + back;
        let loss = (self.wavelength_m / (4.0 * std::f64::consts::PI * whole_m)).powi(2);
        let residual = -std::f64::consts::PI * self.slope_hz_per_s * (whole_m / SPEED_OF_LIGHT).powi(2);
        let (sin, cos) = residual.sin_cos();
        let amplitude = strength * loss * out * back;
        [amplitude * cos, amplitude * sin]
    }
}

#[cfg(test)]
mod tests;
