//! Masked graph convolution on the mesh (paper, section 3.2 and supplement "GCN as a Training-Time Regularizer").
//!
//! Features of neighbouring vertices are mixed as Â h with the symmetrically normalised adjacency
//! Â = D^−½ (A + 1) D^−½, which is a step of heat flow on the mesh. In training some vertices are hidden behind a
//! learned token and must be made up from their neighbours. Whether it runs at all is the caller's choice: at random in
//! training, never at inference, where the decoders read the features directly.

use std::collections::BTreeSet;

use burn::module::{Module, Param};
use burn::tensor::{Device, Tensor, TensorData};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::draw;
use super::mlp::{Layer, activation};
use super::rows::RowIndex;
use crate::bounds;
use crate::error::{Error, Result};

/// Â of a mesh as a list of edges, both ways and from each vertex to itself.
#[derive(Clone, Debug)]
pub struct MeshGraph {
    from: RowIndex,
    to: RowIndex,
    /// `[edge, 1]`: 1 / √(degree of from · degree of to), where the degree counts the vertex itself.
    weight: Tensor<2>,
}

impl MeshGraph {
    /// Edges may repeat and come in either direction.
    ///
    /// # Panics
    /// When an edge names a vertex that does not exist.
    pub fn new(vertices: usize, edges: impl IntoIterator<Item = [usize; 2]>, device: &Device) -> Self {
        let mut both: BTreeSet<[usize; 2]> = (0..vertices).map(|vertex| [vertex, vertex]).collect();
        both.extend(edges.into_iter().flat_map(|[a, b]| [[a, b], [b, a]]));
        let mut degree = vec![0.0; vertices];
        for &[to, _] in &both {
            assert!(to < vertices, "mesh graph: an edge names vertex {to} of {vertices}");
            degree[to] += 1.0;
        }
        let weight: Vec<f32> = both.iter().map(|&[to, from]| (1.0_f64 / (degree[to] * degree[from])).sqrt() as f32).collect();
        let end = |which: usize| {
            let vertex: Vec<usize> = both.iter().map(|edge| edge[which]).collect();
            RowIndex::new(&vertex, vertices, device)
        };
        let weight = Tensor::from_data(TensorData::new(weight, [both.len(), 1]), &device.clone().without_autodiff());
        Self { to: end(0), from: end(1), weight }
    }

    /// The graph of a mesh: every edge of its facets, each `[face, 3]` vertices.
    ///
    /// # Panics
    /// When a facet names a vertex that is not below `vertices`.
    pub fn from_faces(vertices: usize, faces: &[[usize; 3]], device: &Device) -> Self {
        Self::new(vertices, faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]), device)
    }

    /// Â h.
    ///
    /// # Shapes
    /// - `features`, result: `[vertex, feature]`
    ///
    /// # Gradient
    /// Flows to `features`.
    pub fn propagate(&self, features: Tensor<2>) -> Tensor<2> {
        let weight = self.weight.clone().cast(features.dtype());
        self.to.sum_into_rows(self.from.pick(features) * weight)
    }
}

/// The deepest network that GCNII was tried with (Chen et al. 2020, table 3).
const MOST_LAYERS: usize = 64;

/// Settings of the graph convolution.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GcnConfig {
    /// Steps of propagation: how many edges far a vertex sees.
    pub layers: usize,
    /// Share of the unpropagated input that each layer keeps (the residual), 0 … 1.
    pub residual: f64,
    /// Probability that training uses the graph in a step.
    pub used: f64,
    /// Probability that a vertex is hidden when it does.
    pub masked: f64,
    /// Keeps it on at inference, without mask: the paper's ablation.
    pub at_inference: bool,
}

impl Default for GcnConfig {
    fn default() -> Self {
        Self { layers: 2, residual: 0.3, used: 0.5, masked: 0.15, at_inference: false }
    }
}

impl GcnConfig {
    /// Refuses what is no share or probability. `key` names these settings in messages.
    pub fn check(&self, key: &str) -> Result<()> {
        for (name, value) in [("residual", self.residual), ("used", self.used), ("masked", self.masked)] {
            if !(0.0..=1.0).contains(&value) {
                return Err(Error::setting(format!("{key}.{name}"), value, "0 to 1"));
            }
        }
        bounds::count(format!("{key}.layers"), self.layers, MOST_LAYERS)
            .map_err(|error| error.with_hint("to train without the graph, set used = 0"))
    }

    /// The layers' weights start at zero, where a layer is exactly a step of smoothing.
    pub fn init(&self, features: usize, rng: &mut ChaCha8Rng, device: &Device) -> Gcn {
        let layers = (0..self.layers)
            .map(|_| Layer {
                weight: draw::values(&vec![0.0; features * features], [features, features], device),
                bias: draw::values(&vec![0.0; features], [features], device),
            })
            .collect();
        Gcn { layers, mask_token: draw::uniform([1, features], 0.01, rng, device), residual: self.residual }
    }
}

/// Layers p = (1 − residual) Â h + residual · h₀, h ← p + activation(p · weight + bias): the initial residual and identity
/// mapping of GCNII (Chen et al. 2020), which keep several layers from smoothing everything away.
///
/// Learned: the layers and the token.
#[derive(Module, Debug)]
pub struct Gcn {
    pub layers: Vec<Layer>,
    /// `[1, feature]`: what a hidden vertex shows.
    pub mask_token: Param<Tensor<2>>,
    residual: f64,
}

impl Gcn {
    /// # Shapes
    /// - `features`, result: `[vertex, feature]`
    /// - `mask`: `[vertex]`, 1 where the vertex is hidden, from `draw::mask`; none at inference
    ///
    /// # Gradient
    /// Flows to `features` (of hidden vertices: none), the layers and the token.
    pub fn forward(&self, graph: &MeshGraph, features: Tensor<2>, mask: Option<Tensor<1>>) -> Tensor<2> {
        let input = match mask {
            Some(mask) => {
                let [vertex, _] = features.dims();
                let mask = mask.cast(features.dtype()).reshape([vertex, 1]);
                features * (1.0 - mask.clone()) + self.mask_token.val() * mask
            }
            None => features,
        };
        self.layers.iter().fold(input.clone(), |value, layer| {
            let mixed = graph.propagate(value) * (1.0 - self.residual) + input.clone() * self.residual;
            mixed.clone() + activation(layer.forward(mixed))
        })
    }
}

#[cfg(test)]
#[path = "graph_tests.rs"]
pub(crate) mod tests;
