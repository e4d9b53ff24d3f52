//! Scatterers that a viewpoint sees, in the groups that move together.

use std::ops::Range;

use burn::tensor::{DType, Device, Tensor};

use super::{FrameView, Scene, Seen, point_tensors::column};
use crate::{
    body::{Displacement, PosedFrame},
    paths::Amplitude,
    scatterers::{material::Material, patches::Patch},
};

/// Scatterers of body or room that a viewpoint sees.
pub(super) struct Visible<'a> {
    pub scene: &'a Scene,
    pub view: &'a FrameView,
    /// The body's frame on the device; absent for a room, and where the host poses the body.
    pub posed: Option<&'a PosedFrame<'a>>,
    pub kind: Kind,
    pub points: &'a [usize],
    pub reference_m: Vec<[f64; 3]>,
}

/// Scatterers that move together, with what they return.
pub(super) struct Group<'a> {
    pub visible: Visible<'a>,
    pub returns: Returns,
    /// What amplitudes are multiplied by, `[point, 1]`; none: nothing.
    pub weight: Option<Tensor<2>>,
}

/// What scatterers are taken for.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Scattering {
    /// L_p
    Microfacets,
    /// SH_{p,k}, from the patches' offset positions.
    Patches,
}

/// What the visible points were decoded to.
pub(super) enum Returns {
    Microfacets(Material),
    Patches(Patch),
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Body,
    Room,
}

/// The points that several walls see, one wall after the other; a point that two walls see stands there twice.
pub(super) struct WallPoints {
    pub seen: Seen,
    /// (wall, its rows among the body's points and the room's), of walls that see any.
    body: Vec<(usize, Range<usize>)>,
    room: Vec<(usize, Range<usize>)>,
}

impl WallPoints {
    pub fn new(view: &FrameView, walls: &[usize]) -> Self {
        let joined = |of: fn(&Seen) -> &Vec<usize>| {
            let (mut points, mut rows) = (vec![], vec![]);
            for &wall in walls {
                let start = points.len();
                points.extend_from_slice(of(&view.proxies[wall]));
                if points.len() > start {
                    rows.push((wall, start..points.len()));
                }
            }
            (points, rows)
        };
        let ((body, body_rows), (room, room_rows)) = (joined(|seen| &seen.body), joined(|seen| &seen.room));
        Self { seen: Seen { body, room }, body: body_rows, room: room_rows }
    }

    /// (wall, its rows in the group of a kind).
    pub fn rows(&self, kind: Kind) -> &[(usize, Range<usize>)] {
        match kind {
            Kind::Body => &self.body,
            Kind::Room => &self.room,
        }
    }

    /// What belongs to the wall of every row.
    pub fn of_walls<T: Clone>(&self, kind: Kind, value: impl Fn(usize) -> T) -> Vec<T> {
        self.rows(kind).iter().flat_map(|(wall, rows)| vec![value(*wall); rows.len()]).collect()
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

    /// `[point, 1]`, m².
    pub fn area_tensor(&self, device: &Device) -> Tensor<2> {
        match self.posed {
            Some(posed) => posed.areas_m2(self.points),
            None => {
                let areas_m2 = self.pick(|| self.of_frame(|frame| &frame.area_m2), &self.scene.patches.area_m2);
                column(areas_m2.into_iter(), device)
            }
        }
    }

    /// Tangents that turn with the body; a room needs none.
    pub fn tangents(&self) -> Option<Vec<[f64; 3]>> {
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
        let offset_m = match &self.returns {
            Returns::Microfacets(_) => None,
            Returns::Patches(patch) => Some(patch.offset_m.clone()),
        };
        if let Some(posed) = self.visible.posed {
            return posed.displacement(points, tx * loops..(tx + 1) * loops, offset_m);
        }
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

    pub fn amplitude(&self, amplitude: Tensor<2>, displacement: &Displacement, tx: usize) -> Amplitude {
        let Visible { scene, view, posed, kind, points, reference_m } = &self.visible;
        match (kind, &view.body) {
            (Kind::Body, Some(frame)) => {
                scene.body_amplitude((frame, *posed), points, (reference_m, displacement), tx, amplitude)
            }
            _ => Amplitude::real(amplitude),
        }
    }
}
