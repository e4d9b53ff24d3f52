//! The coherent sum and its adjoint over plain slices, sixteen chirps at a time.
//!
//! Sixteen neighbouring chirps of one point nearly always share a cell of the range grid, because a point moves much less
//! than a cell meanwhile; then a moment is one vector addition. Chirps that have left the cell go to theirs in a
//! further round. Spreading costs some hundred vector instructions for sixteen returns, whatever the number of samples.

use rayon::prelude::*;

use super::fourier::Fourier;
use super::lanes::{LANES, Lanes, cis, fma, map, multiply_add, round, zip};
use crate::if_signal::grid::RangeGrid;

/// Moments per cell. With a reach of one cell the expansion is right to 10⁻⁵ in the worst sample, 3·10⁻⁶ on average.
const ORDERS: usize = 6;
const REACH: f64 = 1.0;
const ROW: usize = 2 * ORDERS;
/// Points per task at most when there are few chirps; fixed, so that the result does not depend on the machine.
const CHUNK: usize = 2048;

/// Tensors `[point, chirp]` in row-major order.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    pub re: &'a [f32],
    pub im: Option<&'a [f32]>,
    pub phase: &'a [f32],
    pub sweep: &'a [f32],
    pub points: usize,
    pub chirps: usize,
}

pub struct Gradients {
    pub re: Vec<f32>,
    pub im: Option<Vec<f32>>,
    pub phase: Vec<f32>,
    pub sweep: Vec<f32>,
}

struct Plan {
    grid: RangeGrid,
    fourier: Fourier,
    places: Vec<u32>,
    /// `[sample][order]`.
    moments: Vec<[f32; ORDERS]>,
    cells_per_turn: f32,
    /// What f32 leaves out of `cells_per_turn`.
    cells_per_turn_rest: f32,
    phase_per_sweep: f32,
}

impl Plan {
    fn new(samples: usize) -> Self {
        let cells = (4 * samples).next_power_of_two();
        let grid = RangeGrid { samples, cells, orders: ORDERS, reach: REACH };
        let fourier = Fourier::new(cells);
        let by_order = grid.moments();
        Self {
            places: (0..cells).map(|cell| fourier.place(cell) as u32).collect(),
            moments: (0..samples).map(|n| std::array::from_fn(|order| by_order[order][n] as f32)).collect(),
            cells_per_turn: grid.cells_per_turn() as f32,
            cells_per_turn_rest: (grid.cells_per_turn() - f64::from(grid.cells_per_turn() as f32)) as f32,
            phase_per_sweep: grid.phase_per_sweep() as f32,
            fourier,
            grid,
        }
    }

    fn empty(&self) -> Vec<Lanes> {
        vec![[0.0; LANES]; self.grid.cells * ROW]
    }

    /// Row of the transform that belongs to a sample.
    fn bin(&self, sample: usize) -> usize {
        self.grid.bin(sample).rem_euclid(self.grid.cells as i64) as usize
    }

    /// First number of a cell's row in the grid.
    #[inline(always)]
    fn row(&self, cell: f32) -> usize {
        // The number of cells is a power of two, so that masking wraps negative cells too.
        let cell = cell as i32 as usize & (self.grid.cells - 1);
        self.places[cell] as usize * ROW
    }

    /// Distance from a cell, without the rounding that the position on the grid has.
    #[inline(always)]
    fn offset(&self, sweep: Lanes, cell: f32) -> Lanes {
        map(sweep, |v| multiply_add(v, self.cells_per_turn_rest, multiply_add(v, self.cells_per_turn, -cell)))
    }

