//! A world put to work: frames of samples, one after the other.

use num_complex::Complex64;
use rayon::prelude::*;

use super::chirp::{Chirp, widened};
use super::draws::Draw;
use super::effects::EffectsConfig;
use super::paths::{Paths, body_scatter};
use super::receiver::{Level, Receiver, noise_for_snr, rail, random_phase};
use super::scatter::Scatter;
use super::signal::Signal;
use super::stages::{Chain, Mover, Stage, Stages, damage, movers, shape_noise, vibration};
use super::world::World;
use crate::data::{IfFrame, IfLayout};
use crate::error::Result;
use crate::radar::Radar;

/// Frames that are in memory together.
const MOST_AT_ONCE: usize = 16;
/// Frames from which the converter's scale is estimated.
const PREVIEWS: usize = 32;

/// Records one world, frame by frame. Equal worlds give equal samples, on any number of threads.
pub struct Recorder {
    world: World,
    stages: Stages,
    paths: Paths,
    /// The board as a receiver, and as a transmitter (`object_radar_object`).
    board: Option<[(Paths, Radar); 2]>,
    movers: Vec<Mover>,
    /// What amplitudes of added reflectors are relative to.
    body: f64,
    /// The peak sample before the receiver, without effects of the receiver: what relative levels are relative to.
    peak: f64,
    chain: Chain,
    /// That nobody knows; the mixer comes before what may be wrong with its two outputs.
    phase: Complex64,
    receiver: Receiver,
}

impl Recorder {
    /// Prepares everything that all frames share.
    pub fn new(world: &World) -> Result<Self> {
        world.check()?;
        let stages = Stages::new(world);
        let scatter = body_scatter(world, &stages, &stages.radar)?;
        // The receiver of another recording needs no scale of its own.
        let previews = if world.receiver.level.is_some() { vec![] } else { preview_frames(world, scatter.is_some()) };
        let body = |frame: usize| -> Result<Signal> {
            let mut signal = Signal::zero(frame, &stages.wide, 1);
            if let Some(scatter) = &scatter {
                signal.values = super::paths::body_values(scatter, frame, 1)?;
            }
            Ok(signal)
        };
        let bodies = previews.iter().map(|&frame| body(frame)).collect::<Result<Vec<Signal>>>()?;
        let own = || bodies.iter().map(Signal::root_mean_square).fold(0.0, f64::max);
        let mut level = world.receiver.level.map_or_else(own, |level| level.body);
        let mut paths = Paths::new(world, scatter, &stages.wide, level)?;
        if level == 0.0 {
            level = largest(paths.surroundings.still());
            paths = Paths::new(world, paths.scatter, &stages.wide, level)?;
        }
        let movers = movers(world, paths.scatter.as_ref().map(|scatter| &scatter.body), level)?;
        let board = if world.effects.object_radar_object.is_some() { Some(board_paths(world, &stages, level)?) } else { None };
        let chain = stages.chain(world, 0.0);
        let receiver = Receiver {
            sampling: world.radar.sampling,
            gain: Complex64::ONE,
            noise_codes: 0.0,
            adc: world.receiver.adc,
            clips: world.receiver.adc,
            rail: rail(&world.radar),
        };
        let unknown = || random_phase(&mut world.random(Draw::Gain));
        let phase = if world.receiver.unknown_phase { unknown() } else { Complex64::ONE };
        let mut recorder =
            Self { world: world.clone(), stages, paths, board, movers, body: level, peak: 0.0, chain, phase, receiver };
        recorder.settle(&bodies)?;
        Ok(recorder)
    }

    /// The world that is recorded.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The body as the fast path and the reference see it; none in an empty room.
    pub fn scatter(&self) -> Option<&Scatter> {
        self.paths.scatter.as_ref()
    }

    /// What the effects have prepared.
    pub fn stages(&self) -> &Stages {
        &self.stages
    }

