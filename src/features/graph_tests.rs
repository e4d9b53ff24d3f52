use super::*;
use crate::support::{assert_close, check_backends, check_gradient, cpu_devices, in_f64, input, numbers, tensor, values};
use burn::optim::{AdamConfig, GradientsParams};
use rand::SeedableRng;

/// A square of `side`² vertices, each joined to its neighbours in row and column.
fn grid(side: usize) -> Vec<[usize; 2]> {
    let at = |row: usize, column: usize| row * side + column;
    (0..side)
        .flat_map(|row| (0..side).map(move |column| (row, column)))
        .flat_map(|(row, column)| {
            let right = (column + 1 < side).then(|| [at(row, column), at(row, column + 1)]);
            let down = (row + 1 < side).then(|| [at(row, column), at(row + 1, column)]);
            right.into_iter().chain(down)
        })
        .collect()
}

fn gcn(features: usize, device: &Device) -> Gcn {
    GcnConfig::default().init(features, &mut ChaCha8Rng::seed_from_u64(2), device)
}

/// Layers that do something, unlike fresh ones.
fn trained(features: usize) -> Gcn {
    let mut gcn = gcn(features, &Device::flex());
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    for layer in &mut gcn.layers {
        layer.weight = draw::uniform([features, features], 0.7, &mut rng, &Device::flex());
        layer.bias = draw::uniform([features], 0.5, &mut rng, &Device::flex());
    }
    gcn.mask_token = draw::uniform([1, features], 0.7, &mut rng, &Device::flex());
    in_f64(gcn)
}

#[test]
fn propagation_is_the_normalised_adjacency_matrix() {
    // A path of three vertices: degrees with the vertex itself 2, 3, 2.
    for (_, device) in cpu_devices() {
        let graph = MeshGraph::new(3, [[0, 1], [2, 1], [1, 0]], &device);
        let identity = tensor(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], [3, 3], &device);
        let cross = 1.0 / 6.0_f64.sqrt();
        let wanted = [0.5, cross, 0.0, cross, 1.0 / 3.0, cross, 0.0, cross, 0.5];
        assert_close("adjacency", &values(&graph.propagate(identity)), &wanted, 1e-7);
    }
}

#[test]
fn faces_give_each_edge_once() {
    let device = Device::flex();
    let from_faces = MeshGraph::from_faces(4, &[[0, 1, 2], [2, 1, 3]], &device);
    let from_edges = MeshGraph::new(4, [[0, 1], [1, 2], [0, 2], [1, 3], [2, 3]], &device);
    let field = tensor(&numbers(1, 8, -1.0, 1.0), [4, 2], &device);
    assert_eq!(values(&from_faces.propagate(field.clone())), values(&from_edges.propagate(field)));
    assert_eq!(from_faces.weight.dims(), [4 + 2 * 5, 1]);
}

/// Σ over edges of (difference / √degree)², the energy of which Â is the heat flow.
fn roughness(field: &[f64], edges: &[[usize; 2]]) -> f64 {
    let mut degree = vec![1.0; field.len()];
    for &[a, b] in edges {
        degree[a] += 1.0;
        degree[b] += 1.0;
    }
    let scaled: Vec<f64> = field.iter().zip(&degree).map(|(value, degree): (&f64, &f64)| value / degree.sqrt()).collect();
    edges.iter().map(|&[a, b]| (scaled[a] - scaled[b]).powi(2)).sum()
}

#[test]
fn a_fresh_graph_smooths() {
    let device = Device::flex();
    let edges = grid(12);
    let graph = MeshGraph::new(144, edges.clone(), &device);
    let noise = numbers(3, 144, -1.0, 1.0);
    let smooth = values(&in_f64(gcn(1, &device)).forward(&graph, tensor(&noise, [144, 1], &device), None));
    let ratio = roughness(&smooth, &edges) / roughness(&noise, &edges);
    // One vertex in five of the neighbourhood's mean, twice, with 0.3 kept.
    assert!(ratio < 0.25, "roughness falls to {ratio}");
    // What is in equilibrium (√degree) stays.
    let flat: Vec<f64> = (0..144).map(|v| (1.0 + edges.iter().filter(|e| e.contains(&v)).count() as f64).sqrt()).collect();
    let kept = values(&in_f64(gcn(1, &device)).forward(&graph, tensor(&flat, [144, 1], &device), None));
    assert_close("equilibrium", &kept, &flat, 1e-6);
}

