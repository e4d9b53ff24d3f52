//! The body's return in one frame: the reference that follows every sample, and the fast path that records.

use std::ops::Range;

use num_complex::Complex64;
use rayon::prelude::*;

use super::amplitude::{Laws, View};
use super::body::MovingBody;
use super::chirp::{Chirp, widened};
use super::lanes::{BLOCK, ChirpWeights, Lanes, NODES, NodeShares};
use super::mirror::Mirror;
use super::range_grid::{RangeGrid, ToneWeights};
use super::sinusoid::SinusoidalMotion;
use super::stages::Clock;
use super::surface::{Element, Pose};
use super::timeline::Weights;
use super::vector::{Vector, add, add_scaled, distance};
use super::visibility::Obstacle;
use crate::error::Result;
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::room::Boundary;

/// Amplitudes are evaluated at four instants that span no more than this, and interpolated between them.
const AMPLITUDE_SPAN_S: f64 = 7.0e-3;

/// A body in front of a radar.
pub struct Scatter {
    pub radar: Radar,
    pub body: MovingBody,
    /// Sorted by face.
    pub elements: Vec<Element>,
    pub smoothing: f64,
    pub laws: Laws,
    /// The direct view first.
    pub mirrors: Vec<Mirror>,
    /// Up to how many wall reflections a path has on its two legs together.
    pub order: usize,
    /// Of them in each boundary.
    pub limits: [usize; 6],
    pub clock: Clock,
    /// Of the antennas.
    pub vibration: Option<SinusoidalMotion>,
    chirp: Chirp,
    grid: RangeGrid,
}

/// Elements that one combination of images sees.
struct Lit {
    tx: usize,
    rx: usize,
    elements: Vec<u32>,
    /// `[pose][axis][element]`, metres.
    positions: Vec<[Vec<f64>; 3]>,
}

/// What is common to all chirps of a frame.
struct FrameScene {
    first_pose: usize,
    poses: Vec<Pose>,
    lit: Vec<Lit>,
}

/// One sample of one chirp.
struct Moment {
    chirp: usize,
    time_s: f64,
    ramp_s: f64,
}

impl Scatter {
    /// Its signals have `guard` samples more at either end of every chirp.
    pub fn new(radar: &Radar, guard: usize, body: MovingBody, elements: Vec<Element>, smoothing: f64, laws: Laws) -> Self {
        let wide = widened(radar, guard);
        Self {
            chirp: Chirp::new(&wide),
            grid: RangeGrid::new(wide.samples_per_chirp),
            radar: radar.clone(),
            body,
            elements,
            smoothing,
            laws,
            mirrors: vec![Mirror::none()],
            order: 0,
            limits: [2; 6],
            clock: Clock::default(),
            vibration: None,
        }
    }

    /// Ramp start of the chirp that is the `index`th in time.
    fn chirp_time_s(&self, frame: usize, index: usize) -> f64 {
        let transmitters = self.radar.tx_m.len();
        self.clock.ramp_s(&self.radar, frame, index % transmitters, index / transmitters)
    }

    /// Poses and weights at a radar time.
    fn weights(&self, time_s: f64) -> Result<Weights> {
        self.body.weights(self.clock.motion_s(time_s))
    }

    /// Where the vibration has moved the antennas.
    fn shake(&self, time_s: f64) -> Vector {
        self.vibration.map_or([0.0; 3], |motion| motion.position(time_s))
    }

    fn chirps(&self) -> usize {
        self.radar.loops_per_frame * self.radar.tx_m.len()
    }

    /// The body's signal in one frame, `[tx, rx, loop, sample]`.
    pub fn frame(&self, frame: usize) -> Result<Vec<Complex64>> {
        let scene = self.scene(frame)?;
        let per_chunk = ((AMPLITUDE_SPAN_S / self.radar.chirp_period_s) as usize).max(1);
        let chunks: Vec<Range<usize>> =
            (0..self.chirps()).step_by(per_chunk).map(|start| start..(start + per_chunk).min(self.chirps())).collect();
        let parts: Vec<Vec<Complex64>> =
            chunks.into_par_iter().map(|chirps| self.chunk(&scene, frame, chirps)).collect::<Result<_>>()?;
        Ok(self.ordered(&parts.concat()))
    }

    /// The first loop of a frame, `[tx, rx, sample]`: a cheap look at how strong the body is.
    pub fn first_loop(&self, frame: usize) -> Result<Vec<Complex64>> {
        self.chunk(&self.scene(frame)?, frame, 0..self.radar.tx_m.len())
    }

