//! The sum over all returns, and its adjoint, on all cores: which points and chirps are worked on together.

use rayon::prelude::*;

use super::lanes::{LANES, Lanes, ZERO, zip};
use super::machine::{Work, widest};
use super::plan::{ORDERS, Plan, Return};
use super::scratch::Scratch;

/// Points per task where chirps are few; fixed, so that the result does not depend on the machine.
const CHUNK: usize = 2048;
/// Tasks from which on the points need not be shared out.
const ENOUGH_TASKS: usize = 8;

/// Where returns come from. Several receivers may see the same points.
pub trait Returns: Sync {
    fn points(&self) -> usize;
    fn chirps(&self) -> usize;
    fn receivers(&self) -> usize;
    /// Chirps from `chirp` on; those beyond the last repeat it.
    fn load<const FUSED: bool>(&self, receiver: usize, point: usize, chirp: usize) -> Return;
}

/// Where the gradients to a range of points go.
pub trait Sink: Send {
    /// How many points.
    fn points(&self) -> usize;
    /// Before anything else.
    fn open(&mut self);
    /// At the chirps from `chirp` on, for a point counted from the first of this range.
    fn put<const FUSED: bool>(&mut self, receiver: usize, local: usize, chirp: usize, gradient: &Return);
    /// After the last chirp of a receiver.
    fn close<const FUSED: bool>(&mut self, receiver: usize);
}

/// Both parts of the sum, `[2, receiver, chirp, sample]`.
pub fn sum(returns: &impl Returns, samples: usize) -> Vec<f32> {
    let plan = Plan::new(samples);
    let (points, chirps, receivers) = (returns.points(), returns.chirps(), returns.receivers());
    let blocks = chirps.div_ceil(LANES);
    let parts = if blocks * receivers >= ENOUGH_TASKS { 1 } else { points.div_ceil(CHUNK).max(1) };
    let chunk = points.div_ceil(parts).max(1);

    let mut out = vec![0.0; 2 * receivers * chirps * samples];
    let (out_re, out_im) = out.split_at_mut(receivers * chirps * samples);
    let by_block = |part| blocks_of(part, receivers, chirps * samples, LANES * samples);
    by_block(out_re).into_par_iter().zip(by_block(out_im)).enumerate().for_each(|(task, (re, im))| {
        let part = |part: usize| {
            let mut grid = plan.empty();
            let points = part * chunk..((part + 1) * chunk).min(points);
            let (receiver, chirp) = (task / blocks, task % blocks * LANES);
            widest(Fill { plan: &plan, returns, points, receiver, chirp, grid: &mut grid });
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
    points: std::ops::Range<usize>,
    receiver: usize,
    chirp: usize,
    grid: &'a mut [Lanes],
}

impl<R: Returns> Work for Fill<'_, R> {
    type Out = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let Self { plan, returns, points, receiver, chirp, grid } = self;
        let width = LANES.min(returns.chirps() - chirp);
        for point in points {
            plan.spread::<FUSED>(&returns.load::<FUSED>(receiver, point, chirp), width, grid);
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
            let start = (receiver * chirps + chirp) * samples;
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
        for receiver in 0..returns.receivers() {
            for block in 0..blocks {
                let (chirp, grid) = (block * LANES, &grids[receiver * blocks + block]);
                for local in 0..sink.points() {
                    let value = returns.load::<FUSED>(receiver, start + local, chirp);
                    let gradient = plan.interpolate::<FUSED>(&value, LANES.min(chirps - chirp), grid);
                    sink.put::<FUSED>(receiver, local, chirp, &gradient);
                }
            }
            sink.close::<FUSED>(receiver);
        }
    }
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

fn add(mut a: Scratch, b: Scratch) -> Scratch {
    for (a, b) in a.iter_mut().zip(b.iter()) {
        *a = zip(*a, *b, |a, b| a + b);
    }
    a
}
