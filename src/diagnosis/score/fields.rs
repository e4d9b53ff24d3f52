//! What follows the signal without a law of the library: its products with itself, each as an operator with a complex amplitude.
//!
//! An effect of the library is named where it explains what the field of its family explains; otherwise the field is reported, without
//! a name.

use burn::tensor::Tensor;

use crate::complex::Complex;
use crate::diagnosis::behaviour::Behaviour;
use crate::effects::{Choice, Context, EffectInfo, Operator, ParameterInfo, Role, SignalOperator, Stage, Values};

/// A field with what a report says that it behaves like.
pub struct Field {
    pub info: &'static EffectInfo,
    pub behaves_like: Behaviour,
}

pub static ALL: [Field; 2] = [
    Field { info: &CONJUGATE, behaves_like: Behaviour::ConjugateImage },
    Field { info: &CUBE, behaves_like: Behaviour::NonLinear },
];

static CONJUGATE: EffectInfo = field(
    "conjugate",
    "everything appears again at the opposite beat frequency and velocity, with the conjugate phase",
    "s → s + (re + j im) s*",
    &[part("re", Role::AmplitudeOfReceivers, IMAGE), part("im", Role::AmplitudeOfReceivers, IMAGE)],
    conjugate,
);

static CUBE: EffectInfo = field(
    "cube",
    "products of three returns lie where none of them is, as those of a receiver that is not linear",
    "s → s + (re + j im) |s|² s / reference²",
    &[part("re", Role::Amplitude, THIRD_ORDER), part("im", Role::Amplitude, THIRD_ORDER), REFERENCE],
    cube,
);

const REFERENCE: ParameterInfo =
    ParameterInfo { name: "reference", role: Role::Fixed, unit: "recording's unit", neutral: 0.0, least: 0.0, most: 1e9 };

/// The strongest that the library's law of the same family can make of it, so that both are held against the same cells: branches that
/// differ by 6 dB, (6 dB · ln 10 / 20) / 2; and half of the strongest sample.
const IMAGE: f64 = 0.345;
const THIRD_ORDER: f64 = 0.5;

const fn part(name: &'static str, role: Role, most: f64) -> ParameterInfo {
    ParameterInfo { name, role, unit: "1", neutral: 0.0, least: -most, most }
}

const fn field(
    id: &'static str,
    title: &'static str,
    equation: &'static str,
    parameters: &'static [ParameterInfo],
    operator: SignalOperator,
) -> EffectInfo {
    EffectInfo {
        id,
        card: "",
        stage: Stage::Receiver,
        needs_person: false,
        title,
        explanation: "no effect of the library explains it",
        equation,
        parameters,
        choice: Choice::None,
        look_alikes: &[],
        separate_by: "",
        operator: Operator::Nonlinear(operator),
    }
}

/// Of receivers, or of all: `[1, rx, 1, 1]` or `[1, 1, 1, 1]`.
fn factor(values: &Values) -> Complex<4> {
    let part = |name: &str| -> Tensor<4> {
        let list = values.get(name);
        let [count] = list.dims();
        list.reshape([1, count, 1, 1])
    };
    let (re, im) = (part("re"), part("im"));
    Complex::new(re.clone() + im.zeros_like(), im + re.zeros_like())
}

/// `[tx, rx, loop, sample]` → the same. Gradients flow to the signal and to the values.
fn conjugate(signal: Complex<4>, values: &Values, _: &Context<'_>) -> Complex<4> {
    signal.clone().add(signal.conj().mul(factor(values)))
}

/// `[tx, rx, loop, sample]` → the same. Gradients flow to the signal and to the values.
fn cube(signal: Complex<4>, values: &Values, _: &Context<'_>) -> Complex<4> {
    let reference = values.reference(&signal).reshape([1, 1, 1, 1]);
    let product = signal.clone().scale(signal.clone().power() / (reference.clone() * reference));
    signal.add(product.mul(factor(values)))
}
