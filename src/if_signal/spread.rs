//! The coherent sum as tensor operations for CPUs: moments by scatter-add, a DFT matrix, and the moments' weights.

use std::f64::consts::TAU;

use burn::tensor::{DType, Device, IndexingUpdateOp, Int, Tensor, TensorData};

use super::cis::cis;
use super::grid::RangeGrid;
use crate::complex::Complex;
use crate::paths::Phasors;

/// Elements of one block of points: bounds the memory without a tape.
const BLOCK: usize = 1 << 21;

pub fn sum(phasors: &Phasors, samples: usize) -> Complex<2> {
    let [points, chirps] = phasors.dims();
    let (device, dtype) = (phasors.device(), phasors.dtype());
    let orders = if dtype == DType::F64 { 12 } else { 5 };
    let grid = RangeGrid { samples, cells: 4 * samples, orders, reach: 0.5 };
    let zeros = || Tensor::<2>::zeros([grid.cells + 1, chirps], (&device, dtype));
    let mut moments: Vec<Complex<2>> = (0..orders).map(|_| Complex::new(zeros(), zeros())).collect();
    let step = (BLOCK / chirps).max(1);
    for start in (0..points).step_by(step) {
        let count = step.min(points - start);
        let block = |tensor: &Tensor<2>| match count == points {
            true => tensor.clone(),
            false => tensor.clone().narrow(0, start, count),
        };
        let block = Phasors {
            amplitude: block(&phasors.amplitude),
            amplitude_im: phasors.amplitude_im.as_ref().map(block),
            phase_turns: block(&phasors.phase_turns),
            sweep_turns: block(&phasors.sweep_turns),
        };
        moments = spread(block, &grid, moments);
    }
    transform(moments, &grid, &device, dtype)
}

/// Adds a block's moments to the grid, each `[cell, chirp]`. Row g holds cell g − C/2, and both ends are one cell.
fn spread(block: Phasors, grid: &RangeGrid, moments: Vec<Complex<2>>) -> Vec<Complex<2>> {
    let cells = block.sweep_turns.clone() * grid.cells_per_turn();
    let nearest = round(cells.clone().detach());
    let offset = (cells - nearest.clone()) * (1.0 / grid.reach);
    let turn = round(nearest.clone() * (1.0 / grid.cells as f64)) * grid.cells as f64;
    let row = to_index(nearest - turn + 0.5 * grid.cells as f64);

    let phase = match grid.phase_per_sweep() {
        0.0 => block.phase_turns,
        factor => block.phase_turns + block.sweep_turns * factor,
    };
    let unit = cis(phase);
    let mut term = match block.amplitude_im {
        Some(im) => unit.mul(Complex::new(block.amplitude, im)),
        None => unit.scale(block.amplitude),
    };
    let add = |sum: Tensor<2>, part: Tensor<2>| sum.scatter(0, row.clone(), part, IndexingUpdateOp::Add);
    moments
        .into_iter()
        .enumerate()
        .map(|(order, sum)| {
            if order > 0 {
                term = Complex::new(term.re.clone() * offset.clone(), term.im.clone() * offset.clone());
            }
            Complex::new(add(sum.re, term.re.clone()), add(sum.im, term.im.clone()))
        })
        .collect()
}

/// X = Σ_d j^d f_d · (DFT of moment d), `[chirp, sample]`.
fn transform(moments: Vec<Complex<2>>, grid: &RangeGrid, device: &Device, dtype: DType) -> Complex<2> {
    let [_, chirps] = moments[0].dims();
    let all = Complex::cat(moments, 1).swap_dims(0, 1);
    let spectrum = all.matmul(dft(grid, device, dtype)).reshape([grid.orders, chirps, grid.samples]);
    // j^d f_d: even orders are real, odd ones imaginary.
    let (mut re, mut im) = (vec![], vec![]);
    for (order, weights) in grid.moments().into_iter().enumerate() {
        let sign = if order % 4 < 2 { 1.0 } else { -1.0 };
        let (on, off) = (weights.iter().map(|w| sign * w).collect::<Vec<_>>(), vec![0.0; grid.samples]);
        let (r, i) = if order % 2 == 0 { (on, off) } else { (off, on) };
        re.extend(r);
        im.extend(i);
    }
    let shape = [grid.orders, 1, grid.samples];
    let tensor = |values: Vec<f64>| Tensor::<3>::from_data(TensorData::new(values, shape).convert_dtype(dtype), (device, dtype));
    let weights = Complex::new(tensor(re), tensor(im));
    spectrum.mul(weights).sum_dim(0).reshape([chirps, grid.samples])
}

/// exp(j2π (row − C/2) k / C), `[row, sample]`, from a table of the C roots.
fn dft(grid: &RangeGrid, device: &Device, dtype: DType) -> Complex<2> {
    let cells = grid.cells as i64;
    let roots: Vec<(f64, f64)> = (0..cells).map(|i| (TAU * i as f64 / cells as f64).sin_cos()).collect();
    let mut re = Vec::with_capacity((grid.cells + 1) * grid.samples);
    let mut im = Vec::with_capacity(re.capacity());
    for row in 0..=cells {
        for sample in 0..grid.samples {
            let (sin, cos) = roots[((row - cells / 2) * grid.bin(sample)).rem_euclid(cells) as usize];
            re.push(cos);
            im.push(sin);
        }
    }
    let tensor = |values: Vec<f64>| {
        Tensor::from_data(TensorData::new(values, [grid.cells + 1, grid.samples]).convert_dtype(dtype), (device, dtype))
    };
    Complex::new(tensor(re), tensor(im))
}

/// To whole numbers; see [`crate::complex::wrap`].
fn round(x: Tensor<2>) -> Tensor<2> {
    let magic = if x.dtype() == DType::F64 { 6_755_399_441_055_744.0 } else { 12_582_912.0 };
    (x + magic) - magic
}

/// 64-bit where the device has them: flex would widen 32-bit indices in every scatter anew.
fn to_index(rows: Tensor<2>) -> Tensor<2, Int> {
    let index = rows.int();
    if index.device().supports_dtype(DType::I64) { index.cast(DType::I64) } else { index }
}
