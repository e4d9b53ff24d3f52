//! What the decoders say about every scatterer, and the constants that they need to know about a scene.

use burn::tensor::{Device, Tensor};

use super::Scene;
use crate::{
    features::{Extent, MeshGraph, TriPlaneSampler, WeightedRows},
    scatterers::{material::Material, patches::Patch},
};

/// Materials of microfacets and Gaussian patches, `[point]`, as far as the paths take scatterers for these: what is decoded and never
/// reaches the loss would stay in the autodiff graph for good.
#[derive(Clone, Debug)]
pub struct Surface {
    pub material: Option<Material>,
    pub patch: Option<Patch>,
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
