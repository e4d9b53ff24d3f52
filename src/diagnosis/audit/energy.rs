//! How the power of the moving cells follows a prediction of where the body's points are.

use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::prediction::Point;
use crate::diagnosis::statistics::ratio_tail;
use crate::diagnosis::vector::{difference, dot, norm};
use crate::radar::Radar;

/// Doppler cells about zero that static clutter leaks into.
pub(super) const CLUTTER_CELLS: f64 = 2.5;

/// Count, sum, and sum of squares of ln power over the noise.
#[derive(Clone, Copy, Debug, Default)]
struct Sums([f64; 3]);

impl Sums {
    fn add(&mut self, value: f64) {
        let Sums([count, sum, squares]) = *self;
        *self = Sums([count + 1.0, sum + value, squares + value * value]);
    }

    fn plus(self, other: Self) -> Self {
        Sums(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }

    fn mean(self) -> f64 {
        self.0[1] / self.0[0].max(1.0)
    }

    /// Sum of squares around a value.
    fn around(self, value: f64) -> f64 {
        let Sums([count, sum, squares]) = self;
        squares - 2.0 * value * sum + count * value * value
    }
}

#[derive(Clone, Debug)]
struct Frame {
    /// Numbers of the predicted cells, ascending.
    predicted: Vec<usize>,
    /// Of the predicted cells and of all others.
    sums: [Sums; 2],
}

/// By frame of the recording; none where the prediction says nothing of a frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Fit {
    frames: Vec<Option<Frame>>,
}

/// One prediction against another, over the frames of both.
#[derive(Clone, Copy, Debug)]
pub(super) struct Comparison {
    /// Logarithm of how much less of a frame's sum of squares the first leaves unexplained, for each cell that one predicts alone.
    pub better: f64,
    /// Chance of that where neither is better.
    pub p_value: f64,
}

impl Frame {
    /// Sums over some frames.
    fn all<'a>(frames: impl Iterator<Item = &'a Frame>) -> [Sums; 2] {
        frames.fold([Sums::default(); 2], |all, Frame { sums, .. }| [all[0].plus(sums[0]), all[1].plus(sums[1])])
    }

    /// Sum of squares around a mean for each group.
    fn left(&self, means: [f64; 2]) -> f64 {
        self.sums.iter().zip(means).map(|(sums, mean)| sums.around(mean)).sum::<f64>().max(f64::MIN_POSITIVE)
    }

    /// Cells that one of two predictions has alone.
    fn apart(&self, other: &Frame) -> usize {
        let shared = self.predicted.iter().filter(|cell| other.predicted.binary_search(cell).is_ok()).count();
        self.predicted.len() + other.predicted.len() - 2 * shared
    }
}

impl Fit {
    /// Mean of the logarithms of power at the predicted cells, dB over the noise.
    pub fn level_db(&self) -> f64 {
        10.0 / std::f64::consts::LN_10 * Frame::all(self.frames.iter().flatten())[0].mean()
    }

    /// Each prediction explains a frame's ln power by two means, one of the predicted cells and one of all others; a frame tells them
    /// apart by the logarithm of what they leave, its likelihood ratio with a free variance. The test is Student's over frames (a frame is
    /// one sample, as all of its cells show one body), weighted by how many cells one of the two predicts alone: where the body hardly
    /// moves, they predict the same.
    ///
    /// The levels alone are no comparison: of two predictions the one with fewer cells, of the strongest part of a motion, has the
    /// higher level, while it leaves the rest of the body's power unexplained.
    pub fn against(&self, other: &Fit) -> Comparison {
        let both = self.frames.iter().zip(&other.frames).filter_map(|(own, other)| own.as_ref().zip(other.as_ref()));
        let both: Vec<(&Frame, &Frame)> = both.collect();
        // Where less is than elsewhere, nothing is predicted.
        let means = |[predicted, others]: [Sums; 2]| match predicted.mean() > others.mean() {
            true => [predicted.mean(), others.mean()],
            false => [predicted.plus(others).mean(); 2],
        };
        let own_means = means(Frame::all(both.iter().map(|(own, _)| *own)));
        let other_means = means(Frame::all(both.iter().map(|(_, other)| *other)));
        let ratios: Vec<f64> = both.iter().map(|(own, other)| (other.left(other_means) / own.left(own_means)).ln()).collect();
        let weights: Vec<f64> = both.iter().map(|(own, other)| own.apart(other) as f64).collect();
        let (better, p_value) = ratio_tail(&ratios, &weights);
        Comparison { better, p_value }
    }
}

/// In the frames to which `shown` gives one of the motion's, each point at the range (m) and velocity (m/s) that `cell` says.
pub(super) fn fit(evidence: &Evidence, shown: impl Fn(usize) -> Option<usize>, cell: impl Fn(&Point) -> Option<[f64; 2]>) -> Fit {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let Some(body) = &evidence.body else { return Fit::default() };
    let moving: Vec<usize> = (0..loops).filter(|&row| row.min(loops - row) as f64 >= CLUTTER_CELLS).collect();
    let of_frame = |frame: usize| {
        let points = shown(frame).and_then(|shown| body.frames.get(shown))?;
        let mut predicted = vec![false; loops * samples];
        for [range_m, velocity] in points.iter().filter_map(&cell) {
            let bin = (range_m / evidence.radar.range_resolution_m()).round() as i64;
            let doppler = velocity / evidence.radar.velocity_resolution_mps();
            if doppler.abs() >= CLUTTER_CELLS {
                let row = (doppler.round() as i64).rem_euclid(loops as i64) as usize;
                predicted[row * samples + bin.rem_euclid(samples as i64) as usize] = true;
            }
        }
        let map = evidence.maps().below([frame]);
        let mut sums = [Sums::default(); 2];
        for cell in moving.iter().flat_map(|row| row * samples..(row + 1) * samples) {
            sums[usize::from(!predicted[cell])].add(f64::from(map[cell]).max(1.0).ln());
        }
        Some(Frame { predicted: (0..predicted.len()).filter(|cell| predicted[*cell]).collect(), sums })
    };
    Fit { frames: (0..body.frames.len()).map(of_frame).collect() }
}

/// Range and radial velocity of a point of the body.
pub fn range_and_velocity(point: &Point, radar: &Radar) -> [f64; 2] {
    let to = difference(point.position_m, radar.centre_m());
    let range = norm(to).max(1e-9);
    [range, dot(to, point.velocity_mps) / range]
}

/// Whether the body ever moves fast enough to be distinguished from static returns.
pub(super) fn moves(evidence: &Evidence) -> bool {
    let fast = CLUTTER_CELLS * evidence.radar.velocity_resolution_mps();
    let points = evidence.body.iter().flat_map(|body| body.frames.iter().flatten());
    points.map(|point| range_and_velocity(point, &evidence.radar)[1].abs()).any(|speed| speed > fast)
}

/// Another reading of the recording's conventions, under which the body would be elsewhere.
pub(super) struct Alternative {
    pub check: &'static str,
    /// What is stated.
    pub expected: &'static str,
    pub fit: Fit,
    /// `at the opposite velocities`
    pub place: String,
    /// What is wrong where this reading is right.
    pub hint: String,
}
