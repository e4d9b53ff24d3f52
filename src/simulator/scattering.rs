//! From decoded surfaces to the signals of direct and indirect paths.

use burn::tensor::{Device, Tensor};

use super::{
    Amplitudes, FrameView, Gains, PathModel, Scene, Seen, Simulator, Surfaces, Weights,
    groups::{Group, Kind, Returns, Scattering, Visible, WallPoints},
    point_tensors::rows,
    sight::{Attitude, Places, Sight},
};
use crate::{
    body::{Displacement, PosedFrame},
    complex::Complex,
    effects::{Chirps, DirectReturns},
    if_signal::{ToWalls, indirect_signal},
    paths::{Amplitude, Points},
    radar::Radar,
    scatterers::{
        microfacet::{self, Law},
        patches,
        tangent::Frame,
    },
};

/// Whoever asks for a kind of scattering has the paths that need it.
const DECODED: &str = "decoded for these paths";

impl Simulator {
    /// Eq. 2 for all transmitters: `[tx, rx, loop, sample]`.
    pub(super) fn direct_signal(
        &self,
        scene: &Scene,
        view: &FrameView,
        surfaces: &Surfaces,
        posed: Option<&PosedFrame<'_>>,
    ) -> Complex<4> {
        let [_, receivers_m] = scene.radar.antenna_centres_m();
        let (scattering, place) = match self.config.paths {
            PathModel::Coupled => (Scattering::Patches, scene.radar.centre_m()),
            _ => (Scattering::Microfacets, receivers_m),
        };
        let groups = self.groups((scene, view, posed), surfaces, &view.direct, scattering);
        let place = Places::Same(place);
        match self.config.equations.amplitudes {
            Amplitudes::Frame => {
                let answers: Vec<_> = groups.iter().map(|group| (group, self.of_frame(group, &place))).collect();
                self.transmitters(scene, |tx, device| {
                    let parts = answers.iter().map(|(group, amplitude)| {
                        let seen = self.as_seen(group, tx, device, |_| amplitude.clone());
                        self.direct_of(group, seen, tx, &scene.radar)
                    });
                    parts.reduce(Complex::add)
                })
            }
            Amplitudes::Paper => self.transmitters(scene, |tx, device| {
                let parts = groups.iter().map(|group| self.direct_by_receiver(group, tx, device));
                parts.reduce(Complex::add)
            }),
        }
    }

    /// One transmitter's direct signal of a group, `[rx, chirp, sample]`, with amplitudes of its own for every receiver.
    fn direct_by_receiver(&self, group: &Group<'_>, tx: usize, device: &Device) -> Complex<3> {
        let radar = &group.visible.scene.radar;
        let attitude = group.attitude_at(tx, device);
        let receivers = (0..radar.rx_m.len()).map(|rx| {
            let place = Places::Same(radar.rx_position_m(rx));
            let seen = self.as_seen(group, tx, device, |displacement| {
                self.answer(group, &attitude, group.sight_at(displacement, tx, &place))
            });
            if self.effects.is_empty() {
                return self.direct_of(group, seen, tx, &Radar { rx_m: vec![radar.rx_m[rx]], ..radar.clone() });
            }
            // Effects know receivers by their place in the array.
            let all = self.direct_of(group, seen, tx, radar);
            Complex::new(all.re.narrow(0, rx, 1), all.im.narrow(0, rx, 1))
        });
        Complex::cat(receivers.collect(), 0)
    }

    /// One transmitter's direct signal of a group, `[rx, chirp, sample]`, from where its points are and how strong.
    fn direct_of(&self, group: &Group<'_>, seen: (Displacement, Tensor<2>), tx: usize, radar: &Radar) -> Complex<3> {
        let (displacement, weighed) = seen;
        let amplitude = group.amplitude(weighed, &displacement, tx);
        let Visible { scene, kind, reference_m, .. } = &group.visible;
        let points = Points { reference_m, displacement: &displacement, amplitude: &amplitude };
        let (dechirp, form) = (self.config.dechirp, self.config.sum);
        let chirps = Chirps { radar, tx, dechirp, form };
        let direct = self.effects.direct_signal(points, &chirps);
        let further = match kind {
            Kind::Body => {
                self.effects.further_paths(&DirectReturns { points, direct: &direct, room: scene.room.as_ref(), chirps })
            }
            Kind::Room => None,
        };
        match further {
            Some(further) => direct.add(further),
            None => direct,
        }
    }

