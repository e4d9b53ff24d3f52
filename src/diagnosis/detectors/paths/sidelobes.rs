//! What the windows' sidelobes carry of a map's loud cells.

/// Accelerations raise sidelobes above the window's own.
const SAFETY: f64 = 10.0;
/// Sidelobes below this share of the noise are nothing.
const LEVEL: f64 = 0.3;

/// Upper bounds of the powers that come from a map's cells within the support, `[doppler, range]`.
pub struct Sidelobes(Vec<f64>);

impl Sidelobes {
    pub fn new(map: &[f32], support: &[bool], samples: usize) -> Self {
        let loops = map.len() / samples;
        let mut lobes = vec![0.0f64; map.len()];
        for cell in (0..map.len()).filter(|&cell| support[cell]) {
            let (doppler, range) = (cell / samples, cell % samples);
            let power = f64::from(map[cell]);
            if power * SAFETY * hann_envelope(3.0) < LEVEL {
                continue;
            }
            // Away from both axes the product of two envelopes vanishes.
            for slow in -3..=3i64 {
                let row = (doppler as i64 + slow).rem_euclid(loops as i64) as usize * samples;
                let across = if slow.abs() < 2 { 1.0 } else { hann_envelope(slow.abs() as f64) };
                for other in 0..samples {
                    let apart = other.abs_diff(range).min(samples - other.abs_diff(range));
                    lobes[row + other] += power * across * hann_envelope(apart as f64);
                }
            }
            for fast in -3..=3i64 {
                let column = (range as i64 + fast).rem_euclid(samples as i64) as usize;
                let across = if fast.abs() < 2 { 1.0 } else { hann_envelope(fast.abs() as f64) };
                for other in 0..loops {
                    let apart = other.abs_diff(doppler).min(loops - other.abs_diff(doppler));
                    lobes[other * samples + column] += power * across * hann_envelope(apart as f64);
                }
            }
        }
        Self(lobes)
    }

    pub fn power(&self, cell: usize) -> f64 {
        self.0[cell]
    }

    /// Whether they reach a cell.
    pub fn reach(&self, cell: usize) -> bool {
        self.0[cell] * SAFETY > LEVEL
    }

    /// Noise and sidelobes.
    pub fn expected(&self, cell: usize) -> f32 {
        if self.reach(cell) { (1.0 + SAFETY * self.0[cell]) as f32 } else { 1.0 }
    }
}

/// Power of a Hann window far from its peak, an upper bound.
fn hann_envelope(cells: f64) -> f64 {
    let x = cells.max(1.5);
    (1.0 / (std::f64::consts::PI * x * (x * x - 1.0))).powi(2).min(1.0)
}
