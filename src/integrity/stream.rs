//! A frame as the converter sent it.

use num_complex::{Complex32, Complex64};

use crate::data::IfFrame;
use crate::radar::{Radar, Sampling};
use crate::room::Room;

/// The axes of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Schedule {
    pub tx: usize,
    pub rx: usize,
    pub loops: usize,
    pub samples: usize,
    pub is_real: bool,
    /// A falling chirp: nearer returns have the smaller negative beat frequency.
    pub is_falling: bool,
    /// Range bin of the room's farthest corner; none where the room is unknown.
    pub farthest_bin: Option<f64>,
}

/// Where a sample is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    pub frame: usize,
    pub index: usize,
    pub tx: usize,
    pub rx: usize,
    pub sample: usize,
}

impl Schedule {
    pub fn of(radar: &Radar, room: Option<&Room>) -> Self {
        let [_, tx, rx, loops, samples] = radar.dims();
        let (is_real, is_falling) = (radar.sampling == Sampling::Real, radar.slope_hz_per_s < 0.0);
        let farthest_bin = room.and_then(Room::farthest_m).map(|far| far / radar.range_resolution_m());
        Self { tx, rx, loops, samples, is_real, is_falling, farthest_bin }
    }

    pub fn channels(&self) -> usize {
        self.tx * self.rx
    }

    /// Samples of one loop over all transmitters and receivers: a static scene repeats itself with this period.
    pub fn period(&self) -> usize {
        self.channels() * self.samples
    }

    /// Of a sample counted through the stream of all frames.
    pub fn spot(&self, place: usize) -> Spot {
        let (chirp, sample) = (place / self.samples, place % self.samples);
        let (row, rx) = (chirp / self.rx, chirp % self.rx);
        let (index, tx) = (row / self.tx, row % self.tx);
        Spot { frame: index / self.loops, index: index % self.loops, tx, rx, sample }
    }

    /// Frame, transmitter, receiver and loop of every chirp that some samples of the stream touch.
    pub fn chirps(&self, places: std::ops::Range<usize>) -> impl Iterator<Item = [usize; 4]> {
        (places.start / self.samples..places.end.div_ceil(self.samples)).map(|chirp| {
            let Spot { frame, index, tx, rx, .. } = self.spot(chirp * self.samples);
            [frame, tx, rx, index]
        })
    }
}

impl std::fmt::Display for Spot {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "frame {}, loop {}, tx {}, rx {}, sample {}", self.frame, self.index, self.tx, self.rx, self.sample)
    }
}

/// One frame's samples in the order in which they were taken: `[loop, tx, rx, sample]`.
pub(super) struct Stream {
    pub frame: usize,
    pub schedule: Schedule,
    pub values: Vec<Complex32>,
}

impl Stream {
    pub fn of(schedule: Schedule, frame: usize, samples: &IfFrame) -> Self {
        let Schedule { tx, rx, loops, samples: length, .. } = schedule;
        let mut values = Vec::with_capacity(samples.re.len());
        for index in 0..loops {
            for channel in 0..tx * rx {
                let start = samples.position(channel / rx, channel % rx, index, 0);
                match &samples.im {
                    Some(im) => {
                        let pairs = samples.re[start..start + length].iter().zip(&im[start..start + length]);
                        values.extend(pairs.map(|(&re, &im)| Complex32::new(re, im)));
                    }
                    None => values.extend(samples.re[start..start + length].iter().map(|&re| Complex32::new(re, 0.0))),
                }
            }
        }
        Self { frame, schedule, values }
    }

    /// All values without their mean.
    pub fn centred(&self) -> Vec<Complex64> {
        let values = || self.values.iter().map(|v| Complex64::new(v.re.into(), v.im.into()));
        let mean = values().sum::<Complex64>() / self.values.len() as f64;
        values().map(|value| value - mean).collect()
    }

    /// `[tx, rx, sample]` of each loop.
    pub fn loops(&self) -> impl Iterator<Item = &[Complex32]> {
        self.values.chunks_exact(self.schedule.period())
    }

    /// `[rx, sample]` of each chirp, with its loop and its transmitter.
    pub fn chirps(&self) -> impl Iterator<Item = (usize, usize, &[Complex32])> {
        let Schedule { tx, rx, samples, .. } = self.schedule;
        self.values.chunks_exact(rx * samples).enumerate().map(move |(chirp, values)| (chirp / tx, chirp % tx, values))
    }
}
