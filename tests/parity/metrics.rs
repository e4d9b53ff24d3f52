//! Scores of images.

use hybridsim::heatmap::{Axis, Map};
use hybridsim::metrics::{DbWindow, psnr, scores, ssim};

use crate::{
    golden::{Golden, close},
    support::fixture_images,
};

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

#[test]
fn ssim_and_psnr_are_those_of_scikit_image() {
    let ([a, b], dims) = fixture_images();
    // scikit-image 0.26.0: structural_similarity(gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1)
    close("ssim", &[ssim(&a, &b, dims).unwrap()], &[0.285_755_407_826_052_1], 1e-12);
    close("psnr", &[psnr(&a, &b)], &[20.403_880_627_091_937], 1e-12);
}