    /// From `[chirp in time, rx, sample]` to `[tx, rx, loop, sample]`.
    fn ordered(&self, signal: &[Complex64]) -> Vec<Complex64> {
        let [_, transmitters, receivers, loops, _] = self.radar.dims();
        let samples = signal.len() / (transmitters * receivers * loops);
        let mut result = Vec::with_capacity(signal.len());
        for tx in 0..transmitters {
            for rx in 0..receivers {
                for index in 0..loops {
                    let start = ((index * transmitters + tx) * receivers + rx) * samples;
                    result.extend_from_slice(&signal[start..start + samples]);
                }
            }
        }
        result
    }

    fn scene(&self, frame: usize) -> Result<FrameScene> {
        let start = self.chirp_time_s(frame, 0) + self.radar.sample_time_s(0);
        let end = self.chirp_time_s(frame, self.chirps() - 1) + self.radar.sample_time_s(self.radar.samples_per_chirp);
        let (early, late) = (self.weights(start)?, self.weights(end)?);
        let first_pose = early.iter().map(|&(pose, _)| pose).min().unwrap_or(0);
        let last_pose = late.iter().map(|&(pose, _)| pose).max().unwrap_or(0);
        let poses: Vec<Pose> = (first_pose..=last_pose)
            .into_par_iter()
            .map(|pose| Pose::new(self.body.pose(pose), &self.body.faces, self.smoothing))
            .collect();
        let mut scene = FrameScene { first_pose, poses, lit: vec![] };
        let middle = self.pose_at(&scene, &self.weights(0.5 * (start + end))?);
        let obstacle = Obstacle::new(&middle, &self.body.faces, self.smoothing)?;
        let centre = self.radar.centre_m();
        let visible: Vec<Vec<bool>> =
            self.mirrors.iter().map(|mirror| obstacle.visible(&self.elements, mirror.point(centre))).collect();
        for (tx, rx) in self.legs() {
            let both = visible[tx].iter().zip(&visible[rx]).enumerate();
            let elements: Vec<u32> = both.filter(|(_, (a, b))| **a && **b).map(|(index, _)| index as u32).collect();
            let positions = scene.poses.iter().map(|pose| self.positions(pose, &elements)).collect();
            scene.lit.push(Lit { tx, rx, elements, positions });
        }
        Ok(scene)
    }

    /// Pairs of images with at most `order` reflections together.
    fn legs(&self) -> Vec<(usize, usize)> {
        let count = self.mirrors.len();
        (0..count * count)
            .map(|pair| (pair / count, pair % count))
            .filter(|&(tx, rx)| {
                let walls = || self.mirrors[tx].walls.iter().chain(&self.mirrors[rx].walls);
                let within = |wall: &Boundary| walls().filter(|other| *other == wall).count() <= self.limits[*wall as usize];
                walls().count() <= self.order && walls().all(within)
            })
            .collect()
    }

    /// The body in the middle of a chirp that starts at `time_s`.
    pub fn pose(&self, time_s: f64) -> Result<Pose> {
        let mut vertices = vec![[0.0; 3]; self.body.rest().len()];
        for (pose, weight) in self.weights(time_s + self.chirp.middle_s)? {
            for (sum, vertex) in vertices.iter_mut().zip(self.body.pose(pose)) {
                *sum = add_scaled(*sum, vertex, weight);
            }
        }
        Ok(Pose::new(vertices, &self.body.faces, self.smoothing))
    }

    fn positions(&self, pose: &Pose, elements: &[u32]) -> [Vec<f64>; 3] {
        let points: Vec<Vector> = elements
            .par_iter()
            .map(|&element| pose.point(&self.elements[element as usize], &self.body.faces, self.smoothing))
            .collect();
        [0, 1, 2].map(|axis| points.iter().map(|point| point[axis]).collect())
    }

    fn pose_at(&self, scene: &FrameScene, weights: &Weights) -> Pose {
        let mut vertices = vec![[0.0; 3]; scene.poses[0].vertices.len()];
        for &(pose, weight) in weights {
            for (sum, vertex) in vertices.iter_mut().zip(&scene.poses[pose - scene.first_pose].vertices) {
                *sum = add_scaled(*sum, *vertex, weight);
            }
        }
        Pose::new(vertices, &self.body.faces, self.smoothing)
    }

