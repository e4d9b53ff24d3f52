//! The crate agrees with NumPy: golden arrays written by `scripts/golden.py` from the formulas alone.

use std::path::Path;

use burn::tensor::{DType, Device, Tensor, TensorData};
use hybridsim::complex::Complex;
use hybridsim::heatmap::{Analysis, Axis, Gate, HeatmapConfig, Map, RangeDoppler, Samples, Scan, StaticRemoval, remove_static};
use hybridsim::loss::{Combine, DbLoss, LossConfig};
use hybridsim::metrics::{DbWindow, psnr, scores, ssim};
use hybridsim::radar::{Radar, Sampling};
use npyz::npz::NpzArchive;
use num_complex::{Complex32, Complex64};

/// One file of golden arrays.
struct Golden(String);

impl Golden {
    /// An array's shape and values, whatever its type.
    fn array(&self, name: &str) -> (Vec<usize>, Vec<f64>) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(format!("{}.npz", self.0));
        let mut archive = NpzArchive::open(&path).unwrap();
        let file = archive.by_name(name).unwrap().unwrap_or_else(|| panic!("{} holds no {name}", path.display()));
        let shape = file.shape().iter().map(|&length| length as usize).collect();
        let values = match file.dtype().descr().trim_matches(['\'', '"']) {
            "<f4" => file.into_vec::<f32>().unwrap().into_iter().map(f64::from).collect(),
            "<f8" => file.into_vec::<f64>().unwrap(),
            "|u1" => file.into_vec::<u8>().unwrap().into_iter().map(f64::from).collect(),
            other => panic!("{name} is of type {other}"),
        };
        (shape, values)
    }

    fn values(&self, name: &str) -> Vec<f64> {
        self.array(name).1
    }

    fn number(&self, name: &str) -> f64 {
        self.values(name)[0]
    }

    fn complex(&self, name: &str) -> Vec<Complex64> {
        let part = |part: &str| self.values(&format!("{name}_{part}"));
        part("re").into_iter().zip(part("im")).map(|(re, im)| Complex64::new(re, im)).collect()
    }

    fn tensor<const D: usize>(&self, name: &str, device: &Device) -> Tensor<D> {
        let (shape, values) = self.array(name);
        Tensor::from_data(TensorData::new(values, shape), (device, DType::F64))
    }

    fn signal(&self, name: &str, device: &Device) -> Complex<5> {
        Complex::new(self.tensor(&format!("{name}_re"), device), self.tensor(&format!("{name}_im"), device))
    }
}

