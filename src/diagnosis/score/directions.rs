//! How an effect's operator changes a signal: at some values, and to first order in its amplitudes.

use burn::tensor::{DType, Device, Tensor, TensorData};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::complex::Complex;
use crate::diagnosis::cube::{Cube, analytic};
use crate::diagnosis::evidence::Evidence;
use crate::effects::{Context, EffectInfo, Operator, ParameterInfo, Role, SignalOperator, Values};
use crate::radar::{Radar, Sampling};

/// Step of the central difference, of a parameter's prior width: its own error is of second order in it.
const STEP: f64 = 1e-4;
/// An inversion by fixed-point steps ends at a change of this share, or after so many steps.
const INVERTED: f64 = 1e-9;
const MOST_STEPS: usize = 40;

/// One real amplitude of an effect: a parameter that its operator is linear in, at one of the two phases of a complex one.
#[derive(Clone, Copy, Debug)]
pub struct Direction {
    pub parameter: &'static ParameterInfo,
    /// Where the amplitude has an angle: a quarter turn.
    pub is_quadrature: bool,
}

/// Values along the directions of an effect: the same for all receivers, or one after the other for each.
#[derive(Clone, Debug)]
pub struct Amplitudes {
    pub directions: Vec<Direction>,
    /// `[direction]` or `[receiver · direction]`.
    pub values: Vec<f64>,
}

impl Amplitudes {
    /// Of one receiver.
    pub fn of(&self, receiver: usize) -> &[f64] {
        let count = self.directions.len();
        let first = if self.values.len() > count { receiver * count } else { 0 };
        &self.values[first..first + count]
    }

    /// How many receivers have values of their own; one where all have the same.
    pub fn receivers(&self) -> usize {
        self.values.len() / self.directions.len()
    }
}

/// An effect as an operator on the samples of a radar, with levels relative to a reference.
#[derive(Clone)]
pub struct Drive {
    info: &'static EffectInfo,
    operator: SignalOperator,
    radar: Radar,
    /// `[tx, rx, loop, sample]`.
    dims: [usize; 4],
    farthest_m: f64,
    reference: f64,
}

impl Direction {
    /// All of an effect. None where it does not act on the summed signal, or adds whatever that is: one line more is no pattern. None
    /// where more than amplitudes are free: shapes need a search, and what is drawn at random changes the covariance instead of the mean.
    pub fn all(info: &'static EffectInfo) -> Vec<Self> {
        let is = |role: Role| info.parameters.iter().filter(move |parameter| parameter.role == role);
        let counts = is(Role::Fixed).any(|parameter| parameter.name != "reference");
        let more = counts || is(Role::Shape).chain(is(Role::Spread)).next().is_some();
        let follows_the_signal = matches!(info.operator, Operator::Signal(_) | Operator::Nonlinear(_));
        if more || !follows_the_signal {
            return vec![];
        }
        let phases: &[bool] = if is(Role::Angle).next().is_some() { &[false, true] } else { &[false] };
        is(Role::Amplitude)
            .chain(is(Role::AmplitudeOfReceivers))
            .flat_map(|parameter| phases.iter().map(move |&is_quadrature| Self { parameter, is_quadrature }))
            .collect()
    }
}

impl Drive {
    /// `reference`: amplitude that levels are relative to. None for what does not act on the summed signal.
    pub fn new(info: &'static EffectInfo, evidence: &Evidence, reference: f64) -> Option<Self> {
        let [_, dims @ ..] = evidence.cube.dims;
        let farthest_m = evidence.farthest_m();
        Some(Self { info, operator: info.operator.on_signal()?, radar: evidence.radar.clone(), dims, farthest_m, reference })
    }

