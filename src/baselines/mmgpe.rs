//! An mmGPE-like simulator: every visible vertex of the body reflects with fixed empirical lobes, direct path only.
//!
//! mmGPE (Xue et al., MobiCom 2023) has no public code, and HybridSim's paper says of it only that it is a physical
//! augmenter which leaves the residual video phase out. Our reading, where the text leaves it open:
//!
//! - A vertex returns A = diffuse · cos θ_i + specular · max(0, r·o)^exponent, with i towards the transmitters, o towards
//!   the receivers and r the mirror direction of i (Lambert and Phong). No area weight: a vertex is a reflector.
//! - The lobes' weights and exponent are the same for all of the body. Their common factor is the calibrated gain.
//! - Back faces are culled by the vertex normal, occluded vertices by hidden point removal, both in the middle of a frame.
//! - Spreading 1/(d_tx d_rx); phase f_c τ + S t τ at the true time of every chirp, transmitters in their order.
//! - No room, no second bounce.
//!
//! [`MmGpeConfig::over_the_surface`] is no method of others but a control: the same lobes, with every facet integrated as our
//! dense surface does. What it gains over the vertices is the sampling's, not the network's.

use burn::tensor::{DType, Device, Tensor, TensorData};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{Baseline, check_range};
use crate::{
    body::{Interpolation, Sampling, SurfaceConfig},
    complex::Complex,
    error::Result,
    if_signal::{SumForm, direct_signal},
    paths::{Dechirp, Points},
    person::Person,
    radar::Radar,
    simulator::{FrameView, Scene, SimulatorConfig},
};

/// Settings of [`MmGpe`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MmGpeConfig {
    /// Weight of the Lambert term.
    pub diffuse: f64,
    /// Weight of the specular lobe.
    pub specular: f64,
    /// Phong's: larger is narrower; 10 halves the lobe 21° from the mirror direction.
    pub exponent: f64,
    /// Between poses.
    pub interpolation: Interpolation,
    /// Where the reflectors sit; facets return by their area, with their phase integrated over it.
    pub surface: SurfaceConfig,
}

impl Default for MmGpeConfig {
    fn default() -> Self {
        let (interpolation, surface) = (Interpolation::default(), SurfaceConfig::vertices());
        Self { diffuse: 0.3, specular: 0.7, exponent: 10.0, interpolation, surface }
    }
}

impl MmGpeConfig {
    /// Summed over all of the surface in place of its vertices.
    pub fn over_the_surface() -> Self {
        Self { surface: SurfaceConfig { sampling: Sampling::Facets, ..SurfaceConfig::default() }, ..Self::default() }
    }

    /// Refuses what no reflector has.
    pub fn check(&self) -> Result<()> {
        check_range("diffuse", self.diffuse, 0.0, 1.0)?;
        check_range("specular", self.specular, 0.0, 1.0)?;
        check_range("exponent", self.exponent, 0.0, 1e4)?;
        self.surface.check("surface")
    }

    /// What a unit normal answers from one unit direction to another.
    fn response(&self, normal: Vector3<f64>, incident: Vector3<f64>, outgoing: Vector3<f64>) -> f64 {
        let cosine = normal.dot(&incident);
        // Culled: the back face shows no lobe either.
        if cosine <= 0.0 || normal.dot(&outgoing) <= 0.0 {
            return 0.0;
        }
        let mirrored = normal * (2.0 * cosine) - incident;
        self.diffuse * cosine + self.specular * mirrored.dot(&outgoing).max(0.0).powf(self.exponent)
    }
}

/// The mmGPE-like simulator of one person in front of one radar.
pub struct MmGpe {
    config: MmGpeConfig,
    scene: Scene,
    device: Device,
}

impl MmGpe {
    /// # Errors
    /// Settings that cannot work, or a person who cannot be posed.
    pub fn new(radar: &Radar, person: &Person, config: &MmGpeConfig, device: &Device) -> Result<Self> {
        config.check()?;
        let (interpolation, surface) = (config.interpolation, config.surface.clone());
        let sampled = SimulatorConfig { interpolation, surface, ..SimulatorConfig::default() };
        let scene = Scene::new(radar, None, Some(person), &sampled)?;
        Ok(Self { config: config.clone(), scene, device: device.clone() })
    }

    /// Visible vertices, or facets, and what they return.
    fn returns(&self, view: &FrameView) -> (Vec<usize>, Vec<f64>) {
        let Some(body) = &view.body else { return Default::default() };
        let [tx_m, rx_m] = self.radar().antenna_centres_m();
        let response = |&vertex: &usize| {
            let place = Vector3::from(body.position_m[vertex]);
            let towards = |antenna_m: [f64; 3]| (Vector3::from(antenna_m) - place).normalize();
            let found = self.config.response(Vector3::from(body.normal[vertex]), towards(tx_m), towards(rx_m));
            let size = if self.scene.facets { body.area_m2[vertex] } else { 1.0 };
            (found > 0.0).then_some((vertex, found * size))
        };
        view.direct.body.iter().filter_map(response).unzip()
    }
}

impl Baseline for MmGpe {
    fn radar(&self) -> &Radar {
        &self.scene.radar
    }

