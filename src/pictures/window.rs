//! Which decibels have colours.

use crate::heatmap::Map;
use crate::metrics::DbWindow;

/// Decibels that a picture shows below its strongest cell, at most and at least.
const SHOWN_DB: [f64; 2] = [60.0, 10.0];

/// From the noise floor up: most cells of a map hold noise, so that half of all cells lie below it.
pub fn window(map_db: &Map) -> DbWindow {
    let [most, least] = SHOWN_DB;
    let high_db = map_db.max();
    DbWindow { low_db: map_db.median().clamp(high_db - most, high_db - least), high_db }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::heatmap::Axis;

    #[test]
    fn colours_begin_at_the_noise_floor() {
        let map = |values: Vec<f64>| Map::new(Axis::new("a", "", vec![0.0]), Axis::new("b", "", vec![0.0; values.len()]), values);
        let window = |values| super::window(&map(values));
        assert_eq!(window(vec![-31.0, -30.0, -30.0, -29.0, 5.0]), DbWindow { low_db: -30.0, high_db: 5.0 });
        // Nothing but noise, and a simulation without any.
        assert_eq!(window(vec![0.0, -1.0, -2.0]).low_db, -10.0);
        assert_eq!(window(vec![0.0, -120.0, -120.0]).low_db, -60.0);
    }
}