    /// Spreads a range of points over the cells, for the chirps from `chirp` on.
    fn spread(&self, inputs: &Inputs, chirp: usize, points: std::ops::Range<usize>, grid: &mut [Lanes]) {
        let width = LANES.min(inputs.chirps - chirp);
        for point in points {
            let at = point * inputs.chirps + chirp;
            let sweep = load(inputs.sweep, at, width);
            let (cos, sin) = cis(zip(load(inputs.phase, at, width), sweep, |phase, v| multiply_add(v, self.phase_per_sweep, phase)));
            let a = load(inputs.re, at, width);
            let (mut re, mut im) = (zip(a, cos, |a, c| a * c), zip(a, sin, |a, s| a * s));
            if let Some(im_part) = inputs.im {
                let b = load(im_part, at, width);
                re = fma(map(b, |b| -b), sin, re);
                im = fma(b, cos, im);
            }
            let cells = map(sweep, |v| v * self.cells_per_turn);
            self.by_cell(cells, width, |cell, inside| {
                let offset = self.offset(sweep, cell);
                let keep = |value: Lanes| match inside {
                    None => value,
                    Some(inside) => zip(value, *inside, |value, on| if on > 0.0 { value } else { 0.0 }),
                };
                // Lanes outside are far from the cell: their offset's powers must not meet the zero as infinities.
                let offset = keep(offset);
                let (mut re, mut im) = (keep(re), keep(im));
                let start = self.row(cell);
                let row: &mut [Lanes; ROW] = (&mut grid[start..start + ROW]).try_into().expect("a row of the grid");
                for order in 0..ORDERS {
                    row[2 * order] = zip(row[2 * order], re, |sum, part| sum + part);
                    row[2 * order + 1] = zip(row[2 * order + 1], im, |sum, part| sum + part);
                    re = zip(re, offset, |part, x| part * x);
                    im = zip(im, offset, |part, x| part * x);
                }
            });
        }
    }

    /// Calls `visit` with a cell and the lanes that lie within its reach and were not visited (`None`: all of them).
    #[inline(always)]
    fn by_cell(&self, cells: Lanes, width: usize, mut visit: impl FnMut(f32, Option<&Lanes>)) {
        let cell = round(cells[width / 2]);
        if cells[..].iter().all(|u| (u - cell).abs() <= REACH as f32) {
            return visit(cell, None);
        }
        let mut waiting: Lanes = [1.0; LANES];
        waiting[width..].fill(0.0);
        while let Some(first) = waiting.iter().position(|&on| on > 0.0) {
            let cell = round(cells[first]);
            let inside = zip(cells, waiting, |u, on| if (u - cell).abs() <= REACH as f32 { on } else { 0.0 });
            waiting = zip(waiting, inside, |on, done| on - done);
            if !cell.is_finite() {
                // A NaN or infinite delay must reach the output, where it is looked for.
                waiting[first] = 0.0;
                let mut only = [0.0; LANES];
                only[first] = 1.0;
                visit(0.0, Some(&only));
                continue;
            }
            visit(cell, Some(&inside));
        }
    }

    /// Samples of up to sixteen chirps, `out[lane][sample]` = (re, im).
    fn collect(&self, grid: &[Lanes], mut put: impl FnMut(usize, Lanes, Lanes)) {
        for (sample, f) in self.moments.iter().enumerate() {
            let row = &grid[self.bin(sample) * ROW..][..ROW];
            let (mut re, mut im) = ([0.0; LANES], [0.0; LANES]);
            for order in 0..ORDERS {
                let (a, b) = (row[2 * order], row[2 * order + 1]);
                // times j^order
                let (a, b) = match order % 4 {
                    0 => (a, b),
                    1 => (map(b, |b| -b), a),
                    2 => (map(a, |a| -a), map(b, |b| -b)),
                    _ => (b, map(a, |a| -a)),
                };
                re = fma([f[order]; LANES], a, re);
                im = fma([f[order]; LANES], b, im);
            }
            put(sample, re, im);
        }
    }

    /// The adjoint of [`Self::collect`]: gradients of the samples onto the transform's rows.
    fn distribute(&self, get: impl Fn(usize) -> (Lanes, Lanes), grid: &mut [Lanes]) {
        for (sample, f) in self.moments.iter().enumerate() {
            let (a, b) = get(sample);
            let row = &mut grid[self.bin(sample) * ROW..][..ROW];
            for order in 0..ORDERS {
                // times (−j)^order
                let (re, im) = match order % 4 {
                    0 => (a, b),
                    1 => (b, map(a, |a| -a)),
                    2 => (map(a, |a| -a), map(b, |b| -b)),
                    _ => (map(b, |b| -b), a),
                };
                row[2 * order] = map(re, |value| value * f[order]);
                row[2 * order + 1] = map(im, |value| value * f[order]);
            }
        }
    }
}

