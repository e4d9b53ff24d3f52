//! Structural similarity (Wang et al. 2004): Gaussian window of 11 × 11 with σ = 1.5, K₁ = 0.01, K₂ = 0.03, images in 0 … 1.
//!
//! Only cells that a whole window fits around are counted ("valid" padding), as in the original and in scikit-image.

const RADIUS: usize = 5;
const SIGMA: f64 = 1.5;
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Local similarity of the inner cells, five cells away from every edge.
#[derive(Clone, Debug, PartialEq)]
pub struct SsimMap {
    /// Of the image, `[row, column]`.
    dims: [usize; 2],
    /// `[row − 5, column − 5]`
    values: Vec<f64>,
}

impl SsimMap {
    pub fn mean(&self) -> f64 {
        self.values.iter().sum::<f64>() / self.values.len() as f64
    }

    /// Mean over the image's cells in a mask; `None` when no inner cell belongs to it.
    pub fn mean_over(&self, mask: &[bool]) -> Option<f64> {
        let [rows, columns] = self.dims;
        assert_eq!(mask.len(), rows * columns, "ssim: mask of {} cells for {rows} × {columns}", mask.len());
        let inner = columns - 2 * RADIUS;
        let cell = |index: usize| (index / inner + RADIUS) * columns + index % inner + RADIUS;
        let chosen: Vec<f64> = (0..self.values.len()).filter(|&i| mask[cell(i)]).map(|i| self.values[i]).collect();
        (!chosen.is_empty()).then(|| chosen.iter().sum::<f64>() / chosen.len() as f64)
    }
}

/// Mean similarity of two images `[row, column]` with values in 0 … 1; `None` when they are smaller than the window.
pub fn ssim(a: &[f64], b: &[f64], dims: [usize; 2]) -> Option<f64> {
    ssim_map(a, b, dims).map(|map| map.mean())
}

/// Similarity at every inner cell; `None` when the images are smaller than the window.
///
/// # Panics
/// When the pixels do not fill `dims`.
pub fn ssim_map(a: &[f64], b: &[f64], dims: [usize; 2]) -> Option<SsimMap> {
    let [rows, columns] = dims;
    assert!(a.len() == rows * columns && b.len() == a.len(), "ssim: {} and {} pixels for {dims:?}", a.len(), b.len());
    if rows.min(columns) < 2 * RADIUS + 1 {
        return None;
    }
    let product = |x: &[f64], y: &[f64]| blur(&x.iter().zip(y).map(|(x, y)| x * y).collect::<Vec<_>>(), dims);
    let (mean_a, mean_b) = (blur(a, dims), blur(b, dims));
    let (square_a, square_b, cross) = (product(a, a), product(b, b), product(a, b));
    let local = |index: usize| {
        let (ma, mb) = (mean_a[index], mean_b[index]);
        let (va, vb) = (square_a[index] - ma * ma, square_b[index] - mb * mb);
        let covariance = cross[index] - ma * mb;
        (2.0 * ma * mb + C1) * (2.0 * covariance + C2) / ((ma * ma + mb * mb + C1) * (va + vb + C2))
    };
    Some(SsimMap { dims, values: (0..mean_a.len()).map(local).collect() })
}

/// Gaussian mean around every inner cell: along the rows, then along the columns.
fn blur(image: &[f64], [rows, columns]: [usize; 2]) -> Vec<f64> {
    let kernel = kernel();
    let inner = columns - 2 * RADIUS;
    let along_rows: Vec<f64> =
        image.chunks_exact(columns).flat_map(|row| row.windows(kernel.len()).map(|cells| dot(cells, &kernel))).collect();
    let mut result = vec![0.0; (rows - 2 * RADIUS) * inner];
    for (row, target) in result.chunks_exact_mut(inner).enumerate() {
        for (offset, weight) in kernel.iter().enumerate() {
            let source = &along_rows[(row + offset) * inner..(row + offset + 1) * inner];
            target.iter_mut().zip(source).for_each(|(sum, value)| *sum += weight * value);
        }
    }
    result
}

fn kernel() -> [f64; 2 * RADIUS + 1] {
    let raw: [f64; 2 * RADIUS + 1] = std::array::from_fn(|index| (-0.5 * ((index as f64 - RADIUS as f64) / SIGMA).powi(2)).exp());
    let sum: f64 = raw.iter().sum();
    raw.map(|weight| weight / sum)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture() -> Vec<f64> {
        (0..24 * 30).map(|index| 0.5 + 0.4 * ((index * index % 97) as f64 / 97.0 - 0.5)).collect()
    }

    #[test]
    fn an_image_is_like_itself_and_unlike_its_negative() {
        let image = texture();
        let negative: Vec<f64> = image.iter().map(|value| 1.0 - value).collect();
        assert!((ssim(&image, &image, [24, 30]).unwrap() - 1.0).abs() < 1e-12);
        assert!(ssim(&image, &negative, [24, 30]).unwrap() < -0.5);
    }

    #[test]
    fn constant_images_follow_the_luminance_term_alone() {
        let (a, b) = (0.3, 0.6);
        let wanted = (2.0 * a * b + C1) / (a * a + b * b + C1);
        let found = ssim(&[a; 144], &[b; 144], [12, 12]).unwrap();
        assert!((found - wanted).abs() < 1e-9, "found {found}, wanted {wanted}");
    }

    #[test]
    fn images_smaller_than_the_window_have_no_similarity() {
        assert_eq!(ssim(&[0.0; 100], &[0.0; 100], [10, 10]), None);
    }

    #[test]
    fn a_mask_looks_at_the_image_where_it_says() {
        let image = texture();
        let mut wrong = image.clone();
        // disturbed in the upper left corner only
        (0..4).for_each(|row| (0..4).for_each(|column| wrong[row * 30 + column] = 0.0));
        let map = ssim_map(&image, &wrong, [24, 30]).unwrap();
        let below: Vec<bool> = (0..24 * 30).map(|index| index / 30 >= 12).collect();
        let above: Vec<bool> = below.iter().map(|cell| !cell).collect();
        assert!((map.mean_over(&below).unwrap() - 1.0).abs() < 1e-12);
        assert!(map.mean_over(&above).unwrap() < 0.999);
        // the edge itself has no windows
        let edge: Vec<bool> = (0..24 * 30).map(|index| index < 30).collect();
        assert_eq!(map.mean_over(&edge), None);
    }
}
