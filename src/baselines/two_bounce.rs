//! Two-bounce mirror ray tracing: our direct path unchanged, and ideal mirrors in place of the learned indirect path
//! (paper, ablation of the indirect path). No code of it is public; our reading:
//!
//! - Each boundary of the room is an infinite mirror with one fixed coefficient. Antennas are mirrored in it: the path
//!   tx → p → wall → rx has the length |tx p| + |p rx'|, and tx → wall → p → rx the length |tx' p| + |p rx|. In a box the
//!   specular point always lies on the wall, so no path is tested for it.
//! - A point of the body answers with its learned microfacet amplitude between the two directions that this path has
//!   there, and only where both the radar and the mirrored radar see it.
//! - A mirror keeps the spreading of the unfolded path, 1/(d₁ d₂) times the coefficient.
//! - Walls' own returns, tx → wall → rx, are single bounces and in the direct path already. Bounces from wall to wall stand
//!   still and hold no person; they are left out.

use std::{path::Path, sync::Mutex};

use burn::tensor::Device;
use serde::{Deserialize, Serialize};

use super::{Baseline, check_range};
use crate::{
    complex::Complex,
    effects::mirror::{mirrored, mirrored_rx, mirrored_tx},
    error::{Error, Result},
    person::Person,
    radar::Radar,
    room::{Boundary, Room},
    scatterers::visibility::visible,
    simulator::{FrameView, Mode, PathModel, Scene, Seen, Simulator, SimulatorConfig, Surfaces},
    training::checkpoint::{self, CheckpointState},
};

/// Settings of [`TwoBounce`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TwoBounceConfig {
    /// Amplitude that a boundary reflects, the same for all of them.
    pub coefficient: f64,
}

impl Default for TwoBounceConfig {
    fn default() -> Self {
        Self { coefficient: 0.5 }
    }
}

/// A trained simulator's direct path, with the room's boundaries as mirrors, for one scene.
pub struct TwoBounce {
    config: TwoBounceConfig,
    simulator: Simulator,
    scene: Scene,
    surfaces: Surfaces,
    /// Those of the body alone.
    of_body: Surfaces,
    /// The body alone, before antennas that change from path to path.
    mirrored: Mutex<Scene>,
    flip_exponent: f64,
}

impl TwoBounce {
    /// The trained simulator of a checkpoint, before a room and a person.
    ///
    /// # Errors
    /// As [`Self::new`]; also a checkpoint that cannot be read.
    pub fn open(
        checkpoint: &Path,
        radar: &Radar,
        room: Option<&Room>,
        person: Option<&Person>,
        config: &TwoBounceConfig,
        device: &Device,
    ) -> Result<(Self, CheckpointState)> {
        let state = checkpoint::read_state(checkpoint)?;
        let settings = direct_only(&state.simulator)?;
        let untrained = checkpoint::with_stable_ids(settings.init(state.site.body_extent, state.seed, device));
        let simulator = checkpoint::load_weights(checkpoint, untrained)?;
        Ok((Self::new(simulator, radar, room, person, config)?, state))
    }

    /// # Errors
    /// Settings that cannot work; a simulator with effects or with other paths than the direct one; a scene that cannot be
    /// sampled.
    pub fn new(
        simulator: Simulator,
        radar: &Radar,
        room: Option<&Room>,
        person: Option<&Person>,
        config: &TwoBounceConfig,
    ) -> Result<Self> {
        check_range("coefficient", config.coefficient, -1.0, 1.0)?;
        let settings = direct_only(simulator.config())?;
        if settings != *simulator.config() {
            return Err(Error::setting("simulator.paths", format!("{:?}", simulator.config().paths).to_lowercase(), "direct"));
        }
        let mut scene = Scene::new(radar, room, person, &settings)?;
        // Nobody listens at the walls' receivers.
        scene.proxies.clear();
        let surfaces = simulator.surfaces(&simulator.constants(&scene), Mode::Inference);
        let of_body = Surfaces { body: surfaces.body.clone(), room: None };
        let mirrored = Mutex::new(Scene::new(radar, None, person, &settings)?);
        let flip_exponent = settings.flip_exponent;
        Ok(Self { config: config.clone(), simulator, scene, surfaces, of_body, mirrored, flip_exponent })
    }

    /// What the body returns by way of one boundary, out and back each by the mirror once.
    fn ghosts(&self, view: &FrameView, room: &Room, boundary: Boundary) -> Option<Complex<4>> {
        let (Some(body), Some(posed)) = (&self.scene.body, &view.body) else { return None };
        let distance_m = room.distance_m(boundary)?;
        let radar = &self.scene.radar;
        let image_m = mirrored(radar.centre_m(), boundary, distance_m);
        let by_mirror = body.surface().decide(&visible(&posed.vertices_m, image_m, self.flip_exponent));
        let both: Vec<usize> = view.direct.body.iter().copied().filter(|&point| by_mirror[point]).collect();
        if both.is_empty() {
            return None;
        }
        let view = FrameView {
            frame: view.frame,
            body: Some(posed.clone()),
            tangent: view.tangent.clone(),
            direct: Seen { body: both, room: Vec::new() },
            proxies: Vec::new(),
        };
        let mut scene = self.mirrored.lock().expect("no panic while locked");
        let mut by_way_of = |antennas: Radar| {
            scene.radar = antennas;
            self.simulator.clean_signal(&scene, &view, &self.of_body)
        };
        let back = by_way_of(mirrored_rx(radar, boundary, distance_m));
        Some(back.add(by_way_of(mirrored_tx(radar, boundary, distance_m))))
    }
}

