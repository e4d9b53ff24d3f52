//! Where training starts: the gain from scattering amplitude to the recording's unit, which no physics here knows.

use super::{FrameId, LoadedRecording};
use crate::{
    error::{Error, Result},
    simulator::{Mode, Simulator},
};

/// Frames that are looked at.
const FRAMES: usize = 4;

/// The simulator with the gain at which its power is that of the recordings, over a few training frames.
///
/// # Errors
/// A recording without any signal, or a scene that returns nothing.
pub fn fit_gain(mut simulator: Simulator, recordings: &[LoadedRecording], frames: &[FrameId]) -> Result<Simulator> {
    use burn::module::Module;
    let plain = simulator.clone().valid();
    let device = plain.device();
    let step = frames.len().div_ceil(FRAMES).max(1);
    let (mut measured, mut simulated) = (0.0, 0.0);
    for id in frames.iter().step_by(step) {
        let recording = &recordings[id.recording];
        let surfaces = plain.surfaces(&plain.constants(&recording.scene), Mode::Inference);
        let signal = plain.clean_signal(&recording.scene, &*recording.scene.view(id.frame)?, &surfaces);
        simulated += f64::from(signal.power().sum().into_scalar::<f32>());
        measured += f64::from(recording.target(id.frame, &device)?.power().sum().into_scalar::<f32>());
    }
    if !(measured.is_finite() && measured > 0.0) {
        return Err(Error::Usage {
            message: format!("the recording's power is {measured}, nothing can be learned from it"),
            hint: Some("check that the recording holds a signal: `hybridsim check`".into()),
        });
    }
    if !(simulated.is_finite() && simulated > 0.0) {
        return Err(Error::Usage {
            message: format!("the simulated power is {simulated}: the radar sees nothing of the scene"),
            hint: Some("check the room's distances and where the person stands: `hybridsim check`".into()),
        });
    }
    simulator.decoders.gain = simulator.decoders.gain.scale((measured / simulated).sqrt());
    Ok(simulator)
}
