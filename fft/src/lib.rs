//! Discrete Fourier transforms of any length (rustfft), in a crate of their own.
//!
//! A `rustfft::FftPlanner<T>` brings all kernels of `T`, for every instruction set, into the crate that makes one: 780,000 lines of
//! LLVM's intermediate language, a ninth of what `hybridsim` had, compiled for the library and again for its tests. Here they are
//! compiled once, beside the other dependencies.

use std::sync::Arc;

pub use rustfft::{Fft, FftDirection};

macro_rules! planner {
    ($(#[$doc:meta])* $name:ident, $real:ty) => {
        $(#[$doc])*
        pub struct $name(rustfft::FftPlanner<$real>);

        impl $name {
            // Never in the caller, or its crate would compile the kernels after all.
            /// A planner that knows no length yet.
            #[inline(never)]
            pub fn new() -> Self {
                Self(rustfft::FftPlanner::new())
            }

            /// Of `length` numbers, not normalised.
            #[inline(never)]
            pub fn plan_fft(&mut self, length: usize, direction: FftDirection) -> Arc<dyn Fft<$real>> {
                self.0.plan_fft(length, direction)
            }

            /// Σ xₙ e^(−j2πkn/N).
            pub fn plan_fft_forward(&mut self, length: usize) -> Arc<dyn Fft<$real>> {
                self.plan_fft(length, FftDirection::Forward)
            }

            /// Σ xₙ e^(+j2πkn/N), without 1/N.
            pub fn plan_fft_inverse(&mut self, length: usize) -> Arc<dyn Fft<$real>> {
                self.plan_fft(length, FftDirection::Inverse)
            }
        }

        impl Default for $name {
            fn default() -> Self {
                Self::new()
            }
        }
    };
}

planner!(
    /// Plans transforms of 64-bit numbers, each length once.
    FftPlanner,
    f64
);
planner!(
    /// Plans transforms of 32-bit numbers, each length once.
    FftPlanner32,
    f32
);
