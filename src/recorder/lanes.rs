//! The inner loop: a block of elements in one chirp, as arrays the compiler turns into SIMD.

use super::chirp::Chirp;
use super::range_grid::{ORDERS, RangeGrid, ToneWeights};
use super::vector::Vector;
use crate::radar::SPEED_OF_LIGHT;

/// Elements in a block: all arrays below stay in the first caches.
pub const BLOCK: usize = 256;

/// Instants between which amplitudes are interpolated.
pub const NODES: usize = 4;

/// Weights of those instants in one chirp.
pub struct NodeShares {
    /// In the middle of the ADC window.
    pub value: [f64; NODES],
    /// From its start to its end: amplitudes change within a chirp, too.
    pub change: [f64; NODES],
}

/// Geometry of one block of elements in one chirp.
pub struct Lanes {
    position: [[f64; BLOCK]; 3],
    velocity: [[f64; BLOCK]; 3],
    /// Of both ways beyond the geometric path, metres.
    extra: [f64; BLOCK],
    tx_delay: [f64; BLOCK],
    tx_rate: [f64; BLOCK],
    spread: [f64; BLOCK],
    /// Amplitude of each order, without spreading.
    amplitude: [ToneWeights; BLOCK],
    turns: [f32; BLOCK],
    bend: [f32; BLOCK],
    cell: [u32; BLOCK],
    between: [f32; BLOCK],
    weights: [ToneWeights; BLOCK],
}

/// Weights of the poses in one chirp.
pub struct ChirpWeights {
    /// (pose within the frame, weight for the position, weight for the velocity in 1/s)
    pub poses: Vec<(usize, f64, f64)>,
}

impl Lanes {
    pub fn new() -> Box<Self> {
        Box::new(Self {
            position: [[0.0; BLOCK]; 3],
            velocity: [[0.0; BLOCK]; 3],
            extra: [0.0; BLOCK],
            tx_delay: [0.0; BLOCK],
            tx_rate: [0.0; BLOCK],
            spread: [0.0; BLOCK],
            amplitude: [[0.0; 2 * ORDERS]; BLOCK],
            turns: [0.0; BLOCK],
            bend: [0.0; BLOCK],
            cell: [0; BLOCK],
            between: [0.0; BLOCK],
            weights: [[0.0; 2 * ORDERS]; BLOCK],
        })
    }

    /// Extra paths of the block's elements, one way.
    pub fn delay(&mut self, extra_m: impl Iterator<Item = f64>) {
        self.extra.fill(0.0);
        for (own, extra) in self.extra.iter_mut().zip(extra_m) {
            *own = 2.0 * extra;
        }
    }

    /// Positions and velocities; `poses[pose][axis][element]`, the block starting at `start`, `count` long.
    pub fn place(&mut self, poses: &[[Vec<f64>; 3]], start: usize, count: usize, weights: &ChirpWeights) {
        for (axis, (position, velocity)) in self.position.iter_mut().zip(&mut self.velocity).enumerate() {
            position.fill(0.0);
            velocity.fill(0.0);
            for &(pose, weight, slope) in &weights.poses {
                let source = &poses[pose][axis][start..start + count];
                for ((x, v), &p) in position.iter_mut().zip(velocity.iter_mut()).zip(source) {
                    *x += weight * p;
                    *v += slope * p;
                }
            }
        }
    }

    /// Amplitudes by interpolation between the instants of `nodes[element][node]`.
    pub fn weigh(&mut self, nodes: &[[ToneWeights; NODES]], shares: &NodeShares) {
        let (value, change) = (shares.value.map(|s| s as f32), shares.change.map(|s| s as f32));
        for (amplitude, node) in self.amplitude.iter_mut().zip(nodes) {
            let mut sum: ToneWeights = [0.0; 2 * ORDERS];
            for (weights, (value, change)) in node.iter().zip(value.into_iter().zip(change)) {
                for (sum, weight) in sum.iter_mut().zip(weights) {
                    *sum += value * weight;
                }
                sum[2] += change * weights[0];
                sum[3] += change * weights[1];
            }
            *amplitude = sum;
        }
    }

    /// One-way delay and its rate to an antenna (or its image), for every lane: (metres, metres per second).
    #[inline(always)]
    fn leg(&self, antenna: Vector, i: usize) -> (f64, f64) {
        let [x, y, z] = [0, 1, 2].map(|axis| self.position[axis][i] - antenna[axis]);
        let distance = (x * x + y * y + z * z).sqrt();
        let inverse = 1.0 / distance;
        (distance, (x * self.velocity[0][i] + y * self.velocity[1][i] + z * self.velocity[2][i]) * inverse)
    }

