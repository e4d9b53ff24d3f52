//! The scene: all that does not learn. Where every scatterer is in each frame, and who sees it.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex},
};

use burn::tensor::{DType, Device, Tensor};
use nalgebra::Vector3;
use rayon::prelude::*;

use super::{
    SimulatorConfig,
    point_tensors::{directions, way},
};
use crate::{
    body::{BodyFrame, Displacement, PoseCorrection, PoseTensors, PosedBody, PosedFrame, Posing, Sampling, facets},
    error::Result,
    paths::Amplitude,
    person::{JOINT_NAMES, Person},
    radar::Radar,
    room::Room,
    scatterers::{
        room_patches::{Proxy, RoomPatches},
        visibility::frame_visibility,
    },
};

/// Indices of the scatterers that a viewpoint sees.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// Of the body's points.
    pub body: Vec<usize>,
    /// Of the room's patches.
    pub room: Vec<usize>,
}

/// One frame of a scene.
#[derive(Clone)]
pub struct FrameView {
    pub frame: usize,
    pub body: Option<BodyFrame>,
    /// `[point, xyz]` of the body: a direction on the surface that turns with it.
    pub tangent: Vec<[f64; 3]>,
    /// From the radar.
    pub direct: Seen,
    /// From every wall proxy.
    pub proxies: Vec<Seen>,
}

/// Radar, room and person, sampled into scatterers.
pub struct Scene {
    pub radar: Radar,
    pub body: Option<PosedBody>,
    pub room: Option<Room>,
    pub patches: RoomPatches,
    pub proxies: Vec<Proxy>,
    /// Whether every scatterer of the body stands for a whole facet.
    pub facets: bool,
    /// `[point]` of the body: the joint that moves it most; empty for meshes.
    pub(super) joints: Vec<&'static str>,
    flip_exponent: f64,
    /// `[point]` of the body: the canonical axis that lies flattest on its surface.
    pub(super) flattest: Vec<usize>,
    /// Visibility does not learn, so a frame is looked at once and kept; the oldest go first.
    views: Mutex<VecDeque<Arc<FrameView>>>,
}

/// Views that are kept: a few MB each.
const KEPT_VIEWS: usize = 200;

fn joint_names(body: &PosedBody) -> Vec<&'static str> {
    body.joints().into_iter().map(|joint| JOINT_NAMES.get(joint).copied().unwrap_or("")).collect()
}

impl Scene {
    /// # Errors
    /// A body whose mesh or motion cannot be sampled; a falling chirp.
    pub fn new(radar: &Radar, room: Option<&Room>, person: Option<&Person>, config: &SimulatorConfig) -> Result<Self> {
        radar.refuse_falling("radar", "the simulator makes no falling ones")?;
        let patches = room.map(|room| config.room.init(room)).transpose()?.unwrap_or_default();
        let proxies = room.map(|room| config.room.proxies(room)).unwrap_or_default();
        let body = person.map(|person| PosedBody::new(person, &config.surface, config.interpolation)).transpose()?;
        let flattest = body.as_ref().map_or_else(Vec::new, |body| {
            let normals = body.surface().normals(body.canonical_vertices());
            normals.into_iter().map(|normal| Vector3::from(normal).iamin()).collect()
        });
        Ok(Self {
            radar: radar.clone(),
            joints: body.as_ref().map(joint_names).unwrap_or_default(),
            body,
            room: room.cloned(),
            patches,
            proxies,
            facets: config.surface.sampling == Sampling::Facets,
            flip_exponent: config.flip_exponent,
            flattest,
            views: Mutex::new(VecDeque::new()),
        })
    }

