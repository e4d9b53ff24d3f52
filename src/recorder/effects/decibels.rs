//! Levels in decibels, as factors of an amplitude.

pub fn from_db(db: f64) -> f64 {
    10f64.powf(db / 20.0)
}