    /// Straight line that fits the motion in a chirp best: through the two Gauss points of the ADC window.
    fn chirp_weights(&self, scene: &FrameScene, time_s: f64) -> Result<ChirpWeights> {
        let half = self.radar.samples_per_chirp as f64 / (self.radar.sample_rate_hz * 12f64.sqrt());
        let middle = time_s + self.chirp.middle_s;
        let mut poses: Vec<(usize, f64, f64)> = vec![];
        for (time, slope) in [(middle - half, -0.5 / half), (middle + half, 0.5 / half)] {
            for (pose, weight) in self.weights(time)? {
                poses.push((pose - scene.first_pose, 0.5 * weight, slope * weight));
            }
        }
        Ok(ChirpWeights { poses })
    }

    /// Some chirps in a row, `[chirp, rx, sample]`.
    fn chunk(&self, scene: &FrameScene, frame: usize, chirps: Range<usize>) -> Result<Vec<Complex64>> {
        let receivers = self.radar.rx_m.len();
        let times: Vec<f64> = chirps.clone().map(|chirp| self.chirp_time_s(frame, chirp)).collect();
        let weights = times.iter().map(|&time| self.chirp_weights(scene, time)).collect::<Result<Vec<_>>>()?;
        let (first, last) = (times[0], times[times.len() - 1]);
        let shares: Vec<NodeShares> = times.iter().map(|time| self.node_shares(time - first, last - first)).collect();
        let nodes: Vec<Pose> = (0..NODES)
            .map(|node| first + (last - first) * node as f64 / (NODES - 1) as f64)
            .map(|time| Ok(self.pose_at(scene, &self.weights(time + self.chirp.middle_s)?)))
            .collect::<Result<_>>()?;
        let mut storage = vec![0f32; chirps.len() * receivers * self.grid.storage()];
        let mut lanes = Lanes::new();
        for lit in &scene.lit {
            let (tx_mirror, rx_mirror) = (&self.mirrors[lit.tx], &self.mirrors[lit.rx]);
            let view = View::new(tx_mirror, rx_mirror, self.radar.centre_m());
            for start in (0..lit.elements.len()).step_by(BLOCK) {
                let block = &lit.elements[start..(start + BLOCK).min(lit.elements.len())];
                let amplitudes = self.amplitudes(block, &nodes, &view);
                lanes.delay(block.iter().map(|&element| self.elements[element as usize].extra_m));
                for (index, chirp) in chirps.clone().enumerate() {
                    let shake = self.shake(times[index]);
                    let transmitter = add(self.radar.tx_position_m(chirp % self.radar.tx_m.len()), shake);
                    lanes.place(&lit.positions, start, block.len(), &weights[index]);
                    lanes.weigh(&amplitudes, &shares[index]);
                    lanes.transmit(tx_mirror.point(transmitter));
                    let grids = storage.chunks_mut(self.grid.storage()).skip(index * receivers);
                    for (rx, grid) in (0..receivers).zip(grids) {
                        let receiver = rx_mirror.point(add(self.radar.rx_position_m(rx), shake));
                        lanes.receive(receiver, block.len(), &self.chirp, &self.grid, grid);
                    }
                }
            }
        }
        Ok(storage.chunks(self.grid.storage()).flat_map(|grid| self.grid.samples(grid)).collect())
    }

    /// Interpolation between the instants of a chunk, for a chirp `since_s` after the first of them.
    fn node_shares(&self, since_s: f64, span_s: f64) -> NodeShares {
        if span_s == 0.0 {
            return NodeShares { value: lagrange(0.0), change: [0.0; NODES] };
        }
        let (middle, half) = (since_s / span_s, 0.5 * self.chirp.window_s / span_s);
        let (before, after) = (lagrange(middle - half), lagrange(middle + half));
        NodeShares { value: lagrange(middle), change: std::array::from_fn(|node| after[node] - before[node]) }
    }

    /// `[element][node]`: amplitude as a parabola over the sweep, at each of the instants.
    fn amplitudes(&self, block: &[u32], nodes: &[Pose], view: &View) -> Vec<[ToneWeights; NODES]> {
        let wavenumbers = [-0.5, 0.0, 0.5].map(|s| std::f64::consts::TAU * self.chirp.frequency_hz(s) / SPEED_OF_LIGHT);
        block
            .iter()
            .map(|&index| {
                let element = &self.elements[index as usize];
                std::array::from_fn(|node| {
                    let patch = nodes[node].patch(element, &self.body.faces, self.smoothing);
                    let [low, middle, high] = self.laws.response(element, &patch, view, wavenumbers);
                    let (slope, bend) = (high - low, (high + low - middle * 2.0) * 2.0);
                    [middle.re, middle.im, slope.re, slope.im, bend.re, bend.im].map(|value| value as f32)
                })
            })
            .collect()
    }

