//! From decoded surfaces to the signals of direct and indirect paths.

use burn::tensor::{DType, Device, Tensor};

use super::{
    FrameView, PathModel, Scene, Seen, Simulator, Surface, Surfaces,
    surfaces::{column, rows, towards, vectors},
};
use crate::{
    body::Displacement,
    complex::Complex,
    if_signal::indirect_signal,
    paths::{Amplitude, Points},
    scatterers::{microfacet, patches, tangent::Frame},
};

/// Scatterers of body or room that a viewpoint sees.
pub(super) struct Visible<'a> {
    pub scene: &'a Scene,
    pub view: &'a FrameView,
    pub kind: Kind,
    pub points: &'a [usize],
    pub reference_m: Vec<[f64; 3]>,
}

/// What scatterers return in one direction.
pub(super) struct Response {
    /// `[point, 1]`
    pub amplitude: Tensor<2>,
    /// `[point, xyz]`, of the Gaussian patches from their surface.
    offset_m: Option<Tensor<2>>,
}

/// Scatterers that move together, with what they return.
pub(super) struct Group<'a> {
    pub visible: Visible<'a>,
    pub response: Response,
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Body,
    Room,
}

impl Simulator {
    /// Eq. 2 for all transmitters: `[tx, rx, loop, sample]`.
    pub(super) fn direct_signal(&self, scene: &Scene, view: &FrameView, surfaces: &Surfaces) -> Complex<4> {
        let centre = scene.radar.centre_m();
        let groups = self.groups(scene, view, surfaces, &view.direct, |visible, surface| match self.config.paths {
            PathModel::Coupled => self.patch_response(visible, surface, centre),
            _ => self.microfacet_response(visible, surface),
        });
        self.transmitters(scene, |tx, device| {
            let radar = &scene.radar;
            let parts = groups.iter().map(|group| {
                let (displacement, weighed) = self.as_seen(group, tx, device);
                let amplitude = group.amplitude(weighed, &displacement, tx);
                let points =
                    Points { reference_m: &group.visible.reference_m, displacement: &displacement, amplitude: &amplitude };
                let (dechirp, form) = (self.config.dechirp, self.config.sum);
                let direct = self.effects.direct_signal(points, radar, tx, dechirp, form);
                let further = match group.visible.kind {
                    Kind::Body => self.effects.further_paths(points, &direct, scene.room.as_ref(), radar, tx, (dechirp, form)),
                    Kind::Room => None,
                };
                match further {
                    Some(further) => direct.add(further),
                    None => direct,
                }
            });
            parts.reduce(Complex::add)
        })
    }

    /// Eq. 3 for all transmitters and walls: `[tx, rx, loop, sample]`.
    pub(super) fn indirect_signal(&self, scene: &Scene, view: &FrameView, surfaces: &Surfaces) -> Complex<4> {
        let walls: Vec<(usize, Vec<Group<'_>>)> = (0..scene.proxies.len())
            .map(|wall| {
                let place = scene.proxies[wall].position_m;
                let groups = self.groups(scene, view, surfaces, &view.proxies[wall], |visible, surface| {
                    self.patch_response(visible, surface, place)
                });
                (wall, groups)
            })
            .collect();
        self.transmitters(scene, |tx, device| {
            let parts =
                walls.iter().flat_map(|(wall, groups)| groups.iter().map(move |group| (wall, group))).map(|(wall, group)| {
                    let (displacement, weighed) = self.as_seen(group, tx, device);
                    let amplitude = Amplitude::real(weighed);
                    let points =
                        Points { reference_m: &group.visible.reference_m, displacement: &displacement, amplitude: &amplitude };
                    let place = scene.proxies[*wall].position_m;
                    indirect_signal(points, place, &scene.radar, tx, self.config.dechirp, self.config.sum)
                });
            parts.reduce(Complex::add)
        })
    }

    /// `[rx, chirp, sample]` of every transmitter, stacked; what stands still has one chirp and is repeated.
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

    /// The visible scatterers of body and room, each with the response that `respond` finds for it, weighted by area
    /// and gain.
    fn groups<'a>(
        &self,
        scene: &'a Scene,
        view: &'a FrameView,
        surfaces: &Surfaces,
        seen: &'a Seen,
        respond: impl Fn(&Visible<'a>, &Surface) -> Response,
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
            let visible = Visible { scene, view, kind, points, reference_m };
            let picked = rows(points, all.len(), &device);
            let surface = Surface { material: surface.material.pick(&picked), patch: surface.patch.pick(&picked) };
            let mut response = respond(&visible, &surface);
            let gain = match kind {
                Kind::Body => &self.decoders.body_gain,
                Kind::Room => &self.decoders.room_gain,
            };
            let weight = column(visible.areas_m2().into_iter(), &device) * gain.factor().reshape([1, 1]);
            response.amplitude = response.amplitude * weight;
            groups.push(Group { visible, response });
        }
        groups
    }

