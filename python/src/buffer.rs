//! Numbers that Python sees without a copy.

use std::{ffi::c_int, os::raw::c_void};

use num_complex::Complex32;
use pyo3::{buffer::PyBuffer, exceptions::PyBufferError, ffi, prelude::*};

/// Owns numbers and lends their memory as bytes; `numpy.frombuffer` makes an array of it that keeps this alive.
#[pyclass(frozen)]
pub struct Numbers(Kind);

enum Kind {
    F32(Vec<f32>),
    F64(Vec<f64>),
    Complex32(Vec<Complex32>),
}

impl From<Vec<f32>> for Numbers {
    fn from(values: Vec<f32>) -> Self {
        Self(Kind::F32(values))
    }
}

impl From<Vec<f64>> for Numbers {
    fn from(values: Vec<f64>) -> Self {
        Self(Kind::F64(values))
    }
}

impl From<Vec<Complex32>> for Numbers {
    fn from(values: Vec<Complex32>) -> Self {
        Self(Kind::Complex32(values))
    }
}

#[pymethods]
impl Numbers {
    /// NumPy's name of the numbers.
    #[getter]
    fn dtype(&self) -> &'static str {
        match self.0 {
            Kind::F32(_) => "float32",
            Kind::F64(_) => "float64",
            Kind::Complex32(_) => "complex64",
        }
    }

    /// # Safety
    /// Python hands over a view that may be written to.
    unsafe fn __getbuffer__(slf: Bound<'_, Self>, view: *mut ffi::Py_buffer, flags: c_int) -> PyResult<()> {
        if view.is_null() {
            return Err(PyBufferError::new_err("no view to fill"));
        }
        fn bytes<T>(values: &[T]) -> (*mut c_void, usize) {
            (values.as_ptr().cast_mut().cast(), size_of_val(values))
        }
        let (start, length) = match &slf.get().0 {
            Kind::F32(values) => bytes(values),
            Kind::F64(values) => bytes(values),
            Kind::Complex32(values) => bytes(values),
        };
        // SAFETY: the memory belongs to `slf`, which the view keeps alive, and is never moved: nothing in Rust reads or writes
        // it from here on, so that Python may write to it.
        let filled = unsafe { ffi::PyBuffer_FillInfo(view, slf.as_ptr(), start, length as ffi::Py_ssize_t, 0, flags) };
        if filled == 0 { Ok(()) } else { Err(PyErr::fetch(slf.py())) }
    }
}

/// Complex samples from pairs of floats.
pub fn complex(py: Python<'_>, pairs: &PyBuffer<f32>) -> PyResult<Vec<Complex32>> {
    let values = pairs.to_vec(py)?;
    let (pairs, _) = values.as_chunks::<2>();
    Ok(pairs.iter().map(|&[re, im]| Complex32::new(re, im)).collect())
}