/// Both parts `[2, chirp, sample]` of the sum.
pub fn sum(inputs: Inputs, samples: usize) -> Vec<f32> {
    let plan = Plan::new(samples);
    let mut out = vec![0.0; 2 * inputs.chirps * samples];
    let (out_re, out_im) = out.split_at_mut(inputs.chirps * samples);
    let blocks = inputs.chirps.div_ceil(LANES);
    // With few chirps the points are shared out instead.
    let parts = if blocks >= 8 { 1 } else { inputs.points.div_ceil(CHUNK).max(1) };
    out_re.par_chunks_mut(LANES * samples).zip(out_im.par_chunks_mut(LANES * samples)).enumerate().for_each(|(block, (re, im))| {
        let chirp = block * LANES;
        let width = LANES.min(inputs.chirps - chirp);
        let part = |part: usize| {
            let mut grid = plan.empty();
            let end = if parts == 1 { inputs.points } else { ((part + 1) * CHUNK).min(inputs.points) };
            plan.spread(&inputs, chirp, part * CHUNK..end, &mut grid);
            grid
        };
        let mut grid = match parts {
            1 => part(0),
            _ => (0..parts).into_par_iter().map(part).collect::<Vec<_>>().into_iter().reduce(add).expect("one part at least"),
        };
        plan.fourier.from_cells(&mut grid, ORDERS);
        plan.collect(&grid, |sample, r, i| {
            for lane in 0..width {
                re[lane * samples + sample] = r[lane];
                im[lane * samples + sample] = i[lane];
            }
        });
    });
    out
}

/// Gradients of a loss whose gradient to both parts of the sum is `upstream` `[2, chirp, sample]`.
pub fn gradients(inputs: Inputs, upstream: &[f32], samples: usize) -> Gradients {
    let plan = Plan::new(samples);
    let chirps = inputs.chirps;
    let (up_re, up_im) = upstream.split_at(chirps * samples);
    let blocks = chirps.div_ceil(LANES);
    let grids: Vec<Vec<Lanes>> = (0..blocks)
        .into_par_iter()
        .map(|block| {
            let chirp = block * LANES;
            let width = LANES.min(chirps - chirp);
            let lanes = |part: &[f32], sample: usize| -> Lanes {
                std::array::from_fn(|lane| if lane < width { part[(chirp + lane) * samples + sample] } else { 0.0 })
            };
            let mut grid = plan.empty();
            plan.distribute(|sample| (lanes(up_re, sample), lanes(up_im, sample)), &mut grid);
            plan.fourier.to_cells(&mut grid, ORDERS);
            grid
        })
        .collect();

    let zeros = || vec![0.0f32; inputs.points * chirps];
    let (mut re, mut phase, mut sweep) = (zeros(), zeros(), zeros());
    let mut im = inputs.im.map(|_| zeros());
    // Long chunks: every one of them walks through all grids.
    let rows = inputs.points.div_ceil(4 * rayon::current_num_threads()).max(64);
    let chunk = rows * chirps;
    let mut none: Vec<&mut [f32]> = vec![];
    let im_chunks: Vec<&mut [f32]> = match &mut im {
        Some(im) => im.chunks_mut(chunk).collect(),
        None => {
            none.resize_with(inputs.points.div_ceil(rows), Default::default);
            none
        }
    };
    re.par_chunks_mut(chunk)
        .zip(im_chunks)
        .zip(phase.par_chunks_mut(chunk).zip(sweep.par_chunks_mut(chunk)))
        .enumerate()
        .for_each(|(index, ((re, im), (phase, sweep)))| {
            for (block, grid) in grids.iter().enumerate() {
                let mut out = Slices { re, im, phase, sweep };
                plan.interpolate(&inputs, index * rows, block * LANES, grid, &mut out);
            }
        });
    Gradients { re, im, phase, sweep }
}

/// Where the gradients of a range of points go; `im` is empty for a real amplitude.
struct Slices<'a> {
    re: &'a mut [f32],
    im: &'a mut [f32],
    phase: &'a mut [f32],
    sweep: &'a mut [f32],
}

