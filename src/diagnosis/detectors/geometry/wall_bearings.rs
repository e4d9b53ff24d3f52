//! Static clutter, as the row of receivers sees it: the walls are where the room says, and so are the directions from which
//! returns of every range come.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::diagnosis::Evidence;
use crate::diagnosis::evidence::spectrum;
use crate::diagnosis::power::hann_power;
use crate::paths::distance;
use crate::scatterers::room_patches::RoomPatchesConfig;

/// Cross-section of rough walls by area, and power that a smooth one mirrors: what is ordinary.
const ROUGH: f64 = 0.03;
const SMOOTH: f64 = 0.1;
/// Of a range's power, what comes from anywhere.
const ELSEWHERE: f64 = 0.05;
/// Bins from one range to the next: windowed neighbours say the same.
const STEP: usize = 2;
/// Bins around it from which power leaks into a range.
const REACH: f64 = 6.0;
/// Power over the noise from which on a range is used.
const LEAST_POWER: f64 = 30.0;

/// One range: what the receivers observe of it, and how it is expected to be alike.
struct Cell {
    range_m: f64,
    /// By transmitter.
    observed: Vec<DVector<Complex64>>,
    /// Inverse of the expected covariance, up to a scale, `[rx, rx]`.
    inverse: DMatrix<Complex64>,
}

pub struct WallBearings {
    cells: Vec<Cell>,
}

impl WallBearings {
    /// None without a room.
    pub fn new(evidence: &Evidence) -> Option<Self> {
        let radar = &evidence.radar;
        let [_, transmitters, receivers, loops, samples] = evidence.cube.dims;
        let room = evidence.room.as_ref().filter(|room| !room.boundaries().is_empty())?;
        let patches = RoomPatchesConfig::default().init(room).ok()?;
        let (centre, wave) = (radar.centre_m(), TAU / radar.wavelength_m());
        let bin_m = radar.range_resolution_m();
        // Range in bins, cross-section over the fourth power of the range, and phases between receivers.
        let source = |at_m: [f64; 3], section: f64, range_m: f64| -> (f64, f64, DVector<Complex64>) {
            let way = |rx: usize| distance(at_m, radar.rx_position_m(rx)) - distance(at_m, radar.rx_position_m(0));
            let phases = DVector::from_fn(receivers, |rx, _| Complex64::cis(wave * way(rx)));
            (range_m / bin_m, section / range_m.powi(4), phases)
        };
        let rough = patches.position_m.iter().zip(&patches.normal).zip(&patches.area_m2).map(|((&at, normal), area)| {
            let range_m = distance(at, centre).max(1e-3);
            let cosine = (0..3).map(|axis| (centre[axis] - at[axis]) / range_m * normal[axis]).sum::<f64>().max(0.0);
            source(at, ROUGH * area * cosine, range_m)
        });
        let smooth = room.boundaries().into_iter().filter_map(|boundary| {
            let ((axis, side), distance_m) = (boundary.axis(), room.distance_m(boundary)?);
            // The radar's own image, behind the wall.
            let mut image = centre;
            image[axis] = 2.0 * side * distance_m - centre[axis];
            let range_m = (side * distance_m - centre[axis]).abs().max(1e-3);
            Some(source(image, SMOOTH * PI * range_m.powi(2), range_m))
        });
        let sources: Vec<_> = rough.chain(smooth).collect();
        let spectra: Vec<Vec<Complex64>> = evidence.clutter().chunks_exact(samples).map(spectrum).collect();
        let noise = evidence.total_noise() / (spectra.len() * loops * evidence.split.training.len()).max(1) as f64;
        let cell = |bin: usize| -> Option<Cell> {
            let mut expected = DMatrix::<Complex64>::zeros(receivers, receivers);
            for (at, power, phases) in sources.iter().filter(|source| (source.0 - bin as f64).abs() < REACH) {
                expected += phases * phases.adjoint() * Complex64::from(power * hann_power(at - bin as f64));
            }
            let power = expected.trace().re / receivers as f64;
            let observed: Vec<DVector<Complex64>> =
                (0..transmitters).map(|tx| DVector::from_fn(receivers, |rx, _| spectra[tx * receivers + rx][bin])).collect();
            let weakest = observed.iter().map(|observed| observed.norm_squared()).fold(f64::INFINITY, f64::min);
            if power <= 0.0 || weakest < LEAST_POWER * receivers as f64 * noise {
                return None;
            }
            let inverse = (expected / Complex64::from(power)
                + DMatrix::identity(receivers, receivers) * Complex64::from(ELSEWHERE))
            .try_inverse()?;
            Some(Cell { range_m: bin as f64 * bin_m, observed, inverse })
        };
        Some(Self {
            cells: (STEP..evidence.range_bins().min(samples / 2 + samples / 4)).step_by(STEP).filter_map(cell).collect(),
        })
    }

    /// Log-likelihood, up to a constant, if the receivers' phases are off by so many radians (of range and receiver). Every range's
    /// strength is free.
    pub fn log_likelihood(&self, off: impl Fn(f64, usize) -> f64) -> f64 {
        let of_cell = |cell: &Cell| -> f64 {
            let of_transmitter = |observed: &DVector<Complex64>| {
                let turned = DVector::from_fn(observed.len(), |rx, _| observed[rx] * Complex64::cis(-off(cell.range_m, rx)));
                -(observed.len() as f64) * turned.dotc(&(&cell.inverse * &turned)).re.max(f64::MIN_POSITIVE).ln()
            };
            // Transmitters see the same walls.
            cell.observed.iter().map(of_transmitter).sum::<f64>() / cell.observed.len().max(1) as f64
        };
        self.cells.iter().map(of_cell).sum()
    }
}
