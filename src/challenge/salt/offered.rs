//! Which effects can be put onto samples alone, in which unit their strength is, and why the others cannot.

use crate::challenge::library::{Graded, every};
use crate::challenge::possible::impossible;
use crate::diagnosis::behaviour::Behaviour;
use crate::effects::{self, Stage};
use crate::error::{Error, Result};
use crate::radar::Radar;
use crate::recorder::effects::Outside;

/// An effect that is offered.
pub struct Offered {
    pub id: &'static str,
    /// Of its strength.
    pub unit: &'static str,
    pub family: Family,
}

/// What a report says of an effect without a name.
#[derive(Clone, Copy)]
pub struct Family {
    pub behaviours: &'static [Behaviour],
    /// Or that the samples are damaged.
    pub damaged: bool,
}

impl Family {
    /// Whether the words of a report's `behaves_like` are one of these.
    pub fn has(&self, words: &str) -> bool {
        self.behaviours.iter().any(|behaviour| behaviour.words() == words)
    }
}

const ADDED: Family = Family {
    behaviours: &[
        Behaviour::AdditiveFastTime,
        Behaviour::SparseAdditive,
        Behaviour::Tone,
        Behaviour::ExcessPower,
        Behaviour::FastTimeGain,
    ],
    damaged: false,
};
const NONLINEAR: Family = Family {
    behaviours: &[Behaviour::NonLinear, Behaviour::Quadratic, Behaviour::ConjugateImage, Behaviour::Amplitude],
    damaged: false,
};
const SLOW: Family = Family {
    behaviours: &[
        Behaviour::SlowTimeGain,
        Behaviour::SlowTimePhase,
        Behaviour::SlowTimeGainOfOneChannel,
        Behaviour::SlowTimePatternOfOneReturn,
        Behaviour::SlowTimeSettlingOfOneReturn,
        Behaviour::SingleFrame,
        Behaviour::FadingBehindTheBody,
        Behaviour::ChangingAtOneRange,
        Behaviour::Modulated,
        Behaviour::DelayProportionalPhase,
        Behaviour::DelayProportionalPhaseByReceiver,
    ],
    damaged: false,
};
const FAST: Family = Family {
    behaviours: &[
        Behaviour::FastTimeGain,
        Behaviour::BeatFrequencyGain,
        Behaviour::DelayProportionalPhase,
        Behaviour::DelayProportionalPhaseByReceiver,
    ],
    damaged: false,
};
const CHANNEL: Family = Family {
    behaviours: &[
        Behaviour::ChannelGain,
        Behaviour::SlowTimeGainOfOneChannel,
        Behaviour::CoupledOnOneSide,
        Behaviour::PhaseBetweenReceivers,
        Behaviour::DirectionOffset,
    ],
    damaged: false,
};
const NOISE: Family = Family {
    behaviours: &[
        Behaviour::NoiseOverBeatFrequency,
        Behaviour::NoiseSharedByReceivers,
        Behaviour::SparseAdditive,
        Behaviour::ExcessPower,
    ],
    damaged: false,
};
const CODES: Family = Family {
    behaviours: &[Behaviour::Quantisation, Behaviour::SlippedSamples, Behaviour::SingleFrame, Behaviour::Amplitude],
    damaged: true,
};

macro_rules! offered {
    ($($id:expr => $unit:literal $family:ident;)*) => {
        &[$(Offered { id: $id, unit: $unit, family: $family }),*]
    };
}

/// In the order of the signal's chain. "Of the peak" is of the recording's peak sample.
pub const OFFERED: &[Offered] = offered! {
    effects::tx_leakage::ID => "of the peak" ADDED;
    effects::phase_noise::ID => "rad at 3 m" SLOW;
    effects::chirp_start_jitter::ID => "s" SLOW;
    effects::channel_mismatch::ID => "dB, and 6° each" CHANNEL;
    effects::mutual_coupling::ID => "of the neighbour" CHANNEL;
    effects::chirp_droop::ID => "dB" FAST;
    effects::gain_drift::ID => "dB" SLOW;
    effects::chirp_settling::ID => "of the gain" SLOW;
    Outside::MAINS_GAIN_RIPPLE => "of the gain" SLOW;
    Outside::GAIN_HOP => "dB" CHANNEL;
    effects::compression::ID => "of the peak" NONLINEAR;
    effects::second_harmonic::ID => "of the peak" NONLINEAR;
    effects::iq_imbalance::ID => "dB, and up to 5° each" NONLINEAR;
    Outside::LO_PULLING => "rad at the peak" NONLINEAR;
    effects::dc_offset::ID => "of the peak" ADDED;
    effects::ramp_edge_transient::ID => "of the peak" ADDED;
    effects::spur::ID => "of the peak" ADDED;
    effects::interference::ID => "of the peak" ADDED;
    Outside::CHIRP_AFTERGLOW => "of the chirp before" SLOW;
    Outside::MUX_CROSSTALK => "of the receiver before" CHANNEL;
    effects::coloured_noise::ID => "Hz" NOISE;
    effects::impulsive_noise::ID => "of the samples" NOISE;
    effects::correlated_noise::ID => "correlation" NOISE;
    effects::adc_saturation::ID => "of the peak, beyond full scale" CODES;
    Outside::LSB_STUCK => "codes" CODES;
    Outside::BUFFER_SLIP => "samples" CODES;
    effects::frame_drop::ID => "frames" CODES;
};

