//! Which effects can be put onto samples alone, in which unit their strength is, and why the others cannot.

use crate::challenge::library::{Graded, every};
use crate::effects;
use crate::error::{Error, Result};
use crate::radar::{Radar, Sampling};

/// An effect that is offered.
pub struct Offered {
    pub id: &'static str,
    /// Of its strength.
    pub unit: &'static str,
    /// What a report says of it without a name: beginnings of `behaves_like`.
    pub family: &'static [&'static str],
}

const ADDED: &[&str] = &["additive", "sparse additive", "tone", "excess power", "fast-time gain"];
const NONLINEAR: &[&str] = &["non-linear", "quadratic", "conjugate image", "image", "amplitude"];
const SLOW: &[&str] = &["slow-time", "single frame", "static returns that", "a static return that", "delay-proportional phase"];
const FAST: &[&str] = &["fast-time", "beat-frequency", "delay-proportional phase"];
const CHANNEL: &[&str] = &[
    "channel gain",
    "slow-time gain of one channel",
    "receivers that are coupled",
    "phase between receivers",
    "direction offset",
];
const NOISE: &[&str] = &["noise", "sparse additive", "excess power"];
const CODES: &[&str] = &["quantisation", "slipped samples", "single frame", "amplitude", "damaged"];

macro_rules! offered {
    ($($id:ident $unit:literal $family:ident;)*) => {
        &[$(Offered { id: stringify!($id), unit: $unit, family: $family }),*]
    };
}

/// In the order of the signal's chain. "Of the peak" is of the recording's peak sample.
pub const OFFERED: &[Offered] = offered! {
    tx_leakage "of the peak" ADDED;
    phase_noise "rad at 3 m" SLOW;
    chirp_start_jitter "s" SLOW;
    channel_mismatch "dB, and 6° each" CHANNEL;
    mutual_coupling "of the neighbour" CHANNEL;
    chirp_droop "dB" FAST;
    gain_drift "dB" SLOW;
    chirp_settling "of the gain" SLOW;
    mains_gain_ripple "of the gain" SLOW;
    gain_hop "dB" CHANNEL;
    compression "of the peak" NONLINEAR;
    second_harmonic "of the peak" NONLINEAR;
    iq_imbalance "dB, and up to 5° each" NONLINEAR;
    lo_pulling "rad at the peak" NONLINEAR;
    dc_offset "of the peak" ADDED;
    ramp_edge_transient "of the peak" ADDED;
    spur "of the peak" ADDED;
    interference "of the peak" ADDED;
    chirp_afterglow "of the chirp before" SLOW;
    mux_crosstalk "of the receiver before" CHANNEL;
    coloured_noise "Hz" NOISE;
    impulsive_noise "of the samples" NOISE;
    correlated_noise "correlation" NOISE;
    adc_saturation "of the peak, beyond the rail" CODES;
    lsb_stuck "codes" CODES;
    buffer_slip "samples" CODES;
    frame_drop "frames" CODES;
};

const PLACE: &str = "it acts on returns by their places, and the samples hold all returns summed";
const BODY: &str = "it acts on the person, whose returns the samples hold summed with all others";
const PATHS: &str = "it is a further way of single returns, and the samples hold all returns summed";
const WINDOW: &str = "it needs the signal before and after the window that was sampled";
const DELAY: &str = "it turns each return by a phase in proportion to its delay, and the samples hold all returns summed";

/// Why the others are not offered.
const REFUSED: &[(&str, &[&str])] = &[
    (
        PLACE,
        &[
            effects::static_reflector::ID,
            effects::moving_reflector::ID,
            effects::carried_reflector::ID,
            effects::pose_offset::ID,
            effects::range_bias::ID,
            effects::radar_vibration::ID,
            "lamp_modulation",
            "moving_curtain",
            effects::antenna_position::ID,
            effects::antenna_pattern::ID,
        ],
    ),
    (
        BODY,
        &[
            effects::breathing::ID,
            effects::heartbeat::ID,
            effects::clothing_delay::ID,
            effects::part_reflectivity::ID,
            effects::clock_offset::ID,
            effects::clock_drift::ID,
        ],
    ),
    (
        PATHS,
        &[
            effects::wall_ghost::ID,
            effects::floor_bounce::ID,
            effects::object_radar_object::ID,
            effects::range_alias::ID,
            effects::soft_occlusion::ID,
            effects::body_multibounce::ID,
            effects::tdm_phase::ID,
        ],
    ),
    (
        WINDOW,
        &[
            effects::slope_error::ID,
            effects::chirp_nonlinearity::ID,
            effects::chirp_ripple::ID,
            "thermal_curvature",
            effects::if_highpass::ID,
            effects::if_lowpass::ID,
            "rx_mux_skew",
        ],
    ),
    (DELAY, &[effects::start_frequency_error::ID, effects::adc_start_error::ID, effects::if_delay::ID]),
];

/// Fewest frames of which some can be lost: eight, and the six that the strongest gap takes.
const FEWEST_FRAMES: usize = 14;

pub fn offered(id: &str) -> Option<&'static Offered> {
    OFFERED.iter().find(|offered| offered.id == id)
}

/// Why an effect cannot be put onto recordings of this radar; none where it can. `codes`: its samples are whole codes.
pub fn refusal(id: &str, radar: &Radar, codes: bool) -> Option<&'static str> {
    if offered(id).is_none() {
        return REFUSED.iter().find(|(_, ids)| ids.contains(&id)).map(|(reason, _)| *reason).or(Some("no such effect is known"));
    }
    let chirps = radar.loops_per_frame * radar.tx_m.len();
    match id {
        effects::iq_imbalance::ID if radar.sampling == Sampling::Real => Some("this receiver has no quadrature"),
        effects::channel_mismatch::ID | effects::mutual_coupling::ID | "mux_crosstalk" | effects::correlated_noise::ID
            if radar.rx_m.len() < 2 =>
        {
            Some("this radar has a single receiver")
        }
        effects::chirp_settling::ID if chirps < 2 => Some("a frame has a single chirp"),
        "chirp_afterglow" if radar.loops_per_frame < 2 => Some("a frame has a single chirp of each transmitter"),
        "gain_hop" if radar.frames < 2 => Some("there is a single frame"),
        effects::frame_drop::ID if radar.frames < FEWEST_FRAMES => Some("there are fewer than 14 frames"),
        "lsb_stuck" if !codes => Some("the samples are no whole codes"),
        _ => None,
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

    #[test]
    fn every_effect_is_offered_or_refused_with_a_reason_and_none_both() {
        for graded in every() {
            let refused = REFUSED.iter().filter(|(_, ids)| ids.contains(&graded.id)).count();
            assert_eq!(refused + usize::from(offered(graded.id).is_some()), 1, "{}", graded.id);
        }
        let known = |id: &str| every().any(|graded| graded.id == id);
        assert!(OFFERED.iter().all(|offered| known(offered.id)));
        // Some ids of docs/report.md are never drawn.
        assert!(REFUSED.iter().flat_map(|(_, ids)| *ids).all(|id| known(id) || *id == "tdm_phase"));
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