impl Plan {
    fn interpolate(&self, inputs: &Inputs, first: usize, chirp: usize, grid: &[Lanes], out: &mut Slices) {
        use std::f32::consts::TAU;
        let chirps = inputs.chirps;
        let width = LANES.min(chirps - chirp);
        for local in 0..out.re.len() / chirps {
            let at = (first + local) * chirps + chirp;
            let to = local * chirps + chirp;
            let sweep = load(inputs.sweep, at, width);
            let (cos, sin) = cis(zip(load(inputs.phase, at, width), sweep, |phase, v| multiply_add(v, self.phase_per_sweep, phase)));
            let cells = map(sweep, |v| v * self.cells_per_turn);
            // γ: gradient to the return's complex value; slope: its derivative along the cells.
            let (mut re, mut im) = ([0.0; LANES], [0.0; LANES]);
            let (mut slope_re, mut slope_im) = ([0.0; LANES], [0.0; LANES]);
            self.by_cell(cells, width, |cell, inside| {
                let offset = self.offset(sweep, cell);
                let start = self.row(cell);
                let row: &[Lanes; ROW] = (&grid[start..start + ROW]).try_into().expect("a row of the grid");
                let (mut a, mut b) = (row[ROW - 2], row[ROW - 1]);
                let (mut da, mut db) = ([0.0; LANES], [0.0; LANES]);
                for order in (0..ORDERS - 1).rev() {
                    (da, db) = (fma(da, offset, a), fma(db, offset, b));
                    (a, b) = (fma(a, offset, row[2 * order]), fma(b, offset, row[2 * order + 1]));
                }
                match inside {
                    None => ((re, im), (slope_re, slope_im)) = ((a, b), (da, db)),
                    Some(inside) => {
                        for lane in 0..LANES {
                            if inside[lane] > 0.0 {
                                (re[lane], im[lane]) = (a[lane], b[lane]);
                                (slope_re[lane], slope_im[lane]) = (da[lane], db[lane]);
                            }
                        }
                    }
                }
            });
            let a = load(inputs.re, at, width);
            let (mut value_re, mut value_im) = (zip(a, cos, |a, c| a * c), zip(a, sin, |a, s| a * s));
            if let Some(im_part) = inputs.im {
                let b = load(im_part, at, width);
                value_re = fma(map(b, |b| -b), sin, value_re);
                value_im = fma(b, cos, value_im);
                store(out.im, to, width, std::array::from_fn(|l| im[l] * cos[l] - re[l] * sin[l]));
            }
            store(out.re, to, width, std::array::from_fn(|l| re[l] * cos[l] + im[l] * sin[l]));
            let phase: Lanes = std::array::from_fn(|l| TAU * (im[l] * value_re[l] - re[l] * value_im[l]));
            store(out.phase, to, width, phase);
            let along: Lanes = std::array::from_fn(|l| slope_re[l] * value_re[l] + slope_im[l] * value_im[l]);
            let along = map(along, |slope| slope * self.cells_per_turn);
            store(out.sweep, to, width, zip(phase, along, |phase, along| multiply_add(phase, self.phase_per_sweep, along)));
        }
    }
}

#[inline(always)]
fn load(values: &[f32], at: usize, width: usize) -> Lanes {
    if width == LANES {
        return values[at..at + LANES].try_into().expect("sixteen values");
    }
    // Missing lanes repeat the last one, so that they share its cell; their amplitude reaches no sample.
    std::array::from_fn(|lane| values[at + lane.min(width - 1)])
}

#[inline(always)]
fn store(values: &mut [f32], at: usize, width: usize, lanes: Lanes) {
    if width == LANES {
        values[at..at + LANES].copy_from_slice(&lanes);
    } else {
        values[at..at + width].copy_from_slice(&lanes[..width]);
    }
}

fn add(mut a: Vec<Lanes>, b: Vec<Lanes>) -> Vec<Lanes> {
    for (a, b) in a.iter_mut().zip(&b) {
        *a = zip(*a, *b, |a, b| a + b);
    }
    a
}