    /// Eq. 3 for all transmitters and walls: `[tx, rx, loop, sample]`.
    pub(super) fn indirect_signal(
        &self,
        scene: &Scene,
        view: &FrameView,
        surfaces: &Surfaces,
        posed: Option<&PosedFrame<'_>>,
    ) -> Complex<4> {
        // One evaluation for the points of all walls; amplitudes at every chirp are too large for that.
        let frame = self.config.equations.amplitudes == Amplitudes::Frame;
        let at_once = if frame { scene.proxies.len() } else { 1 };
        let walls: Vec<usize> = (0..scene.proxies.len()).collect();
        let blocks: Vec<WallPoints> = walls.chunks(at_once).map(|walls| WallPoints::new(view, walls)).collect();
        let groups: Vec<_> = blocks
            .iter()
            .flat_map(|block| {
                let groups = self.groups((scene, view, posed), surfaces, &block.seen, Scattering::Patches);
                groups.into_iter().map(move |group| (block, group))
            })
            .map(|(block, group)| {
                let places = Places::Each(block.of_walls(group.visible.kind, |wall| scene.proxies[wall].position_m));
                let amplitude = frame.then(|| self.of_frame(&group, &places));
                (block, group, places, amplitude)
            })
            .collect();
        let places_m: Vec<[f64; 3]> = scene.proxies.iter().map(|proxy| proxy.position_m).collect();
        self.transmitters(scene, |tx, device| {
            let seen = groups.iter().map(|(_, group, places, amplitude)| {
                let (displacement, weighed) = self.as_seen(group, tx, device, |displacement| match amplitude {
                    Some(amplitude) => amplitude.clone(),
                    None => {
                        let attitude = group.attitude_at(tx, device);
                        self.answer(group, &attitude, group.sight_at(displacement, tx, places))
                    }
                });
                (displacement, Amplitude::real(weighed))
            });
            let seen: Vec<(Displacement, Amplitude)> = seen.collect();
            let to_walls = groups.iter().zip(&seen).map(|((block, group, ..), (displacement, amplitude))| ToWalls {
                points: Points { reference_m: &group.visible.reference_m, displacement, amplitude },
                walls: block.rows(group.visible.kind),
            });
            let to_walls: Vec<ToWalls> = to_walls.collect();
            indirect_signal(&to_walls, &places_m, &scene.radar, tx, self.config.dechirp, self.config.sum)
        })
    }

    /// `[rx, chirp, sample]` of every transmitter, stacked; a static signal has one chirp and is repeated.
    pub(super) fn transmitters(&self, scene: &Scene, signal: impl Fn(usize, &Device) -> Option<Complex<3>>) -> Complex<4> {
        let device = self.device();
        let [_, tx, rx, loops, samples] = scene.radar.dims();
        let silent = || Complex::zeros([rx, loops, samples], &device);
        let parts = (0..tx).map(|tx| {
            let signal = signal(tx, &device).unwrap_or_else(silent);
            let full = |part: Tensor<3>| part.expand([rx, loops, samples]).unsqueeze_dim::<4>(0);
            Complex::new(full(signal.re), full(signal.im))
        });
        Complex::cat(parts.collect(), 0)
    }

    /// The visible scatterers of body and room, with their decoded surface.
    fn groups<'a>(
        &self,
        (scene, view, posed): (&'a Scene, &'a FrameView, Option<&'a PosedFrame<'a>>),
        surfaces: &Surfaces,
        seen: &'a Seen,
        scattering: Scattering,
    ) -> Vec<Group<'a>> {
        let device = self.device();
        let sides = [(Kind::Body, &seen.body, &surfaces.body), (Kind::Room, &seen.room, &surfaces.room)];
        let mut groups = Vec::new();
        for (kind, points, surface) in sides {
            let (Some(surface), false) = (surface, points.is_empty()) else { continue };
            let all = match kind {
                Kind::Body => &view.body.as_ref().expect("it has visible points").position_m,
                Kind::Room => &scene.patches.position_m,
            };
            let reference_m = points.iter().map(|&point| all[point]).collect();
            let posed = posed.filter(|_| kind == Kind::Body);
            let visible = Visible { scene, view, posed, kind, points, reference_m };
            let picked = rows(points, all.len(), &device);
            let returns = match scattering {
                Scattering::Microfacets => Returns::Microfacets(surface.material.as_ref().expect(DECODED).pick(&picked)),
                Scattering::Patches => Returns::Patches(surface.patch.as_ref().expect(DECODED).pick(&picked)),
            };
            let weight = self.weight(&visible);
            groups.push(Group { visible, returns, weight });
        }
        groups
    }

    /// Area times gain, `[point, 1]`, as far as amplitudes are weighted by either.
    fn weight(&self, visible: &Visible<'_>) -> Option<Tensor<2>> {
        let equations = &self.config.equations;
        let area = (equations.weights == Weights::Area).then(|| visible.area_tensor(&self.device()));
        let gain = (equations.gains == Gains::Learned).then(|| {
            let gain = match visible.kind {
                Kind::Body => &self.decoders.body_gain,
                Kind::Room => &self.decoders.room_gain,
            };
            gain.factor().reshape([1, 1])
        });
        match (area, gain) {
            (Some(area), Some(gain)) => Some(area * gain),
            (area, gain) => area.or(gain),
        }
    }

    /// What a group returns towards places, once for a frame, `[point, 1]`.
    fn of_frame(&self, group: &Group<'_>, places: &Places) -> Tensor<2> {
        let device = self.device();
        self.answer(group, &group.visible.attitude(&device), group.visible.sight(places, &device))
    }

    /// Weighted L_p or SH_{p,k}, `[point, chirp]` or `[point, 1]`.
    fn answer(&self, group: &Group<'_>, attitude: &Attitude, sight: Sight) -> Tensor<2> {
        let normal = attitude.normal.clone();
        let Sight { incident, outgoing } = sight;
        let amplitude = match &group.returns {
            Returns::Microfacets(material) => {
                let law = Law { response: self.config.response, grazing: self.config.equations.grazing };
                microfacet::amplitude(material, normal, incident, outgoing, law)
            }
            Returns::Patches(patch) => {
                let frame = match &attitude.tangent {
                    Some(tangent) => Frame::along(normal, tangent.clone()),
                    None => Frame::from_normal(normal),
                };
                let wavenumber = std::f64::consts::TAU / group.visible.scene.radar.wavelength_m();
                patches::amplitude(patch, &frame, incident, outgoing, wavenumber)
            }
        };
        match &group.weight {
            Some(weight) => amplitude * weight.clone(),
            None => amplitude,
        }
    }
}
