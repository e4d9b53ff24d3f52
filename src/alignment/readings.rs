//! What moves in a recording: complex cells of all channels over range and Doppler, in units of the noise.

use num_complex::Complex32;
use rayon::prelude::*;

use crate::diagnosis::{Evidence, Split, power};
use crate::radar::Radar;
use crate::room::Room;

/// Shortest extent of the array in wavelengths along which a direction is estimable: the phase between its ends then turns by a
/// quarter of a turn from one side to the other.
const APERTURE: f64 = 0.125;
/// Farthest body where no room says less, metres.
const FARTHEST_M: f64 = 12.0;

/// A recording's moving cells. The mean over the training frames is taken out of every channel, as the diagnosis does it.
pub struct Readings {
    pub radar: Radar,
    room: Option<Room>,
    pub cells: power::Cells,
    pub split: Split,
    /// Radar time of the middle of every frame.
    pub middle_s: Vec<f64>,
    /// Cells away from static clutter, `[doppler, range]`.
    pub usable: Vec<bool>,
    /// Mean over the channels, `[frame, doppler, range]`.
    power: Vec<f32>,
    /// `[frame, doppler, range, channel]`
    fields: Vec<Complex32>,
    /// Of every channel (tx · rx): place of transmitter and receiver together, and how much later it fires than the first.
    pub channels: Vec<([f64; 3], f64)>,
    /// Phase per metre at the middle of the ramp.
    pub wave: f64,
}

impl Readings {
    pub fn new(evidence: &Evidence) -> Self {
        let radar = evidence.radar.clone();
        let [frames, tx, rx, loops, samples] = evidence.cube.dims;
        let (size, count) = (loops * samples, tx * rx);
        let cells = power::Cells::new(&radar);
        let (maps, noise) = (evidence.maps(), evidence.noise());
        let fields = (0..frames)
            .into_par_iter()
            .flat_map_iter(|frame| {
                let map = maps.below([frame]);
                let mut fields = vec![Complex32::default(); size * count];
                for (channel, noise) in noise.iter().enumerate() {
                    let scale = 1.0 / noise.max(f64::MIN_POSITIVE).sqrt();
                    for (cell, value) in evidence.range_doppler(frame, channel).into_iter().enumerate() {
                        fields[cell * count + channel] = Complex32::new((value.re * scale) as f32, (value.im * scale) as f32);
                    }
                }
                // Where a filter has shaped the noise, the maps are flat.
                for (cell, fields) in fields.chunks_exact_mut(count).enumerate() {
                    let mean = fields.iter().map(|field| field.norm_sqr()).sum::<f32>() / count as f32;
                    let scale = (map[cell] / mean.max(f32::MIN_POSITIVE)).sqrt();
                    fields.iter_mut().for_each(|field| *field *= scale);
                }
                fields
            })
            .collect();
        let channel = |index: usize| {
            let (transmitter, receiver) = (radar.tx_m[index / rx], radar.rx_m[index % rx]);
            let place = std::array::from_fn(|axis| transmitter[axis] + receiver[axis]);
            (place, (index / rx) as f64 * radar.chirp_period_s)
        };
        let half_s = 0.5 * radar.frame_duration_s();
        Self {
            channels: (0..count).map(channel).collect(),
            wave: std::f64::consts::TAU / radar.wavelength_m(),
            usable: power::usable(&cells),
            middle_s: evidence.starts_s.iter().map(|start| start + half_s).collect(),
            split: evidence.split.clone(),
            room: evidence.room.clone(),
            power: maps.values().to_vec(),
            fields,
            cells,
            radar,
        }
    }

    pub fn frames(&self) -> usize {
        self.middle_s.len()
    }

    /// Cells of a frame.
    pub fn size(&self) -> usize {
        self.cells.loops * self.cells.samples
    }

    /// Mean power of a frame's cells over the noise, `[doppler, range]`.
    pub fn power(&self, frame: usize) -> &[f32] {
        &self.power[frame * self.size()..][..self.size()]
    }

    /// All channels of one cell.
    pub fn field(&self, frame: usize, cell: usize) -> &[Complex32] {
        let count = self.channels.len();
        &self.fields[(frame * self.size() + cell) * count..][..count]
    }

    /// Whether directions along an axis show in the phases between channels.
    pub fn resolves(&self, axis: usize) -> bool {
        let ends = self
            .channels
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (place, _)| [low.min(place[axis]), high.max(place[axis])]);
        self.channels.len() > 1 && ends[1] - ends[0] >= APERTURE * self.radar.wavelength_m()
    }

    /// Variance of the channels' places along an axis, m².
    pub fn spread_m2(&self, axis: usize) -> f64 {
        let count = self.channels.len() as f64;
        let mean = self.channels.iter().map(|(place, _)| place[axis]).sum::<f64>() / count;
        self.channels.iter().map(|(place, _)| (place[axis] - mean).powi(2)).sum::<f64>() / count
    }

    /// Phase of a channel for a direction (unit vector) and a radial velocity: the array phase falls towards the direction, and a
    /// channel that fires later sees the body farther along.
    pub fn phase(&self, channel: usize, direction: [f64; 3], velocity_mps: f64) -> f64 {
        let (place, later_s) = self.channels[channel];
        let towards: f64 = (0..3).map(|axis| place[axis] * direction[axis]).sum();
        self.wave * (2.0 * velocity_mps * later_s - towards)
    }

    /// Farthest that a body may be: whoever is in the room is nearer than its corners, and ranges beyond the unambiguous are others.
    pub fn farthest_m(&self) -> f64 {
        let sides = self.room.as_ref().and_then(|room| Some([room.front_m?, room.left_m?.max(room.right_m?)]));
        let corner = sides.map_or(FARTHEST_M, |[ahead, aside]| ahead.hypot(aside));
        corner.min(self.cells.bins as f64 / self.cells.bins_per_m)
    }
}