    pub fn transmit(&mut self, antenna: Vector) {
        for i in 0..BLOCK {
            let (distance, rate) = self.leg(antenna, i);
            self.tx_delay[i] = distance + self.extra[i];
            self.tx_rate[i] = rate;
            self.spread[i] = 1.0 / distance;
        }
    }

    /// Adds the block, received by one antenna, to a range grid.
    pub fn receive(&mut self, antenna: Vector, count: usize, chirp: &Chirp, grid: &RangeGrid, storage: &mut [f32]) {
        let size = grid.size() as f64;
        let mut spread = [0f32; BLOCK];
        for (i, spread) in spread.iter_mut().enumerate() {
            let (distance, rate) = self.leg(antenna, i);
            let line = chirp
                .line((self.tx_delay[i] + distance) * (1.0 / SPEED_OF_LIGHT), (self.tx_rate[i] + rate) * (1.0 / SPEED_OF_LIGHT));
            *spread = (self.spread[i] / distance) as f32;
            self.turns[i] = (line.turns - nearest(line.turns)) as f32;
            self.bend[i] = line.bend_rad as f32;
            // Fraction of a turn per sample in 0..1; the last rounding may reach 1 itself, which is cell 0 again.
            let tone = line.turns_per_sample - nearest(line.turns_per_sample - 0.5);
            let position = if (0.0..1.0).contains(&tone) { tone * size } else { 0.0 };
            let cell = position as i32;
            self.cell[i] = cell as u32;
            self.between[i] = (position - f64::from(cell)) as f32;
        }
        for (i, &spread) in spread.iter().enumerate() {
            let (cos, sin) = cos_sin_turns(self.turns[i]);
            let (cos, sin) = (cos * spread, sin * spread);
            let a = &self.amplitude[i];
            let mut w = [0f32; 2 * ORDERS];
            for order in 0..ORDERS {
                w[2 * order] = a[2 * order] * cos - a[2 * order + 1] * sin;
                w[2 * order + 1] = a[2 * order] * sin + a[2 * order + 1] * cos;
            }
            // exp(j bend s²) ≈ 1 + j bend s²: the bend is a few milliradians.
            w[4] -= self.bend[i] * w[1];
            w[5] += self.bend[i] * w[0];
            self.weights[i] = w;
        }
        grid.add(storage, &self.cell[..count], &self.between[..count], &self.weights[..count]);
    }
}

/// Rounds to the nearest integer without a call; for magnitudes below 2^51.
#[inline(always)]
fn nearest(value: f64) -> f64 {
    const SHIFT: f64 = 6_755_399_441_055_744.0;
    (value + SHIFT) - SHIFT
}

/// cos and sin of 2π · turns for turns within ±1/2, to 1e-7.
#[inline(always)]
fn cos_sin_turns(turns: f32) -> (f32, f32) {
    let magnitude = turns.abs();
    // Both are sines of an angle within a quarter turn.
    let for_cos = 0.25 - magnitude;
    let for_sin = (0.25 - (magnitude - 0.25).abs()).copysign(turns);
    (sine(for_cos), sine(for_sin))
}

#[inline(always)]
fn sine(turns: f32) -> f32 {
    let z = turns * std::f32::consts::TAU;
    let q = z * z;
    // Taylor to z^11: 6e-8 at a quarter turn.
    let tail = -2.505_210_8e-8_f32;
    z * (1.0 + q * (-1.666_666_7e-1 + q * (8.333_333e-3 + q * (-1.984_127e-4 + q * (2.755_731_9e-6 + q * tail)))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fast_sine_and_cosine_are_right_to_single_precision() {
        for step in -1000..=1000 {
            let turns = step as f32 / 2000.0;
            let (cos, sin) = cos_sin_turns(turns);
            let angle = f64::from(turns) * std::f64::consts::TAU;
            assert!((f64::from(cos) - angle.cos()).abs() < 3e-7 && (f64::from(sin) - angle.sin()).abs() < 3e-7, "{turns}");
        }
    }

    #[test]
    fn nearest_rounds_like_round() {
        for value in [0.2, 0.7, -0.3, -0.8, 12345.6, 4.0] {
            assert_eq!(nearest(value), f64::round(value));
        }
    }
}