    /// What some points of the body return of a real amplitude: with the closed-form integral over each facet, where facets
    /// are what is sampled.
    ///
    /// # Shapes
    /// - `reference_m`: `[point, xyz]`, `displacement` in the transmitter's chirps: components `[point, chirp]`, metres
    /// - `amplitude`: `[point, 1]`
    ///
    /// # Gradient
    /// Flows to amplitude and displacement.
    pub(crate) fn body_amplitude(
        &self,
        (frame, posed): (&BodyFrame, Option<&PosedFrame<'_>>),
        points: &[usize],
        (reference_m, displacement): (&[[f64; 3]], &Displacement),
        tx: usize,
        amplitude: Tensor<2>,
    ) -> Amplitude {
        let Some(body) = self.body.as_ref().filter(|_| self.facets) else { return Amplitude::real(amplitude) };
        let (radar, loops) = (&self.radar, self.radar.loops_per_frame);
        let [_, receivers_m] = radar.antenna_centres_m();
        let antennas = [radar.tx_position_m(tx), receivers_m];
        let wavevector = facets::wavevector(reference_m, displacement, antennas, radar.wavelength_m());
        let chirps = tx * loops..(tx + 1) * loops;
        let edges = match posed {
            Some(posed) => posed.facet_edges(points, chirps),
            None => body.facet_edges(frame, points, chirps, &amplitude.device()),
        };
        let integral = facets::facet_integral(&edges, &wavevector);
        Amplitude { re: integral.re * amplitude.clone(), im: Some(integral.im * amplitude) }
    }

    /// The same scene with its person (the one it was made with) moved by a correction.
    ///
    /// # Errors
    /// A motion that cannot be posed once corrected.
    pub fn corrected(&self, person: &Person, correction: PoseCorrection) -> Result<Self> {
        Ok(Self {
            radar: self.radar.clone(),
            body: self.body.as_ref().map(|body| body.corrected(person, correction)).transpose()?,
            room: self.room.clone(),
            patches: self.patches.clone(),
            proxies: self.proxies.clone(),
            facets: self.facets,
            joints: self.joints.clone(),
            flip_exponent: self.flip_exponent,
            flattest: self.flattest.clone(),
            views: Mutex::new(VecDeque::new()),
        })
    }

    /// The body of a frame on a device, with what learns of its pose; `None` without a body or where the host poses it.
    ///
    /// # Panics
    /// When a pose is given and the host poses the body.
    pub fn posed<'a>(&'a self, view: &'a FrameView, pose: Option<&PoseTensors>, device: &Device) -> Option<PosedFrame<'a>> {
        let (body, frame) = self.body.as_ref().zip(view.body.as_ref())?;
        if body.posing() == Posing::Host {
            assert!(pose.is_none(), "a pose learns only with posing = \"tensor\"");
            return None;
        }
        Some(PosedFrame::new(body, frame, pose, device, DType::F32))
    }

    /// Unit vectors towards the radar's centre from points that have moved on the device, `[point, xyz]`.
    ///
    /// # Gradient
    /// Flows to `moved_m` (`[point, xyz]`, metres from the references).
    pub fn towards_radar(&self, reference_m: &[[f64; 3]], moved_m: Tensor<2>, device: &Device) -> Tensor<2> {
        directions(reference_m.iter().map(|&point| way(point, self.radar.centre_m())), moved_m, device).squeeze_dim(1)
    }

    /// Of chosen points of the body the canonical axis that lies flattest on the surface.
    pub(super) fn flattest_of(&self, points: &[usize]) -> Vec<usize> {
        points.iter().map(|&point| self.flattest[point]).collect()
    }

    /// Range of the farthest echo that the scene can hold, metres.
    pub fn farthest_m(&self) -> f64 {
        // Without a room, the body and some space behind it.
        let known = self.room.as_ref().and_then(Room::farthest_m).unwrap_or(6.0);
        // Some space behind, for ghosts of the body by way of a wall.
        1.15 * known
    }

    /// Times of all chirps of a frame, seconds: transmitter by transmitter, loop by loop; each at the middle of its
    /// sampling window, where the phases are referred to.
    pub fn chirp_times_s(&self, frame: usize) -> Vec<f64> {
        let middle = self.radar.sample_time_s(self.radar.samples_per_chirp / 2);
        (0..self.radar.tx_m.len())
            .flat_map(|tx| (0..self.radar.loops_per_frame).map(move |index| (tx, index)))
            .map(|(tx, index)| self.radar.chirp_time_s(frame, tx, index) + middle)
            .collect()
    }

    /// Positions and visibility of a frame, computed once and kept.
    ///
    /// # Errors
    /// A frame outside the motion.
    pub fn view(&self, frame: usize) -> Result<Arc<FrameView>> {
        let known = self.views.lock().expect("no panic while locked").iter().find(|view| view.frame == frame).cloned();
        if let Some(view) = known {
            return Ok(view);
        }
        let view = Arc::new(self.look(frame)?);
        let mut views = self.views.lock().expect("no panic while locked");
        if views.len() == KEPT_VIEWS {
            views.pop_front();
        }
        views.push_back(view.clone());
        Ok(view)
    }

    fn look(&self, frame: usize) -> Result<FrameView> {
        let body = self.body.as_ref().map(|body| body.frame(&self.chirp_times_s(frame))).transpose()?;
        // A dense surface is as visible as the vertices around it.
        let vertices = body.as_ref().map(|body| body.vertices_m.as_slice()).unwrap_or_default();
        let patches = &self.patches;
        let seen = |mask: &[bool]| {
            let (of_vertices, of_room) = mask.split_at(vertices.len());
            let of_body = self.body.as_ref().map(|body| body.surface().decide(of_vertices)).unwrap_or_default();
            let indices = |mask: &[bool]| (0..mask.len()).filter(|&index| mask[index]).collect();
            Seen { body: indices(&of_body), room: indices(of_room) }
        };
        let visibility = frame_visibility(
            vertices,
            &patches.position_m,
            &patches.boundary,
            self.radar.centre_m(),
            &self.proxies,
            self.flip_exponent,
        );
        Ok(FrameView {
            frame,
            tangent: self.tangents(body.as_ref()),
            direct: seen(&visibility.direct),
            proxies: visibility.proxies.iter().map(|mask| seen(mask)).collect(),
            body,
        })
    }

    /// A canonical direction of every point, turned with the body.
    fn tangents(&self, frame: Option<&BodyFrame>) -> Vec<[f64; 3]> {
        let (Some(body), Some(frame)) = (&self.body, frame) else { return Vec::new() };
        let pose = frame.basis.poses.len() / 2;
        (0..frame.position_m.len())
            .into_par_iter()
            .map(|point| {
                let rotation = body.rotation(frame, point, pose);
                let axis = Vector3::from_fn(|row, _| if row == self.flattest[point] { 1.0 } else { 0.0 });
                (rotation * axis).into()
            })
            .collect()
    }
}
