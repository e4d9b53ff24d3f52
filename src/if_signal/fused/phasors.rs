//! Returns given as phasors, and the gradients to these.

use super::kernel::{self, Output, Returns, Sink};
use super::lanes::{ZERO, load, store};
use super::plan::Return;

/// Tensors `[point, chirp]` in row-major order.
pub struct Inputs<'a> {
    /// All points in one.
    pub outputs: [Output; 1],
    pub re: &'a [f32],
    pub im: Option<&'a [f32]>,
    pub phase: &'a [f32],
    pub sweep: &'a [f32],
    pub points: usize,
    pub chirps: usize,
}

impl Returns for Inputs<'_> {
    fn points(&self) -> usize {
        self.points
    }

    fn chirps(&self) -> usize {
        self.chirps
    }

    fn paths(&self) -> usize {
        1
    }

    fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    #[inline(always)]
    fn load<const FUSED: bool>(&self, _: usize, point: usize, chirp: usize) -> Return {
        let (at, width) = (point * self.chirps + chirp, self.chirps - chirp);
        Return {
            re: load(self.re, at, width),
            im: self.im.map_or(ZERO, |im| load(im, at, width)),
            phase: load(self.phase, at, width),
            sweep: load(self.sweep, at, width),
        }
    }
}

/// Gradients to re, im, phase and sweep; that to im is empty for a real amplitude.
pub fn gradients(inputs: Inputs, upstream: &[f32], samples: usize) -> [Vec<f32>; 4] {
    let size = inputs.points * inputs.chirps;
    let mut all = [vec![0.0; size], vec![0.0; if inputs.im.is_some() { size } else { 0 }], vec![0.0; size], vec![0.0; size]];
    let chunk = kernel::points_per_sink(inputs.points) * inputs.chirps;
    let [re, im, phase, sweep] = &mut all;
    let mut im = im.chunks_mut(chunk);
    let sinks: Vec<Columns> = re
        .chunks_mut(chunk)
        .zip(phase.chunks_mut(chunk).zip(sweep.chunks_mut(chunk)))
        .map(|(re, (phase, sweep))| Columns { re, im: im.next(), phase, sweep, chirps: inputs.chirps })
        .collect();
    kernel::gradients(&inputs, upstream, samples, sinks);
    all
}

struct Columns<'a> {
    re: &'a mut [f32],
    im: Option<&'a mut [f32]>,
    phase: &'a mut [f32],
    sweep: &'a mut [f32],
    chirps: usize,
}

impl Sink for Columns<'_> {
    fn points(&self) -> usize {
        self.phase.len() / self.chirps
    }

    #[inline(always)]
    fn open(&mut self) {}

    #[inline(always)]
    fn put<const FUSED: bool>(&mut self, _: usize, local: usize, chirp: usize, gradient: &Return) {
        let (at, width) = (local * self.chirps + chirp, self.chirps - chirp);
        store(self.re, at, width, gradient.re);
        if let Some(im) = &mut self.im {
            store(im, at, width, gradient.im);
        }
        store(self.phase, at, width, gradient.phase);
        store(self.sweep, at, width, gradient.sweep);
    }

    #[inline(always)]
    fn close<const FUSED: bool>(&mut self, _: usize) {}
}
