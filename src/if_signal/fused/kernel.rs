//! The sum over all returns, and its adjoint, on all cores: which points and chirps are worked on together.

use std::ops::Range;

use rayon::prelude::*;

use super::lanes::{LANES, Lanes, ZERO, zip};
use super::machine::{Work, widest};
use super::plan::{ORDERS, Plan, Return};
use super::scratch::Scratch;

/// Points per task where chirps are few; fixed, so that the result does not depend on the machine.
const CHUNK: usize = 2048;
/// Tasks from which on the points need not be shared out.
const ENOUGH_TASKS: usize = 8;

/// One sum: of the paths of some points.
#[derive(Clone, Debug)]
pub struct Output {
    /// Which of the paths of each point.
    pub path: usize,
    pub points: Range<usize>,
}

/// Where returns come from.
pub trait Returns: Sync {
    fn points(&self) -> usize;
    fn chirps(&self) -> usize;
    /// Paths of each point.
    fn paths(&self) -> usize;
    /// What is summed apart. Every point's paths are in one sum each, or in none.
    fn outputs(&self) -> &[Output];
    /// Chirps from `chirp` on; those beyond the last repeat it.
    fn load<const FUSED: bool>(&self, path: usize, point: usize, chirp: usize) -> Return;
}

/// Where the gradients to a range of points go.
pub trait Sink: Send {
    /// How many points.
    fn points(&self) -> usize;
    /// Before anything else.
    fn open(&mut self);
    /// At the chirps from `chirp` on, for a point counted from the first of this range.
    fn put<const FUSED: bool>(&mut self, path: usize, local: usize, chirp: usize, gradient: &Return);
    /// After the last chirp of a path of all points.
    fn close<const FUSED: bool>(&mut self, path: usize);
}

/// Both parts of the sums, `[2, output, chirp, sample]`.
pub fn sum(returns: &impl Returns, samples: usize) -> Vec<f32> {
    let plan = Plan::new(samples);
    let (chirps, outputs) = (returns.chirps(), returns.outputs());
    let blocks = chirps.div_ceil(LANES);
    let most = outputs.iter().map(|output| output.points.len()).max().unwrap_or(0);
    let parts = if blocks * outputs.len() >= ENOUGH_TASKS { 1 } else { most.div_ceil(CHUNK).max(1) };
    let chunk = most.div_ceil(parts).max(1);

    let mut out = vec![0.0; 2 * outputs.len() * chirps * samples];
    let (out_re, out_im) = out.split_at_mut(outputs.len() * chirps * samples);
    let by_block = |part| blocks_of(part, outputs.len(), chirps * samples, LANES * samples);
    by_block(out_re).into_par_iter().zip(by_block(out_im)).enumerate().for_each(|(task, (re, im))| {
        let part = |part: usize| {
            let mut grid = plan.empty();
            let (Output { path, points }, chirp) = (&outputs[task / blocks], task % blocks * LANES);
            let points = points.start + part * chunk..(points.start + (part + 1) * chunk).min(points.end);
            widest(Fill { plan: &plan, returns, points, path: *path, chirp, grid: &mut grid });
            grid
        };
        let mut grid = match parts {
            1 => part(0),
            _ => {
                let grids: Vec<_> = (0..parts).into_par_iter().map(part).collect();
                grids.into_iter().reduce(add).expect("one part at least")
            }
        };
        widest(Collect { plan: &plan, grid: &mut grid, re, im });
    });
    out
}

/// Spreads points at sixteen chirps onto a grid.
struct Fill<'a, R> {
    plan: &'a Plan,
    returns: &'a R,
    points: Range<usize>,
    path: usize,
    chirp: usize,
    grid: &'a mut [Lanes],
}

impl<R: Returns> Work for Fill<'_, R> {
    type Out = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let Self { plan, returns, points, path, chirp, grid } = self;
        let width = LANES.min(returns.chirps() - chirp);
        for point in points {
            plan.spread::<FUSED>(&returns.load::<FUSED>(path, point, chirp), width, grid);
        }
    }
}

/// Transforms a grid into the samples of up to sixteen chirps.
struct Collect<'a> {
    plan: &'a Plan,
    grid: &'a mut [Lanes],
    re: &'a mut [f32],
    im: &'a mut [f32],
}

