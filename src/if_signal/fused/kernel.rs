//! The range grid for sixteen chirps at a time: spreading returns over it, reading samples from it, and the adjoints.
//!
//! Sixteen neighbouring chirps of one point nearly always share a cell of the range grid, because a point moves much less
//! than a cell meanwhile; then a moment is one vector addition. Chirps that have left the cell go to theirs in a
//! further round. Spreading costs some hundred vector instructions for sixteen returns, whatever the number of samples.

use rayon::prelude::*;

use super::fourier::Fourier;
use super::lanes::{LANES, Lanes, ZERO, cis, fma, map, multiply_add, round, zip};
use super::scratch::Scratch;
use crate::if_signal::grid::RangeGrid;

/// Moments per cell. With a reach of one cell the expansion is right to 10⁻⁵ in the worst sample, 3·10⁻⁶ on average.
const ORDERS: usize = 6;
const REACH: f64 = 1.0;
const ROW: usize = 2 * ORDERS;
/// Points per task where chirps are few; fixed, so that the result does not depend on the machine.
const CHUNK: usize = 2048;
/// Tasks from which on the points need not be shared out.
const ENOUGH_TASKS: usize = 8;

/// Sixteen chirps of one point: a return, or the gradients to it.
#[derive(Clone, Copy)]
pub struct Return {
    pub re: Lanes,
    pub im: Lanes,
    pub phase: Lanes,
    pub sweep: Lanes,
}

/// Where returns come from. Several receivers may see the same points.
pub trait Returns: Sync {
    fn points(&self) -> usize;
    fn chirps(&self) -> usize;
    fn receivers(&self) -> usize;
    /// Chirps from `chirp` on; those beyond the last repeat it.
    fn load(&self, receiver: usize, point: usize, chirp: usize) -> Return;
}

