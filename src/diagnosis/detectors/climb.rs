//! The maximum of a smooth function near a start, such as the top of a periodogram.

/// The top near a start and its height: steps of one width as long as they lead up, then of half of it, down to the finest.
pub fn climb(height: impl Fn(f64) -> f64, start: f64, width: f64, finest: f64) -> (f64, f64) {
    let (mut at, mut top, mut width) = (start, height(start), width);
    while width > finest {
        let (left, right) = (height(at - width), height(at + width));
        if left > top {
            (at, top) = (at - width, left);
        } else if right > top {
            (at, top) = (at + width, right);
        } else {
            width *= 0.5;
        }
    }
    (at, top)
}

/// The top between two ends, by golden section in so many steps.
pub fn golden_section([mut low, mut high]: [f64; 2], steps: usize, mut height: impl FnMut(f64) -> f64) -> f64 {
    const RATIO: f64 = 0.618_033_988_749_895;
    for _ in 0..steps {
        let (a, b) = (high - RATIO * (high - low), low + RATIO * (high - low));
        if height(a) > height(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}
