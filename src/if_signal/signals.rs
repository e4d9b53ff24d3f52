//! What each receiver samples: the sum of all direct paths, and of all paths by way of one wall receiver.

use std::ops::Range;

use burn::tensor::Tensor;

use super::{SumForm, coherent_sum, fused};
use crate::complex::Complex;
use crate::paths::{Dechirp, DirectPaths, Points, WallReceiver, Waveform};
use crate::radar::Radar;

/// Direct signal of one transmitter (eq. 2).
///
/// # Shapes
/// points `[point, chirp]`; result `[rx, chirp, sample]`. Points at rest have one chirp, and so has their signal: adding
/// it to that of moving points broadcasts.
///
/// # Gradient
/// Flows to amplitude and displacement.
pub fn direct_signal(points: Points, radar: &Radar, tx: usize, dechirp: Dechirp, form: SumForm) -> Complex<3> {
    if points.reference_m.is_empty() {
        return silence(&points, radar);
    }
    if form.is_fused(&points.displacement.x) {
        let receivers: Vec<_> = (0..radar.rx_m.len()).map(|rx| radar.rx_position_m(rx)).collect();
        let waveform = Waveform::new(radar, dechirp);
        return fused::array_signal(&points, radar.tx_position_m(tx), &receivers, &waveform, radar.samples_per_chirp);
    }
    let paths = DirectPaths::new(points, radar, tx, dechirp);
    stack((0..radar.rx_m.len()).map(|rx| coherent_sum(&paths.phasors(rx), radar.samples_per_chirp, form)))
}

/// Points that send their echoes to walls, one wall's points after another's.
pub struct ToWalls<'a> {
    /// `[point, chirp]`, their amplitude that towards the wall's receiver.
    pub points: Points<'a>,
    /// (wall, its points); together all points in their order.
    pub walls: &'a [(usize, Range<usize>)],
}

/// Signal of one transmitter by way of the walls' receivers at `walls_m` (eq. 3), of all groups together; `None` where no wall has points.
///
/// # Shapes
/// result `[rx, chirp, sample]`, of one chirp where all points are at rest.
///
/// # Gradient
/// Flows to amplitude and displacement.
pub fn indirect_signal(
    groups: &[ToWalls],
    walls_m: &[[f64; 3]],
    radar: &Radar,
    tx: usize,
    dechirp: Dechirp,
    form: SumForm,
) -> Option<Complex<3>> {
    let walls: Vec<WallReceiver> = walls_m.iter().map(|&wall_m| WallReceiver::new(wall_m, radar, dechirp)).collect();
    // As they arrive at a wall's receiver, `[chirp, sample]`.
    let mut arriving: Vec<Option<Complex<2>>> = vec![None; walls.len()];
    for group in groups {
        for (&(wall, _), signal) in group.walls.iter().zip(group.arriving(&walls, radar, tx, form)) {
            arriving[wall] = Some(match arriving[wall].take() {
                Some(sum) => sum.add(signal),
                None => signal,
            });
        }
    }
    let onward = arriving.into_iter().zip(&walls).filter_map(|(arriving, wall)| Some(wall.onward(arriving?)));
    onward.reduce(Complex::add)
}

impl ToWalls<'_> {
    /// What each of its walls receives, `[chirp, sample]`.
    fn arriving(&self, walls: &[WallReceiver], radar: &Radar, tx: usize, form: SumForm) -> Vec<Complex<2>> {
        let (points, samples) = (&self.points, radar.samples_per_chirp);
        if !points.reference_m.is_empty() && form.is_fused(&points.displacement.x) {
            let to = self.walls.iter().map(|(wall, rows)| (rows.clone(), walls[*wall].position_m(), walls[*wall].waveform()));
            let all = fused::signals_apart(points, radar.tx_position_m(tx), &to.collect::<Vec<_>>(), samples);
            let [count, chirps, _] = all.dims();
            let of = |part: &Tensor<3>, index: usize| part.clone().narrow(0, index, 1).reshape([chirps, samples]);
            return (0..count).map(|index| Complex::new(of(&all.re, index), of(&all.im, index))).collect();
        }
        let of_wall = |(wall, rows): &(usize, Range<usize>)| {
            let displacement = points.displacement.rows(rows.clone());
            let amplitude = points.amplitude.rows(rows.clone());
            let reference_m = &points.reference_m[rows.clone()];
            let points = Points { reference_m, displacement: &displacement, amplitude: &amplitude };
            coherent_sum(&walls[*wall].phasors(points, radar, tx), samples, form)
        };
        self.walls.iter().map(of_wall).collect()
    }
}

fn stack(receivers: impl Iterator<Item = Complex<2>>) -> Complex<3> {
    let (re, im) = receivers.map(|signal| (signal.re, signal.im)).unzip();
    let stack = |parts: Vec<Tensor<2>>| Tensor::stack(parts, 0);
    Complex::new(stack(re), stack(im))
}

fn silence(points: &Points, radar: &Radar) -> Complex<3> {
    let [_, chirps] = points.displacement.dims();
    let (device, dtype) = (points.displacement.x.device(), points.displacement.x.dtype());
    let zeros = || Tensor::zeros([radar.rx_m.len(), chirps, radar.samples_per_chirp], (&device, dtype));
    Complex::new(zeros(), zeros())
}

#[cfg(test)]
#[path = "signals_tests.rs"]
pub(crate) mod tests;
