//! Periodic encoding of where a patch of the room is (paper, section 3.1).
//!
//! γ(p) = (p, sin 2⁰πp, cos 2⁰πp, …, sin 2ᴸ⁻¹πp, cos 2ᴸ⁻¹πp) for each coordinate p in −1 … 1: a small network that sees
//! only p learns smooth functions of it, one that sees γ(p) also learns rapidly varying ones.

use burn::tensor::{Device, Tensor, TensorData};
use serde::{Deserialize, Serialize};

use super::extent::Extent;
use crate::error::{Error, Result};
use crate::room::Boundary;

/// Settings of the encoding; nothing in it is learned.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EncodingConfig {
    /// Frequencies per coordinate (L): the finest period is 2^(2−L) of the room's half width.
    pub octaves: usize,
    /// Adds six numbers that say which boundary the patch belongs to, so that the two sides of an edge can differ.
    pub boundary: bool,
}

impl Default for EncodingConfig {
    fn default() -> Self {
        Self { octaves: 6, boundary: true }
    }
}

impl EncodingConfig {
    /// Refuses frequencies that f32 cannot tell apart. `key` names these settings in messages.
    pub fn check(&self, key: &str) -> Result<()> {
        if self.octaves > 12 {
            return Err(Error::setting(format!("{key}.octaves"), self.octaves, "at most 12"));
        }
        Ok(())
    }

    /// Length of a patch's feature vector.
    pub fn features_out(&self) -> usize {
        3 + 6 * self.octaves + if self.boundary { Boundary::ALL.len() } else { 0 }
    }

    /// Features of the room's patches, ready for the decoders. The room stands still: call it once.
    ///
    /// # Shapes
    /// - `position_m`: `[patch]`, metres; `boundary`: `[patch]`
    /// - result: `[point, feature]`
    pub fn features(&self, position_m: &[[f64; 3]], boundary: &[Boundary], extent: &Extent, device: &Device) -> Tensor<2> {
        assert_eq!(position_m.len(), boundary.len(), "encoding: {} positions, {} boundaries", position_m.len(), boundary.len());
        let point = position_m.len();
        let normalised: Vec<f32> =
            position_m.iter().flat_map(|&position| extent.fraction(position)).map(|f| (2.0 * f - 1.0) as f32).collect();
        let periodic = self.encode(Tensor::from_data(TensorData::new(normalised, [point, 3]), device));
        if !self.boundary {
            return periodic;
        }
        let membership: Vec<f32> =
            boundary.iter().flat_map(|own| Boundary::ALL.map(|other| if *own == other { 1.0 } else { 0.0 })).collect();
        let membership = Tensor::from_data(TensorData::new(membership, [point, Boundary::ALL.len()]), device);
        Tensor::cat(vec![periodic, membership], 1)
    }

    /// γ of normalised coordinates.
    ///
    /// # Shapes
    /// - `position`: `[point, xyz]`, −1 … 1
    /// - result: `[point, feature]`: the coordinates, then all sines, then all cosines, octave after octave
    ///
    /// # Gradient
    /// Flows to `position`.
    pub fn encode(&self, position: Tensor<2>) -> Tensor<2> {
        if self.octaves == 0 {
            return position;
        }
        let octave = |octave: usize| position.clone() * (std::f64::consts::PI * (1_u64 << octave) as f64);
        let phase = Tensor::cat((0..self.octaves).map(octave).collect(), 1);
        Tensor::cat(vec![position.clone(), phase.clone().sin(), phase.cos()], 1)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::support::{assert_close, check_backends, check_gradient, input, numbers, tensor, values};
    use std::f64::consts::PI;

    #[test]
    fn the_encoding_is_the_formula() {
        let config = EncodingConfig { octaves: 2, boundary: false };
        let found = values(&config.encode(tensor(&[0.1, -0.4, 0.9], [1, 3], &Device::flex())));
        let p = [0.1, -0.4, 0.9_f64];
        let mut wanted = p.to_vec();
        for wave in [f64::sin, f64::cos] {
            for octave in [1.0, 2.0] {
                wanted.extend(p.map(|p| wave(octave * PI * p)));
            }
        }
        assert_eq!(found.len(), config.features_out());
        assert_close("encoding", &found, &wanted, 1e-14);
    }

    #[test]
    fn patches_at_the_same_corner_of_two_walls_differ_by_their_boundary() {
        let config = EncodingConfig::default();
        let extent = Extent { low_m: [-2.0; 3], high_m: [2.0; 3] };
        let corner = [[2.0, 2.0, 0.0]; 2];
        let features = config.features(&corner, &[Boundary::Right, Boundary::Front], &extent, &Device::flex());
        assert_eq!(features.dims(), [2, config.features_out()]);
        let rows = values(&features);
        let (right, front) = rows.split_at(config.features_out());
        let differing: Vec<usize> = (0..right.len()).filter(|&i| right[i] != front[i]).collect();
        assert_eq!(differing, [40, 41], "only the membership of right (1) and front (2)");
    }

    #[test]
    fn the_room_is_normalised_to_plus_and_minus_one() {
        let config = EncodingConfig { octaves: 0, boundary: false };
        let extent = Extent { low_m: [-1.9, -0.6, -1.0], high_m: [2.4, 5.6, 1.7] };
        let rows = config.features(&[[-1.9, 5.6, 0.35]], &[Boundary::Left], &extent, &Device::flex());
        assert_close("coordinates", &values(&rows), &[-1.0, 1.0, 0.0], 1e-6);
    }

    pub(crate) fn gradients_agree_with_central_differences() {
        let inputs = [input("position", numbers(4, 6, -1.0, 1.0))];
        let encode = |x: &[Tensor<1>]| {
            let config = EncodingConfig { octaves: 3, boundary: false };
            config.encode(x[0].clone().reshape([2, 3])).reshape([2 * config.features_out()])
        };
        check_gradient(&inputs, 1e-5, 1e-7, encode);
        check_backends(&inputs, 1e-5, encode);
    }

    #[test]
    fn too_many_octaves_are_refused() {
        assert!(EncodingConfig { octaves: 13, boundary: true }.check("room.encoding").is_err());
        assert!(EncodingConfig::default().check("room.encoding").is_ok());
    }
}
