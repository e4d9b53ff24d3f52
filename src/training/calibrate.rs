//! Where training starts: the levels that no physics here knows, from scattering amplitude to the recording's unit.
//!
//! Body, room and noise are each brought to their power in the recording: the body in the moving cells that stand
//! out of the noise, the room to all that is at rest (leakage and furniture included), the noise in the median cell.
//! Training refines them.
//!
//! Effects stay in place meanwhile. What they add to silence (leakage, offsets, spurs) is taken out of the recording and left
//! out of the simulation, so that no level is measured on it.

use std::f64::consts::LN_2;

use burn::{
    module::Module,
    tensor::{Device, Tensor},
};

use super::{FrameId, LoadedRecording, prepared::Prepared};
use crate::{
    complex::Complex,
    error::{Error, Result},
    heatmap::{HeatmapConfig, RangeDoppler, remove_loop_mean},
    radar::Sampling,
    simulator::{Gains, Mode, Simulator, Surfaces},
};

/// Frames that are looked at.
const FRAMES: usize = 8;

/// A moving cell counts when it is this many times stronger than the noise.
const ABOVE_NOISE: f64 = 30.0;

/// Powers summed over frames.
#[derive(Default)]
struct Levels {
    measured_moving: f64,
    simulated_moving: f64,
    measured_clutter: f64,
    simulated_clutter: f64,
    /// Of everything, whether or not it can be told apart.
    simulated: f64,
    /// Noise variance of one component of a sample, summed over frames.
    noise: f64,
    frames: f64,
}

/// The simulator with gains and noise at the recordings' levels. `known_body`: the body's gain stays as it is, as in another
/// room before the same board.
///
/// # Errors
/// A recording without any signal, or a scene that returns nothing.
pub fn fit_levels(
    mut simulator: Simulator,
    recordings: &[LoadedRecording],
    prepared: &[Prepared],
    frames: &[FrameId],
    heatmap: &HeatmapConfig,
    known_body: bool,
) -> Result<Simulator> {
    // In the units of before, what is not linear would answer to the wrong amplitudes.
    let mut plain = simulator.clone().valid();
    plain.effects.switch_off_nonlinear();
    let mut levels = Levels::default();
    let looked_at: Vec<FrameId> = frames.iter().copied().step_by(frames.len().div_ceil(FRAMES).max(1)).collect();
    let surfaces = decode(&plain, prepared);
    for id in &looked_at {
        let transform = prepared[id.recording].loss.transform();
        levels.add(&plain, &recordings[id.recording], id.frame, &surfaces[id.recording], transform, heatmap)?;
    }
    levels.check()?;
    let noise = match noise_between(recordings, prepared, &looked_at, heatmap, &simulator.device())? {
        Some(noise) => noise,
        None => levels.noise / levels.frames,
    };
    let ratio = |measured: f64, simulated: f64| (measured > 0.0 && simulated > 0.0).then(|| (measured / simulated).sqrt());
    let body = ratio(levels.measured_moving, levels.simulated_moving);
    let room = ratio(levels.measured_clutter, levels.simulated_clutter);
    // Where one of them cannot be told apart, the other's level is the best guess.
    let gains = simulator.config().equations.gains;
    let decoders = &mut simulator.decoders;
    let any = (levels.measured() / levels.simulated).sqrt();
    if gains == Gains::Paper {
        // None is applied: the materials must reach the level by themselves.
    } else if known_body {
        decoders.room_gain = decoders.room_gain.clone().scale(room.unwrap_or(1.0));
    } else {
        decoders.body_gain = decoders.body_gain.clone().scale(body.or(room).unwrap_or(any));
        decoders.room_gain = decoders.room_gain.clone().scale(room.or(body).unwrap_or(any));
    }
    // The rate is relative to the simulated amplitude, which the gains have just changed.
    let plain = simulator.clone().valid();
    let mut amplitude = 0.0;
    for id in &looked_at {
        let scene = &recordings[id.recording].scene;
        let clean = plain.clean_signal(scene, &*scene.view(id.frame)?, &surfaces[id.recording]);
        amplitude += f64::from((clean.power() + 1e-30).sqrt().mean().into_scalar::<f32>());
    }
    if noise > 0.0 && amplitude > 0.0 {
        let deviation = noise.sqrt();
        let device = simulator.device();
        simulator.noise = simulator.noise.starting_at(deviation / (amplitude / levels.frames), deviation, &device);
    }
    Ok(simulator)
}

