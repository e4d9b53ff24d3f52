//! Reading and comparing golden arrays.

use std::path::Path;

use burn::tensor::{DType, Device, Tensor, TensorData};
use hybridsim::radar::{Radar, Sampling};
use num_complex::Complex64;

/// One file of golden arrays.
pub struct Golden(pub &'static str);

impl Golden {
    /// An array's shape and values, whatever its type.
    pub fn array(&self, name: &str) -> (Vec<usize>, Vec<f64>) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(format!("{}.npz", self.0));
        let mut archive = zip::ZipArchive::new(std::fs::File::open(&path).unwrap()).unwrap();
        let entry = archive.by_name(&format!("{name}.npy")).unwrap_or_else(|error| panic!("{}: {name}: {error}", path.display()));
        let file = npyz::NpyFile::new(entry).unwrap();
        let shape = file.shape().iter().map(|&length| length as usize).collect();
        let values = match file.dtype().descr().trim_matches(['\'', '"']) {
            "<f4" => file.into_vec::<f32>().unwrap().into_iter().map(f64::from).collect(),
            "<f8" => file.into_vec::<f64>().unwrap(),
            "<i8" => file.into_vec::<i64>().unwrap().into_iter().map(|value| value as f64).collect(),
            "|u1" => file.into_vec::<u8>().unwrap().into_iter().map(f64::from).collect(),
            other => panic!("{name} is of type {other}"),
        };
        (shape, values)
    }

    pub fn values(&self, name: &str) -> Vec<f64> {
        self.array(name).1
    }

    /// Rows of three numbers.
    pub fn points(&self, name: &str) -> Vec<[f64; 3]> {
        self.values(name).chunks_exact(3).map(|xyz| [xyz[0], xyz[1], xyz[2]]).collect()
    }

    pub fn number(&self, name: &str) -> f64 {
        self.values(name)[0]
    }

    pub fn complex(&self, name: &str) -> Vec<Complex64> {
        let part = |part: &str| self.values(&format!("{name}_{part}"));
        part("re").into_iter().zip(part("im")).map(|(re, im)| Complex64::new(re, im)).collect()
    }

    pub fn tensor<const D: usize>(&self, name: &str, device: &Device) -> Tensor<D> {
        let (shape, values) = self.array(name);
        Tensor::from_data(TensorData::new(values, shape), (device, DType::F64))
    }
}

/// The largest difference, relative to the largest wanted value.
#[track_caller]
pub fn close(what: &str, found: &[f64], wanted: &[f64], tolerance: f64) {
    assert_eq!(found.len(), wanted.len(), "{what}: number of values");
    let scale = wanted.iter().fold(0.0f64, |scale, value| scale.max(value.abs()));
    let worst = (0..found.len()).max_by(|&a, &b| (found[a] - wanted[a]).abs().total_cmp(&(found[b] - wanted[b]).abs())).unwrap();
    let error = (found[worst] - wanted[worst]).abs() / scale;
    assert!(
        error <= tolerance,
        "{what}[{worst}]: found {}, wanted {}, error {error:e} > {tolerance:e}",
        found[worst],
        wanted[worst]
    );
}

/// As in `scripts/golden.py`.
pub fn radar() -> Radar {
    Radar {
        start_frequency_hz: 77e9,
        slope_hz_per_s: 60e12,
        sample_rate_hz: 4e6,
        sampling: Sampling::Complex,
        samples_per_chirp: 18,
        loops_per_frame: 15,
        adc_start_s: 6e-6,
        chirp_period_s: 80e-6,
        frame_period_s: 0.05,
        frames: 2,
        position_m: [0.0; 3],
        tx_m: vec![[0.0; 3], [0.0038, 0.0, 0.0]],
        rx_m: vec![[0.0; 3], [0.0019, 0.0, 0.0]],
        full_scale_codes: None,
    }
}