    /// The definition, slowly: every element at every sample, with its amplitude at that moment and frequency and the
    /// true transmit phase. Only who is visible is fixed within the frame. `[tx, rx, loop, sample]`, without guard samples.
    ///
    /// `extra_turns(chirp in time, time after the ramp's start, delay)` is what the oscillator adds to an ideal ramp.
    pub fn reference_frame(&self, frame: usize, extra_turns: &(dyn Fn(usize, f64, f64) -> f64 + Sync)) -> Result<Vec<Complex64>> {
        let scene = self.scene(frame)?;
        let (receivers, samples) = (self.radar.rx_m.len(), self.radar.samples_per_chirp);
        let moments: Vec<(usize, usize)> = (0..self.chirps() * samples).map(|i| (i / samples, i % samples)).collect();
        let values: Vec<Vec<Complex64>> = moments
            .into_par_iter()
            .map(|(chirp, sample)| {
                let ramp_s = self.radar.sample_time_s(sample);
                let time_s = self.chirp_time_s(frame, chirp) + ramp_s;
                let weights = self.weights(time_s)?;
                let moment = Moment { chirp, time_s, ramp_s };
                Ok(self.reference_sample(&scene, &weights, moment, extra_turns))
            })
            .collect::<Result<_>>()?;
        // [chirp, sample][rx] to [chirp, rx, sample]
        let mut signal = vec![Complex64::ZERO; values.len() * receivers];
        for (moment, by_receiver) in values.iter().enumerate() {
            for (rx, value) in by_receiver.iter().enumerate() {
                signal[(moment / samples * receivers + rx) * samples + moment % samples] = *value;
            }
        }
        Ok(self.ordered(&signal))
    }

    fn reference_sample(
        &self,
        scene: &FrameScene,
        weights: &Weights,
        Moment { chirp, time_s, ramp_s }: Moment,
        extra_turns: &(dyn Fn(usize, f64, f64) -> f64 + Sync),
    ) -> Vec<Complex64> {
        let (transmitter, shake) = (chirp % self.radar.tx_m.len(), self.shake(time_s));
        let pose = self.pose_at(scene, weights);
        let mut sums = vec![Complex64::ZERO; self.radar.rx_m.len()];
        let frequency_hz = self.chirp.middle_hz + self.chirp.slope_hz_per_s * (ramp_s - self.chirp.middle_s);
        let wavenumber = std::f64::consts::TAU * frequency_hz / SPEED_OF_LIGHT;
        for lit in &scene.lit {
            let (tx_mirror, rx_mirror) = (&self.mirrors[lit.tx], &self.mirrors[lit.rx]);
            let view = View::new(tx_mirror, rx_mirror, self.radar.centre_m());
            let tx_m = tx_mirror.point(add(self.radar.tx_position_m(transmitter), shake));
            for (position, &index) in lit.elements.iter().enumerate() {
                let element = &self.elements[index as usize];
                let patch = pose.patch(element, &self.body.faces, self.smoothing);
                let [amplitude] = self.laws.response(element, &patch, &view, [wavenumber]);
                let point: Vector = std::array::from_fn(|axis| {
                    weights.iter().map(|&(pose, weight)| weight * lit.positions[pose - scene.first_pose][axis][position]).sum()
                });
                let to_tx = distance(point, tx_m);
                for (rx, sum) in sums.iter_mut().enumerate() {
                    let to_rx = distance(point, rx_mirror.point(add(self.radar.rx_position_m(rx), shake)));
                    let delay = (to_tx + to_rx + 2.0 * element.extra_m) / SPEED_OF_LIGHT;
                    let turns = self.chirp.exact_turns(ramp_s, delay) + extra_turns(chirp, ramp_s, delay);
                    *sum += amplitude * Complex64::cis(std::f64::consts::TAU * turns.fract()) / (to_tx * to_rx);
                }
            }
        }
        sums
    }
}

/// Cubic interpolation between 0, 1/3, 2/3 and 1.
fn lagrange(u: f64) -> [f64; NODES] {
    let [a, b, c, d] = [0.0, 1.0, 2.0, 3.0].map(|node| 3.0 * u - node);
    [b * c * d / -6.0, a * c * d / 2.0, a * b * d / -2.0, a * b * c / 6.0]
}
