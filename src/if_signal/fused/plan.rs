//! The range grid for sixteen chirps at a time: spreading returns over it, reading samples from it, and the adjoints.
//!
//! Sixteen neighbouring chirps of one point nearly always share a cell of the range grid, because a point moves much less
//! than a cell meanwhile; then a moment is one vector addition. Chirps that have left the cell go to theirs in a
//! further round. Spreading costs some hundred vector instructions for sixteen returns, whatever the number of samples.

use super::fourier::Fourier;
use super::lanes::{LANES, Lanes, ZERO, cis, fma, map, multiply_add, round, zip};
use super::scratch::Scratch;
use crate::if_signal::grid::RangeGrid;

/// Moments per cell. With a reach of one cell the expansion is right to 10⁻⁵ in the worst sample, 3·10⁻⁶ on average.
pub const ORDERS: usize = 6;
const REACH: f64 = 1.0;
const ROW: usize = 2 * ORDERS;

/// Sixteen chirps of one point: a return, or the gradients to it.
#[derive(Clone, Copy)]
pub struct Return {
    pub re: Lanes,
    pub im: Lanes,
    pub phase: Lanes,
    pub sweep: Lanes,
}

/// The grid of a number of samples.
pub struct Plan {
    pub grid: RangeGrid,
    pub fourier: Fourier,
    places: Vec<u32>,
    /// `[sample][order]`.
    moments: Vec<[f32; ORDERS]>,
    cells_per_turn: f32,
    /// What f32 leaves out of `cells_per_turn`.
    cells_per_turn_rest: f32,
    phase_per_sweep: f32,
}

