//! Vectors in space `[x, y, z]`: places, velocities and directions; `paths::distance` is how far two places are apart.

/// a − b.
pub fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

/// Σ a b.
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| a[axis] * b[axis]).sum()
}

/// √(Σ a²).
pub fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// Sine of the angle to the boresight, across it, at which something is seen from a place: x over the distance.
pub fn sine(at_m: [f64; 3], from_m: [f64; 3]) -> f64 {
    let way = difference(at_m, from_m);
    way[0] / norm(way).max(1e-6)
}
