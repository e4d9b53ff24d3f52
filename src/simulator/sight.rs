//! Between which directions scatterers are seen, and how their surface is turned.

use burn::tensor::{DType, Device, Tensor};

use super::{
    groups::{Group, Kind, Returns, Visible},
    point_tensors::{column, directions, towards, vectors, way},
};
use crate::body::Displacement;

/// How surfaces are turned; `[point, chirp, xyz]`, or one chirp for all.
pub(super) struct Attitude {
    pub normal: Tensor<3>,
    /// A direction on the surface that turns with the body; a room needs none.
    pub tangent: Option<Tensor<3>>,
}

/// Unit vectors from the scatterers towards the transmitter and towards the receiver; `[point, chirp, xyz]`, or one chirp
/// for all.
pub(super) struct Sight {
    pub incident: Tensor<3>,
    pub outgoing: Tensor<3>,
}

/// Where the points of a group send their echoes.
pub(super) enum Places {
    Same([f64; 3]),
    /// `[point]`
    Each(Vec<[f64; 3]>),
}

impl Places {
    fn of(&self, row: usize) -> [f64; 3] {
        match self {
            Self::Same(place) => *place,
            Self::Each(places) => places[row],
        }
    }
}

impl Visible<'_> {
    /// In the middle of the frame.
    pub fn attitude(&self, device: &Device) -> Attitude {
        if let Some(posed) = self.posed {
            return Attitude {
                normal: posed.normals(self.points).unsqueeze_dim(1),
                tangent: Some(posed.turned_axes(self.points, &self.scene.flattest_of(self.points)).unsqueeze_dim(1)),
            };
        }
        Attitude {
            normal: vectors(self.normals().into_iter(), device),
            tangent: self.tangents().map(|tangents| vectors(tangents.into_iter(), device)),
        }
    }

    /// In the middle of the frame, from the transmitters' centre to places, one per point.
    pub fn sight(&self, places: &Places, device: &Device) -> Sight {
        let [transmitters_m, _] = self.scene.radar.antenna_centres_m();
        let towards = |places: &Places| {
            let ways = self.reference_m.iter().enumerate().map(|(row, &point)| way(point, places.of(row)));
            match self.posed {
                Some(posed) => directions(ways, posed.middle_m(self.points), device),
                None => towards(ways, device),
            }
        };
        Sight { incident: towards(&Places::Same(transmitters_m)), outgoing: towards(places) }
    }
}

impl Group<'_> {
    /// At the chirps of a transmitter, as the host has them: no gradient to the pose; tangents only for patches.
    pub fn attitude_at(&self, tx: usize, device: &Device) -> Attitude {
        let Visible { scene, view, kind, points, .. } = &self.visible;
        let (Kind::Body, Some(body), Some(frame)) = (kind, &scene.body, &view.body) else {
            return self.visible.attitude(device);
        };
        let loops = scene.radar.loops_per_frame;
        let chirps = tx * loops..(tx + 1) * loops;
        let on_device = |directions: Vec<[f64; 3]>| vectors(directions.into_iter(), device).reshape([points.len(), loops, 3]);
        let tangents = || {
            let axes: Vec<usize> = points.iter().map(|&point| scene.flattest[point]).collect();
            on_device(body.axes_at(frame, points, &axes, chirps.clone()))
        };
        Attitude {
            normal: on_device(body.normals_at(frame, points, chirps.clone())),
            tangent: matches!(self.returns, Returns::Patches(_)).then(tangents),
        }
    }

    /// At the chirps of a transmitter, from it to places. Gradient flows to the displacement.
    pub fn sight_at(&self, displacement: &Displacement, tx: usize, places: &Places) -> Sight {
        let reference_m = &self.visible.reference_m;
        let transmitter = Places::Same(self.visible.scene.radar.tx_position_m(tx));
        Sight {
            incident: towards_moved(reference_m, displacement, &transmitter),
            outgoing: towards_moved(reference_m, displacement, places),
        }
    }
}

/// Added to squared lengths, m²: a point at the place itself has a finite gradient.
const TINY_M2: f64 = 1e-12;

/// Unit vectors from displaced points to places, `[point, chirp, xyz]`.
fn towards_moved(reference_m: &[[f64; 3]], displacement: &Displacement, places: &Places) -> Tensor<3> {
    let Displacement { x, y, z } = displacement;
    let way = [x, y, z].into_iter().enumerate().map(|(axis, u)| {
        let still = column(reference_m.iter().enumerate().map(|(row, point)| places.of(row)[axis] - point[axis]), &u.device());
        debug_assert_eq!(u.dtype(), DType::F32);
        still - u.clone()
    });
    let way: Tensor<3> = Tensor::stack(way.collect(), 2);
    let length = ((way.clone() * way.clone()).sum_dim(2) + TINY_M2).sqrt();
    way / length
}
