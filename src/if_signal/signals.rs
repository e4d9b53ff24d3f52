//! What each receiver samples: the sum of all direct paths, and of all paths by way of one wall receiver.

use burn::tensor::Tensor;

use super::{SumForm, coherent_sum, fused};
use crate::complex::Complex;
use crate::paths::{Dechirp, DirectPaths, IndirectPaths, Points, Waveform, onward};
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
        return fused::signal(&points, radar.tx_position_m(tx), &receivers, &waveform, radar.samples_per_chirp);
    }
    let paths = DirectPaths::new(points, radar, tx, dechirp);
    stack((0..radar.rx_m.len()).map(|rx| coherent_sum(&paths.phasors(rx), radar.samples_per_chirp, form)))
}

/// Signal of one transmitter by way of one wall receiver at `proxy_m` (eq. 3).
///
/// # Shapes
/// points `[point, chirp]`, their amplitude that towards the wall's receiver; result `[rx, chirp, sample]`.
///
/// # Gradient
/// Flows to amplitude and displacement.
pub fn indirect_signal(
    points: Points,
    proxy_m: [f64; 3],
    radar: &Radar,
    tx: usize,
    dechirp: Dechirp,
    form: SumForm,
) -> Complex<3> {
    if points.reference_m.is_empty() {
        return silence(&points, radar);
    }
    let samples = radar.samples_per_chirp;
    let (at_wall, onward) = if form.is_fused(&points.displacement.x) {
        let (waveform, onward) = onward(proxy_m, radar, dechirp);
        let at_wall = fused::signal(&points, radar.tx_position_m(tx), &[proxy_m], &waveform, samples);
        let [_, chirps, _] = at_wall.dims();
        (at_wall.reshape([chirps, samples]), onward)
    } else {
        let paths = IndirectPaths::new(points, proxy_m, radar, tx, dechirp);
        (coherent_sum(&paths.at_wall, samples, form), paths.onward)
    };
    stack(onward.iter().map(|onward| onward.apply(at_wall.clone())))
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
