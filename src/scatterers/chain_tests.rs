//! Features to amplitudes as one chain, on every backend.

use burn::module::Param;
use burn::tensor::{DType, Device, Tensor};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::decoders::{Decoders, DecodersConfig};
use super::material::Material;
use super::microfacet::{self, Response};
use super::patches::{self, Patch};
use super::tangent::Frame;
use crate::features::{EncodingConfig, Extent, Gcn, GcnConfig, MeshGraph, RowIndex, TriPlane, TriPlaneConfig, TriPlaneSampler};
use crate::room::Boundary;
use crate::support::{assert_close, cpu_devices, directions, numbers, tensor, values};

const KNOTS: usize = 4;

struct Chain {
    planes: TriPlane,
    sampler: TriPlaneSampler,
    graph: MeshGraph,
    gcn: Gcn,
    room: Tensor<2>,
    decoders: Decoders,
    seen: RowIndex,
    /// normal, reference, towards the transmitter, towards a receiver.
    directions: [Tensor<3>; 4],
}

impl Chain {
    fn new(body: usize, room: usize, device: &Device) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let triples = |seed, count| -> Vec<[f64; 3]> {
            numbers(seed, 3 * count, -1.0, 1.0).chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect()
        };
        let (points, patches) = (triples(1, body), triples(2, room));
        let boundary: Vec<Boundary> = (0..room).map(|patch| Boundary::ALL[patch % 6]).collect();
        let (planes, encoding) = (TriPlaneConfig::default(), EncodingConfig::default());
        let edges = (0..body).flat_map(|v| [1, 7, 85].map(|step| [v, (v + step) % body]));
        let seen: Vec<usize> = (0..body + room).filter(|point| point % 3 > 0).collect();
        let direction = |seed| {
            let values = directions(seed, seen.len() * KNOTS);
            tensor::<3>(&values, [seen.len(), KNOTS, 3], &Device::flex()).cast(DType::F32).into_data()
        };
        Self {
            planes: planes.init(&mut rng, device),
            sampler: TriPlaneSampler::new(&points, &Extent::around(&points, planes.margin), planes.resolution, device),
            graph: MeshGraph::new(body, edges, device),
            gcn: GcnConfig::default().init(planes.features_out(), &mut rng, device),
            room: encoding.features(&patches, &boundary, &Extent::around(&patches, 0.0), device),
            decoders: DecodersConfig::default().init(planes.features_out(), encoding.features_out(), &mut rng, device),
            seen: RowIndex::new(&seen, body + room, device),
            directions: [3, 4, 5, 6].map(|seed| Tensor::from_data(direction(seed), device)),
        }
    }

    /// Direct and indirect amplitudes `[point, knot]`.
    fn amplitudes(&self) -> [Tensor<2>; 2] {
        let body = self.planes.forward(&self.sampler);
        let mixed = self.gcn.forward(&self.graph, body.clone(), None);
        let Decoders { body_material, room_material, body_patch, room_patch, gain } = &self.decoders;
        let material = Material::cat(vec![body_material.forward(mixed), room_material.forward(self.room.clone())]);
        let patch = Patch::cat(vec![body_patch.forward(body), room_patch.forward(self.room.clone())]);
        let [normal, reference, incident, outgoing] = self.directions.clone();
        let material = material.pick(&self.seen);
        let direct = microfacet::amplitude(&material, normal.clone(), incident.clone(), outgoing.clone(), Response::Projected);
        let frame = Frame::along(normal, reference);
        let indirect = patches::amplitude(&patch.pick(&self.seen), &frame, incident, outgoing, 1653.5);
        [direct, indirect].map(|amplitude| amplitude * gain.factor().unsqueeze_dim::<2>(1))
    }

    /// Parameters at both ends of the chain.
    fn parameters(&self) -> [&Param<Tensor<2>>; 4] {
        [
            &self.planes.texels,
            &self.gcn.layers[0].weight,
            &self.decoders.body_material.network.layers[0].weight,
            &self.decoders.room_patch.network.layers[2].weight,
        ]
    }
}

#[allow(unused_mut)]
fn devices() -> Vec<(&'static str, Device)> {
    let mut devices = cpu_devices();
    #[cfg(feature = "wgpu")]
    devices.push(("wgpu", Device::wgpu(burn::tensor::DeviceKind::Cpu)));
    devices
}

#[test]
fn the_chain_gives_the_same_values_and_gradients_on_every_backend() {
    let runs: Vec<_> = devices()
        .into_iter()
        .map(|(name, device)| {
            let chain = Chain::new(300, 100, &device.autodiff());
            let [direct, indirect] = chain.amplitudes();
            let found = [values(&direct.clone().inner()), values(&indirect.clone().inner())];
            let gradients = (direct.powi_scalar(2).sum() + indirect.powi_scalar(2).sum()).backward();
            let reached = chain.parameters().map(|parameter| {
                let gradient = parameter.val().grad(&gradients).expect("the chain reaches every parameter");
                values(&gradient)
            });
            (name, found, reached)
        })
        .collect();
    let (_, wanted, wanted_gradients) = &runs[0];
    for (name, found, gradients) in &runs[1..] {
        for (found, wanted) in found.iter().zip(wanted) {
            assert_close(&format!("amplitude on {name}"), found, wanted, 1e-4);
        }
        for (found, wanted) in gradients.iter().zip(wanted_gradients) {
            assert_close(&format!("gradient on {name}"), found, wanted, 1e-3);
        }
    }
    assert!(wanted_gradients.iter().all(|gradient| gradient.iter().any(|value| *value != 0.0)));
}
