//! A line in slow time: a supply's ripple, a radar that vibrates, an oscillator that is modulated.

use std::f64::consts::PI;
use std::sync::Arc;

use super::{Description, Deviation, STATED_AT_M, behaves_like, correction, energy, stated_delay_s};
use crate::diagnosis::detectors::slow::field::{Field, PATTERN, Part};
use crate::diagnosis::detectors::slow::lines::Line;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Estimate, NINETY, Place};
use crate::diagnosis::statistics;
use crate::effects::{self, Stage};

/// `of_leakage`: the radar's own leakage has it, too.
pub fn of_line(evidence: &Evidence, field: &Field, part: Part, line: &Line, of_leakage: bool) -> Candidate {
    // The fitted deviation is relative to the mean of the training frames, that of the finding to the undisturbed radar.
    let scale = if part == Part::Gain { 1.0 / (1.0 + line.constant) } else { 1.0 };
    let deviation = deviation(evidence, line, scale);
    let wave = Wave { line, amplitude: scale * line.amplitude(), hertz: hertz(line) };
    let (stage, description) = match part {
        Part::Gain => (Stage::Receiver, wave.ripple()),
        Part::Phase if of_leakage => (Stage::Receiver, wave.turn()),
        Part::Phase | Part::Boresight => (Stage::Scene, wave.vibration(evidence, field, part)),
        Part::Delay => (Stage::Waveform, wave.oscillator()),
    };
    let p_value = statistics::corrected((-line.training_nats).exp(), line.tried);
    let interval = NINETY * line.frequency_deviation_hz;
    Candidate {
        line_hz: Some([line.frequency_hz - interval, line.frequency_hz + interval]),
        energy: energy(evidence, field, part, &*deviation),
        correction: correction(evidence, part, deviation, 0.0),
        ..description.candidate(behaves_like(part), Place::at(stage), p_value, line.held_out_nats)
    }
}

fn deviation(evidence: &Evidence, line: &Line, scale: f64) -> Deviation {
    let (radar, starts, shape) = (evidence.radar.clone(), evidence.starts_s.clone(), line.clone());
    let time =
        move |[frame, tx, index]: [usize; 3]| starts[frame] + (index * radar.tx_m.len() + tx) as f64 * radar.chirp_period_s;
    Arc::new(move |at| scale * (shape.value(time(at)) - shape.constant))
}

/// The frequency with its interval, to as many places as that has, and the harmonics.
fn hertz(line: &Line) -> String {
    let interval = NINETY * line.frequency_deviation_hz;
    let places = (2.0 - interval.max(1e-6).log10().floor()).clamp(2.0, 5.0) as usize - 1;
    let harmonics =
        if line.amplitudes.len() > 1 { format!(", with harmonics up to the {}th", line.amplitudes.len()) } else { String::new() };
    format!("{:.places$} ± {:.places$} Hz{harmonics}", line.frequency_hz, interval)
}

/// A line relative to the undisturbed radar.
struct Wave<'a> {
    line: &'a Line,
    amplitude: f64,
    /// Its frequency in words.
    hertz: String,
}

impl Wave<'_> {
    /// Of the receiver's gain.
    fn ripple(&self) -> Description {
        // No gain changes its sign: frames show too little of a period to say how large its amplitude is.
        if self.amplitude >= 1.0 {
            return Description::unnamed(format!(
                "The gain of the whole receiver changes along the frames, at all ranges and in all channels alike, as a ripple at {} or \
                 at another multiple of the frame rate would do it; the frames show too little of its period for an amplitude.",
                self.hertz
            ));
        }
        Description::unnamed(format!(
            "The gain of the whole receiver is modulated by {:.2} % (amplitude) at {}, at all ranges and in \
             all channels alike: as mains ripple on a supply would do it.",
            100.0 * self.amplitude,
            self.hertz
        ))
    }

    /// Of all that is received. A radar that moves takes its leakage with it.
    fn turn(&self) -> Description {
        Description::unnamed(format!(
            "The phase of all that is received oscillates by {:.3} rad at {}, the same at all ranges, and that of the transmitters' \
             leakage as well, which a radar that moves takes with it.",
            self.amplitude, self.hertz
        ))
    }

    /// Of the radar itself. What moves along the boresight turns the returns by its cosine, whether or not the ranges tell it apart.
    fn vibration(&self, evidence: &Evidence, field: &Field, part: Part) -> Description {
        let along = if part == Part::Phase { field.mean_ahead() } else { 1.0 };
        let metres = evidence.radar.wavelength_m() / (4.0 * PI * along);
        let deviation = self.line.amplitude_deviation.hypot(PATTERN * self.amplitude);
        let where_ = match part {
            Part::Boresight if evidence.room.is_some() => "the more the farther ahead they are",
            Part::Boresight => "the same at all ranges but those of the transmitters' leakage",
            _ => "the same at all ranges",
        };
        let estimates = vec![
            Estimate::normal("amplitude_m", self.amplitude * metres, deviation * metres),
            Estimate::normal("frequency_hz", self.line.frequency_hz, self.line.frequency_deviation_hz),
        ];
        let observed = format!(
            "The phases of all static returns oscillate together, by {:.3} rad at {}, {where_}",
            self.amplitude, self.hertz
        );
        let cause = format!("the radar itself vibrates by {:.1} µm along its boresight", 1e6 * self.amplitude * metres);
        Description::named(evidence, effects::radar_vibration::ID, estimates, [observed, cause])
    }

    /// Of the local oscillator's frequency.
    fn oscillator(&self) -> Description {
        Description::unnamed(format!(
            "The phase of every return oscillates at {} in proportion to its delay, by {:.4} rad at \
             {STATED_AT_M} m, as if the local oscillator's frequency were modulated by {:.0} Hz.",
            self.hertz,
            self.amplitude * stated_delay_s(),
            self.amplitude / (2.0 * PI)
        ))
    }
}
