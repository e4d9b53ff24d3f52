//! The operations on GPUs: every backend of CubeCL (wgpu, CUDA), in f32.
//!
//! Displacements become phasors of every path, and those are summed: four kernels with the adjoints, so that neither phases nor the
//! tape become tensors of Burn, whose launches would take longer than the work.

mod geometry;
mod sum;

use std::sync::Arc;

use burn::backend::ops::FloatTensorOps;
use burn::tensor::{DType, Shape};
use burn_cubecl::cubecl::{calculate_cube_count_elemwise, prelude::*};
use burn_cubecl::ops::numeric::empty_device_contiguous_dtype;
use burn_cubecl::tensor::CubeTensor;
use burn_cubecl::{CubeBackend, kernel::into_contiguous};

use super::LARGEST;
use super::extension::RadarOps;
use super::kernel::Output;
use super::moving::Geometry;

/// Cubes that fill a large GPU: 132 multiprocessors of 2,048 units (NVIDIA H100). Fixed, so that equal inputs give equal sums on every
/// device.
const CUBES: usize = 132 * 2048 / sum::UNITS;

/// Phasors of several paths of each point, each `[path, point, chirp]`; the imaginary amplitude counts only if `complex`.
struct Phasors {
    re: CubeTensor,
    im: CubeTensor,
    phase: CubeTensor,
    sweep: CubeTensor,
    paths: usize,
    points: usize,
    chirps: usize,
    outputs: Vec<Output>,
    complex: bool,
}

impl Phasors {
    /// One path each, `[point, chirp]`, all in one sum.
    fn given([re, im, phase, sweep]: [CubeTensor; 4], complex: bool) -> Self {
        let [points, chirps] = phase.meta.shape().dims();
        let [re, im, phase, sweep] = [re, im, phase, sweep].map(into_contiguous);
        let outputs = vec![Output { path: 0, points: 0..points }];
        Self { re, im, phase, sweep, paths: 1, points, chirps, outputs, complex }
    }

    /// Points of the largest sum.
    fn most(&self) -> usize {
        self.outputs.iter().map(|output| output.points.len()).max().unwrap_or(0)
    }

    /// Path, first point and the point after the last, `[output, 3]`.
    fn outputs(&self) -> BufferArg {
        let row = |output: &Output| [output.path, output.points.start, output.points.end].map(|number| number as u32);
        let rows: Vec<u32> = self.outputs.iter().flat_map(row).collect();
        let handle = self.phase.client.create_from_slice(u32::as_bytes(&rows));
        let shape = Shape::from([rows.len()]);
        CubeTensor::new_contiguous(self.phase.client.clone(), self.phase.device.clone(), shape, handle, DType::U32)
            .into_buffer_arg()
    }

    /// `[2, output, chirp, sample]`
    fn sum(self, samples: usize) -> CubeTensor {
        let (outputs, chirps, most) = (self.outputs.len(), self.chirps, self.most());
        let blocks = samples.div_ceil(sum::BLOCK);
        let rows = chirps.div_ceil(sum::CHIRPS);
        let whole = 2 * outputs * chirps * samples;
        let chunks = (CUBES / (rows * outputs * blocks)).min(LARGEST / whole).min(most.div_ceil(sum::LANES)).max(1);
        let per_chunk = most.div_ceil(chunks).next_multiple_of(sum::LANES).max(sum::LANES);
        let chunks = most.div_ceil(per_chunk).max(1);
        let out = empty(&self.phase, [chunks, 2, outputs, chirps, samples]);
        let cubes = cubes(rows, outputs, chunks * blocks);
        let ranges = self.outputs();
        // Every index is held to these sizes.
        unsafe {
            sum::add_up::launch_unchecked(
                &out.client,
                cubes,
                CubeDim::new_1d(sum::UNITS as u32),
                self.re.into_buffer_arg(),
                self.im.into_buffer_arg(),
                self.phase.into_buffer_arg(),
                self.sweep.into_buffer_arg(),
                ranges,
                out.clone().into_buffer_arg(),
                outputs,
                self.points,
                chirps,
                samples,
                per_chunk,
                self.complex,
            );
        }
        let total = if chunks > 1 { CubeBackend::float_sum_dim(out, 0) } else { out };
        CubeBackend::float_reshape(total, Shape::from([2, outputs, chirps, samples]))
    }

