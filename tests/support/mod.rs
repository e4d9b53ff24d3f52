//! What tests share: gradients against central differences, agreement between backends, seeded numbers.
//!
//! Unit tests reach it as `crate::support`, integration tests as `crate::support` of their program. It knows nothing of the crate.
#![allow(dead_code, unused_imports)]

mod gradients;

use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{DType, Device, Tensor, TensorData};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub use gradients::*;

/// A file or folder of the shared third-party data (`""` is all of it), or `None` where that data is not at all.
///
/// Where it is (`HYBRIDSIM_SHARED` is set, or `../shared` has recordings), every test that uses it is required: what is
/// missing then fails. Elsewhere the test counts as skipped.
///
/// # Panics
/// Where the data is, but not this part of it.
pub fn shared(path: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    let found = find_shared(std::env::var_os("HYBRIDSIM_SHARED").map(PathBuf::from), &beside, path);
    let found = found.unwrap_or_else(|message| panic!("{message}"));
    if found.is_none() {
        skip("shared material");
    }
    found
}

fn find_shared(named: Option<PathBuf>, beside: &Path, path: &str) -> Result<Option<PathBuf>, String> {
    let root = match named {
        Some(root) => root,
        None if beside.join("recordings").is_dir() => beside.into(),
        None => return Ok(None),
    };
    let found = root.join(path);
    match found.exists() {
        true => Ok(Some(found)),
        false => Err(format!("{} is absent, but required: the shared data is at {}", found.display(), root.display())),
    }
}

/// Says that this test cannot run here for lack of something, and how many could not until now. `HYBRIDSIM_STRICT`, which
/// CI sets, makes everything but shared material required; `HYBRIDSIM_SKIPPED` names a file that collects a line for each.
///
/// # Panics
/// Where it is required.
pub fn skip(lack: &'static str) {
    static SKIPPED: Mutex<BTreeSet<(&str, String)>> = Mutex::new(BTreeSet::new());
    assert!(
        lack == "shared material" || std::env::var_os("HYBRIDSIM_STRICT").is_none(),
        "{lack} is absent, but required by HYBRIDSIM_STRICT"
    );
    let test = std::thread::current().name().unwrap_or("a test").to_string();
    let mut skipped = SKIPPED.lock().unwrap_or_else(PoisonError::into_inner);
    if !skipped.insert((lack, test.clone())) {
        return;
    }
    let count = skipped.iter().filter(|(other, _)| *other == lack).count();
    // Straight to standard error: the harness hides what a passing test prints.
    let _ = writeln!(std::io::stderr(), "skipped: {count} tests need {lack} ({test})");
    if let Some(file) = std::env::var_os("HYBRIDSIM_SKIPPED") {
        let opened = std::fs::OpenOptions::new().append(true).create(true).open(file);
        let written = opened.and_then(|mut file| writeln!(file, "{lack}: {test}"));
        assert!(written.is_ok(), "HYBRIDSIM_SKIPPED cannot be written: {written:?}");
    }
}

/// A named input of the function under test, row by row.
pub struct Input {
    pub name: &'static str,
    pub values: Vec<f64>,
}

pub fn input(name: &'static str, values: impl Into<Vec<f64>>) -> Input {
    Input { name, values: values.into() }
}

/// Numbers in `low .. high` that are the same in every run (a linear congruential generator).
pub fn numbers(seed: u64, count: usize, low: f64, high: f64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    for _ in 0..8 {
        next();
    }
    (0..count).map(|_| low + (high - low) * next()).collect()
}

/// Numbers of the standard normal distribution, the same in every run.
pub fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    move || StandardNormal.sample(&mut random)
}

/// splitmix64's uniform numbers in 0 .. 1, for what other programs draw too.
pub fn splitmix64(seed: u64, count: usize) -> Vec<f64> {
    let number = |index: u64| {
        let mut z = index.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(seed);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 * 2f64.powi(-53)
    };
    (1..=count as u64).map(number).collect()
}

/// Two images in 0 … 1 and their `[row, column]`: texture with two blobs, and the same with noise. scikit-image and the
/// `lpips` package have scored them.
pub fn fixture_images() -> ([Vec<f64>; 2], [usize; 2]) {
    let [rows, columns] = [128, 256];
    let (texture, error) = (splitmix64(1, rows * columns), splitmix64(2, rows * columns));
    let pixel = |index: usize| {
        let (y, x) = ((index / columns) as f64, (index % columns) as f64);
        let blob = |row: f64, height: f64, width: f64| (-((y - row).powi(2) / height + (x - 60.0).powi(2) / width)).exp();
        (0.15 * texture[index] + 0.8 * blob(64.0, 20.0, 90.0) + 0.5 * blob(80.0, 200.0, 60.0)).clamp(0.0, 1.0)
    };
    let a: Vec<f64> = (0..rows * columns).map(pixel).collect();
    let b = a.iter().zip(&error).map(|(a, u)| (a + 0.2 * (2.0 * u - 1.0)).clamp(0.0, 1.0)).collect();
    ([a, b], [rows, columns])
}

