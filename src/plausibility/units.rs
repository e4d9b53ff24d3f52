//! Units that numbers come in, and which of them a number out of its band is likely to be in.

/// A unit by its name, and what one of it is in SI.
pub type Unit = (&'static str, f64);

/// Of lengths, the most usual beside metres first.
pub const LENGTHS: [Unit; 5] =
    [("centimetres", 1e-2), ("millimetres", 1e-3), ("inches", 0.0254), ("decimetres", 0.1), ("feet", 0.3048)];

/// The first unit in which `value` lies within `band`.
pub fn likely(value: f64, units: &[Unit], band: [f64; 2]) -> Option<Unit> {
    units.iter().copied().find(|(_, factor)| (band[0]..=band[1]).contains(&(value.abs() * factor)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_person_in_any_unit_is_recognised_and_a_person_in_no_unit_is_not() {
        for (value, name) in
            [(1750.0, "millimetres"), (175.0, "centimetres"), (68.9, "inches"), (17.5, "decimetres"), (5.74, "feet")]
        {
            assert_eq!(likely(value, &LENGTHS, [1.0, 2.2]).unwrap().0, name);
        }
        assert_eq!(likely(1e6, &LENGTHS, [1.0, 2.2]), None);
    }
}
