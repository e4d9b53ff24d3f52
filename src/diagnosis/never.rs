//! Effects that no recording of some kind can show, and why.

use crate::effects;

struct Never {
    ids: &'static [&'static str],
    /// Only where somebody was tracked.
    of_the_tracked: bool,
    reason: &'static str,
}

const NEVER: [Never; 5] = [
    Never {
        ids: &[effects::part_reflectivity::ID],
        of_the_tracked: false,
        reason: "a wrong reflectivity is only another amplitude, and amplitudes are free: no recording can show it without a prior",
    },
    Never {
        ids: &[effects::start_frequency_error::ID, effects::adc_start_error::ID, effects::if_delay::ID],
        of_the_tracked: false,
        reason: "it only turns every return by a phase in proportion to its delay, and phases of returns are free: millimetres of the \
         mesh and of the room do the same; it would show only if known ranges were good to a fiftieth of a millimetre",
    },
    Never {
        ids: &[effects::antenna_pattern::ID],
        of_the_tracked: false,
        reason: "a factor that depends on direction alone is part of the amplitudes of whatever stands in that direction, and those are \
         free; the same body would have to be seen from the same side in several directions",
    },
    Never {
        ids: &[effects::tdm_phase::ID],
        of_the_tracked: false,
        reason: "within the body's few velocities it is a phase of channels, which is reported as such (channel_mismatch); a faster target \
         would tell them apart",
    },
    Never {
        ids: &[effects::breathing::ID, effects::heartbeat::ID, effects::clothing_delay::ID],
        of_the_tracked: true,
        reason: "of a body whose motion is known to millimetres: the mesh's own error moves by as much, and as slowly; breath and heart \
         are looked for only where nobody was tracked",
    },
];

/// Ids of effects that no recording of this kind can show, with the reason; `body`: somebody was tracked.
pub fn all(body: bool) -> impl Iterator<Item = (&'static str, &'static str)> {
    let applying = NEVER.iter().filter(move |never| body || !never.of_the_tracked);
    applying.flat_map(|never| never.ids.iter().map(|id| (*id, never.reason)))
}
