//! Streams of random numbers, one per effect that draws some.

macro_rules! streams {
    ($($name:ident = $id:literal),*) => { $(pub(super) const $name: u64 = $id;)* };
}

streams! {
    CHIRP_RIPPLE = 1, PHASE_NOISE = 2, CHIRP_START_JITTER = 3, TX_LEAKAGE = 4, DC_OFFSET = 5, RAMP_EDGE_TRANSIENT = 6,
    SPUR = 7, INTERFERENCE = 8, MUTUAL_COUPLING = 9, MOVING_REFLECTOR = 10, RADAR_VIBRATION = 11, RANGE_ALIAS = 12,
    BREATHING = 13, HEARTBEAT = 14, IMPULSIVE_NOISE = 15, CORRELATED_NOISE = 16,
    // The entries of `outside` follow each other.
    OUTSIDE = 100
}

/// Whether the draws of an effect are noise, which is another one in each recording of the same truth.
pub fn is_noise(id: u64) -> bool {
    [PHASE_NOISE, CHIRP_START_JITTER, IMPULSIVE_NOISE, CORRELATED_NOISE].contains(&id)
}
