//! The antennas: whether their positions are in metres.

use super::facts::{minus, norm};
use super::{Facts, Finding, Kind, Part};
use crate::radar::Radar;

/// Neighbours of one array are closer than this many wavelengths (0.4 m at 77 GHz); with half a wavelength or a few between
/// them they measure angles.
const FARTHEST_NEIGHBOURS: f64 = 100.0;
/// Distances of neighbours that arrays have, in wavelengths.
const NEIGHBOURS: [f64; 2] = [0.2, 40.0];
/// Boards, and arrays of boards on one frame, are smaller than this.
const LARGEST_APERTURE_M: f64 = 1.0;

/// Antennas of an array are near each other.
pub fn spacing(facts: &Facts) -> Vec<Finding> {
    let Some(radar) = &facts.radar else { return vec![] };
    [("radar.tx_m", &radar.tx_m), ("radar.rx_m", &radar.rx_m)]
        .into_iter()
        .filter_map(|(key, antennas)| array(key, antennas, radar))
        .collect()
}

fn array(key: &str, antennas: &[[f64; 3]], radar: &Radar) -> Option<Finding> {
    let distances = || {
        let pairs = antennas.iter().enumerate().flat_map(|(index, a)| antennas[index + 1..].iter().map(move |b| (a, b)));
        pairs.map(|(a, b)| norm(minus(*a, *b))).filter(|&distance| distance > 0.0)
    };
    let (nearest, aperture) = (distances().fold(f64::INFINITY, f64::min), distances().fold(0.0, f64::max));
    let wavelength = radar.wavelength_m();
    // A wavelength that is no radar's is another check's.
    if !(wavelength.is_finite() && wavelength > 0.0) || aperture == 0.0 {
        return None;
    }
    let found = format!("antennas {nearest:.4} m to {aperture:.4} m apart");
    if nearest > FARTHEST_NEIGHBOURS * wavelength {
        let expected = format!("neighbours within {:.3} m, {FARTHEST_NEIGHBOURS} wavelengths", FARTHEST_NEIGHBOURS * wavelength);
        let units = [("half wavelengths", 0.5 * wavelength), ("millimetres", 1e-3)];
        // Whole numbers are counted in half wavelengths, others are lengths.
        let whole = antennas.iter().flatten().all(|x| (2.0 * x - (2.0 * x).round()).abs() < 1e-6);
        let order = if whole { [0, 1] } else { [1, 0] };
        let fits = |&which: &usize| (NEIGHBOURS[0]..=NEIGHBOURS[1]).contains(&(nearest * units[which].1 / wavelength));
        let unit = order.into_iter().find(fits).map(|which| units[which]);
        if let Some((unit, factor)) = unit {
            let hint =
                format!("in {unit} the neighbours would be {:.2} mm apart: multiply by {factor:.4e}", 1e3 * nearest * factor);
            return Some(Finding::new(Kind::Refuse, Part::Settings, key, found, expected).with_hint(hint));
        }
    }
    (aperture > LARGEST_APERTURE_M).then(|| {
        let expected = format!("an array within {LARGEST_APERTURE_M} m, as antennas with one clock usually are");
        Finding::new(Kind::Note, Part::Settings, key, found, expected)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(scale: f64, positions: &[f64]) -> Vec<Finding> {
        let rx_m = positions.iter().map(|x| [x * scale, 0.0, 0.0]).collect();
        spacing(&Facts { radar: Some(Radar { rx_m, ..Radar::mmmesh(1) }), ..Facts::default() })
    }

    #[test]
    fn an_array_in_metres_passes_and_single_antennas_do() {
        assert!(of(0.0019, &[0.0, 1.0, 2.0, 3.0]).is_empty());
        assert!(of(1.0, &[0.3]).is_empty());
        assert!(of(1.0, &[0.0, 0.0]).is_empty());
    }

    #[test]
    fn millimetres_and_half_wavelengths_are_told_apart() {
        let millimetres = of(1.9, &[0.0, 1.0, 2.0, 3.0]);
        assert_eq!((millimetres[0].kind, millimetres[0].field.as_str()), (Kind::Refuse, "radar.rx_m"));
        assert!(millimetres[0].hint.as_ref().unwrap().contains("in millimetres the neighbours would be 1.90 mm apart"));
        let halves = of(1.0, &[0.0, 1.0, 2.0, 3.0]);
        assert!(halves[0].hint.as_ref().unwrap().contains("in half wavelengths"), "{halves:?}");
    }

    #[test]
    fn a_wide_array_is_a_note() {
        let wide = of(1.0, &[0.0, 0.0019, 1.5]);
        assert_eq!((wide.len(), wide[0].kind), (1, Kind::Note));
    }
}
