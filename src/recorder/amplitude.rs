//! The amplitude law: physical optics on small elements.
//!
//! A patch of area dA with reflection Γ, seen from both antennas, adds to the received wave
//! Γ · (n·û_tx + n·û_rx)/2 · exp(+j k (r_tx + r_rx)) / (4π r_tx r_rx) · dA, in units of the wave that isotropic antennas
//! would exchange over a metre. It is the radar equation with the physical-optics cross-section
//! σ = 4π/λ² |∫ Γ cosθ exp(j 2 k r) dA|², in which λ cancels.
//!
//! Amplitudes are taken for the centre of the array (a few centimetres across), phases and spreading for each antenna.

use std::f64::consts::PI;

use num_complex::Complex64;

use super::material::Material;
use super::mirror::Mirror;
use super::surface::{Element, Patch};
use super::triangle::mean_phasor;
use super::vector::{Vector, distance, dot, scale, subtract};
use crate::room::Boundary;

/// What the walls do to a wave that they mirror.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WallLaw {
    /// The same factor at every angle.
    Constant(f64),
    Fresnel(Material),
}

/// All laws that turn an element into an amplitude.
#[derive(Clone, Copy, Debug)]
pub struct Laws {
    pub body: Material,
    pub walls: WallLaw,
    /// Of single boundaries, instead of `walls`.
    pub wall_coefficients: [Option<f64>; 6],
    /// Power gain cos^q about boresight (y); 0: the same everywhere in front of the board.
    pub antenna_exponent: f64,
}

/// The array's centre as seen over the walls of either leg.
pub struct View<'a> {
    pub tx: &'a Mirror,
    pub rx: &'a Mirror,
    pub tx_m: Vector,
    pub rx_m: Vector,
}

impl<'a> View<'a> {
    /// The array's centre (metres, radar frame) mirrored once for each leg.
    pub fn new(tx: &'a Mirror, rx: &'a Mirror, centre_m: Vector) -> Self {
        Self { tx, rx, tx_m: tx.point(centre_m), rx_m: rx.point(centre_m) }
    }
}

impl Laws {
    /// Field gain of an antenna towards `direction` (unit). Nothing is radiated behind the board.
    pub fn antenna_gain(&self, direction: Vector) -> f64 {
        if direction[1] < -1e-9 {
            0.0
        } else if self.antenna_exponent == 0.0 {
            1.0
        } else {
            direction[1].max(0.0).powf(0.5 * self.antenna_exponent)
        }
    }

    /// Factor of one mirror reflection at `cosine` from the wall's normal.
    pub fn wall(&self, wall: Boundary, cosine: f64, wavenumber: f64) -> Complex64 {
        match self.wall_coefficients[wall as usize].map_or(self.walls, WallLaw::Constant) {
            WallLaw::Constant(coefficient) => coefficient.into(),
            WallLaw::Fresnel(material) => material.reflection(cosine) * material.coherence(wavenumber, 2.0 * cosine),
        }
    }

    /// Gain of the antenna and the walls on one leg, `to_image` pointing from the element to the image.
    fn leg(&self, mirror: &Mirror, to_image: Vector, wavenumber: f64) -> Complex64 {
        let gain = self.antenna_gain(mirror.direction(scale(to_image, -1.0)));
        mirror.walls.iter().fold(gain.into(), |product: Complex64, wall: &Boundary| {
            product * self.wall(*wall, to_image[wall.axis().0].abs(), wavenumber)
        })
    }

    /// Complex amplitude of an element at each of `wavenumbers` (rad/m), relative to the phase of its reference point
    /// and without the spreading 1/(r_tx r_rx). Smooth in the element's motion: who faces away is for `visibility` to say.
    pub fn response<const N: usize>(
        &self,
        element: &Element,
        patch: &Patch,
        view: &View,
        wavenumbers: [f64; N],
    ) -> [Complex64; N] {
        let (tx, rx) = (distance(view.tx_m, patch.point), distance(view.rx_m, patch.point));
        let to_tx = scale(subtract(view.tx_m, patch.point), 1.0 / tx);
        let to_rx = scale(subtract(view.rx_m, patch.point), 1.0 / rx);
        let (cos_tx, cos_rx) = (dot(patch.normal, to_tx), dot(patch.normal, to_rx));
        let obliquity = 0.5 * (cos_tx + cos_rx);
        let strength = self.body.reflection(obliquity) * (element.reflectivity * obliquity * patch.area_m2 / (4.0 * PI));
        let extra = patch
            .corners
            .map(|corners| corners.map(|corner| distance(view.tx_m, corner) + distance(view.rx_m, corner) - tx - rx));
        wavenumbers.map(|wavenumber| {
            let shape = extra.map_or(Complex64::ONE, |extra| {
                // The sphericity of the wave lifts the corners together; over the triangle a quarter of it remains.
                let lift = extra.iter().sum::<f64>() / 3.0;
                mean_phasor(extra.map(|path| wavenumber * (path - 0.75 * lift)))
            });
            let legs = self.leg(view.tx, to_tx, wavenumber) * self.leg(view.rx, to_rx, wavenumber);
            strength * legs * shape * self.body.coherence(wavenumber, cos_tx + cos_rx)
        })
    }
}