/// Where the gradients to a range of points go.
pub trait Sink: Send {
    /// How many points.
    fn points(&self) -> usize;
    /// Before anything else.
    fn open(&mut self);
    /// At the chirps from `chirp` on, for a point counted from the first of this range.
    fn put(&mut self, receiver: usize, local: usize, chirp: usize, gradient: &Return);
    /// After the last chirp of a receiver.
    fn close(&mut self, receiver: usize);
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
        let cells_per_turn = grid.cells_per_turn() as f32;
        Self {
            places: (0..cells).map(|cell| fourier.place(cell) as u32).collect(),
            moments: (0..samples).map(|n| std::array::from_fn(|order| by_order[order][n] as f32)).collect(),
            cells_per_turn,
            cells_per_turn_rest: (grid.cells_per_turn() - f64::from(cells_per_turn)) as f32,
            phase_per_sweep: grid.phase_per_sweep() as f32,
            fourier,
            grid,
        }
    }

    fn empty(&self) -> Scratch {
        let mut grid = Scratch::new(self.grid.cells * ROW);
        grid.fill(ZERO);
        grid
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

    /// cos and sin of a return's phase at the sample that the grid calls k = 0.
    #[inline(always)]
    fn unit(&self, value: &Return) -> (Lanes, Lanes) {
        cis(zip(value.phase, value.sweep, |phase, v| multiply_add(v, self.phase_per_sweep, phase)))
    }

    #[inline(always)]
    fn spread(&self, value: &Return, width: usize, grid: &mut [Lanes]) {
        let (cos, sin) = self.unit(value);
        let (re, im) = multiply((value.re, value.im), (cos, sin));
        self.by_cell(value.sweep, width, |cell, inside| {
            let keep = |value: Lanes| match inside {
                None => value,
                Some(inside) => zip(value, *inside, |value, on| if on > 0.0 { value } else { 0.0 }),
            };
            let (mut re, mut im, offset) = (keep(re), keep(im), keep(self.offset(value.sweep, cell)));
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

    /// Gradients to a return, from the gradient on the grid.
    #[inline(always)]
    fn interpolate(&self, value: &Return, width: usize, grid: &[Lanes]) -> Return {
        let (cos, sin) = self.unit(value);
        // The gradient to the return's complex value, and its derivative along the cells.
        let (mut gradient, mut slope) = ((ZERO, ZERO), (ZERO, ZERO));
        self.by_cell(value.sweep, width, |cell, inside| {
            let offset = self.offset(value.sweep, cell);
            let start = self.row(cell);
            let row: &[Lanes; ROW] = (&grid[start..start + ROW]).try_into().expect("a row of the grid");
            let (mut a, mut b) = (row[ROW - 2], row[ROW - 1]);
            let (mut da, mut db) = (ZERO, ZERO);
            for order in (0..ORDERS - 1).rev() {
                (da, db) = (fma(da, offset, a), fma(db, offset, b));
                (a, b) = (fma(a, offset, row[2 * order]), fma(b, offset, row[2 * order + 1]));
            }
            match inside {
                None => (gradient, slope) = ((a, b), (da, db)),
                Some(inside) => {
                    for lane in (0..LANES).filter(|&lane| inside[lane] > 0.0) {
                        (gradient.0[lane], gradient.1[lane]) = (a[lane], b[lane]);
                        (slope.0[lane], slope.1[lane]) = (da[lane], db[lane]);
                    }
                }
            }
        });
        let (re, im) = multiply((value.re, value.im), (cos, sin));
        let (to_re, to_im) = multiply(gradient, (cos, map(sin, |s| -s)));
        let turned = zip(fma(gradient.1, re, ZERO), zip(gradient.0, im, |g, v| g * v), |a, b| a - b);
        let phase = map(turned, |radians| std::f32::consts::TAU * radians);
        let along = fma(slope.0, re, zip(slope.1, im, |s, v| s * v));
        let sweep = zip(phase, along, |phase, along| multiply_add(phase, self.phase_per_sweep, along * self.cells_per_turn));
        Return { re: to_re, im: to_im, phase, sweep }
    }

    /// Calls `visit` with a cell and the lanes that lie within its reach and were not visited (`None`: all of them).
    #[inline(always)]
    fn by_cell(&self, sweep: Lanes, width: usize, mut visit: impl FnMut(f32, Option<&Lanes>)) {
        let cells = map(sweep, |v| v * self.cells_per_turn);
        let near = |u: f32, cell: f32| (u - cell).abs() <= REACH as f32;
        let cell = round(cells[width / 2]);
        if cells.iter().fold(true, |all, &u| all & near(u, cell)) {
            return visit(cell, None);
        }
        let mut waiting: Lanes = [1.0; LANES];
        waiting[width..].fill(0.0);
        while let Some(first) = waiting.iter().position(|&on| on > 0.0) {
            let cell = round(cells[first]);
            let mut inside = zip(cells, waiting, |u, on| if near(u, cell) { on } else { 0.0 });
            // A NaN or infinite delay is near nothing, but must reach the output, where it is looked for.
            inside[first] = 1.0;
            waiting = zip(waiting, inside, |on, done| on - done);
            visit(cell, Some(&inside));
        }
    }

    /// Calls `put` with every sample of up to sixteen chirps, from a transformed grid.
    fn collect(&self, grid: &[Lanes], mut put: impl FnMut(usize, Lanes, Lanes)) {
        for (sample, f) in self.moments.iter().enumerate() {
            let row = &grid[self.bin(sample) * ROW..][..ROW];
            let (mut re, mut im) = (ZERO, ZERO);
            for order in 0..ORDERS {
                let (a, b) = turn((row[2 * order], row[2 * order + 1]), order);
                re = fma([f[order]; LANES], a, re);
                im = fma([f[order]; LANES], b, im);
            }
            put(sample, re, im);
        }
    }

    /// The adjoint of [`Self::collect`]: gradients of the samples onto the transform's rows.
    fn distribute(&self, get: impl Fn(usize) -> (Lanes, Lanes), grid: &mut [Lanes]) {
        for (sample, f) in self.moments.iter().enumerate() {
            let gradient = get(sample);
            let row = &mut grid[self.bin(sample) * ROW..][..ROW];
            for order in 0..ORDERS {
                // times (−j)^order
                let (re, im) = turn(gradient, 3 * order);
                row[2 * order] = map(re, |value| value * f[order]);
                row[2 * order + 1] = map(im, |value| value * f[order]);
            }
        }
    }
}

/// Both parts of the sum, `[2, receiver, chirp, sample]`.
pub fn sum(returns: &impl Returns, samples: usize) -> Vec<f32> {
    let plan = Plan::new(samples);
    let (points, chirps, receivers) = (returns.points(), returns.chirps(), returns.receivers());
    let blocks = chirps.div_ceil(LANES);
    let parts = if blocks * receivers >= ENOUGH_TASKS { 1 } else { points.div_ceil(CHUNK).max(1) };
    let chunk = points.div_ceil(parts).max(1);
    let fill = |grid: &mut [Lanes], task: usize, part: usize| {
        let (receiver, chirp) = (task / blocks, task % blocks * LANES);
        let width = LANES.min(chirps - chirp);
        for point in part * chunk..((part + 1) * chunk).min(points) {
            plan.spread(&returns.load(receiver, point, chirp), width, grid);
        }
    };

    let mut out = vec![0.0; 2 * receivers * chirps * samples];
    let (out_re, out_im) = out.split_at_mut(receivers * chirps * samples);
    let by_block = |part| blocks_of(part, receivers, chirps * samples, LANES * samples);
    by_block(out_re).into_par_iter().zip(by_block(out_im)).enumerate().for_each(|(task, (re, im))| {
        let part = |part: usize| {
            let mut grid = plan.empty();
            fill(&mut grid, task, part);
            grid
        };
        let mut grid = match parts {
            1 => part(0),
            _ => {
                let grids: Vec<_> = (0..parts).into_par_iter().map(part).collect();
                grids.into_iter().reduce(add).expect("one part at least")
            }
        };
        plan.fourier.transform(&mut grid, ORDERS);
        let width = re.len() / samples;
        plan.collect(&grid, |sample, r, i| {
            for lane in 0..width {
                re[lane * samples + sample] = r[lane];
                im[lane * samples + sample] = i[lane];
            }
        });
    });
    out
}

/// The adjoint of [`sum`]: from the gradient to both parts of the sum, `[2, receiver, chirp, sample]`, those to the
/// returns. The sinks cover the points in order.
pub fn gradients(returns: &impl Returns, upstream: &[f32], samples: usize, sinks: Vec<impl Sink>) {
    let plan = Plan::new(samples);
    let (chirps, receivers) = (returns.chirps(), returns.receivers());
    let blocks = chirps.div_ceil(LANES);
    let (up_re, up_im) = upstream.split_at(receivers * chirps * samples);
    let grids: Vec<Scratch> = (0..receivers * blocks)
        .into_par_iter()
        .map(|task| {
            let (receiver, chirp) = (task / blocks, task % blocks * LANES);
            let width = LANES.min(chirps - chirp);
            let lanes = |part: &[f32], sample: usize| -> Lanes {
                let mut lanes = ZERO;
                for (lane, value) in lanes[..width].iter_mut().enumerate() {
                    *value = part[(receiver * chirps + chirp + lane) * samples + sample];
                }
                lanes
            };
            let mut grid = plan.empty();
            plan.distribute(|sample| (lanes(up_re, sample), lanes(up_im, sample)), &mut grid);
            plan.fourier.adjoint(&mut grid, ORDERS);
            grid
        })
        .collect();

    let starts: Vec<usize> = sinks
        .iter()
        .scan(0, |next, sink| {
            let start = *next;
            *next += sink.points();
            Some(start)
        })
        .collect();
    sinks.into_par_iter().zip(starts).for_each(|(mut sink, start)| {
        sink.open();
        for receiver in 0..receivers {
            for block in 0..blocks {
                let chirp = block * LANES;
                for local in 0..sink.points() {
                    let value = returns.load(receiver, start + local, chirp);
                    let grid = &grids[receiver * blocks + block];
                    let gradient = plan.interpolate(&value, LANES.min(chirps - chirp), grid);
                    sink.put(receiver, local, chirp, &gradient);
                }
            }
            sink.close(receiver);
        }
    });
}

/// Points per sink: long ranges, because every one of them walks through all grids.
pub fn points_per_sink(points: usize) -> usize {
    points.div_ceil(4 * rayon::current_num_threads()).max(64)
}

/// Every receiver's stretch of `per_receiver` numbers in blocks of `size`, the last of them shorter.
fn blocks_of(values: &mut [f32], receivers: usize, per_receiver: usize, size: usize) -> Vec<&mut [f32]> {
    debug_assert_eq!(values.len(), receivers * per_receiver);
    values.chunks_mut(per_receiver).flat_map(|receiver| receiver.chunks_mut(size)).collect()
}

/// z·w.
#[inline(always)]
fn multiply(z: (Lanes, Lanes), w: (Lanes, Lanes)) -> (Lanes, Lanes) {
    (zip(zip(z.0, w.0, |a, b| a * b), zip(z.1, w.1, |a, b| a * b), |a, b| a - b), fma(z.0, w.1, zip(z.1, w.0, |a, b| a * b)))
}

/// z·j^times.
#[inline(always)]
fn turn((re, im): (Lanes, Lanes), times: usize) -> (Lanes, Lanes) {
    match times % 4 {
        0 => (re, im),
        1 => (map(im, |x| -x), re),
        2 => (map(re, |x| -x), map(im, |x| -x)),
        _ => (im, map(re, |x| -x)),
    }
}

fn add(mut a: Scratch, b: Scratch) -> Scratch {
    for (a, b) in a.iter_mut().zip(b.iter()) {
        *a = zip(*a, *b, |a, b| a + b);
    }
    a
}