#[test]
fn a_hidden_vertex_has_no_influence() {
    let device = Device::flex();
    let graph = MeshGraph::new(9, grid(3), &device);
    let gcn = trained(2);
    let mask = tensor(&[0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0], [9], &device);
    let mut field = numbers(3, 18, -1.0, 1.0);
    let before = values(&gcn.forward(&graph, tensor(&field, [9, 2], &device), Some(mask.clone())));
    field[8] += 10.0;
    let after = values(&gcn.forward(&graph, tensor(&field, [9, 2], &device), Some(mask)));
    assert_eq!(before, after);
}

#[test]
fn hidden_vertices_are_recovered_from_their_neighbours() {
    // Trained on random masks of smooth fields, tested on another field and mask.
    let device = Device::flex().autodiff();
    let side = 10;
    let graph = MeshGraph::new(side * side, grid(side), &device);
    let field = |phase: f64| {
        let values: Vec<f64> = (0..side * side)
            .flat_map(|v| {
                let (x, y) = ((v % side) as f64 / 3.0, (v / side) as f64 / 3.0);
                [(x + phase).sin(), (y - phase).cos(), (0.7 * x + y + phase).sin()]
            })
            .collect();
        tensor::<2>(&values, [side * side, 3], &device).cast(burn::tensor::DType::F32)
    };
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut gcn = gcn(3, &device);
    let error = |gcn: &Gcn, field: Tensor<2>, mask: Tensor<1>| {
        let hidden = mask.clone().reshape([side * side, 1]);
        let squares = (gcn.forward(&graph, field.clone(), Some(mask)) - field).powi_scalar(2) * hidden.clone();
        squares.sum() / (hidden.sum() * 3.0)
    };
    let mut optimiser = AdamConfig::new().init();
    for step in 0..300 {
        let loss = error(&gcn, field(0.37 * step as f64), draw::mask(side * side, 0.15, &mut rng, &device));
        let gradients = GradientsParams::from_grads(loss.backward(), &gcn);
        gcn = optimiser.step(0.01, gcn, gradients);
    }
    let found = values(&error(&gcn, field(200.2), draw::mask(side * side, 0.15, &mut rng, &device)).inner())[0];
    // The fields' variance is ½.
    assert!(found < 0.03, "mean squared error of hidden vertices: {found}");
}

pub(crate) fn gradients_agree_with_central_differences() {
    let gcn = trained(2);
    let inputs = [
        input("features", numbers(6, 12, -1.0, 1.0)),
        input("token", values(&gcn.mask_token.val())),
        input("weight", values(&gcn.layers[0].weight.val())),
        input("bias", values(&gcn.layers[1].bias.val())),
    ];
    let forward = |x: &[Tensor<1>]| {
        let mut gcn = gcn.clone().to_device(&x[0].device());
        gcn.mask_token = gcn.mask_token.map(|_| x[1].clone().reshape([1, 2]));
        gcn.layers[0].weight = gcn.layers[0].weight.clone().map(|_| x[2].clone().reshape([2, 2]));
        gcn.layers[1].bias = gcn.layers[1].bias.clone().map(|_| x[3].clone());
        let graph = MeshGraph::new(6, [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [0, 4]], &x[0].device());
        let mask = tensor(&[0.0, 1.0, 0.0, 0.0, 1.0, 0.0], [6], &x[0].device());
        gcn.forward(&graph, x[0].clone().reshape([6, 2]), Some(mask)).reshape([12])
    };
    check_gradient(&inputs, 1e-5, 1e-7, forward);
}

#[test]
fn propagation_agrees_between_backends() {
    check_backends(&[input("features", numbers(6, 12, -1.0, 1.0))], 1e-6, |x| {
        let graph = MeshGraph::new(6, [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [0, 4]], &x[0].device());
        graph.propagate(x[0].clone().reshape([6, 2])).reshape([12])
    });
}

#[test]
fn unusable_settings_are_refused() {
    let error = GcnConfig { masked: 1.5, ..Default::default() }.check("gcn").unwrap_err();
    assert_eq!(error.to_string(), "`gcn.masked` is 1.5, expected 0 to 1");
    assert!(GcnConfig { layers: 0, ..Default::default() }.check("gcn").is_err());
    assert!(GcnConfig::default().check("gcn").is_ok());
}
