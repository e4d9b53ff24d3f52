//! How detection grows with strength: shares in bins, and a logistic curve through all cases.

use crate::pictures::{Chart, Scale, Series};

/// p = 1 / (1 + exp(−slope · (log₁₀ d′ − middle))).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Logistic {
    pub middle: f64,
    pub slope: f64,
}

impl Logistic {
    /// By maximum likelihood; `points` are (log₁₀ d′, detected). A weak pull on the slope keeps it finite where the
    /// cases can be parted perfectly. None without both kinds.
    pub fn fit(points: &[(f64, bool)]) -> Option<Self> {
        let hits = points.iter().filter(|(_, hit)| *hit).count();
        if hits == 0 || hits == points.len() {
            return None;
        }
        let mean = points.iter().map(|(x, _)| x).sum::<f64>() / points.len() as f64;
        let (mut a, mut b) = (0.0f64, 1.0f64);
        const PULL: f64 = 1e-3;
        for _ in 0..100 {
            let (mut ga, mut gb, mut haa, mut hab, mut hbb) = (0.0, -PULL * b, 1e-9, 0.0, PULL);
            for &(x, hit) in points {
                let x = x - mean;
                let p = 1.0 / (1.0 + (-(a + b * x)).exp());
                let (error, weight) = (f64::from(u8::from(hit)) - p, p * (1.0 - p));
                ga += error;
                gb += error * x;
                haa += weight;
                hab += weight * x;
                hbb += weight * x * x;
            }
            let determinant = haa * hbb - hab * hab;
            let (da, db) = ((hbb * ga - hab * gb) / determinant, (haa * gb - hab * ga) / determinant);
            // Newton's step may be too long where the curve is steep.
            let length = (da * da + db * db).sqrt().max(1.0);
            a += da / length;
            b += db / length;
        }
        (b.is_finite() && b.abs() > 1e-9).then(|| Self { middle: mean - a / b, slope: b })
    }

    /// Share detected at x = log₁₀ d′.
    pub fn at(&self, x: f64) -> f64 {
        1.0 / (1.0 + (-self.slope * (x - self.middle)).exp())
    }

    /// log₁₀ d′ at which so large a part is detected.
    pub fn level(&self, part: f64) -> f64 {
        self.middle + (part / (1.0 - part)).ln() / self.slope
    }
}

/// Shares in tenths of the cases, with the curve if there is one; each point is log₁₀ d′ and whether it was detected.
pub fn chart(points: &[(f64, bool)], fit: Option<Logistic>) -> Chart {
    let (low, high) = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &(x, _)| (low.min(x), high.max(x)));
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let per_bin = sorted.len().div_ceil(10).max(1);
    let bins = sorted
        .chunks(per_bin)
        .map(|bin| {
            let n = bin.len() as f64;
            [10f64.powf(bin.iter().map(|(x, _)| x).sum::<f64>() / n), bin.iter().filter(|(_, hit)| *hit).count() as f64 / n]
        })
        .collect();
    let mut series = vec![Series { name: "detected, tenths of the cases".into(), points: bins }];
    if let Some(fit) = fit.filter(|_| low < high) {
        let points = (0..=100).map(|i| low + (high - low) * f64::from(i) / 100.0).map(|x| [10f64.powf(x), fit.at(x)]).collect();
        series.push(Series { name: "logistic fit".into(), points });
    }
    Chart {
        title: "detection against strength".into(),
        x_label: "d' (effect against noise)".into(),
        y_label: "share detected".into(),
        x_scale: Scale::Log,
        series,
        ..Chart::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_logistic_curve_is_found_again() {
        let truth = Logistic { middle: 0.8, slope: 5.0 };
        // 50 cases at each of 21 strengths, with the very shares of the curve.
        let points: Vec<(f64, bool)> = (0..21)
            .flat_map(|i| {
                let x = -0.2 + 0.1 * f64::from(i);
                (0..50).map(move |k| (x, (f64::from(k) + 0.5) / 50.0 < truth.at(x)))
            })
            .collect();
        let found = Logistic::fit(&points).unwrap();
        assert!((found.middle - 0.8).abs() < 0.02 && (found.slope - 5.0).abs() < 0.4, "{found:?}");
        assert!((found.level(0.5) - found.middle).abs() < 1e-12);
        assert!((found.at(found.level(0.9)) - 0.9).abs() < 1e-9);
    }

    #[test]
    fn cases_that_part_perfectly_or_are_all_alike_do_no_harm() {
        let parted: Vec<(f64, bool)> = (0..40).map(|i| (f64::from(i) * 0.1, i >= 20)).collect();
        let found = Logistic::fit(&parted).unwrap();
        assert!((found.middle - 1.95).abs() < 0.1 && found.slope.is_finite());
        assert_eq!(Logistic::fit(&[(0.0, true), (1.0, true)]), None);
        assert_eq!(Logistic::fit(&[]), None);
        let folder = tempfile::tempdir().unwrap();
        chart(&parted, Some(found)).save(&folder.path().join("a.png")).unwrap();
    }
}
