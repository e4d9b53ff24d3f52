//! Different gains and phases of the channels (card C1).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "channel_mismatch",
    card: "C1",
    stage: Stage::Antenna,
    title: "different gains and phases of the channels",
    explanation: "The channels differ in gain and phase, the same for all echoes, which turns and blurs directions.",
    equation: "s_{t,r} → s_{t,r} 10^{gain_db/20} e^{j phase_deg}",
    parameters: &[parameter("gain_db", "dB", 0.0, -20.0, 20.0), parameter("phase_deg", "deg", 0.0, -180.0, 180.0)],
    look_alikes: &["tdm_phase", "antenna_position", "mutual_coupling"],
    separate_by: "a strong reflector at several directions: gains and phases stay, an antenna's misplacement changes with direction",
};
