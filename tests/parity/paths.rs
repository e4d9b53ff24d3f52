//! Direct and indirect paths, and their coherent sums (eq. 1 to 3).

use burn::tensor::{DType, Device, Tensor, TensorData};
use hybridsim::complex::Complex;
use hybridsim::if_signal::{SumForm, ToWalls, direct_signal, indirect_signal};
use hybridsim::paths::{Amplitude, Dechirp, Displacement, Points};
use hybridsim::radar::Radar;
use num_complex::Complex64;

use crate::golden::{Golden, radar};

/// Moving points as the device gets them: references on the host, and what they move by.
struct Scene {
    reference_m: Vec<[f64; 3]>,
    displacement: Displacement,
    dims: [usize; 2],
}

fn scene(golden: &Golden, device: &Device, dtype: DType) -> Scene {
    let (shape, _) = golden.array("in_position_m");
    let (position, dims) = (golden.points("in_position_m"), [shape[0], shape[1]]);
    let reference_m: Vec<[f64; 3]> = position.chunks_exact(dims[1]).map(|chirps| chirps[dims[1] / 2]).collect();
    let moved = |axis: usize| {
        let values: Vec<f64> = position.iter().enumerate().map(|(i, x)| x[axis] - reference_m[i / dims[1]][axis]).collect();
        Tensor::from_data(TensorData::new(values, dims), (device, dtype))
    };
    let displacement = Displacement { x: moved(0), y: moved(1), z: moved(2) };
    Scene { reference_m, displacement, dims }
}

impl Scene {
    fn amplitude(&self, values: &[f64]) -> Amplitude {
        let like = &self.displacement.x;
        Amplitude::real(Tensor::from_data(TensorData::new(values.to_vec(), self.dims), (&like.device(), like.dtype())))
    }

    fn points<'a>(&'a self, amplitude: &'a Amplitude) -> Points<'a> {
        Points { reference_m: &self.reference_m, displacement: &self.displacement, amplitude }
    }
}

fn radar_of_paths() -> Radar {
    Radar { samples_per_chirp: 20, ..radar() }
}

/// Energy of the difference over the energy of what was wanted, dB.
fn error_db(found: Complex<3>, wanted: &[Complex64]) -> f64 {
    let (re, im) = (found.re.into_data(), found.im.into_data());
    let found = re.iter::<f64>().zip(im.iter::<f64>()).map(|(re, im)| Complex64::new(re, im));
    let difference: f64 = found.zip(wanted).map(|(a, b)| (a - b).norm_sqr()).sum();
    10.0 * (difference / wanted.iter().map(|value| value.norm_sqr()).sum::<f64>()).log10()
}

/// Form, type, and the error that each may have.
const FORMS: [(SumForm, DType, f64); 4] = [
    (SumForm::Exact, DType::F64, -150.0),
    (SumForm::Tensor, DType::F64, -100.0),
    (SumForm::Tensor, DType::F32, -100.0),
    (SumForm::Fused, DType::F32, -100.0),
];

#[test]
fn the_direct_signal_is_that_of_numpy_in_every_form() {
    let golden = Golden("direct");
    let device = Device::flex();
    for (form, dtype, tolerance_db) in FORMS {
        let scene = scene(&golden, &device, dtype);
        let amplitude = scene.amplitude(&golden.values("in_amplitude"));
        let found = direct_signal(scene.points(&amplitude), &radar_of_paths(), 0, Dechirp::Paper, form);
        assert_eq!(found.dims(), [2, 11, 20]);
        let error = error_db(found, &golden.complex("paper"));
        assert!(error < tolerance_db, "{form:?} {dtype:?}: {error:.1} dB, at most {tolerance_db} dB");
    }
}

#[test]
fn the_exact_dechirp_is_that_of_numpy_but_for_the_curvature_within_a_chirp() {
    let golden = Golden("direct");
    let scene = scene(&golden, &Device::flex(), DType::F64);
    let amplitude = scene.amplitude(&golden.values("in_amplitude"));
    let signal = |dechirp| direct_signal(scene.points(&amplitude), &radar_of_paths(), 0, dechirp, SumForm::Exact);
    let error = error_db(signal(Dechirp::Exact), &golden.complex("exact"));
    assert!(error < -90.0, "{error:.1} dB");
    // and what it adds to the paper's form is not small
    assert!(error_db(signal(Dechirp::Paper), &golden.complex("exact")) > -40.0);
}

#[test]
fn the_indirect_signal_by_way_of_each_wall_is_that_of_numpy() {
    let golden = Golden("indirect");
    let device = Device::flex();
    for (form, dtype, tolerance_db) in FORMS {
        let scene = scene(&golden, &device, dtype);
        let (amplitudes, wanted) = (golden.values("in_amplitude"), golden.complex("paper"));
        let (cells, signal_length) = (scene.dims[0] * scene.dims[1], wanted.len() / 2);
        for (wall, proxy_m) in golden.points("in_proxy_m").into_iter().enumerate() {
            let amplitude = scene.amplitude(&amplitudes[wall * cells..(wall + 1) * cells]);
            let points = scene.points(&amplitude);
            let to_walls = ToWalls { points, walls: &[(0, 0..points.reference_m.len())] };
            let found = indirect_signal(&[to_walls], &[proxy_m], &radar_of_paths(), 0, Dechirp::Paper, form).unwrap();
            let error = error_db(found, &wanted[wall * signal_length..(wall + 1) * signal_length]);
            assert!(error < tolerance_db, "wall {wall} {form:?} {dtype:?}: {error:.1} dB, at most {tolerance_db} dB");
        }
    }
}