    /// The peak sample that relative levels are relative to, in the unit of [`Recorder::field`].
    pub fn peak(&self) -> f64 {
        self.peak
    }

    /// The board's gain and noise, for other recordings with the same.
    pub fn level(&self) -> Level {
        Level { body: self.body, peak: self.peak, gain: self.receiver.gain.re, noise_codes: self.receiver.noise_codes }
    }

    /// The IF before noise and converter, `[tx, rx, loop, sample]`, in units of the transmitted wave.
    pub fn field(&self, frame: usize) -> Result<Vec<Complex64>> {
        let body = self.paths.body(frame, &self.stages.wide, self.world.radar.loops_per_frame)?;
        Ok(self.received(body)?.values)
    }

    /// All paths, wide, for a body that is there already.
    fn all_paths(&self, mut signal: Signal) -> Result<Signal> {
        self.stages.multibounce(&self.world.effects, &mut signal);
        self.paths.add_surroundings(&self.stages, &mut signal)?;
        Ok(signal)
    }

    /// From the body's wide signal to the converter's input.
    fn received(&self, body: Signal) -> Result<Signal> {
        let (frame, loops) = (body.frame, body.loops);
        let mut signal = self.all_paths(body)?;
        let antennas = vibration(&self.world);
        let chirp = Chirp::new(&self.stages.wide);
        let stage = Stage {
            radar: &self.stages.radar,
            chirp: &chirp,
            clock: &self.stages.clock,
            body: self.paths.scatter.as_ref().map(|scatter| &scatter.body),
            vibration: antennas.as_ref(),
        };
        self.movers.iter().try_for_each(|mover| mover.add(&stage, &mut signal))?;
        if let (Some([out, back]), Some(effect)) = (&self.board, &self.world.effects.object_radar_object)
            && self.peak > 0.0
        {
            let beam = |(paths, wide): &(Paths, Radar)| -> Result<Signal> {
                let mut beam = paths.body(frame, wide, loops)?;
                paths.add_surroundings(&self.stages, &mut beam)?;
                Ok(beam)
            };
            let (radar, resampler) = (&self.stages.radar, &self.stages.resampler);
            let again = effect.twice_bounced(&beam(out)?, &beam(back)?, radar, resampler, self.peak);
            signal.values.iter_mut().zip(again.values).for_each(|(value, bounce)| *value += bounce);
        }
        let mut signal = self.stages.apply(&self.world, self.peak, signal);
        signal.values.iter_mut().for_each(|value| *value *= self.phase);
        self.chain.apply(&self.world, &mut signal);
        Ok(signal)
    }

