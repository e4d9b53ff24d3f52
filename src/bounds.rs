//! What numbers in settings and files can be at all. Everything that reads numbers asks here.
//!
//! [`unit()`] bounds a number by the unit that its key ends with, so that a new key is bounded without a word; [`count`]
//! bounds what is allocated, and stands in the `check` of the settings that it belongs to. Neither says what is
//! plausible: that is for who knows the scene.

use crate::error::{Error, Result};

/// Most numbers of one array that settings can ask for: 1 GiB in f32, of which training holds four (value, gradient and
/// Adam's two moments).
pub const MOST_NUMBERS: usize = 1 << 28;

/// Largest length, metres: the edge of the atmosphere (Kármán line, FAI). Farther is no scene of a radar.
pub const LONGEST_M: f64 = 1e5;

/// Largest angle, radians: of a body that has turned about itself ten thousand times. A motion may count its turns.
pub const WIDEST_RAD: f64 = 1e5;

/// What a number in one unit can be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// What the keys end with.
    suffix: &'static str,
    /// Largest absolute value.
    most: f64,
    name: &'static str,
}

/// Longer suffixes first: `_hz_per_s` ends with `_s`, too.
const UNITS: [Unit; 11] = [
    // All of the ITU's band 12 (to 3 THz) in a microsecond.
    Unit { suffix: "_hz_per_s", most: 3e18, name: "hertz per second" },
    // Speed of light.
    Unit { suffix: "_mps", most: 299_792_458.0, name: "metres per second" },
    Unit { suffix: "_m2", most: LONGEST_M * LONGEST_M, name: "square metres" },
    // Terahertz waves end at 3 THz (ITU-R V.431, band 12).
    Unit { suffix: "_hz", most: 3e12, name: "hertz" },
    // The largest amplitude of f32, 20 log10(3.4e38).
    Unit { suffix: "_db", most: 770.0, name: "decibels" },
    Unit { suffix: "_deg", most: WIDEST_RAD * 180.0 / std::f64::consts::PI, name: "degrees" },
    Unit { suffix: "_rad", most: WIDEST_RAD, name: "radians" },
    // The widest converter has 32 bits.
    Unit { suffix: "_codes", most: 4_294_967_296.0, name: "codes" },
    Unit { suffix: "_m", most: LONGEST_M, name: "metres" },
    // A year.
    Unit { suffix: "_s", most: 3.2e7, name: "seconds" },
    // The simulator computes in f32, where larger numbers are infinite.
    Unit { suffix: "", most: f32::MAX as f64, name: "" },
];

/// The bound of a key's numbers, by the unit that it ends with.
pub fn unit(key: &str) -> Unit {
    *UNITS.iter().find(|unit| key.ends_with(unit.suffix)).expect("the last unit fits every key")
}

impl Unit {
    /// What was expected, if `value` cannot be.
    pub fn refuses(self, value: f64) -> Option<String> {
        if !value.is_finite() {
            Some("a finite number".into())
        } else if value.abs() > self.most {
            Some(format!("at most {:.3e} {}", self.most, self.name).trim_end().into())
        } else {
            None
        }
    }
}

/// Refuses a number of things below 1 or above `most`. The caller says why so many are the most.
///
/// # Errors
/// With the key, the number and both bounds.
pub fn count(key: impl Into<String>, value: usize, most: usize) -> Result<()> {
    if (1..=most).contains(&value) { Ok(()) } else { Err(Error::setting(key, value, format!("1 to {most}"))) }
}

/// Refuses an array of these lengths if it holds more than [`MOST_NUMBERS`]. `what` names the lengths, such as
/// `texels of three planes x features`.
///
/// # Errors
/// With the key, the product and the bound.
pub fn numbers(key: impl Into<String>, what: &str, lengths: &[usize]) -> Result<()> {
    let product = lengths.iter().try_fold(1usize, |product, &length| product.checked_mul(length));
    match product {
        Some(product) if product <= MOST_NUMBERS => Ok(()),
        _ => {
            let lengths: Vec<String> = lengths.iter().map(ToString::to_string).collect();
            Err(Error::setting(key, lengths.join(" x "), format!("at most {MOST_NUMBERS} numbers ({what})")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_bounded_by_the_unit_of_its_key() {
        for (key, good, bad) in [
            ("front_m", 99_000.0, 1e300),
            ("area_m2", 1e9, 1e11),
            ("slope_hz_per_s", 6e13, 1e19),
            ("start_frequency_hz", 7.7e10, 1e13),
            ("speed_mps", 30.0, 3e8),
            ("frame_period_s", 0.05, 1e9),
            ("floor_db", -120.0, -1e3),
            ("residual", 1e30, 1e39),
        ] {
            assert_eq!(unit(key).refuses(good), None, "{key}");
            for value in [bad, -bad, f64::NAN, f64::INFINITY] {
                assert!(unit(key).refuses(value).is_some(), "{key} = {value}");
            }
        }
    }

    #[test]
    fn counts_and_products_are_refused_without_overflow() {
        count("layers", 64, 64).unwrap();
        for bad in [0, 65, usize::MAX] {
            let message = count("layers", bad, 64).unwrap_err().to_string();
            assert_eq!(message, format!("`layers` is {bad}, expected 1 to 64"));
        }
        numbers("x", "a x b", &[1 << 14, 1 << 14]).unwrap();
        assert!(numbers("x", "a x b", &[1 << 14, (1 << 14) + 1]).is_err());
        assert!(numbers("x", "a x b", &[usize::MAX, usize::MAX]).is_err());
    }
}
