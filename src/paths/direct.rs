//! Transmitter → scatterer → receiver (paper, eq. 1 and 2).

use super::{Amplitude, Dechirp, Leg, Motion, Phasors, Points, Waveform};
use crate::radar::Radar;

/// The direct paths of one transmitter. All receivers share its leg; each receiver's phasors are made when asked for,
/// so that only one receiver's are alive at a time.
pub struct DirectPaths<'a> {
    motion: Motion<'a>,
    amplitude: &'a Amplitude,
    radar: &'a Radar,
    waveform: Waveform,
    from_tx: Leg,
}

impl<'a> DirectPaths<'a> {
    /// Prepares the leg from transmitter `tx` to all points. Gradients flow to the points' displacement and amplitude.
    pub fn new(points: Points<'a>, radar: &'a Radar, tx: usize, dechirp: Dechirp) -> Self {
        let motion = Motion::new(points.reference_m, points.displacement);
        let from_tx = motion.leg(radar.tx_position_m(tx));
        Self { motion, amplitude: points.amplitude, radar, waveform: Waveform::new(radar, dechirp), from_tx }
    }

    /// `[point, chirp]`, at one receiver.
    pub fn phasors(&self, rx: usize) -> Phasors {
        let to_rx = self.motion.leg(self.radar.rx_position_m(rx));
        self.waveform.phasors(&[&self.from_tx, &to_rx], self.amplitude)
    }
}
