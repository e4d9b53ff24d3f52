//! What the decoders say about every scatterer, and the constants that they need to know about a scene.

use burn::tensor::{DType, Device, Tensor, TensorData};

use super::Scene;
use crate::{
    features::{Extent, MeshGraph, RowIndex, TriPlaneSampler, WeightedRows},
    scatterers::{material::Material, patches::Patch},
};

/// Materials of the direct path and patches of the indirect path, `[point]`.
#[derive(Clone, Debug)]
pub struct Surface {
    pub material: Material,
    pub patch: Patch,
}

/// The decoded surfaces of a scene: the same for all of its frames until the parameters change.
#[derive(Clone, Debug)]
pub struct Surfaces {
    pub body: Option<Surface>,
    pub room: Option<Surface>,
}

/// Tensors of a scene that never change.
#[derive(Clone, Debug)]
pub struct SceneConstants {
    pub body: Option<BodyConstants>,
    /// Encoded patches, `[point, feature]`.
    pub room: Option<Tensor<2>>,
}

#[derive(Clone, Debug)]
pub struct BodyConstants {
    /// Tri-plane corners of the mesh's vertices.
    pub sampler: TriPlaneSampler,
    pub graph: MeshGraph,
    pub vertices: usize,
    /// From vertices to scatterers; none where they are the same.
    pub points: Option<WeightedRows>,
}

impl SceneConstants {
    /// `extent` is the box of the trained planes.
    pub fn new(scene: &Scene, config: &super::SimulatorConfig, extent: &Extent, device: &Device) -> Self {
        let device = &device.clone().without_autodiff();
        let body = scene.body.as_ref().map(|body| {
            let vertices = body.canonical_vertices();
            let surface = body.surface();
            BodyConstants {
                sampler: TriPlaneSampler::new(vertices, extent, config.triplane.resolution, device),
                graph: MeshGraph::new(vertices.len(), surface.edges.iter().copied(), device),
                vertices: vertices.len(),
                points: (!surface.is_vertices())
                    .then(|| WeightedRows::new(&surface.corners, &surface.weights, vertices.len(), device)),
            }
        });
        let patches = &scene.patches;
        let room = (!patches.position_m.is_empty()).then(|| {
            let unit = Extent { low_m: [-1.0; 3], high_m: [1.0; 3] };
            config.encoding.features(&patches.normalised, &patches.boundary, &unit, device)
        });
        Self { body, room }
    }
}

/// Unit vectors from points to a place, `[point, 1, xyz]`.
pub(super) fn towards(points: impl ExactSizeIterator<Item = [f64; 3]>, place: [f64; 3], device: &Device) -> Tensor<3> {
    vectors(
        points.map(|point| {
            let way: [f64; 3] = std::array::from_fn(|axis| place[axis] - point[axis]);
            let length = way.iter().map(|value| value * value).sum::<f64>().sqrt().max(1e-9);
            way.map(|value| value / length)
        }),
        device,
    )
}

/// The same from points that have moved on the device, `[point, xyz]`, metres.
///
/// # Gradient
/// Flows to `moved_m`.
pub(super) fn directions(
    points: impl ExactSizeIterator<Item = [f64; 3]>,
    moved_m: Tensor<2>,
    place: [f64; 3],
    device: &Device,
) -> Tensor<3> {
    let ways = points.map(|point| std::array::from_fn(|axis| place[axis] - point[axis]));
    let way = vectors(ways, device) - moved_m.unsqueeze_dim(1);
    // The small number keeps value and gradient finite in the place itself.
    let length = (way.clone().square().sum_dim(2) + 1e-18).sqrt();
    way / length
}

/// `[point, 1, xyz]`.
pub(super) fn vectors(values: impl ExactSizeIterator<Item = [f64; 3]>, device: &Device) -> Tensor<3> {
    let count = values.len();
    let flat: Vec<f32> = values.flatten().map(|value| value as f32).collect();
    Tensor::from_data(TensorData::new(flat, [count, 1, 3]), (&device.clone().without_autodiff(), DType::F32))
}

/// `[point, 1]`.
pub(super) fn column(values: impl ExactSizeIterator<Item = f64>, device: &Device) -> Tensor<2> {
    let count = values.len();
    let values: Vec<f32> = values.map(|value| value as f32).collect();
    Tensor::from_data(TensorData::new(values, [count, 1]), (&device.clone().without_autodiff(), DType::F32))
}

/// Rows of a table of `rows` points.
pub(super) fn rows(index: &[usize], rows: usize, device: &Device) -> RowIndex {
    RowIndex::new(index, rows, &device.clone().without_autodiff())
}
