//! Radars that people have.

use super::{Radar, SPEED_OF_LIGHT, Sampling};

impl Radar {
    /// The mmMesh set-up: a TI AWR1843BOOST, its transmitters fired in the order 0, 2, 1, 10 frames per second.
    ///
    /// The board's receivers are half a wavelength apart; transmitters 0 and 2 lie four half wavelengths apart
    /// on the same line, transmitter 1 halfway between them and half a wavelength higher.
    pub fn mmmesh(frames: usize) -> Self {
        let half = SPEED_OF_LIGHT / 77.0e9 / 2.0;
        Self {
            start_frequency_hz: 77.0e9,
            slope_hz_per_s: 60.012e12,
            sample_rate_hz: 4.4e6,
            sampling: Sampling::Complex,
            samples_per_chirp: 256,
            loops_per_frame: 128,
            adc_start_s: 6.0e-6,
            chirp_period_s: 72.0e-6,
            frame_period_s: 0.1,
            frames,
            position_m: [0.0; 3],
            tx_m: vec![[-12.0 * half, 0.0, 0.0], [-8.0 * half, 0.0, 0.0], [-10.0 * half, 0.0, half]],
            rx_m: (0..4).map(|rx| [rx as f64 * half - 1.5 * half, 0.0, 0.0]).collect(),
            full_scale_codes: Some(32767.0),
        }
    }

    /// The same chirp made small for tests: one transmitter, two receivers, 32 samples, 16 loops.
    ///
    /// The sampling rate is kept, so range bins are eight times coarser: 0.34 m, up to 11 m.
    pub fn small(frames: usize) -> Self {
        let full = Self::mmmesh(frames);
        Self {
            samples_per_chirp: 32,
            loops_per_frame: 16,
            chirp_period_s: 216.0e-6,
            tx_m: vec![[0.0; 3]],
            rx_m: full.rx_m[..2].to_vec(),
            ..full
        }
    }
}
