//! Groups of ranges, and what a deviation means at them.

use std::f64::consts::TAU;
use std::ops::Range;

use num_complex::Complex64;

use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::support::UNKNOWN_NEAR_M;
use crate::radar::SPEED_OF_LIGHT;
use crate::room::Room;

/// Range cells whose gain is estimated together.
#[derive(Clone, Debug)]
pub struct Group {
    /// Mean delay of its static returns, weighted by their power.
    pub delay_s: f64,
    /// Cosine to the boresight, mean over what the room has at that range; one where the room is not known, and zero for what moves
    /// with the radar.
    pub ahead: f64,
    /// Its beat-frequency bins.
    pub bins: Range<usize>,
}

/// Which part of the deviation is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Logarithm of the gain.
    Gain,
    /// Phase that is the same at all ranges.
    Phase,
    /// Phase in proportion to the delay: an error of the local oscillator. Stated per second of delay.
    Delay,
    /// Phase in proportion to the cosine to the boresight, along which the radar moves.
    Boresight,
}

/// Share that is uncertain of an amplitude along the boresight: how much returns from where is not known.
pub const PATTERN: f64 = 0.2;

/// Mean cosine of a group below which most of it moves with the radar.
const OWN: f64 = 0.5;

impl Group {
    /// Of some bins, of which `strong` hold static returns of a power each. None where nothing does.
    pub fn of(evidence: &Evidence, bins: Range<usize>, strong: &[usize], power: impl Fn(usize) -> f64) -> Option<Self> {
        let radar = &evidence.radar;
        let delay_of_bin = radar.sample_rate_hz / (evidence.cube.dims[4] as f64 * radar.slope_hz_per_s);
        let sum: f64 = strong.iter().map(|&bin| power(bin)).sum();
        let mean = |of: &dyn Fn(usize) -> f64| strong.iter().map(|&bin| power(bin) * of(bin)).sum::<f64>() / sum;
        let ahead_at = |bin: usize| ahead(evidence.room.as_ref(), 0.5 * SPEED_OF_LIGHT * bin as f64 * delay_of_bin);
        (sum > 0.0).then(|| Self { delay_s: mean(&|bin| bin as f64) * delay_of_bin, ahead: mean(&ahead_at), bins })
    }

    /// Whether it is the radar's own leakage, for the most part.
    pub fn is_own(&self) -> bool {
        self.ahead < OWN
    }
}

impl Part {
    /// What a value of one means at some ranges.
    pub fn lever(self, group: &Group) -> f64 {
        match self {
            Part::Gain | Part::Phase => 1.0,
            Part::Delay => group.delay_s,
            Part::Boresight => group.ahead,
        }
    }

    /// A part that is read from the other component of the same deviations.
    pub fn other(self) -> Self {
        if self == Part::Gain { Part::Phase } else { Part::Gain }
    }

    /// The complex deviation that a value means there.
    pub fn deviation(self, value: f64, group: &Group) -> Complex64 {
        let value = value * self.lever(group);
        if self == Part::Gain { value.into() } else { Complex64::new(0.0, value) }
    }
}

/// Mean cosine to the boresight of what the room's surfaces before the radar return from a range: of the ring that each of them
/// has there, as rough surfaces return by the sine of grazing (constant γ), seen by antennas of one gain in all directions. Zero for what is
/// nearer than anything: the radar's own leakage moves with it.
pub fn ahead(room: Option<&Room>, range_m: f64) -> f64 {
    const DIRECTIONS: usize = 48;
    if range_m < UNKNOWN_NEAR_M {
        return 0.0;
    }
    let Some(room) = room else { return 1.0 };
    let (low, high) = room.extent_m(range_m);
    let (mut sum, mut all) = (0.0, 0.0);
    for boundary in room.boundaries() {
        let (axis, sign) = boundary.axis();
        let Some(distance) = room.distance_m(boundary).filter(|&distance| distance < range_m) else { continue };
        let radius = (range_m * range_m - distance * distance).sqrt();
        for direction in 0..DIRECTIONS {
            let (sine, cosine) = (TAU * (direction as f64 + 0.5) / DIRECTIONS as f64).sin_cos();
            let mut place = [0.0; 3];
            (place[axis], place[(axis + 1) % 3], place[(axis + 2) % 3]) = (sign * distance, radius * cosine, radius * sine);
            let inside = (0..3).filter(|&other| other != axis).all(|other| (low[other]..=high[other]).contains(&place[other]));
            let cosine = place[1] / range_m;
            if inside && cosine > 0.0 {
                let weight = distance / range_m;
                (sum, all) = (sum + weight * cosine, all + weight);
            }
        }
    }
    if all > 0.0 { sum / all } else { 1.0 }
}