impl Work for Collect<'_> {
    type Out = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let Self { plan, grid, re, im } = self;
        plan.fourier.transform::<FUSED>(grid, ORDERS);
        let samples = plan.grid.samples;
        let width = re.len() / samples;
        plan.collect::<FUSED>(grid, |sample, r, i| {
            for lane in 0..width {
                re[lane * samples + sample] = r[lane];
                im[lane * samples + sample] = i[lane];
            }
        });
    }
}

/// The adjoint of [`sum`]: from the gradient to both parts of the sums, `[2, output, chirp, sample]`, those to the
/// returns. The sinks cover the points in order.
pub fn gradients(returns: &impl Returns, upstream: &[f32], samples: usize, sinks: Vec<impl Sink>) {
    let plan = Plan::new(samples);
    let (chirps, outputs) = (returns.chirps(), returns.outputs().len());
    let blocks = chirps.div_ceil(LANES);
    let (up_re, up_im) = upstream.split_at(outputs * chirps * samples);
    let grids: Vec<Scratch> = (0..outputs * blocks)
        .into_par_iter()
        .map(|task| {
            let (output, chirp) = (task / blocks, task % blocks * LANES);
            let width = LANES.min(chirps - chirp);
            let start = (output * chirps + chirp) * samples;
            let [re, im] = [up_re, up_im].map(|part| &part[start..start + width * samples]);
            let mut grid = plan.empty();
            widest(Distribute { plan: &plan, re, im, grid: &mut grid });
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
    let grids = &grids;
    sinks.into_par_iter().zip(starts).for_each(|(sink, start)| widest(Drain { plan: &plan, returns, grids, sink, start }));
}

/// Takes the gradients of the samples of up to sixteen chirps, `[chirp, sample]`, back to their grid.
struct Distribute<'a> {
    plan: &'a Plan,
    re: &'a [f32],
    im: &'a [f32],
    grid: &'a mut [Lanes],
}

impl Work for Distribute<'_> {
    type Out = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let Self { plan, re, im, grid } = self;
        let samples = plan.grid.samples;
        plan.distribute(|sample| (across(re, sample, samples), across(im, sample, samples)), grid);
        plan.fourier.adjoint::<FUSED>(grid, ORDERS);
    }
}

/// A sample of up to sixteen chirps; zero beyond the last.
#[inline(always)]
fn across(values: &[f32], sample: usize, samples: usize) -> Lanes {
    let mut lanes = ZERO;
    for (lane, chirp) in lanes.iter_mut().zip(values.chunks_exact(samples)) {
        *lane = chirp[sample];
    }
    lanes
}

/// Gives a sink its gradients.
struct Drain<'a, R, S> {
    plan: &'a Plan,
    returns: &'a R,
    grids: &'a [Scratch],
    sink: S,
    /// Its first point.
    start: usize,
}

impl<R: Returns, S: Sink> Work for Drain<'_, R, S> {
    type Out = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let Self { plan, returns, grids, mut sink, start } = self;
        let chirps = returns.chirps();
        let blocks = chirps.div_ceil(LANES);
        sink.open();
        for path in 0..returns.paths() {
            for (index, output) in returns.outputs().iter().enumerate().filter(|(_, output)| output.path == path) {
                let points = output.points.start.max(start)..output.points.end.min(start + sink.points());
                for block in 0..blocks {
                    let (chirp, grid) = (block * LANES, &grids[index * blocks + block]);
                    for point in points.clone() {
                        let value = returns.load::<FUSED>(path, point, chirp);
                        let gradient = plan.interpolate::<FUSED>(&value, LANES.min(chirps - chirp), grid);
                        sink.put::<FUSED>(path, point - start, chirp, &gradient);
                    }
                }
            }
            sink.close::<FUSED>(path);
        }
    }
}

/// Points per sink: long ranges, because every one of them walks through all grids.
pub fn points_per_sink(points: usize) -> usize {
    points.div_ceil(4 * rayon::current_num_threads()).max(64)
}

/// Every output's stretch of `per_output` numbers in blocks of `size`, the last of them shorter.
fn blocks_of(values: &mut [f32], outputs: usize, per_output: usize, size: usize) -> Vec<&mut [f32]> {
    debug_assert_eq!(values.len(), outputs * per_output);
    values.chunks_mut(per_output).flat_map(|output| output.chunks_mut(size)).collect()
}

fn add(mut a: Scratch, b: Scratch) -> Scratch {
    for (a, b) in a.iter_mut().zip(b.iter()) {
        *a = zip(*a, *b, |a, b| a + b);
    }
    a
}
