//! Random numbers: what they are drawn for, each in its own stream, so that one switch does not move the others.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The random numbers of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stream {
    pub id: u64,
    /// Whether its draws are another one in each recording of the same truth.
    pub is_noise: bool,
}

impl Stream {
    pub const fn new(id: u64) -> Self {
        Self { id, is_noise: false }
    }

    pub const fn of_noise(id: u64) -> Self {
        Self { id, is_noise: true }
    }
}

#[derive(Clone, Copy, Debug)]
pub enum Draw {
    MeshError,
    Reflectivity,
    Elements,
    Clutter,
    Gain,
    Noise {
        frame: usize,
    },
    /// What an effect draws in a frame.
    Effect {
        stream: Stream,
        frame: usize,
    },
}

/// The seeds of a world.
#[derive(Clone, Copy, Debug)]
pub struct Draws {
    pub seed: u64,
    pub noise_seed: Option<u64>,
    pub redraw: u64,
    pub other_skin: u64,
}

impl Draws {
    pub fn random(&self, draw: Draw) -> ChaCha8Rng {
        let number = match draw {
            Draw::MeshError => 1,
            Draw::Reflectivity => 2,
            Draw::Elements => 3,
            Draw::Clutter => 4,
            Draw::Gain => 5,
            Draw::Noise { frame } => 1000 + frame as u64,
            Draw::Effect { stream, frame } => ((1 + stream.id) << 40) + frame as u64,
        };
        let again = match draw {
            Draw::Noise { .. } => true,
            Draw::Effect { stream, .. } => stream.is_noise,
            _ => false,
        };
        let redraw = match draw {
            Draw::MeshError | Draw::Noise { .. } => self.redraw,
            Draw::Reflectivity | Draw::Elements => self.other_skin,
            _ => 0,
        };
        let seed = if again { self.noise_seed.unwrap_or(self.seed) } else { self.seed };
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(number + (redraw << 24));
        rng
    }

    /// What an effect draws in a frame.
    pub fn of_effect(&self, stream: Stream, frame: usize) -> ChaCha8Rng {
        self.random(Draw::Effect { stream, frame })
    }

    /// A phase that an effect has, radians; `index` tells its instances apart.
    pub fn phase(&self, stream: Stream, index: usize) -> f64 {
        self.of_effect(stream, (1 << 30) + index).random_range(0.0..std::f64::consts::TAU)
    }
}
