//! How an effect enters the simulator.

use burn::tensor::Tensor;

use super::{context::Context, points::BodyPoints, values::Values};
use crate::{
    body::Displacement,
    complex::Complex,
    if_signal::SumForm,
    paths::{Dechirp, Points},
    radar::Radar,
    room::Room,
};

/// `[tx, rx, loop, sample]` → the same.
pub type SignalOperator = fn(Complex<4>, &Values, &Context<'_>) -> Complex<4>;
/// `[point, chirp]` → the same.
pub type DisplacementOperator = fn(Displacement, &Values, &BodyPoints<'_>) -> Displacement;

/// Where an effect enters the simulator, and its function.
#[derive(Clone, Copy, Debug)]
pub enum Operator {
    /// How many frames later than its number a frame shows the scene.
    Frame(fn(&Values, usize) -> usize),
    /// Moves points of the body.
    Displacement(DisplacementOperator),
    /// Shows points of the body at another time; [`BodyPoints::velocity`] is computed for it.
    Time(DisplacementOperator),
    /// Weighs points of the body, `[point, 1]`.
    Amplitude(fn(Tensor<2>, &Values, &BodyPoints<'_>) -> Tensor<2>),
    /// Takes the place of the direct signal of points, `[rx, chirp, sample]`.
    Direct(fn(Points<'_>, &Values, &Chirps<'_>) -> Complex<3>),
    /// Adds paths of the body's points, `[rx, chirp, sample]`; none where the room has no wall for them.
    Paths(fn(&DirectReturns<'_>, &Values) -> Option<Complex<3>>),
    /// An object that is not in the scene, at these radar times of the chirps, seconds: `[rx, chirp, sample]` or `[rx, 1, sample]`.
    Reflector(fn(&Values, &[f64], &Chirps<'_>) -> Complex<3>),
    /// An object that a part of the body carries, at this place, moved by this much: `[rx, chirp, sample]`.
    Carried(fn(&Values, [f64; 3], &Displacement, &Chirps<'_>) -> Complex<3>),
    /// Changes the sum of the paths, in proportion to it.
    Signal(SignalOperator),
    /// Changes the sum of the paths by what is there without it, too.
    Added(SignalOperator),
    /// Changes the sum of the paths, not in proportion to it.
    Nonlinear(SignalOperator),
    /// Shapes the noise before its level; the number is the seed.
    Noise(fn(Complex<4>, &Values, &Radar, u64) -> Complex<4>),
}

/// The chirps of one transmitter in one frame, and how their samples are summed.
#[derive(Clone, Copy, Debug)]
pub struct Chirps<'a> {
    pub radar: &'a Radar,
    pub tx: usize,
    pub dechirp: Dechirp,
    pub form: SumForm,
}

/// What one transmitter receives of the body's points on the direct path.
#[derive(Clone, Copy, Debug)]
pub struct DirectReturns<'a> {
    pub points: Points<'a>,
    /// `[rx, chirp, sample]`.
    pub direct: &'a Complex<3>,
    pub room: Option<&'a Room>,
    pub chirps: Chirps<'a>,
}

impl Operator {
    /// What acts on the sum of the paths.
    pub fn on_signal(self) -> Option<SignalOperator> {
        match self {
            Self::Signal(apply) | Self::Added(apply) | Self::Nonlinear(apply) => Some(apply),
            _ => None,
        }
    }

    /// What moves points of the body.
    pub fn on_displacement(self) -> Option<DisplacementOperator> {
        match self {
            Self::Displacement(displace) | Self::Time(displace) => Some(displace),
            _ => None,
        }
    }

    /// Whether silence does not stay silent.
    pub fn adds_to_silence(self) -> bool {
        matches!(self, Self::Reflector(_) | Self::Carried(_) | Self::Added(_))
    }
}
