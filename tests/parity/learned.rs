//! What is learned about places, and what it makes them return.

use burn::module::Param;
use burn::tensor::{DType, Device, Tensor, TensorData};
use hybridsim::features::{Combination, EncodingConfig, Extent, TriPlaneConfig, TriPlaneSampler};
use hybridsim::scatterers::material::Material;
use hybridsim::scatterers::microfacet::{Response, amplitude};
use hybridsim::scatterers::{fresnel, spherical_harmonics};
use rand::SeedableRng;

use crate::golden::{Golden, close};

fn tensor<const D: usize>(values: &[f64], dims: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::from_data(TensorData::new(values.to_vec(), dims), (device, DType::F64))
}

fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f64> {
    tensor.into_data().iter::<f64>().collect()
}

#[test]
fn planes_are_sampled_as_in_numpy_also_beyond_their_border() {
    let golden = Golden("triplane");
    let device = Device::flex();
    let corner = |name| golden.points(name)[0];
    let extent = Extent { low_m: corner("in_low_m"), high_m: corner("in_high_m") };
    let sampler = TriPlaneSampler::new(&golden.points("in_position_m"), &extent, 6, &device);
    for (name, combination) in [("concatenated", Combination::Concatenate), ("summed", Combination::Sum)] {
        let config = TriPlaneConfig { resolution: 6, features: 3, combination, ..Default::default() };
        let mut planes = config.init(&mut rand_chacha::ChaCha8Rng::seed_from_u64(1), &device);
        planes.texels = Param::from_tensor(golden.tensor("in_texels", &device));
        // the sampler's weights are f32
        close(name, &values(planes.forward(&sampler)), &golden.values(name), 1e-6);
    }
}

#[test]
fn room_coordinates_are_encoded_as_in_numpy() {
    let golden = Golden("encoding");
    let encoding = EncodingConfig { octaves: 5, ..Default::default() };
    let found = encoding.encode(golden.tensor("in_position", &Device::flex()));
    close("encoding", &values(found), &golden.values("encoded"), 1e-13);
}

#[test]
fn spherical_harmonics_are_those_of_the_legendre_functions() {
    let golden = Golden("harmonics");
    let device = Device::flex();
    let (points, wanted) = (golden.points("in_direction"), golden.values("basis"));
    let component = |axis: usize| {
        let values: Vec<f64> = points.iter().map(|direction| direction[axis]).collect();
        tensor(&values, [1, points.len()], &device)
    };
    for index in 0..16 {
        let mut weights = [0.0; 16];
        weights[index] = 1.0;
        let found = spherical_harmonics::directional(tensor(&weights, [1, 16], &device), [0, 1, 2].map(component));
        let wanted: Vec<f64> = wanted.iter().skip(index).step_by(16).copied().collect();
        close(&format!("coefficient {index}"), &values(found), &wanted, 1e-13);
    }
}

#[test]
fn reflected_power_is_that_of_maxwells_boundary_conditions() {
    let golden = Golden("fresnel");
    let device = Device::flex();
    let cosines = golden.values("in_cosine");
    let (s, p) = (golden.values("power_s"), golden.values("power_p"));
    for (row, (eta, k)) in golden.values("in_eta").into_iter().zip(golden.values("in_k")).enumerate() {
        let squares: Vec<f64> = cosines.iter().map(|cosine| cosine * cosine).collect();
        let index = |value: f64| tensor(&[value], [1, 1], &device);
        let found = fresnel::reflectance(tensor(&squares, [1, cosines.len()], &device), index(eta), index(k));
        let range = row * cosines.len()..(row + 1) * cosines.len();
        for (name, found, wanted) in [("s", found.s, &s[range.clone()]), ("p", found.p, &p[range])] {
            for (found, wanted) in values(found).into_iter().zip(wanted) {
                // small numbers keep roots and quotients finite
                assert!((found - wanted).abs() < 1e-5, "{name}, n = {eta} − {k}j: found {found}, wanted {wanted}");
            }
        }
    }
}

#[test]
fn the_microfacet_amplitude_is_that_of_slope_statistics_away_from_grazing() {
    let golden = Golden("microfacet");
    let device = Device::flex();
    let count = golden.values("in_alpha").len();
    let each = |name: &str| golden.tensor::<1>(name, &device);
    let material = Material {
        roughness: each("in_alpha"),
        metallic: each("in_metallic"),
        refraction: each("in_eta"),
        extinction: each("in_k"),
        polarisation: each("in_weight_s"),
    };
    let directions = |name: &str| golden.tensor::<2>(name, &device).reshape([count, 1, 3]);
    let normal = tensor(&[0.0, 0.0, 1.0].repeat(count), [count, 1, 3], &device);
    let found = amplitude(&material, normal, directions("in_incident"), directions("in_outgoing"), Response::Paper);
    let (incident, outgoing) = (golden.points("in_incident"), golden.points("in_outgoing"));
    for (index, (found, wanted)) in values(found).into_iter().zip(golden.values("amplitude")).enumerate() {
        // cosines are rounded off below 0.01, which is felt as its square over theirs
        let cosines = [incident[index][2], outgoing[index][2]];
        let tolerance: f64 = cosines.iter().map(|cosine| 1e-4 / (cosine * cosine)).sum();
        let error = (found / wanted - 1.0).abs();
        assert!(error < tolerance, "cosines {cosines:.2?}: found {found}, wanted {wanted}, error {error:.1e} > {tolerance:.1e}");
    }
}