/// Noise variance of one component of a sample, of frames of one chirp, which no other chirp tells apart from what stands still: of what
/// differs between two frames, in the median cell. None where frames have more chirps, or nothing to compare with.
fn noise_between(
    recordings: &[LoadedRecording],
    prepared: &[Prepared],
    frames: &[FrameId],
    heatmap: &HeatmapConfig,
    device: &Device,
) -> Result<Option<f64>> {
    let (mut sum, mut pairs) = (0.0, 0.0);
    for pair in frames.windows(2).filter(|pair| pair[0].recording == pair[1].recording) {
        let recording = &recordings[pair[0].recording];
        let radar = &recording.scene.radar;
        if radar.loops_per_frame > 1 {
            continue;
        }
        let change = recording.target(pair[1].frame, device)?.sub(recording.target(pair[0].frame, device)?);
        let powers = values(prepared[pair[0].recording].loss.transform().map(change).power());
        sum += 0.5 * median(&powers) / LN_2 / heatmap.noise_gain(radar);
        pairs += 1.0;
    }
    Ok((pairs > 0.0).then(|| sum / pairs))
}

/// The surfaces of every recording, which the gains do not change.
fn decode(plain: &Simulator, prepared: &[Prepared]) -> Vec<Surfaces> {
    prepared.iter().map(|prepared| plain.surfaces(&prepared.constants, Mode::Inference)).collect()
}

impl Levels {
    fn measured(&self) -> f64 {
        self.measured_moving + self.measured_clutter
    }

    fn check(&self) -> Result<()> {
        let measured = self.measured();
        if !(measured.is_finite() && measured > 0.0) {
            return Err(Error::Usage {
                message: format!("the recording's power is {measured}, nothing can be learned from it"),
                hint: Some("check that the recording holds a signal: `hybridsim check`".into()),
            });
        }
        if !(self.simulated.is_finite() && self.simulated > 0.0) {
            return Err(Error::Usage {
                message: format!("the simulated power is {}: the radar sees nothing of the scene", self.simulated),
                hint: Some("check the room's distances and where the person stands: `hybridsim check`".into()),
            });
        }
        Ok(())
    }

    fn add(
        &mut self,
        plain: &Simulator,
        recording: &LoadedRecording,
        frame: usize,
        surfaces: &Surfaces,
        transform: &RangeDoppler,
        heatmap: &HeatmapConfig,
    ) -> Result<()> {
        let device = plain.device();
        let scene = &recording.scene;
        let radar = &scene.radar;
        let power = |signal: Complex<4>| values(transform.map(signal).power());

        // A receiver without quadrature sees the real part alone.
        let sampled = |signal: Complex<4>| match radar.sampling {
            Sampling::Complex => signal,
            Sampling::Real => Complex::new(signal.re, signal.im.zeros_like()),
        };
        let mut measured = recording.target(frame, &device)?;
        let view = scene.view(frame)?;
        let Surfaces { body, room } = surfaces.clone();
        // What is there without body and room. It is left out of the simulation, not taken away again: before the gains are
        // known, body and room may be smaller than its rounding.
        if !plain.effects.is_empty() {
            let added = plain.clean_signal(scene, &view, &Surfaces { body: None, room: None });
            measured = measured.sub(sampled(added));
        }
        let mut silent = plain.clone();
        silent.effects.switch_off_additive();
        let alone = |surfaces: Surfaces| silent.clean_signal(scene, &view, &surfaces);
        let of_body = sampled(alone(Surfaces { body, room: None }));
        let of_room = sampled(alone(Surfaces { body: None, room }));

        self.simulated += values(of_body.clone().power()).iter().chain(&values(of_room.clone().power())).sum::<f64>();
        let moving = power(remove_loop_mean(measured.clone()));
        let floor = median(&moving) / LN_2;
        self.noise += floor / heatmap.noise_gain(radar);
        self.frames += 1.0;
        for (measured, simulated) in moving.iter().zip(power(remove_loop_mean(of_body))) {
            if *measured > ABOVE_NOISE * floor {
                self.measured_moving += measured - floor;
                self.simulated_moving += simulated;
            }
        }
        let clutter = |signal: Complex<4>| values(signal.mean_dim(2).power()).iter().sum::<f64>();
        self.measured_clutter += clutter(measured);
        self.simulated_clutter += clutter(of_room);
        Ok(())
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn values(power: Tensor<4>) -> Vec<f64> {
    power.into_data().convert::<f64>().try_into_vec::<f64>().expect("converted")
}
