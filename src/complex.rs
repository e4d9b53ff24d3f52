//! Complex numbers as a pair of real tensors, with the few operations that radar needs.

use burn::tensor::{Device, Tensor};
use num_complex::Complex32;

/// A complex tensor. Gradients flow through both parts.
#[derive(Clone, Debug)]
pub struct Complex<const D: usize> {
    /// Real part; the axes are the caller's.
    pub re: Tensor<D>,
    /// Imaginary part, of the same shape.
    pub im: Tensor<D>,
}

// `add`, `sub` and `mul` are methods that chain, as Burn's own are.
#[allow(clippy::should_implement_trait)]
impl<const D: usize> Complex<D> {
    /// # Panics
    /// When the shapes of the two parts differ.
    pub fn new(re: Tensor<D>, im: Tensor<D>) -> Self {
        assert_eq!(re.dims(), im.dims(), "complex: real part {:?}, imaginary part {:?}", re.dims(), im.dims());
        Self { re, im }
    }

    /// Zeros of a shape, on a device.
    pub fn zeros(dims: [usize; D], device: &Device) -> Self {
        Self { re: Tensor::zeros(dims, device), im: Tensor::zeros(dims, device) }
    }

    /// amplitude · exp(j 2π turns).
    pub fn from_polar(amplitude: Tensor<D>, turns: Tensor<D>) -> Self {
        let Self { re, im } = Self::unit(turns);
        Self { re: re * amplitude.clone(), im: im * amplitude }
    }

    /// exp(j 2π turns). The turns are wrapped to ±½ before the sine, which f32 needs for accuracy.
    pub fn unit(turns: Tensor<D>) -> Self {
        let radians = wrap(turns) * std::f64::consts::TAU;
        Self { re: radians.clone().cos(), im: radians.sin() }
    }

    /// The shape of either part.
    pub fn dims(&self) -> [usize; D] {
        self.re.dims()
    }

    /// The device that the real part is on.
    pub fn device(&self) -> Device {
        self.re.device()
    }

    /// The complex conjugate. Gradients flow through both parts.
    pub fn conj(self) -> Self {
        Self { re: self.re, im: -self.im }
    }

    /// Element-wise product; shapes broadcast as Burn's do.
    pub fn mul(self, other: Self) -> Self {
        Self {
            re: self.re.clone() * other.re.clone() - self.im.clone() * other.im.clone(),
            im: self.re * other.im + self.im * other.re,
        }
    }

    /// Element-wise sum; shapes broadcast as Burn's do. Gradients flow to both summands.
    pub fn add(self, other: Self) -> Self {
        Self { re: self.re + other.re, im: self.im + other.im }
    }

    /// Element-wise difference; shapes broadcast as Burn's do. Gradients flow to both.
    pub fn sub(self, other: Self) -> Self {
        Self { re: self.re - other.re, im: self.im - other.im }
    }

    /// Times a real tensor.
    pub fn scale(self, factor: Tensor<D>) -> Self {
        Self { re: self.re * factor.clone(), im: self.im * factor }
    }

    /// Times a number that does not learn. Gradients flow to the tensor.
    pub fn scale_by(self, factor: f64) -> Self {
        Self { re: self.re * factor, im: self.im * factor }
    }

    /// Matrix product over the last two axes.
    pub fn matmul(self, other: Self) -> Self {
        Self {
            re: self.re.clone().matmul(other.re.clone()) - self.im.clone().matmul(other.im.clone()),
            im: self.re.matmul(other.im) + self.im.matmul(other.re),
        }
    }

    /// Sum over one axis, which keeps the length 1. Gradients flow.
    pub fn sum_dim(self, dim: usize) -> Self {
        Self { re: self.re.sum_dim(dim), im: self.im.sum_dim(dim) }
    }

    /// Mean over one axis, which keeps the length 1. Gradients flow.
    pub fn mean_dim(self, dim: usize) -> Self {
        Self { re: self.re.mean_dim(dim), im: self.im.mean_dim(dim) }
    }

    /// |z|², smooth everywhere.
    pub fn power(self) -> Tensor<D> {
        self.re.clone() * self.re + self.im.clone() * self.im
    }

    /// The same values, in the order of the axes, under another shape. Gradients flow.
    ///
    /// # Panics
    /// When the shapes do not hold equally many values.
    pub fn reshape<const E: usize>(self, dims: [usize; E]) -> Complex<E> {
        Complex { re: self.re.reshape(dims), im: self.im.reshape(dims) }
    }

    /// Swaps two axes. Gradients flow.
    pub fn swap_dims(self, a: usize, b: usize) -> Self {
        Self { re: self.re.swap_dims(a, b), im: self.im.swap_dims(a, b) }
    }

    /// The `length` entries of axis `dim` from `start` on. Gradients flow to them.
    pub fn narrow(self, dim: usize, start: usize, length: usize) -> Self {
        Self { re: self.re.narrow(dim, start, length), im: self.im.narrow(dim, start, length) }
    }

    /// Joins tensors along axis `dim`; the other axes must agree. Gradients flow to every part.
    ///
    /// # Panics
    /// Without any part.
    pub fn cat(parts: Vec<Self>, dim: usize) -> Self {
        let (re, im) = parts.into_iter().map(|part| (part.re, part.im)).unzip();
        Self { re: Tensor::cat(re, dim), im: Tensor::cat(im, dim) }
    }

    /// The values on the host, in the order of the axes.
    pub fn to_host(self) -> Vec<Complex32> {
        let part = |tensor: Tensor<D>| tensor.into_data().convert::<f32>().try_into_vec::<f32>().expect("converted");
        part(self.re).into_iter().zip(part(self.im)).map(|(re, im)| Complex32::new(re, im)).collect()
    }

    /// The same values, from which no gradient flows back.
    pub fn detach(self) -> Self {
        Self { re: self.re.detach(), im: self.im.detach() }
    }
}

/// Turns without their whole part, in −½ … ½; the gradient is that of the identity.
///
/// Adding and taking away 1.5·2²³ rounds an f32 to whole numbers twelve times faster than `round` does;
/// 1.5·2⁵² does the same for an f64. The rounded part is detached, so that its gradient is exactly zero.
pub fn wrap<const D: usize>(turns: Tensor<D>) -> Tensor<D> {
    let magic = match turns.dtype() {
        burn::tensor::DType::F64 => 6_755_399_441_055_744.0,
        _ => 12_582_912.0,
    };
    let whole = (turns.clone().detach() + magic) - magic;
    turns - whole
}