const PLACE: &str = "it acts on returns by their places, and the samples hold all returns summed";
const VELOCITY: &str = "it acts on returns by their velocities, and the samples hold all returns summed";
const BODY: &str = "it acts on the person, whose returns the samples hold summed with all others";
const PATHS: &str = "it is a further way of single returns, and the samples hold all returns summed";
const WINDOW: &str = "it needs the signal before and after the window that was sampled";
const DELAY: &str = "it turns each return by a phase in proportion to its delay, and the samples hold all returns summed";

/// Why others are not offered that change neither the person alone nor the ways of returns.
const REFUSED: &[(&str, &[&str])] = &[
    (
        PLACE,
        &[
            effects::static_reflector::ID,
            effects::moving_reflector::ID,
            effects::range_bias::ID,
            effects::radar_vibration::ID,
            Outside::LAMP_MODULATION,
            Outside::MOVING_CURTAIN,
            effects::antenna_position::ID,
            effects::antenna_pattern::ID,
        ],
    ),
    (VELOCITY, &[effects::tdm_phase::ID]),
    (
        WINDOW,
        &[
            effects::slope_error::ID,
            effects::chirp_nonlinearity::ID,
            effects::chirp_ripple::ID,
            Outside::THERMAL_CURVATURE,
            effects::if_highpass::ID,
            effects::if_lowpass::ID,
            Outside::RX_MUX_SKEW,
        ],
    ),
    (DELAY, &[effects::start_frequency_error::ID, effects::adc_start_error::ID, effects::if_delay::ID]),
];

/// Fewest frames of which some can be lost: eight, and the six that the strongest gap takes.
const FEWEST_FRAMES: usize = 14;

/// An effect by its id; none where samples alone cannot be given it.
pub fn offered(id: &str) -> Option<&'static Offered> {
    OFFERED.iter().find(|offered| offered.id == id)
}

/// Why samples alone cannot be given an effect, whatever the radar.
fn refused(id: &str) -> Option<&'static str> {
    match effects::info(id) {
        Some(info) if info.stage == Stage::Propagation => Some(PATHS),
        Some(info) if info.needs_person => Some(BODY),
        _ => REFUSED.iter().find(|(_, ids)| ids.contains(&id)).map(|(reason, _)| *reason),
    }
}

/// Why an effect cannot be put onto recordings of this radar; none where it can. `codes`: its samples are whole codes.
pub fn refusal(id: &str, radar: &Radar, codes: bool) -> Option<&'static str> {
    if offered(id).is_none() {
        return refused(id).or(Some("no such effect is known"));
    }
    match id {
        effects::frame_drop::ID if radar.frames < FEWEST_FRAMES => Some("there are fewer than 14 frames"),
        Outside::LSB_STUCK if !codes => Some("the samples are no whole codes"),
        _ => impossible(id, radar),
    }
}

/// The effects that were asked for, or all that this radar can have; and the others with their reasons.
///
/// # Errors
/// One that was asked for and cannot be.
pub fn chosen(asked: &[String], radar: &Radar, codes: bool) -> Result<Vec<&'static Graded>> {
    if let Some((id, reason)) = asked.iter().find_map(|id| Some((id, refusal(id, radar, codes)?))) {
        let able: Vec<&str> = OFFERED.iter().map(|offered| offered.id).filter(|id| refusal(id, radar, codes).is_none()).collect();
        return Err(Error::setting("effects", id, "an effect that samples alone can be given")
            .with_hint(format!("{reason}; this recording can be given {}", able.join(", "))));
    }
    let wanted = |id: &str| match asked {
        [] => refusal(id, radar, codes).is_none(),
        _ => asked.iter().any(|asked| asked == id),
    };
    let graded = |offered: &Offered| every().find(|graded| graded.id == offered.id);
    Ok(OFFERED.iter().filter(|offered| wanted(offered.id)).filter_map(graded).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::Sampling;

    #[test]
    fn every_effect_is_offered_or_refused_with_a_reason_and_none_both() {
        for graded in every() {
            assert_ne!(refused(graded.id).is_some(), offered(graded.id).is_some(), "{}", graded.id);
            let stated = REFUSED.iter().filter(|(_, ids)| ids.contains(&graded.id)).count();
            let derived = effects::info(graded.id).is_some_and(|info| info.needs_person || info.stage == Stage::Propagation);
            assert!(stated + usize::from(derived) <= 1, "{}", graded.id);
        }
        let known = |id: &str| every().any(|graded| graded.id == id);
        assert!(OFFERED.iter().all(|offered| known(offered.id)));
        // Some ids of docs/report.md are never drawn.
        assert!(REFUSED.iter().flat_map(|(_, ids)| *ids).all(|id| known(id) || *id == effects::tdm_phase::ID));
    }

    #[test]
    fn what_a_radar_cannot_have_is_left_out_and_refused_by_name() {
        let radar = Radar { sampling: Sampling::Real, loops_per_frame: 1, tx_m: vec![[0.0; 3]], ..Radar::small(20) };
        let of = |asked: &[&str]| chosen(&asked.iter().map(|id| id.to_string()).collect::<Vec<_>>(), &radar, true);
        let all: Vec<&str> = of(&[]).unwrap().iter().map(|graded| graded.id).collect();
        assert!(all.contains(&"spur") && all.contains(&"frame_drop"));
        assert!(!all.contains(&"iq_imbalance") && !all.contains(&"chirp_settling"));
        for (id, reason) in [("iq_imbalance", "no quadrature"), ("breathing", "the person"), ("ghosts", "no such effect")] {
            let error = of(&["spur", id]).err().unwrap();
            assert!(error.to_string().contains(id) && error.hint().unwrap().contains(reason), "{error}");
        }
        assert_eq!(of(&["spur"]).unwrap().len(), 1);
    }
}
