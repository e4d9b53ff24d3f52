//! Scores of images.

use hybridsim::heatmap::{Axis, Map};
use hybridsim::metrics::{DbWindow, psnr, scores, ssim};

use crate::golden::{Golden, close};

#[test]
fn metrics_are_those_of_numpy_with_and_without_a_mask() {
    let golden = Golden("metrics");
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