    /// What the receiver makes of a frame.
    pub fn frame(&self, frame: usize) -> Result<IfFrame> {
        let [_, tx, rx, loops, samples] = self.world.radar.dims();
        let mut rng = self.world.random(Draw::Noise { frame });
        let field = self.field(frame)?;
        let mut noise = Signal { frame, tx, rx, loops, samples, values: self.receiver.noise(field.len(), &mut rng) };
        if self.receiver.noise_codes > 0.0 {
            shape_noise(&self.world, self.receiver.noise_codes, &mut noise);
        }
        let mut written = self.receiver.convert(&field, &noise.values, [tx, rx, loops, samples]);
        damage(&self.world.effects, frame, &mut written);
        Ok(written)
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

    /// The body's return in frame 0 as it were without effects: no effect of the scene changes the receiver's noise.
    fn plain_body(&self) -> Result<Vec<Complex64>> {
        let loops = self.world.radar.loops_per_frame;
        if self.world.effects.is_off() {
            let body = self.paths.body(0, &self.stages.wide, loops)?;
            return Ok(body.cropped(self.stages.guard()).values);
        }
        let plain = World { effects: EffectsConfig::default(), ..self.world.clone() };
        let stages = Stages::new(&plain);
        let mut body = Signal::zero(0, &stages.wide, loops);
        if let Some(scatter) = body_scatter(&plain, &stages, &stages.radar)? {
            body.values = super::paths::body_values(&scatter, 0, loops)?;
        }
        Ok(body.cropped(stages.guard()).values)
    }

    /// Scales the strongest sample to a part of full scale and finds the noise for the signal-to-noise ratio.
    fn settle(&mut self, bodies: &[Signal]) -> Result<()> {
        let (world, guard) = (self.world.clone(), self.stages.guard());
        let (radar, config) = (&world.radar, &world.receiver);
        if let Some(level) = config.level {
            self.peak = level.peak;
            self.chain = self.stages.chain(&world, level.peak);
            self.receiver.gain = level.gain.into();
            self.receiver.noise_codes = level.noise_codes;
            self.receiver.clips = config.adc || world.effects.adc_saturation.is_some();
            return Ok(());
        }
        let mut peak: f64 = 0.0;
        for body in bodies {
            peak = peak.max(self.all_paths(body.clone())?.cropped(guard).peak());
        }
        self.peak = peak;
        self.chain = self.stages.chain(&world, peak);
        let mut strongest: f64 = 0.0;
        for body in bodies {
            strongest = strongest.max(self.received(body.clone())?.largest_component());
        }
        let noise = if !config.noise {
            0.0
        } else if self.paths.scatter.is_some() {
            noise_for_snr(&self.plain_body()?, radar, config.snr_db)
        } else {
            // Without a body the ratio is to static clutter.
            let still = self.paths.surroundings.still().chunks_exact(self.stages.wide.samples_per_chirp);
            let window = still.map(|chirp| &chirp[guard..guard + radar.samples_per_chirp]);
            let chirps: Vec<Complex64> = window.flat_map(|chirp| chirp.repeat(radar.loops_per_frame)).collect();
            noise_for_snr(&chirps, radar, config.snr_db)
        };
        let saturation = world.effects.adc_saturation.as_ref().map(|saturation| saturation.level);
        let fraction = saturation.unwrap_or(config.peak_fraction);
        let scale = if strongest > 0.0 { fraction * rail(radar) / strongest } else { 1.0 };
        self.receiver.gain = scale.into();
        self.receiver.noise_codes = noise * scale;
        self.receiver.clips = config.adc || saturation.is_some();
        Ok(())
    }
}

fn largest(signal: &[Complex64]) -> f64 {
    signal.iter().map(|value| value.re.abs().max(value.im.abs())).fold(0.0, f64::max)
}

fn preview_frames(world: &World, moving: bool) -> Vec<usize> {
    let frames = world.radar.frames;
    let count = if moving || !world.effects.is_off() { PREVIEWS.min(frames) } else { 1 };
    (0..count).map(|preview| preview * (frames - 1) / (count - 1).max(1)).collect()
}

/// The scene as an antenna at the array's reference receives it, and as it is received from one there.
fn board_paths(world: &World, stages: &Stages, level: f64) -> Result<[(Paths, Radar); 2]> {
    let received = Radar { rx_m: vec![[0.0; 3]], ..stages.radar.clone() };
    let sent = Radar { tx_m: vec![[0.0; 3]; stages.radar.tx_m.len()], ..stages.radar.clone() };
    let paths = |radar: Radar| -> Result<(Paths, Radar)> {
        let wide = widened(&radar, stages.guard());
        Ok((Paths::new(world, body_scatter(world, stages, &radar)?, &wide, level)?, wide))
    };
    Ok([paths(received)?, paths(sent)?])
}

/// All frames of a world; `progress` receives how many of how many are done.
pub fn record(world: &World, progress: &mut dyn FnMut(usize, usize)) -> Result<Vec<IfFrame>> {
    let recorder = Recorder::new(world)?;
    let frames = recorder.frames().enumerate();
    frames.map(|(frame, samples)| samples.inspect(|_| progress(frame + 1, world.radar.frames))).collect()
}