    /// L_p of the direct path.
    fn microfacet_response(&self, visible: &Visible<'_>, surface: &Surface) -> Response {
        let radar = &visible.scene.radar;
        let (normal, incident) = self.illumination(visible);
        let [_, receivers_m] = radar.antenna_centres_m();
        let outgoing = self.towards(visible, receivers_m);
        let amplitude = microfacet::amplitude(&surface.material, normal, incident, outgoing, self.config.response);
        Response { amplitude, offset_m: None }
    }

    /// SH_{p,k} towards a place, from the patches' offset positions.
    fn patch_response(&self, visible: &Visible<'_>, surface: &Surface, place: [f64; 3]) -> Response {
        let (normal, incident) = self.illumination(visible);
        let outgoing = self.towards(visible, place);
        let frame = match visible.tangents() {
            Some(tangents) => Frame::along(normal, vectors(tangents.into_iter(), &self.device())),
            None => Frame::from_normal(normal),
        };
        let wavenumber = std::f64::consts::TAU / visible.scene.radar.wavelength_m();
        let amplitude = patches::amplitude(&surface.patch, &frame, incident, outgoing, wavenumber);
        Response { amplitude, offset_m: Some(surface.patch.offset_m.clone()) }
    }

    /// Normals, and directions towards the transmitters' centre; each `[point, 1, xyz]`.
    fn illumination(&self, visible: &Visible<'_>) -> (Tensor<3>, Tensor<3>) {
        let radar = &visible.scene.radar;
        let normal = vectors(visible.normals().into_iter(), &self.device());
        let [transmitters_m, _] = radar.antenna_centres_m();
        (normal, self.towards(visible, transmitters_m))
    }

    fn towards(&self, visible: &Visible<'_>, place: [f64; 3]) -> Tensor<3> {
        towards(visible.reference_m.iter().copied(), place, &self.device())
    }
}

impl Visible<'_> {
    fn pick<T: Copy>(&self, of_body: impl Fn() -> Vec<T>, of_room: &[T]) -> Vec<T> {
        match self.kind {
            Kind::Body => of_body(),
            Kind::Room => self.points.iter().map(|&point| of_room[point]).collect(),
        }
    }

    pub fn normals(&self) -> Vec<[f64; 3]> {
        self.pick(|| self.of_frame(|frame| &frame.normal), &self.scene.patches.normal)
    }

    fn areas_m2(&self) -> Vec<f64> {
        self.pick(|| self.of_frame(|frame| &frame.area_m2), &self.scene.patches.area_m2)
    }

    /// Tangents that turn with the body; a room needs none.
    fn tangents(&self) -> Option<Vec<[f64; 3]>> {
        (self.kind == Kind::Body).then(|| self.points.iter().map(|&point| self.view.tangent[point]).collect())
    }

    fn of_frame<T: Copy>(&self, values: impl Fn(&crate::body::BodyFrame) -> &Vec<T>) -> Vec<T> {
        let values = values(self.view.body.as_ref().expect("a body's group"));
        self.points.iter().map(|&point| values[point]).collect()
    }
}

impl Group<'_> {
    /// How the points move around their references in the chirps of a transmitter.
    pub fn displacement(&self, tx: usize, device: &Device) -> Displacement {
        let Visible { scene, view, kind, points, .. } = &self.visible;
        let loops = scene.radar.loops_per_frame;
        let offset_m = self.response.offset_m.clone();
        match (kind, &scene.body, &view.body, offset_m) {
            (Kind::Body, Some(body), Some(frame), offset_m) => {
                body.displacement(frame, points, tx * loops..(tx + 1) * loops, offset_m, device)
            }
            (_, _, _, Some(offset_m)) => {
                let along = |axis: usize| offset_m.clone().narrow(1, axis, 1);
                Displacement { x: along(0), y: along(1), z: along(2) }
            }
            (_, _, _, None) => Displacement::still(points.len(), device, DType::F32),
        }
    }

    fn amplitude(&self, amplitude: Tensor<2>, displacement: &Displacement, tx: usize) -> Amplitude {
        let Visible { scene, view, kind, points, reference_m } = &self.visible;
        match (kind, &view.body) {
            (Kind::Body, Some(frame)) => scene.body_amplitude(frame, points, (reference_m, displacement), tx, amplitude),
            _ => Amplitude::real(amplitude),
        }
    }
}
