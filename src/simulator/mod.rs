//! The simulator: the whole journey as one Burn module.
//!
//! Features of the body (tri-plane) and of the room (encoded coordinates) are decoded into materials and Gaussian
//! patches; the scene says where they are and who is seen; paths and the coherent sum make IF samples of them.
//!
//! Phases are those of every chirp and antenna. Amplitudes are evaluated once per frame, at its middle and between the
//! antennas' centres (a body part that turns at 5 rad/s turns by 8° within a 27 ms frame), or like phases
//! ([`Amplitudes::Paper`]).

mod config;
mod equations;
mod groups;
mod parts;
mod point_tensors;
mod points;
mod scattering;
mod scene;
mod sight;
mod surfaces;

pub use config::{PathModel, SimulatorConfig};
pub use equations::{Amplitudes, EquationsConfig, Gains, Weights};
pub use parts::Part;
pub use scene::{FrameView, Scene, Seen};
pub use surfaces::{SceneConstants, Surface, Surfaces};

use burn::{
    module::Module,
    tensor::{DType, Device, Tensor},
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{
    body::{PoseTensors, PosedFrame},
    complex::Complex,
    effects::{Context, Effects},
    features::{Extent, Gcn, TriPlane, draw},
    if_signal::{Noise, noise},
    radar::Radar,
    scatterers::{decoders::Decoders, material::Material, patches::Patch},
};

/// What learns.
#[derive(Module, Debug)]
pub struct Simulator {
    pub triplane: TriPlane,
    pub graph: Gcn,
    pub decoders: Decoders,
    pub noise: Noise,
    /// Physics beyond the plain model.
    pub effects: Effects,
    #[module(skip)]
    config: SimulatorConfig,
    /// The box that canonical points are looked up in.
    #[module(skip)]
    extent: Extent,
}

/// Training regularises with the masked graph convolution; inference does not.
#[derive(Clone, Copy, Debug)]
pub enum Mode {
    Inference,
    /// `seed` decides whether the graph is on in this step and which vertices it hides.
    Training {
        seed: u64,
    },
}

impl Simulator {
    /// The same with other effects, which `config` names.
    pub fn with_effects(self, config: &SimulatorConfig, effects: Effects) -> Self {
        Self { effects, config: config.clone(), ..self }
    }
}

impl SimulatorConfig {
    /// A simulator as it is before training; equal seeds give equal parameters on every backend.
    ///
    /// `extent`: the box around the canonical body.
    pub fn init(&self, extent: Extent, seed: u64, device: &Device) -> Simulator {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let body_features = self.triplane.features_out();
        Simulator {
            triplane: self.triplane.init(&mut rng, device),
            graph: self.graph.init(body_features, &mut rng, device),
            decoders: self.decoders.init(body_features, self.encoding.features_out(), &mut rng, device),
            noise: self.noise.init(device),
            effects: Effects::new(&self.effects, device),
            config: self.clone(),
            extent,
        }
    }
}

impl Simulator {
    /// The settings that it was made with.
    pub fn config(&self) -> &SimulatorConfig {
        &self.config
    }

    /// The device that its parameters are on.
    pub fn device(&self) -> Device {
        self.decoders.body_gain.log_gain.val().device()
    }

    /// The tensors of a scene that never change; made once.
    pub fn constants(&self, scene: &Scene) -> SceneConstants {
        SceneConstants::new(scene, &self.config, &self.extent, &self.device())
    }

    /// Decodes materials and patches of all scatterers.
    ///
    /// # Gradient
    /// Flows to the planes, the graph's layers and the decoders.
    pub fn surfaces(&self, constants: &SceneConstants, mode: Mode) -> Surfaces {
        let paths = self.config.paths;
        let body = constants.body.as_ref().map(|body| {
            let features = self.triplane.forward(&body.sampler);
            let at_points = |features: Tensor<2>| match &body.points {
                Some(points) => points.apply(features),
                None => features,
            };
            let material = |features: &Tensor<2>| {
                let regularised = self.regularise(features.clone(), body, mode);
                self.decoders.body_material.forward(at_points(regularised))
            };
            Surface {
                material: paths.has_microfacets().then(|| material(&features)),
                patch: paths.has_indirect().then(|| self.decoders.body_patch.forward(at_points(features))),
            }
        });
        let room = constants.room.as_ref().map(|encoded| Surface {
            material: paths.has_microfacets().then(|| self.decoders.room_material.forward(encoded.clone())),
            patch: paths.has_indirect().then(|| self.decoders.room_patch.forward(encoded.clone())),
        });
        Surfaces { body, room }
    }

    fn regularise(&self, features: Tensor<2>, body: &surfaces::BodyConstants, mode: Mode) -> Tensor<2> {
        match mode {
            Mode::Training { seed } => {
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                if !rng.random_bool(self.config.graph.used) {
                    return features;
                }
                let mask = draw::mask(body.vertices, self.config.graph.masked, &mut rng, &features.device());
                self.graph.forward(&body.graph, features, Some(mask))
            }
            Mode::Inference if self.config.graph.at_inference => self.graph.forward(&body.graph, features, None),
            Mode::Inference => features,
        }
    }

    /// The signal before noise: direct and indirect paths, as the settings have it, and what the effects make of them.
    ///
    /// # Shapes
    /// - result: `[tx, rx, loop, sample]`, in the units of the recordings it was trained on
    ///
    /// # Gradient
    /// Flows to everything that learns.
    pub fn clean_signal(&self, scene: &Scene, view: &FrameView, surfaces: &Surfaces) -> Complex<4> {
        self.signal_of_pose(scene, view, surfaces, None)
    }

    /// The same of a person who moves otherwise than the scene's.
    ///
    /// # Gradient
    /// Flows to everything that learns, and to the pose through positions, directions, normals, areas and facets; not through
    /// who is seen, not through normals at every chirp (`equations.amplitudes = "paper"`), and not through what effects know of the body beside its positions.
    ///
    /// # Panics
    /// When a pose is given and the scene poses its body on the host.
    pub fn signal_of_pose(&self, scene: &Scene, view: &FrameView, surfaces: &Surfaces, pose: Option<&PoseTensors>) -> Complex<4> {
        if self.effects.is_empty() {
            return self.paths_signal(scene, view, surfaces, pose);
        }
        let frame = view.frame;
        // After lost frames a later one is seen, as far as the motion lasts.
        let later = match self.effects.frame_shift(frame, &self.device()) {
            0 => None,
            shift => scene.view(frame + shift).ok(),
        };
        let seen = later.as_deref().unwrap_or(view);
        let mut signal = self.paths_signal(scene, seen, surfaces, pose);
        if let Some(reflectors) = self.reflectors_signal(scene, frame, seen) {
            signal = signal.add(reflectors);
        }
        self.effects.apply(signal, &Context { radar: &scene.radar, frame, farthest_m: scene.farthest_m() })
    }

    /// The sum of direct and indirect paths.
    fn paths_signal(&self, scene: &Scene, view: &FrameView, surfaces: &Surfaces, pose: Option<&PoseTensors>) -> Complex<4> {
        let posed = scene.posed(view, pose, &self.device());
        let posed = posed.as_ref();
        let mut sum: Option<Complex<4>> = None;
        let mut add = |part: Complex<4>| {
            sum = Some(match sum.take() {
                Some(sum) => sum.add(part),
                None => part,
            });
        };
        if self.config.paths.has_direct() {
            add(self.direct_signal(scene, view, surfaces, posed));
        }
        if self.config.paths.has_indirect() && !scene.proxies.is_empty() {
            add(self.indirect_signal(scene, view, surfaces, posed));
        }
        sum.unwrap_or_else(|| {
            let [_, tx, rx, loops, samples] = scene.radar.dims();
            Complex::zeros([tx, rx, loops, samples], &self.device())
        })
    }

    /// Adds noise; equal seeds give equal noise on every backend.
    pub fn with_noise(&self, radar: &Radar, clean: Complex<4>, seed: u64) -> Complex<4> {
        let normals = noise::normals(seed, clean.dims(), &clean.device(), DType::F32);
        let normals = self.effects.shape_noise(normals, radar, seed);
        self.noise.add_to(clean, normals)
    }

    /// σ² of each component of the noise that [`Self::with_noise`] adds to a frame, `[1]`, with gradients; `None` without noise. What an
    /// effect makes of the noise's spectrum is left out.
    pub fn noise_variance(&self, clean: &Complex<4>) -> Option<Tensor<1>> {
        self.noise.deviation(clean).map(|deviation| deviation.clone() * deviation)
    }

    /// σ of the noise over the signal's mean amplitude; `None` for a law without a rate.
    pub fn noise_rate(&self) -> Option<f64> {
        Some(f64::from(self.noise.rate(&self.device())?.into_scalar::<f32>()))
    }

    /// The first stage of the journey with a value that is not finite; for the message when training breaks.
    pub fn first_non_finite_stage(
        &self,
        scene: &Scene,
        view: &FrameView,
        constants: &SceneConstants,
        mode: Mode,
    ) -> Option<&'static str> {
        if let Some(body) = &constants.body {
            let features = self.triplane.forward(&body.sampler);
            if !is_finite(features.clone()) {
                return Some("tri-plane features");
            }
            if !is_finite(self.regularise(features, body, mode)) {
                return Some("graph convolution");
            }
        }
        let surfaces = self.surfaces(constants, mode);
        for surface in [&surfaces.body, &surfaces.room].into_iter().flatten() {
            let finite = |material: &Material| is_finite(material.refraction.clone()) && is_finite(material.roughness.clone());
            if !surface.material.as_ref().is_none_or(finite) {
                return Some("material decoder");
            }
            let finite = |patch: &Patch| is_finite(patch.lobes.clone()) && is_finite(patch.offset_m.clone());
            if !surface.patch.as_ref().is_none_or(finite) {
                return Some("patch decoder");
            }
        }
        let posed: Option<PosedFrame> = scene.posed(view, None, &self.device());
        let posed = posed.as_ref();
        let finite = |signal: Complex<4>| is_finite(signal.re) && is_finite(signal.im);
        if self.config.paths.has_direct() && !finite(self.direct_signal(scene, view, &surfaces, posed)) {
            return Some("direct path");
        }
        if self.config.paths.has_indirect()
            && !scene.proxies.is_empty()
            && !finite(self.indirect_signal(scene, view, &surfaces, posed))
        {
            return Some("indirect path");
        }
        let clean = self.clean_signal(scene, view, &surfaces);
        if !finite(clean.clone()) {
            return Some("effects");
        }
        (!finite(self.with_noise(&scene.radar, clean, 0))).then_some("noise")
    }
}

/// Whether no element is NaN or infinite.
pub fn is_finite<const D: usize>(tensor: Tensor<D>) -> bool {
    let data = tensor.detach().into_data().convert::<f32>();
    data.as_slice::<f32>().expect("converted").iter().all(|value| value.is_finite())
}

#[cfg(test)]
mod effects_tests;
