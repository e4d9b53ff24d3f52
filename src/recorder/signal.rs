//! The samples of a frame, or of its first loop, on their way through the effects.

use num_complex::Complex64;

use crate::radar::Radar;

/// `[tx, rx, loop, sample]` of one frame.
#[derive(Clone, Debug)]
pub struct Signal {
    pub frame: usize,
    pub tx: usize,
    pub rx: usize,
    pub loops: usize,
    pub samples: usize,
    pub values: Vec<Complex64>,
}

/// Which chirp of a frame.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub tx: usize,
    pub rx: usize,
    pub index: usize,
}

impl Signal {
    pub fn zero(frame: usize, radar: &Radar, loops: usize) -> Self {
        let (tx, rx, samples) = (radar.tx_m.len(), radar.rx_m.len(), radar.samples_per_chirp);
        Self { frame, tx, rx, loops, samples, values: vec![Complex64::ZERO; tx * rx * loops * samples] }
    }

    pub fn chirp(&self, place: Place) -> &[Complex64] {
        let start = self.start(place);
        &self.values[start..start + self.samples]
    }

    fn start(&self, place: Place) -> usize {
        ((place.tx * self.rx + place.rx) * self.loops + place.index) * self.samples
    }

    /// All chirps with their places, in the order of the samples.
    pub fn chirps_mut(&mut self) -> impl Iterator<Item = (Place, &mut [Complex64])> {
        let (rx, loops, samples) = (self.rx, self.loops, self.samples);
        self.values
            .chunks_exact_mut(samples)
            .enumerate()
            .map(move |(i, chirp)| (Place { tx: i / (rx * loops), rx: i / loops % rx, index: i % loops }, chirp))
    }

    /// The same for what every receiver got in one chirp: `mix(tx, index, [rx] values)` for each sample.
    pub fn mix_receivers(&mut self, mut mix: impl FnMut(Place, usize, &mut [Complex64])) {
        let mut values = vec![Complex64::ZERO; self.rx];
        for tx in 0..self.tx {
            for index in 0..self.loops {
                for sample in 0..self.samples {
                    let at = |rx: usize| ((tx * self.rx + rx) * self.loops + index) * self.samples + sample;
                    for (rx, value) in values.iter_mut().enumerate() {
                        *value = self.values[at(rx)];
                    }
                    mix(Place { tx, rx: 0, index }, sample, &mut values);
                    for (rx, value) in values.iter().enumerate() {
                        let place = ((tx * self.rx + rx) * self.loops + index) * self.samples + sample;
                        self.values[place] = *value;
                    }
                }
            }
        }
    }

    /// Without `guard` samples at either end of every chirp.
    pub fn cropped(self, guard: usize) -> Self {
        if guard == 0 {
            return self;
        }
        let samples = self.samples - 2 * guard;
        let values = self.values.chunks_exact(self.samples).flat_map(|chirp| &chirp[guard..guard + samples]).copied().collect();
        Self { samples, values, ..self }
    }

    /// Largest magnitude of a sample.
    pub fn peak(&self) -> f64 {
        self.values.iter().map(Complex64::norm_sqr).fold(0.0, f64::max).sqrt()
    }

    /// Largest magnitude of a component, which is what a converter's rail bounds.
    pub fn largest_component(&self) -> f64 {
        self.values.iter().map(|value| value.re.abs().max(value.im.abs())).fold(0.0, f64::max)
    }

    pub fn root_mean_square(&self) -> f64 {
        (self.values.iter().map(Complex64::norm_sqr).sum::<f64>() / self.values.len().max(1) as f64).sqrt()
    }
}