    /// To re, im, phase and sweep, each `[path, point, chirp]`; that to im is empty for a real amplitude.
    fn gradients(self, upstream: CubeTensor) -> [CubeTensor; 4] {
        let Self { paths, points, chirps, complex, .. } = self;
        let [_, _, _, samples] = upstream.meta.shape().dims();
        let gradient = |on: bool| empty(&self.phase, if on { [paths, points, chirps] } else { [1; 3] });
        let found = [gradient(true), gradient(complex), gradient(true), gradient(true)];
        let [to_re, to_im, to_phase, to_sweep] = found.clone().map(CubeTensor::into_buffer_arg);
        let cubes = cubes(chirps.div_ceil(sum::CHIRPS), self.outputs.len(), self.most().div_ceil(sum::LANES));
        let ranges = self.outputs();
        unsafe {
            sum::gradients::launch_unchecked(
                &upstream.client.clone(),
                cubes,
                CubeDim::new_1d(sum::UNITS as u32),
                self.re.into_buffer_arg(),
                self.im.into_buffer_arg(),
                self.phase.into_buffer_arg(),
                self.sweep.into_buffer_arg(),
                into_contiguous(upstream).into_buffer_arg(),
                ranges,
                to_re,
                to_im,
                to_phase,
                to_sweep,
                self.outputs.len(),
                points,
                chirps,
                samples,
                complex,
            );
        }
        found
    }
}

/// Displaced points, as [`RadarOps::sum_of_moving`] has them.
#[derive(Clone)]
struct Moving {
    /// x, y, z `[point, chirp]`, re, im `[point, chirp]` or `[point, 1]`, and the geometry's constants.
    tensors: [CubeTensor; 6],
    geometry: Arc<Geometry>,
    chirps: usize,
    amplitude_chirps: usize,
    complex: bool,
}

impl Moving {
    fn new([x, y, z, re, im]: [CubeTensor; 5], geometry: Arc<Geometry>, complex: bool) -> Self {
        let [points, chirps] = x.meta.shape().dims();
        let [_, amplitude_chirps] = re.meta.shape().dims();
        assert_eq!(points, geometry.points(), "coherent sum: displacement of {points} points, {} positions", geometry.points());
        assert!(
            amplitude_chirps == 1 || amplitude_chirps == chirps,
            "coherent sum: {amplitude_chirps} amplitudes, {chirps} chirps"
        );
        let constants = upload(&x, geometry.constants());
        let tensors = [x, y, z, re, im, constants].map(into_contiguous);
        Self { tensors, geometry, chirps, amplitude_chirps, complex }
    }

    /// As the kernels take them.
    fn displaced(&self) -> geometry::DisplacedLaunch {
        let [x, y, z, re, im, constants] = self.tensors.clone().map(CubeTensor::into_buffer_arg);
        let (paths, points) = (self.geometry.paths(), self.geometry.points());
        let (per_metre, per_step) = self.geometry.sweep_factors();
        geometry::DisplacedLaunch::new(
            x,
            y,
            z,
            re,
            im,
            constants,
            paths,
            points,
            self.chirps,
            self.amplitude_chirps,
            per_metre,
            per_step,
        )
    }

    fn phasors(&self) -> Phasors {
        let (paths, points, chirps) = (self.geometry.paths(), self.geometry.points(), self.chirps);
        let like = &self.tensors[0];
        let part = |on: bool| empty(like, if on { [paths, points, chirps] } else { [1; 3] });
        let found = [part(true), part(self.complex), part(true), part(true)];
        let [to_re, to_im, to_phase, to_sweep] = found.clone().map(CubeTensor::into_buffer_arg);
        let dim = CubeDim::new_1d(sum::UNITS as u32);
        unsafe {
            geometry::phasors::launch_unchecked(
                &like.client,
                calculate_cube_count_elemwise(&like.client, paths * points * chirps, dim),
                dim,
                self.displaced(),
                to_re,
                to_im,
                to_phase,
                to_sweep,
                self.complex,
            );
        }
        let [re, im, phase, sweep] = found;
        let outputs = self.geometry.outputs().to_vec();
        Phasors { re, im, phase, sweep, paths, points, chirps, outputs, complex: self.complex }
    }

