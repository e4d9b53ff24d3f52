//! The IF signal as tones of the band in which a scene's echoes are: what filters and errors of the chirp act on.
//!
//! With the IF convention exp(j2π(f_c τ + S t τ)), an error of the chirp that adds 2π τ g(t) to every path is the same as
//! reading the beat signal at t + g(t)/S. So one interpolation serves all of them. A Fourier transform of the window
//! would tear at its edges, where tones do not close; instead a signal is written as the tones of the scene's band that
//! fit it with the least norm (ridge regression), and these are evaluated elsewhere. The ridge trades accuracy in the band
//! for safety outside of it, where an echo is answered at random but hardly stronger than it is.
//!
//! Error against exact tones of amplitude 1 (128 samples, band up to half the sample rate): −67 dB for shifts of a tenth of
//! a sample, −40 dB for one sample, −20 dB for five; −40 dB for a filter with its corner in the band. For a band up to 0.9 of
//! the sample rate: −45 dB for a tenth of a sample. Outside of the band, up to +7 dB for a shift of one sample.

use std::{
    f64::consts::TAU,
    sync::{Arc, Mutex},
};

use burn::tensor::{DType, Device, Tensor, TensorData};
use nalgebra::{Complex as Number, DMatrix};

use crate::complex::Complex;

/// Tones per sample, and the ridge relative to the tones' number.
const OVERSAMPLING: usize = 2;
const RIDGE: f64 = 1e-4;
/// The band's lower end, cycles per sample.
const LOWEST: f64 = -0.02;

type Entries = Vec<Number<f64>>;

/// The matrices in f64, row by row.
struct Host {
    samples: usize,
    /// Highest tone, in steps.
    last: i64,
    cycles: Vec<f64>,
    /// `[sample, tone]`
    analysis: Entries,
    /// `[tone, sample]`
    synthesis: Entries,
}

/// They depend on the window and the band alone, and cost a matrix inversion.
static KNOWN: Mutex<Vec<Arc<Host>>> = Mutex::new(Vec::new());

fn host(samples: usize, highest: f64) -> Arc<Host> {
    let steps = (OVERSAMPLING * samples) as f64;
    let last = (highest * steps).ceil() as i64;
    let mut known = KNOWN.lock().expect("no panic while locked");
    if let Some(host) = known.iter().find(|host| host.samples == samples && host.last == last) {
        return host.clone();
    }
    let cycles: Vec<f64> = ((LOWEST * steps).floor() as i64..=last).map(|step| step as f64 / steps).collect();
    let middle = 0.5 * (samples as f64 - 1.0);
    let tones = DMatrix::from_fn(cycles.len(), samples, |tone, sample| {
        Number::from_polar(1.0, TAU * (cycles[tone] * (sample as f64 - middle)).fract())
    });
    let adjoint = tones.adjoint();
    let mut gram = &adjoint * &tones;
    for sample in 0..samples {
        gram[(sample, sample)] += RIDGE * cycles.len() as f64;
    }
    let analysis = gram.cholesky().expect("positive definite by its ridge").solve(&adjoint);
    let rows = |matrix: &DMatrix<Number<f64>>| matrix.transpose().iter().copied().collect();
    let host = Arc::new(Host { samples, last, analysis: rows(&analysis), synthesis: rows(&tones), cycles });
    known.push(host.clone());
    host
}

/// The tones as tensors.
pub struct Tones {
    /// `[sample, tone]`
    analysis: Complex<2>,
    /// `[tone, sample]`
    synthesis: Complex<2>,
    /// `[tone]`, cycles per sample.
    cycles: Tensor<1>,
}

impl Tones {
    /// `highest`: the band's upper end, cycles per sample.
    pub fn new(samples: usize, highest: f64, device: &Device, dtype: DType) -> Self {
        let host = host(samples, highest.clamp(0.1, 0.9));
        let count = host.cycles.len();
        let tensor = |values: Vec<f64>, dims: [usize; 2]| {
            Tensor::<2>::from_data(TensorData::new(values, dims).convert_dtype(dtype), (device, dtype))
        };
        let complex = |entries: &Entries, dims| {
            let (re, im) = entries.iter().map(|entry| (entry.re, entry.im)).unzip();
            Complex::new(tensor(re, dims), tensor(im, dims))
        };
        Self {
            analysis: complex(&host.analysis, [samples, count]),
            synthesis: complex(&host.synthesis, [count, samples]),
            cycles: tensor(host.cycles.clone(), [count, 1]).reshape([count]),
        }
    }

    /// `[tone]`, cycles per sample: the beat frequency over the sample rate.
    pub fn cycles(&self) -> Tensor<1> {
        self.cycles.clone()
    }

    /// Multiplies every tone; leaves the signal exactly as it is where the factor is 1.
    ///
    /// # Shapes
    /// signal `[tx, rx, loop, sample]`; factor broadcasts with `[tx, rx, loop, tone]`
    ///
    /// # Gradient
    /// Flows to both.
    pub fn filter(&self, signal: Complex<4>, factor: Complex<4>) -> Complex<4> {
        let change = Complex::new(factor.re - 1.0, factor.im);
        let tones = product(signal.clone(), &self.analysis).mul(change);
        signal.add(product(tones, &self.synthesis))
    }

    /// Reads every chirp at other times: sample n at n + shift. A shift of zero changes nothing at all.
    ///
    /// # Shapes
    /// signal `[tx, rx, loop, sample]`; shift, in samples, `[sample]`, or `[1]` for all
    ///
    /// # Gradient
    /// Flows to both.
    pub fn warp(&self, signal: Complex<4>, shift: Tensor<1>) -> Complex<4> {
        let [count] = shift.dims();
        let turns = self.cycles().reshape([self.cycles.dims()[0], 1]) * shift.reshape([1, count]);
        let unit = Complex::unit(turns);
        let moved = self.synthesis.clone().mul(Complex::new(unit.re - 1.0, unit.im));
        signal.clone().add(product(product(signal, &self.analysis), &moved))
    }

    /// The same with a shift for every chirp: broadcasts with `[tx, rx, loop, 1]`.
    pub fn shift(&self, signal: Complex<4>, shift: Tensor<4>) -> Complex<4> {
        let cycles = self.cycles().reshape([1, 1, 1, -1]);
        self.filter(signal, Complex::unit(cycles * shift))
    }
}

/// `[tx, rx, loop, a]` times `[a, b]`, as one product.
fn product(signal: Complex<4>, matrix: &Complex<2>) -> Complex<4> {
    let [tx, rx, loops, from] = signal.dims();
    let to = matrix.dims()[1];
    signal.reshape([tx * rx * loops, from]).matmul(matrix.clone()).reshape([tx, rx, loops, to])
}
