//! The scene: all that does not learn. Where every scatterer is in each frame, and who sees it.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex},
};

use super::SimulatorConfig;
use crate::{
    body::{BodyFrame, PosedBody},
    error::Result,
    person::Person,
    radar::Radar,
    room::Room,
    scatterers::{
        room_patches::{self, Proxy, RoomPatches},
        visibility::{self, FrameVisibility},
    },
};

/// Indices of the scatterers that a viewpoint sees.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    pub body: Vec<usize>,
    pub room: Vec<usize>,
}

/// One frame of a scene.
pub struct FrameView {
    pub frame: usize,
    pub body: Option<BodyFrame>,
    /// From the radar.
    pub direct: Seen,
    /// From every wall proxy.
    pub proxies: Vec<Seen>,
}

/// Radar, room and person, sampled into scatterers.
pub struct Scene {
    pub radar: Radar,
    pub body: Option<PosedBody>,
    pub patches: RoomPatches,
    pub proxies: Vec<Proxy>,
    flip_exponent: f64,
    /// Visibility does not learn, so every frame is looked at once.
    views: Mutex<HashMap<usize, Arc<FrameView>>>,
}

impl Scene {
    /// # Errors
    /// A body whose mesh or motion cannot be sampled.
    pub fn new(radar: &Radar, room: Option<&Room>, person: Option<&Person>, config: &SimulatorConfig) -> Result<Self> {
        let patches = room.map(|room| RoomPatches::new(room, radar.position_m, &config.room)).unwrap_or_default();
        let proxies = room.map(|room| room_patches::proxies(room, radar.position_m, &config.room)).unwrap_or_default();
        let body = person.map(|person| PosedBody::new(person, &config.surface, config.interpolation)).transpose()?;
        Ok(Self {
            radar: radar.clone(),
            body,
            patches,
            proxies,
            flip_exponent: config.flip_exponent,
            views: Mutex::new(HashMap::new()),
        })
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
        if let Some(view) = self.views.lock().expect("no panic while locked").get(&frame) {
            return Ok(view.clone());
        }
        let view = Arc::new(self.look(frame)?);
        self.views.lock().expect("no panic while locked").insert(frame, view.clone());
        Ok(view)
    }

    fn look(&self, frame: usize) -> Result<FrameView> {
        let body = self.body.as_ref().map(|body| body.frame(&self.chirp_times_s(frame))).transpose()?;
        let body_points = body.as_ref().map(|body| body.position_m.as_slice()).unwrap_or_default();
        let FrameVisibility { direct, proxies } = visibility::frame_visibility(
            body_points,
            &self.patches,
            self.radar.centre_m(),
            &self.proxies,
            self.flip_exponent,
        );
        let seen = |mask: Vec<bool>| {
            let (of_body, of_room) = mask.split_at(body_points.len());
            let indices = |mask: &[bool]| (0..mask.len()).filter(|&index| mask[index]).collect();
            Seen { body: indices(of_body), room: indices(of_room) }
        };
        Ok(FrameView { frame, direct: seen(direct), proxies: proxies.into_iter().map(seen).collect(), body })
    }
}
