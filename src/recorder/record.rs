//! A world put to work: frames of samples, one after the other.

use num_complex::Complex64;
use rayon::prelude::*;

use super::amplitude::{Laws, WallLaw};
use super::body::{MovingBody, smooth_field};
use super::mirror::Mirror;
use super::receiver::{Receiver, noise_for_snr, rail, random_phase};
use super::scatter::Scatter;
use super::surface::elements;
use super::surroundings::static_signal;
use super::world::{Draw, World};
use crate::data::{IfFrame, IfLayout};
use crate::error::Result;

/// Frames that are in memory together.
const MOST_AT_ONCE: usize = 16;
/// Frames from which the converter's scale is estimated.
const PREVIEWS: usize = 6;

/// Records one world, frame by frame. Equal worlds give equal samples, on any number of threads.
pub struct Recorder {
    world: World,
    scatter: Option<Scatter>,
    /// `[tx, rx, sample]`
    surroundings: Vec<Complex64>,
    receiver: Receiver,
}

impl Recorder {
    /// Prepares everything that all frames share.
    pub fn new(world: &World) -> Result<Self> {
        world.check()?;
        let laws = Laws {
            body: world.skin,
            walls: world.walls.image_coefficient.map_or(WallLaw::Fresnel(world.walls.material), WallLaw::Constant),
            antenna_exponent: world.antenna_exponent,
        };
        let scatter = world.person.is_some().then(|| body_scatter(world, laws)).transpose()?;
        let surroundings = static_signal(world, &laws);
        let receiver = settle_receiver(world, scatter.as_ref(), &surroundings)?;
        Ok(Self { world: world.clone(), scatter, surroundings, receiver })
    }

    pub fn world(&self) -> &World {
        &self.world
    }

    /// The body as the fast path and the reference see it; none in an empty room.
    pub fn scatter(&self) -> Option<&Scatter> {
        self.scatter.as_ref()
    }

    /// Field at the receiving antennas before the receiver, `[tx, rx, loop, sample]`.
    pub fn field(&self, frame: usize) -> Result<Vec<Complex64>> {
        let radar = &self.world.radar;
        let (loops, samples) = (radar.loops_per_frame, radar.samples_per_chirp);
        let mut field = match &self.scatter {
            Some(scatter) => scatter.frame(frame)?,
            None => vec![Complex64::ZERO; radar.dims()[1..].iter().product()],
        };
        for (channel, still) in field.chunks_exact_mut(loops * samples).zip(self.surroundings.chunks_exact(samples)) {
            for chirp in channel.chunks_exact_mut(samples) {
                for (value, echo) in chirp.iter_mut().zip(still) {
                    *value += echo;
                }
            }
        }
        Ok(field)
    }

    /// What the receiver makes of a frame.
    pub fn frame(&self, frame: usize) -> Result<IfFrame> {
        let [_, tx, rx, loops, samples] = self.world.radar.dims();
        let mut rng = self.world.random(Draw::Noise { frame });
        Ok(self.receiver.receive(&self.field(frame)?, [tx, rx, loops, samples], &mut rng))
    }

    /// All frames in order, several at a time on all cores. A frame that cannot be recorded ends the sequence with its error.
    pub fn frames(&self) -> impl Iterator<Item = Result<IfFrame>> + '_ {
        let (count, batch) = (self.world.radar.frames, rayon::current_num_threads().clamp(1, MOST_AT_ONCE));
        (0..count).step_by(batch).flat_map(move |start| {
            let frames = start..(start + batch).min(count);
            frames.into_par_iter().map(|frame| self.frame(frame)).collect::<Vec<_>>()
        })
    }

    /// How its frames are stored.
    pub fn layout(&self) -> IfLayout {
        self.receiver.layout()
    }
}

/// All frames of a world; `progress` hears how many of how many are done.
pub fn record(world: &World, progress: &mut dyn FnMut(usize, usize)) -> Result<Vec<IfFrame>> {
    let recorder = Recorder::new(world)?;
    let frames = recorder.frames().enumerate();
    frames.map(|(frame, samples)| samples.inspect(|_| progress(frame + 1, world.radar.frames))).collect()
}

fn body_scatter(world: &World, laws: Laws) -> Result<Scatter> {
    let Some(person) = &world.person else { unreachable!("asked for only with a person") };
    let mut body = MovingBody::new(person, world.interpolation)?;
    body.displace(world.mesh_error_m, &mut world.random(Draw::MeshError));
    let surface = &world.surface;
    let mut variation = smooth_field(body.rest(), surface.variation_scale_m, &mut world.random(Draw::Reflectivity));
    variation.iter_mut().for_each(|db| *db *= surface.variation_db);
    let elements = elements(body.rest(), &body.faces, &variation, surface, &mut world.random(Draw::Elements));
    let mut scatter = Scatter::new(&world.radar, body, elements, surface.smoothing, laws);
    scatter.mirrors = Mirror::images(&world.room, &world.image_walls(), world.walls.images);
    scatter.order = world.walls.images;
    Ok(scatter)
}

/// Scales the strongest sample to a part of full scale and finds the noise for the signal-to-noise ratio.
fn settle_receiver(world: &World, scatter: Option<&Scatter>, surroundings: &[Complex64]) -> Result<Receiver> {
    let (radar, config) = (&world.radar, &world.receiver);
    let samples = radar.samples_per_chirp;
    let largest = |signal: &[Complex64]| signal.iter().map(|value| value.re.abs().max(value.im.abs())).fold(0.0, f64::max);
    let mut peak = largest(surroundings);
    if let Some(scatter) = scatter {
        let count = PREVIEWS.min(radar.frames);
        for preview in 0..count {
            let frame = preview * (radar.frames - 1) / (count - 1).max(1);
            let mut first = scatter.first_loop(frame)?;
            for (chirp, still) in first.chunks_exact_mut(samples).zip(surroundings.chunks_exact(samples)) {
                chirp.iter_mut().zip(still).for_each(|(value, echo)| *value += echo);
            }
            peak = peak.max(largest(&first));
        }
    }
    let noise = match scatter {
        Some(scatter) if config.noise => noise_for_snr(&scatter.frame(0)?, radar, config.snr_db),
        // Without a body the ratio is to what stands still.
        None if config.noise => {
            let chirps: Vec<Complex64> =
                surroundings.chunks_exact(samples).flat_map(|chirp| chirp.repeat(radar.loops_per_frame)).collect();
            noise_for_snr(&chirps, radar, config.snr_db)
        }
        _ => 0.0,
    };
    let scale = if peak > 0.0 { config.peak_fraction * rail(radar) / peak } else { 1.0 };
    let phase = if config.unknown_phase { random_phase(&mut world.random(Draw::Gain)) } else { Complex64::ONE };
    Ok(Receiver { sampling: radar.sampling, gain: phase * scale, noise_codes: noise * scale, adc: config.adc, rail: rail(radar) })
}