impl Plan {
    pub fn new(samples: usize) -> Self {
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

    pub fn empty(&self) -> Scratch {
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
    fn offset<const FUSED: bool>(&self, sweep: Lanes, cell: f32) -> Lanes {
        map(sweep, |v| multiply_add::<FUSED>(v, self.cells_per_turn_rest, multiply_add::<FUSED>(v, self.cells_per_turn, -cell)))
    }

    /// cos and sin of a return's phase at the sample that the grid calls k = 0.
    #[inline(always)]
    fn unit<const FUSED: bool>(&self, value: &Return) -> (Lanes, Lanes) {
        cis::<FUSED>(zip(value.phase, value.sweep, |phase, v| multiply_add::<FUSED>(v, self.phase_per_sweep, phase)))
    }

    #[inline(always)]
    pub fn spread<const FUSED: bool>(&self, value: &Return, width: usize, grid: &mut [Lanes]) {
        let (re, im) = multiply::<FUSED>((value.re, value.im), self.unit::<FUSED>(value));
        let mut spreading = Spreading { plan: self, sweep: value.sweep, re, im, grid };
        self.by_cell::<FUSED>(value.sweep, width, &mut spreading);
    }

    /// Gradients to a return, from the gradient on the grid.
    #[inline(always)]
    pub fn interpolate<const FUSED: bool>(&self, value: &Return, width: usize, grid: &[Lanes]) -> Return {
        let (cos, sin) = self.unit::<FUSED>(value);
        let mut found = Interpolation { plan: self, sweep: value.sweep, grid, gradient: (ZERO, ZERO), slope: (ZERO, ZERO) };
        self.by_cell::<FUSED>(value.sweep, width, &mut found);
        let Interpolation { gradient, slope, .. } = found;
        let (re, im) = multiply::<FUSED>((value.re, value.im), (cos, sin));
        let (to_re, to_im) = multiply::<FUSED>(gradient, (cos, map(sin, |s| -s)));
        let turned = zip(fma::<FUSED>(gradient.1, re, ZERO), zip(gradient.0, im, |g, v| g * v), |a, b| a - b);
        let phase = map(turned, |radians| std::f32::consts::TAU * radians);
        let along = fma::<FUSED>(slope.0, re, zip(slope.1, im, |s, v| s * v));
        let sweep =
            zip(phase, along, |phase, along| multiply_add::<FUSED>(phase, self.phase_per_sweep, along * self.cells_per_turn));
        Return { re: to_re, im: to_im, phase, sweep }
    }

    /// Visits cells with the lanes that lie within their reach and were not visited (`None`: all of them).
    #[inline(always)]
    fn by_cell<const FUSED: bool>(&self, sweep: Lanes, width: usize, visitor: &mut impl Visitor) {
        let cells = map(sweep, |v| v * self.cells_per_turn);
        let near = |u: f32, cell: f32| (u - cell).abs() <= REACH as f32;
        let cell = round(cells[width / 2]);
        if cells.iter().fold(true, |all, &u| all & near(u, cell)) {
            return visitor.visit::<FUSED>(cell, None);
        }
        let mut waiting: Lanes = [1.0; LANES];
        waiting[width..].fill(0.0);
        while let Some(first) = waiting.iter().position(|&on| on > 0.0) {
            let cell = round(cells[first]);
            let mut inside = zip(cells, waiting, |u, on| if near(u, cell) { on } else { 0.0 });
            // A NaN or infinite delay is near nothing, but must reach the output, where it is looked for.
            inside[first] = 1.0;
            waiting = zip(waiting, inside, |on, done| on - done);
            visitor.visit::<FUSED>(cell, Some(&inside));
        }
    }

    /// Calls `put` with every sample of up to sixteen chirps, from a transformed grid.
    #[inline(always)]
    pub fn collect<const FUSED: bool>(&self, grid: &[Lanes], mut put: impl FnMut(usize, Lanes, Lanes)) {
        for (sample, f) in self.moments.iter().enumerate() {
            let row = &grid[self.bin(sample) * ROW..][..ROW];
            let (mut re, mut im) = (ZERO, ZERO);
            for order in 0..ORDERS {
                let (a, b) = turn((row[2 * order], row[2 * order + 1]), order);
                re = fma::<FUSED>([f[order]; LANES], a, re);
                im = fma::<FUSED>([f[order]; LANES], b, im);
            }
            put(sample, re, im);
        }
    }

    /// The adjoint of [`Self::collect`]: gradients of the samples onto the transform's rows.
    #[inline(always)]
    pub fn distribute(&self, get: impl Fn(usize) -> (Lanes, Lanes), grid: &mut [Lanes]) {
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

/// What is done at a cell. A trait, for closures are not always inlined.
trait Visitor {
    fn visit<const FUSED: bool>(&mut self, cell: f32, inside: Option<&Lanes>);
}

/// Adds a return's moments to the grid.
struct Spreading<'a> {
    plan: &'a Plan,
    sweep: Lanes,
    re: Lanes,
    im: Lanes,
    grid: &'a mut [Lanes],
}

impl Visitor for Spreading<'_> {
    #[inline(always)]
    fn visit<const FUSED: bool>(&mut self, cell: f32, inside: Option<&Lanes>) {
        let (mut re, mut im) = (kept(self.re, inside), kept(self.im, inside));
        let offset = kept(self.plan.offset::<FUSED>(self.sweep, cell), inside);
        let start = self.plan.row(cell);
        let row: &mut [Lanes; ROW] = (&mut self.grid[start..start + ROW]).try_into().expect("a row of the grid");
        for order in 0..ORDERS {
            row[2 * order] = zip(row[2 * order], re, |sum, part| sum + part);
            row[2 * order + 1] = zip(row[2 * order + 1], im, |sum, part| sum + part);
            re = zip(re, offset, |part, x| part * x);
            im = zip(im, offset, |part, x| part * x);
        }
    }
}

/// The lanes that are inside, zero elsewhere; `None`: all of them.
#[inline(always)]
fn kept(value: Lanes, inside: Option<&Lanes>) -> Lanes {
    match inside {
        None => value,
        Some(inside) => zip(value, *inside, |value, on| if on > 0.0 { value } else { 0.0 }),
    }
}

/// Reads the gradient to a return's complex value from the grid, and its derivative along the cells.
struct Interpolation<'a> {
    plan: &'a Plan,
    sweep: Lanes,
    grid: &'a [Lanes],
    gradient: (Lanes, Lanes),
    slope: (Lanes, Lanes),
}

impl Visitor for Interpolation<'_> {
    #[inline(always)]
    fn visit<const FUSED: bool>(&mut self, cell: f32, inside: Option<&Lanes>) {
        let offset = self.plan.offset::<FUSED>(self.sweep, cell);
        let start = self.plan.row(cell);
        let row: &[Lanes; ROW] = (&self.grid[start..start + ROW]).try_into().expect("a row of the grid");
        let (mut a, mut b) = (row[ROW - 2], row[ROW - 1]);
        let (mut da, mut db) = (ZERO, ZERO);
        for order in (0..ORDERS - 1).rev() {
            (da, db) = (fma::<FUSED>(da, offset, a), fma::<FUSED>(db, offset, b));
            (a, b) = (fma::<FUSED>(a, offset, row[2 * order]), fma::<FUSED>(b, offset, row[2 * order + 1]));
        }
        match inside {
            None => (self.gradient, self.slope) = ((a, b), (da, db)),
            Some(inside) => {
                for lane in (0..LANES).filter(|&lane| inside[lane] > 0.0) {
                    (self.gradient.0[lane], self.gradient.1[lane]) = (a[lane], b[lane]);
                    (self.slope.0[lane], self.slope.1[lane]) = (da[lane], db[lane]);
                }
            }
        }
    }
}

/// z·w.
#[inline(always)]
fn multiply<const FUSED: bool>(z: (Lanes, Lanes), w: (Lanes, Lanes)) -> (Lanes, Lanes) {
    (
        zip(zip(z.0, w.0, |a, b| a * b), zip(z.1, w.1, |a, b| a * b), |a, b| a - b),
        fma::<FUSED>(z.0, w.1, zip(z.1, w.0, |a, b| a * b)),
    )
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
