//! Windows against the leakage of strong returns into weak cells.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

/// In its periodic form: the one whose DFT has exact zeros on whole bins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Window {
    #[default]
    Hann,
    Hamming,
    Rectangular,
}

impl Window {
    /// Weights that sum to 1, so that a constant stays what it was.
    pub fn weights(self, length: usize) -> Vec<f64> {
        let (offset, swing) = match self {
            // a single sample, and the zero that a Hann window has for it, would leave nothing
            _ if length == 1 => (1.0, 0.0),
            Self::Hann => (0.5, 0.5),
            Self::Hamming => (0.54, 0.46),
            Self::Rectangular => (1.0, 0.0),
        };
        let raw: Vec<f64> = (0..length).map(|n| offset - swing * (TAU * n as f64 / length as f64).cos()).collect();
        let sum: f64 = raw.iter().sum();
        raw.into_iter().map(|weight| weight / sum).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_and_are_never_negative() {
        for window in [Window::Hann, Window::Hamming, Window::Rectangular] {
            for length in [1, 2, 3, 85, 128] {
                let weights = window.weights(length);
                assert_eq!(weights.len(), length);
                assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-14, "{window:?} {length}");
                assert!(weights.iter().all(|&weight| weight >= 0.0), "{window:?} {length}");
            }
        }
    }

    #[test]
    fn a_hann_window_starts_at_zero_and_peaks_in_the_middle() {
        let weights = Window::Hann.weights(8);
        assert_eq!(weights[0], 0.0);
        // mean weight 1/8, peak twice that
        assert!((weights[4] - 0.25).abs() < 1e-15);
        assert!((weights[1] - weights[7]).abs() < 1e-15);
    }

    #[test]
    fn settings_name_windows_in_lower_case() {
        assert_eq!(serde_json::to_string(&Window::Hamming).unwrap(), "\"hamming\"");
        assert!(serde_json::from_str::<Window>("\"Hann\"").is_err());
    }
}