    fn values(&self, amplitudes: &Amplitudes, device: &Device) -> Values {
        let mut given: Vec<(&'static str, Vec<f64>)> = vec![];
        let angle = self.info.parameters.iter().find(|other| other.role == Role::Angle);
        for parameter in self.info.parameters {
            if parameter.name == "reference" {
                given.push((parameter.name, vec![self.reference]));
            }
            let along = |is_quadrature: bool| {
                let place = |direction: &Direction| {
                    direction.parameter.name == parameter.name && direction.is_quadrature == is_quadrature
                };
                let index = amplitudes.directions.iter().position(place)?;
                Some((0..amplitudes.receivers()).map(|receiver| amplitudes.of(receiver)[index]).collect::<Vec<f64>>())
            };
            match (along(false), along(true), angle) {
                (None, None, _) => {}
                (re, im, Some(angle)) => {
                    let first = |values: Option<Vec<f64>>| values.map_or(0.0, |values| values[0]);
                    let amplitude = Complex64::new(first(re), first(im));
                    given.extend([(parameter.name, vec![amplitude.norm()]), (angle.name, vec![amplitude.arg()])]);
                }
                (values, _, None) => given.push((parameter.name, values.unwrap_or_default())),
            }
        }
        self.info.values(&given, device, DType::F64)
    }

    /// What the operator makes of a frame's samples, `[tx, rx, loop, sample]`. Receivers without quadrature keep the real part.
    pub fn applied(&self, signal: &[Complex64], frame: usize, amplitudes: &Amplitudes) -> Vec<Complex64> {
        let device = Device::flex();
        let part = |of: fn(&Complex64) -> f64| -> Tensor<4> {
            let data = TensorData::new(signal.iter().map(of).collect::<Vec<f64>>(), self.dims);
            Tensor::from_data(data, (&device, DType::F64))
        };
        let context = Context { radar: &self.radar, frame, farthest_m: self.farthest_m };
        let before = Complex::new(part(|value| value.re), part(|value| value.im));
        let after = (self.operator)(before, &self.values(amplitudes, &device), &context);
        let host = |part: Tensor<4>| part.into_data().convert::<f64>().try_into_vec::<f64>().expect("converted");
        let re = host(after.re);
        if self.radar.sampling == Sampling::Real {
            return analytic(&re.iter().map(|&value| value as f32).collect::<Vec<f32>>(), self.radar.samples_per_chirp);
        }
        re.into_iter().zip(host(after.im)).map(|(re, im)| Complex64::new(re, im)).collect()
    }

    /// Derivative of [`Self::applied`] by one amplitude at zero: a central difference of the operator in double precision.
    pub fn tangent(&self, signal: &[Complex64], frame: usize, direction: Direction) -> Vec<Complex64> {
        let ParameterInfo { neutral, least, most, .. } = *direction.parameter;
        let step = STEP * (most - least);
        let at = |value: f64| Amplitudes { directions: vec![direction], values: vec![value] };
        let [above, below] = [neutral + step, neutral - step].map(|value| self.applied(signal, frame, &at(value)));
        above.iter().zip(below).map(|(above, below)| (above - below) / (2.0 * step)).collect()
    }

    /// Whether every sample is changed for itself, whatever the others are.
    pub fn is_by_sample(&self, signal: &[Complex64], amplitudes: &Amplitudes) -> bool {
        // A fixed draw of half of the samples changes: what depends on others shows in the half that does not.
        let changes = |index: usize| (index.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40).is_multiple_of(2);
        let changed: Vec<Complex64> =
            signal.iter().enumerate().map(|(index, value)| if changes(index) { value * 2.0 + 1.0 } else { *value }).collect();
        let [before, after] = [signal, &changed].map(|signal| self.applied(signal, 0, amplitudes));
        before.iter().zip(after).enumerate().all(|(index, (before, after))| changes(index) || *before == after)
    }

    /// All samples as they were before the effect: v = y − (E(v) − v), step by step.
    pub fn undone(&self, cube: &Cube, amplitudes: &Amplitudes) -> Cube {
        let mut cube = cube.clone();
        let size: usize = cube.dims[1..].iter().product();
        cube.samples.par_chunks_exact_mut(size).enumerate().for_each(|(frame, found)| {
            let mut before = found.to_vec();
            for _ in 0..MOST_STEPS {
                let after = self.applied(&before, frame, amplitudes);
                let (mut change, mut all) = (0.0, 0.0);
                for ((before, after), found) in before.iter_mut().zip(after).zip(found.iter()) {
                    let next = found - (after - *before);
                    change += (next - *before).norm_sqr();
                    all += next.norm_sqr();
                    *before = next;
                }
                if change <= INVERTED * INVERTED * all {
                    break;
                }
            }
            found.copy_from_slice(&before);
        });
        cube
    }
}