    fn clean_signal(&self, frame: usize) -> Result<Complex<4>> {
        let view = self.scene.view(frame)?;
        let (vertices, response) = self.returns(&view);
        let (Some(body), Some(posed)) = (&self.scene.body, &view.body) else { unreachable!("the scene has a person") };
        let reference_m: Vec<[f64; 3]> = vertices.iter().map(|&vertex| posed.position_m[vertex]).collect();
        let response = TensorData::new(response, [vertices.len(), 1]).convert_dtype(DType::F32);
        let response: Tensor<2> = Tensor::from_data(response, &self.device);
        let loops = self.radar().loops_per_frame;
        Ok(transmitters(self.radar(), |tx| {
            let displacement = body.displacement(posed, &vertices, tx * loops..(tx + 1) * loops, None, &self.device);
            let amplitude =
                self.scene.body_amplitude((posed, None), &vertices, (&reference_m, &displacement), tx, response.clone());
            let points = Points { reference_m: &reference_m, displacement: &displacement, amplitude: &amplitude };
            direct_signal(points, self.radar(), tx, Dechirp::Paper, SumForm::Auto)
        }))
    }
}

/// `[rx, loop, sample]` of every transmitter, stacked.
pub(super) fn transmitters(radar: &Radar, signal: impl Fn(usize) -> Complex<3>) -> Complex<4> {
    let [_, tx, rx, loops, samples] = radar.dims();
    let stacked = (0..tx).map(|tx| signal(tx).reshape([1, rx, loops, samples])).collect();
    Complex::cat(stacked, 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baselines::test_support::{moving_ball, peak, radar};

    #[test]
    fn over_the_surface_a_ball_of_twice_the_radius_returns_about_four_times_the_power() {
        let radar = radar();
        let power = |radius: f64| {
            let person = moving_ball([0.4, 2.8, 0.1], radius, [0.0, 0.0, 0.0]);
            let surface = MmGpe::new(&radar, &person, &MmGpeConfig::over_the_surface(), &Device::flex()).unwrap();
            let signal: Vec<num_complex::Complex32> = surface.clean_signal(0).unwrap().to_host();
            signal.iter().map(|value| f64::from(value.norm_sqr())).sum::<f64>()
        };
        // The cross-section of a sphere is π r²; its nearest point is a radius closer.
        let ratio = power(0.04) / power(0.02);
        println!("power of twice the radius: {ratio}");
        assert!((ratio / 4.0 - 1.0).abs() < 0.1, "{ratio}");
    }

    #[test]
    fn a_moving_ball_is_in_its_range_and_doppler_bin() {
        let radar = radar();
        for velocity in [1.2, -2.0] {
            let person = moving_ball([0.4, 2.8, 0.1], 0.02, [0.0, velocity, 0.0]);
            let signal = MmGpe::new(&radar, &person, &MmGpeConfig::default(), &Device::flex()).unwrap().clean_signal(0).unwrap();
            let [found, range] = peak(&radar, signal);
            // The near side, from the antennas' middle; its radial velocity is that of the ball along the line of sight.
            let [tx, rx] = radar.antenna_centres_m();
            let distance = |antenna: [f64; 3]| (Vector3::new(0.4, 2.8, 0.1) - Vector3::from(antenna)).norm();
            let wanted = 0.5 * (distance(tx) + distance(rx)) - 0.02;
            assert!((range - wanted).abs() <= 0.5 * radar.range_resolution_m() + 0.02, "{range} m, wanted {wanted} m");
            let radial = velocity * 2.8 / (wanted + 0.02);
            assert!((found - radial).abs() <= 0.55 * radar.velocity_resolution_mps(), "{found} m/s, wanted {radial} m/s");
        }
    }

    #[test]
    fn lobes_point_where_they_must() {
        let config = MmGpeConfig { diffuse: 0.0, specular: 1.0, ..Default::default() };
        let towards = |degrees: f64| Vector3::new(degrees.to_radians().sin(), 0.0, degrees.to_radians().cos());
        let normal = Vector3::z();
        assert!((config.response(normal, towards(30.0), towards(-30.0)) - 1.0).abs() < 1e-12, "the mirror direction");
        assert!(config.response(normal, towards(30.0), towards(30.0)) < 0.51f64.powi(10) + 1e-12);
        assert_eq!(config.response(normal, towards(100.0), towards(-80.0)), 0.0, "lit from behind");
        assert_eq!(config.response(normal, towards(80.0), towards(-100.0)), 0.0, "seen from behind");
        let lambert = MmGpeConfig { diffuse: 1.0, specular: 0.0, ..Default::default() };
        assert!((lambert.response(normal, towards(60.0), towards(10.0)) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn only_the_near_side_returns() {
        let radar = radar();
        let person = moving_ball([0.0, 3.0, 0.0], 0.3, [0.0; 3]);
        let baseline = MmGpe::new(&radar, &person, &MmGpeConfig::default(), &Device::flex()).unwrap();
        let view = baseline.scene.view(0).unwrap();
        let (vertices, response) = baseline.returns(&view);
        let places = &view.body.as_ref().unwrap().position_m;
        assert!(vertices.len() > places.len() / 4, "{} of {}", vertices.len(), places.len());
        // Tangents from the radar touch the ball 3 cm before its middle.
        assert!(vertices.iter().all(|&vertex| places[vertex][1] < 2.98), "the far side is hidden");
        assert!(response.iter().all(|value| value.is_finite() && *value > 0.0));
    }

    #[test]
    fn settings_that_cannot_work_are_named() {
        let refused = |config: MmGpeConfig| config.check().unwrap_err().to_string();
        assert!(refused(MmGpeConfig { diffuse: -0.1, ..Default::default() }).starts_with("`diffuse` is -0.1"));
        assert!(refused(MmGpeConfig { exponent: f64::NAN, ..Default::default() }).starts_with("`exponent` is NaN"));
    }
}