    /// To x, y, z, re and im, shaped as these.
    fn gradients(self, upstream: CubeTensor) -> [CubeTensor; 5] {
        let (points, chirps) = (self.geometry.points(), self.chirps);
        let of = self.phasors().gradients(upstream).map(CubeTensor::into_buffer_arg);
        let [of_re, of_im, of_phase, of_sweep] = of;
        let like = &self.tensors[0];
        let gradient = |on: bool| empty(like, if on { [points, chirps] } else { [1; 2] });
        let found = [gradient(true), gradient(true), gradient(true), gradient(true), gradient(self.complex)];
        let [to_x, to_y, to_z, to_re, to_im] = found.clone().map(CubeTensor::into_buffer_arg);
        let dim = CubeDim::new_1d(sum::UNITS as u32);
        unsafe {
            geometry::adjoint::launch_unchecked(
                &like.client,
                calculate_cube_count_elemwise(&like.client, points * chirps, dim),
                dim,
                self.displaced(),
                of_re,
                of_im,
                of_phase,
                of_sweep,
                to_x,
                to_y,
                to_z,
                to_re,
                to_im,
                self.complex,
            );
        }
        let [x, y, z, re, im] = found;
        let of_amplitude = |gradient: CubeTensor| match self.amplitude_chirps < chirps {
            true => CubeBackend::float_sum_dim(gradient, 1),
            false => gradient,
        };
        let re = of_amplitude(re);
        let im = if self.complex { of_amplitude(im) } else { re.clone() };
        [x, y, z, re, im]
    }
}

fn cubes(x: usize, y: usize, z: usize) -> CubeCount {
    CubeCount::Static(x as u32, y as u32, z as u32)
}

fn empty<const D: usize>(like: &CubeTensor, shape: [usize; D]) -> CubeTensor {
    empty_device_contiguous_dtype(like.client.clone(), like.device.clone(), Shape::from(shape), DType::F32)
}

fn upload(like: &CubeTensor, values: &[f32]) -> CubeTensor {
    let handle = like.client.create_from_slice(f32::as_bytes(values));
    CubeTensor::new_contiguous(like.client.clone(), like.device.clone(), Shape::from([values.len()]), handle, DType::F32)
}

impl RadarOps for CubeBackend {
    fn sum_of_phasors(
        re: CubeTensor,
        im: CubeTensor,
        phase: CubeTensor,
        sweep: CubeTensor,
        complex: bool,
        samples: usize,
    ) -> CubeTensor {
        Phasors::given([re, im, phase, sweep], complex).sum(samples)
    }

    fn sum_of_phasors_gradients(
        re: CubeTensor,
        im: CubeTensor,
        phase: CubeTensor,
        sweep: CubeTensor,
        upstream: CubeTensor,
        complex: bool,
        _: usize,
    ) -> (CubeTensor, CubeTensor, CubeTensor, CubeTensor) {
        let phasors = Phasors::given([re, im, phase, sweep], complex);
        let shape = Shape::from([phasors.points, phasors.chirps]);
        let [re, im, phase, sweep] = phasors.gradients(upstream);
        let im = if complex { im } else { re.clone() };
        let flat = |gradient: CubeTensor| CubeBackend::float_reshape(gradient, shape.clone());
        (flat(re), flat(im), flat(phase), flat(sweep))
    }

    fn sum_of_moving(
        x: CubeTensor,
        y: CubeTensor,
        z: CubeTensor,
        re: CubeTensor,
        im: CubeTensor,
        geometry: Arc<Geometry>,
        complex: bool,
        samples: usize,
    ) -> CubeTensor {
        Moving::new([x, y, z, re, im], geometry, complex).phasors().sum(samples)
    }

    fn sum_of_moving_gradients(
        x: CubeTensor,
        y: CubeTensor,
        z: CubeTensor,
        re: CubeTensor,
        im: CubeTensor,
        upstream: CubeTensor,
        geometry: Arc<Geometry>,
        complex: bool,
        _: usize,
    ) -> (CubeTensor, CubeTensor, CubeTensor, CubeTensor, CubeTensor) {
        let [x, y, z, re, im] = Moving::new([x, y, z, re, im], geometry, complex).gradients(upstream);
        (x, y, z, re, im)
    }
}