/// The largest difference, relative to the largest wanted value.
#[track_caller]
fn close(what: &str, found: &[f64], wanted: &[f64], tolerance: f64) {
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
fn radar() -> Radar {
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

fn narrow(signal: &[Complex64]) -> Vec<Complex32> {
    signal.iter().map(|value| Complex32::new(value.re as f32, value.im as f32)).collect()
}

fn parts(values: &[Complex64]) -> Vec<f64> {
    values.iter().flat_map(|value| [value.re, value.im]).collect()
}

#[test]
fn range_doppler_maps_and_axes_are_those_of_numpy_on_the_host_and_in_the_graph() {
    let golden = Golden("heatmap".into());
    let radar = radar();
    let analysis = Analysis::new(&radar, &HeatmapConfig::default());
    let signal = narrow(&golden.complex("in_signal"));
    let frame = Samples::new(&signal, radar.dims()).frame(0);
    let wanted = parts(&golden.complex("map"));
    close("host", &parts(&analysis.range_doppler_complex(frame)), &wanted, 1e-13);
    close("velocity", &analysis.velocity_axis().values, &golden.values("velocity_mps"), 1e-14);
    close("range", &analysis.range_axis().values, &golden.values("range_m"), 1e-14);

    let device = Device::flex();
    let config = HeatmapConfig::default();
    for (dtype, tolerance) in [(DType::F64, 1e-13), (DType::F32, 1e-6)] {
        let transform = RangeDoppler::new(15, 18, Sampling::Complex, &config, (&device, dtype));
        let signal = golden.signal("in_signal", &device).narrow(0, 0, 1);
        let map = transform.map(Complex::new(signal.re.cast(dtype), signal.im.cast(dtype)));
        let (re, im) = (map.re.into_data(), map.im.into_data());
        let found: Vec<f64> = re.iter::<f64>().zip(im.iter::<f64>()).flat_map(|(re, im)| [re, im]).collect();
        close("graph", &found, &wanted, tolerance);
    }
    let real = Radar { sampling: Sampling::Real, ..radar };
    let map = Analysis::new(&real, &config).range_doppler_complex(frame);
    close("real-sampled", &parts(&map), &parts(&golden.complex("real_map")), 1e-13);
}

#[test]
fn powers_static_removal_and_beams_are_those_of_numpy() {
    let golden = Golden("heatmap".into());
    let radar = radar();
    let analysis = Analysis::new(&radar, &HeatmapConfig::default());
    let signal = narrow(&golden.complex("in_signal"));
    let samples = Samples::new(&signal, radar.dims());
    for (name, removal, tolerance) in [
        ("power", StaticRemoval::None, 1e-13),
        // the samples less their mean are f32 again
        ("power_without_loop_mean", StaticRemoval::Loops, 1e-6),
        ("power_without_frame_mean", StaticRemoval::Frames, 1e-6),
    ] {
        let values = remove_static(samples, removal);
        let samples = Samples::new(&values, radar.dims());
        let found: Vec<f64> = (0..2).flat_map(|frame| analysis.range_doppler(samples.frame(frame)).values).collect();
        close(name, &found, &golden.values(name), tolerance);
    }
    let scan = Scan::azimuth(60.0, 10.0);
    assert_eq!(scan.axis().values, golden.values("in_azimuth_deg"));
    let beams = analysis.range_angle(samples.frame(0), &scan, &Gate::default());
    close("azimuth", &beams.values, &golden.values("azimuth_power"), 1e-12);
}

#[test]
fn the_loss_is_that_of_numpy_for_every_setting() {
    let golden = Golden("heatmap".into());
    let device = Device::flex();
    let heatmap = HeatmapConfig { floor_db: -60.0, ..Default::default() };
    let transform = RangeDoppler::new(15, 18, Sampling::Complex, &heatmap, (&device, DType::F64));
    let peak = transform.peak_amplitude(golden.signal("in_signal", &device));
    close("peak", &[peak], &golden.values("peak_amplitude"), 1e-13);
    for (name, config) in [
        ("loss_each", LossConfig::default()),
        ("loss_mean", LossConfig { combine: Combine::Mean, ..Default::default() }),
        ("loss_clamped", LossConfig { clamp_db: Some(-25.0), ..Default::default() }),
        ("loss_without_static", LossConfig { static_removed: true, ..Default::default() }),
    ] {
        let loss = DbLoss::new(&radar(), &heatmap, &config, peak, (&device, DType::F64)).unwrap();
        let measured = loss.maps_db(golden.signal("in_signal", &device));
        let found = loss.loss(golden.signal("in_simulated", &device), measured).into_scalar::<f64>();
        close(name, &[found], &golden.values(name), 1e-10);
    }
}

#[test]
fn metrics_are_those_of_numpy_with_and_without_a_mask() {
    let golden = Golden("metrics".into());
    let map = |name: &str| {
        let (shape, values) = golden.array(name);
        let axis = |length: usize| Axis::new("cell", "", (0..length).map(|index| index as f64).collect());
        Map::new(axis(shape[0]), axis(shape[1]), values)
    };
    let (measured, simulated) = (map("in_measured_db"), map("in_simulated_db"));
    let ends = golden.values("in_window_db");
    let window = DbWindow { low_db: ends[0], high_db: ends[1] };
    let mask: Vec<bool> = golden.values("in_mask").into_iter().map(|cell| cell != 0.0).collect();
    for (prefix, mask) in [("", None), ("masked_", Some(mask.as_slice()))] {
        let found = scores(&measured, &simulated, &window, mask).unwrap();
        for (name, value) in
            [("psnr_db", found.psnr_db), ("ssim", found.ssim), ("mean_absolute_error_db", found.mean_absolute_error_db)]
        {
            let name = format!("{prefix}{name}");
            close(&name, &[value], &[golden.number(&name)], 1e-12);
        }
    }
}

/// Uniform numbers of splitmix64.
fn uniform(seed: u64, count: usize) -> Vec<f64> {
    let number = |index: u64| {
        let mut z = index.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(seed);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 * 2f64.powi(-53)
    };
    (1..=count as u64).map(number).collect()
}

#[test]
fn ssim_and_psnr_are_those_of_scikit_image() {
    let (rows, columns) = (128, 256);
    let (texture, error) = (uniform(1, rows * columns), uniform(2, rows * columns));
    let a: Vec<f64> = (0..rows * columns)
        .map(|index| {
            let (y, x) = ((index / columns) as f64, (index % columns) as f64);
            let blob = |row: f64, height: f64, width: f64| (-((y - row).powi(2) / height + (x - 60.0).powi(2) / width)).exp();
            (0.15 * texture[index] + 0.8 * blob(64.0, 20.0, 90.0) + 0.5 * blob(80.0, 200.0, 60.0)).clamp(0.0, 1.0)
        })
        .collect();
    let b: Vec<f64> = a.iter().zip(&error).map(|(a, u)| (a + 0.2 * (2.0 * u - 1.0)).clamp(0.0, 1.0)).collect();
    // scikit-image 0.26.0: structural_similarity(gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1)
    close("ssim", &[ssim(&a, &b, [rows, columns]).unwrap()], &[0.285_755_407_826_052_1], 1e-12);
    close("psnr", &[psnr(&a, &b)], &[20.403_880_627_091_937], 1e-12);
}
