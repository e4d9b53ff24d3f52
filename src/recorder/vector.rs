//! Three-dimensional vectors in float64: the few operations the recorder's geometry needs.

/// x, y, z.
pub type Vector = [f64; 3];

/// a + b.
pub fn add(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a − b.
pub fn subtract(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// factor · a.
pub fn scale(a: Vector, factor: f64) -> Vector {
    [a[0] * factor, a[1] * factor, a[2] * factor]
}

/// a + factor · b.
pub fn add_scaled(a: Vector, b: Vector, factor: f64) -> Vector {
    [a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]]
}

/// a · b.
pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b, right-handed.
pub fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// |a|.
pub fn length(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

/// |a − b|.
pub fn distance(a: Vector, b: Vector) -> f64 {
    length(subtract(a, b))
}

/// The unit vector along `a`; zero stays zero.
pub fn unit(a: Vector) -> Vector {
    scale(a, 1.0 / length(a).max(1e-300))
}

/// matrix · a, the matrix `[row][column]`.
pub fn rotate(matrix: &[[f64; 3]; 3], a: Vector) -> Vector {
    [dot(matrix[0], a), dot(matrix[1], a), dot(matrix[2], a)]
}

/// Matrix product a · b, each `[row][column]`.
pub fn multiply(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|row| std::array::from_fn(|column| (0..3).map(|k| a[row][k] * b[k][column]).sum()))
}

/// Σ weight · item.
pub fn combine(items: &[Vector], weights: [f64; 3]) -> Vector {
    std::array::from_fn(|axis| (0..3).map(|i| items[i][axis] * weights[i]).sum())
}
