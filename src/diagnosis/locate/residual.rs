//! Measured over expected power, cell by cell.

use crate::diagnosis::Evidence;
use crate::diagnosis::power::CLUTTER_BINS;
use crate::grid::Grid;

/// Σ |correlation|² of neighbouring cells of two Hann windows.
pub const CELLS_PER_VALUE: f64 = 3.78;

/// Powers of the moving part over what is expected of body and noise, `[frame, doppler, range]`.
pub struct Residual {
    /// Beat frequencies that exist.
    pub bins: usize,
    /// Mean 1 under the null; NaN never: cells that mean nothing have weight zero.
    pub ratio: Grid<f32, 3>,
    /// Independent values that a cell counts for: one per channel where there is noise, fewer where the body's speckle is
    /// the same in all channels, none where nothing can be said.
    pub count: Grid<f32, 3>,
}

impl Residual {
    /// None for an empty recording.
    pub fn new(evidence: &Evidence) -> Option<Self> {
        let [frames, _, _, loops, samples] = evidence.cube.dims;
        let (size, bins) = (loops * samples, evidence.range_bins());
        if frames == 0 || size == 0 {
            return None;
        }
        let (maps, model, noise_bins) = (evidence.maps(), evidence.power(), evidence.noise_bins());
        let channels = evidence.cube.channels() as f32;
        let mut ratio = maps.clone();
        let mut count = Grid::filled(["frame", "doppler", "range"], maps.shape(), 0.0);
        for frame in 0..frames {
            let (ratio, count) = (ratio.below_mut([frame]), count.below_mut([frame]));
            let expected = model.as_ref().map(|model| model.expected(frame));
            let support = model.as_ref().map(|model| model.support(frame));
            for cell in 0..size {
                let (doppler, range) = (cell / samples, cell % samples);
                let in_clutter = loops >= 8 && doppler.min(loops - doppler) <= CLUTTER_BINS;
                if !noise_bins.contains(&range) || in_clutter || !ratio[cell].is_finite() {
                    ratio[cell] = 1.0;
                    continue;
                }
                count[cell] = channels / CELLS_PER_VALUE as f32;
                if let (Some(expected), Some(support)) = (expected, support)
                    && support[cell]
                {
                    // The template is good to a factor, speckle is one draw for many channels: a cell of the body
                    // counts only for what is far beyond it.
                    let mean = expected[cell].max(1.0);
                    ratio[cell] = (ratio[cell] / (BODY_FACTOR * mean)).min(1e6);
                    let independent = model.as_ref().map_or(1.0, |model| model.independent as f32);
                    count[cell] = independent / CELLS_PER_VALUE as f32;
                    if ratio[cell] < 1.0 {
                        // Below the bound nothing is said, neither for nor against.
                        (ratio[cell], count[cell]) = (1.0, 0.0);
                    }
                }
            }
        }
        Some(Self { bins, ratio, count })
    }

    /// Frames, Doppler and range bins.
    pub fn shape(&self) -> [usize; 3] {
        self.ratio.shape()
    }
}

/// The body's expected power is trusted to this factor.
pub const BODY_FACTOR: f32 = 10.0;