/// Unit vectors in all directions, `[point, xyz]` row by row, the same in every run.
pub fn directions(seed: u64, count: usize) -> Vec<f64> {
    let draws = numbers(seed, 2 * count, 0.0, 1.0);
    draws
        .chunks_exact(2)
        .flat_map(|draw| {
            let height = 2.0 * draw[0] - 1.0;
            let radius = (1.0 - height * height).sqrt();
            let (sine, cosine) = (std::f64::consts::TAU * draw[1]).sin_cos();
            [radius * cosine, radius * sine, height]
        })
        .collect()
}

/// An f64 tensor.
pub fn tensor<const D: usize>(values: &[f64], shape: [usize; D], device: &Device) -> Tensor<D> {
    Tensor::from_data(TensorData::new(values.to_vec(), shape), (device, DType::F64))
}

/// The values as f64, whatever the tensor's own type is.
pub fn values<const D: usize>(tensor: &Tensor<D>) -> Vec<f64> {
    tensor.clone().into_data_as::<f64>().try_into_vec::<f64>().expect("f64 data")
}

/// A module with every parameter in f64.
pub fn in_f64<M: Module>(module: M) -> M {
    struct Cast;
    impl ModuleMapper for Cast {
        fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
            param.map(|tensor| tensor.cast(DType::F64).detach())
        }
    }
    module.map(&mut Cast)
}

/// All backends of the build but flex; a test that compares with none of them is counted as skipped.
pub fn other_devices() -> Vec<(&'static str, Device)> {
    let others: Vec<_> = cpu_devices().into_iter().skip(1).chain(software_gpu()).collect();
    if others.is_empty() {
        skip("a build with a second backend");
    }
    others
}

/// wgpu on a software driver.
fn software_gpu() -> Option<(&'static str, Device)> {
    #[cfg(feature = "wgpu")]
    return Some(("wgpu", Device::wgpu(burn::tensor::DeviceKind::Cpu)));
    #[cfg(not(feature = "wgpu"))]
    None
}

/// The backends that compute in f64.
pub fn cpu_devices() -> Vec<(&'static str, Device)> {
    vec![
        ("flex", Device::flex()),
        // ndarray is deprecated in 0.22, but it is the independent implementation to compare with.
        #[cfg(feature = "ndarray")]
        #[allow(deprecated)]
        ("ndarray", Device::ndarray()),
    ]
}

/// # Panics
/// With all rows that differ by more than `tolerance` of the largest wanted value.
pub fn assert_close(what: &str, found: &[f64], wanted: &[f64], tolerance: f64) {
    assert_eq!(found.len(), wanted.len(), "{what}: number of values");
    let largest = wanted.iter().fold(1e-12_f64, |largest, w| largest.max(w.abs()));
    let rows: Vec<_> = found
        .iter()
        .zip(wanted)
        .enumerate()
        .filter(|(_, (f, w))| (*f - *w).abs() > tolerance * largest || (*f - *w).is_nan())
        .map(|(i, (f, w))| format!("{what}[{i}]: found {f:e}, wanted {w:e}, difference {:e}", (f - w).abs()))
        .collect();
    assert!(rows.is_empty(), "tolerance {:e}\n{}", tolerance * largest, rows.join("\n"));
}

mod tests {
    #[allow(unused_imports)]
    use super::*;

    #[test]
    fn shared_data_that_is_there_is_required_and_what_is_not_is_skipped() {
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path();
        assert_eq!(find_shared(None, here, "bodies"), Ok(None));
        assert!(find_shared(Some(here.join("nowhere")), here, "").is_err(), "whoever names a folder means it");
        std::fs::create_dir(here.join("recordings")).unwrap();
        assert_eq!(find_shared(None, here, "recordings"), Ok(Some(here.join("recordings"))));
        assert!(find_shared(None, here, "bodies").unwrap_err().contains("bodies is absent, but required"));
    }

    #[test]
    fn nan_is_never_close() {
        let close = std::panic::catch_unwind(|| assert_close("x", &[f64::NAN], &[1.0], 1.0));
        assert!(close.is_err());
    }
}
