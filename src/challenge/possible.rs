//! Which effects a radar cannot have, whoever plants them.

use crate::effects;
use crate::radar::{Radar, Sampling};
use crate::recorder::effects::Outside;

/// Why recordings of a radar cannot have an effect; none where they can.
pub fn impossible(id: &str, radar: &Radar) -> Option<&'static str> {
    let chirps = radar.loops_per_frame * radar.tx_m.len();
    match id {
        effects::iq_imbalance::ID if radar.sampling == Sampling::Real => Some("this receiver has no quadrature"),
        effects::channel_mismatch::ID
        | effects::antenna_position::ID
        | effects::mutual_coupling::ID
        | effects::correlated_noise::ID
        | Outside::MUX_CROSSTALK
        | Outside::RX_MUX_SKEW
            if radar.rx_m.len() < 2 =>
        {
            Some("this radar has a single receiver")
        }
        effects::chirp_settling::ID if chirps < 2 => Some("a frame has a single chirp"),
        Outside::CHIRP_AFTERGLOW if radar.loops_per_frame < 2 => Some("a frame has a single chirp of each transmitter"),
        Outside::GAIN_HOP if radar.frames < 2 => Some("there is a single frame"),
        _ => None,
    }
}
