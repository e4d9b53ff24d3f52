//! Levels in decibels and factors of an amplitude.

pub fn from_db(db: f64) -> f64 {
    10f64.powf(db / 20.0)
}

pub fn in_db(factor: f64) -> f64 {
    20.0 * factor.max(1e-300).log10()
}