impl Baseline for TwoBounce {
    fn radar(&self) -> &Radar {
        &self.scene.radar
    }

    /// In the units of the recordings that the simulator was trained on.
    fn clean_signal(&self, frame: usize) -> Result<Complex<4>> {
        let view = self.scene.view(frame)?;
        let direct = self.simulator.clean_signal(&self.scene, &view, &self.surfaces);
        let Some(room) = &self.scene.room else { return Ok(direct) };
        let ghosts = room.boundaries().into_iter().filter_map(|boundary| self.ghosts(&view, room, boundary));
        Ok(match ghosts.reduce(Complex::add) {
            Some(ghosts) => direct.add(ghosts.scale_by(self.config.coefficient)),
            None => direct,
        })
    }
}

/// The settings with the direct path alone.
fn direct_only(settings: &SimulatorConfig) -> Result<SimulatorConfig> {
    if !matches!(settings.paths, PathModel::Decoupled | PathModel::Direct) {
        let found = format!("{:?}", settings.paths).to_lowercase();
        return Err(Error::setting("simulator.paths", found, "decoupled or direct")
            .with_hint("the two-bounce baseline keeps a learned microfacet direct path; give a checkpoint that has one"));
    }
    if !settings.effects.is_empty() {
        return Err(Error::setting("simulator.effects", format!("{} effects", settings.effects.len()), "none")
            .with_hint("the two-bounce baseline replaces the indirect path of the plain simulator"));
    }
    Ok(SimulatorConfig { paths: PathModel::Direct, ..settings.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        baselines::test_support::{moving_ball, peak, radar},
        features::Extent,
        paths::distance,
    };

    const BALL: [f64; 3] = [0.6, 2.5, 0.0];

    fn room() -> Room {
        Room { right_m: Some(2.0), ..Room::default() }
    }

    fn settings() -> SimulatorConfig {
        let mut settings = SimulatorConfig::default();
        settings.room.patches = Some(20);
        settings.triplane.resolution = 8;
        settings.decoders.network.hidden = vec![8];
        settings
    }

    fn baseline(velocity_mps: [f64; 3], coefficient: f64) -> TwoBounce {
        let person = moving_ball(BALL, 0.05, velocity_mps);
        let direct = direct_only(&settings()).unwrap();
        let simulator = direct.init(Extent { low_m: [-0.1; 3], high_m: [0.1; 3] }, 1, &Device::flex());
        TwoBounce::new(simulator, &radar(), Some(&room()), Some(&person), &TwoBounceConfig { coefficient }).unwrap()
    }

    #[test]
    fn a_ghost_has_the_delay_and_the_doppler_of_the_image_source() {
        let radar = radar();
        for velocity in [[0.0; 3], [1.5, 0.0, 0.0], [0.0, -2.0, 0.0]] {
            let (with, without) = (baseline(velocity, 0.5), baseline(velocity, 0.0));
            let ghosts = with.clean_signal(0).unwrap().sub(without.clean_signal(0).unwrap());
            let [found, range] = peak(&radar, ghosts);
            let (centre, image) = (radar.centre_m(), mirrored(radar.centre_m(), Boundary::Right, 2.0));
            // The specular points lie up to a radius nearer on each leg; in the middle of the frame.
            let ball: [f64; 3] = std::array::from_fn(|axis| BALL[axis] + 0.004 * velocity[axis]);
            let wanted = 0.5 * (distance(centre, ball) + distance(ball, image));
            let tolerance = 0.5 * radar.range_resolution_m() + 0.05;
            assert!((range - wanted).abs() <= tolerance, "{range} m, wanted {wanted} m");
            let rate = |from: [f64; 3]| {
                (0..3).map(|axis| velocity[axis] * (ball[axis] - from[axis])).sum::<f64>() / distance(from, ball)
            };
            let wanted = 0.5 * (rate(centre) + rate(image));
            assert!((found - wanted).abs() <= 0.6 * radar.velocity_resolution_mps(), "{found} m/s, wanted {wanted} m/s");
        }
    }

    #[test]
    fn without_a_coefficient_it_is_our_direct_path() {
        let baseline = baseline([0.0, 1.0, 0.0], 0.0);
        let view = baseline.scene.view(1).unwrap();
        let ours = baseline.simulator.clean_signal(&baseline.scene, &view, &baseline.surfaces).to_host();
        assert_eq!(baseline.clean_signal(1).unwrap().to_host(), ours);
        assert!(ours.iter().any(|value| value.norm() > 0.0));
    }

    #[test]
    fn checkpoints_without_a_plain_direct_path_are_refused() {
        let refused = |settings: SimulatorConfig| direct_only(&settings).unwrap_err().to_string();
        let other = SimulatorConfig { paths: PathModel::Indirect, ..settings() };
        assert!(refused(other).starts_with("`simulator.paths` is indirect, expected decoupled or direct"));
        let effects = vec![crate::effects::EffectSetting::neutral("dc_offset")];
        assert!(refused(SimulatorConfig { effects, ..settings() }).starts_with("`simulator.effects` is 1 effects"));
    }
}
