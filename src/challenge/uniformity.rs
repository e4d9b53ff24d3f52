//! Whether p-values are what they say: uniform on nulls.

use super::report::Report;
use super::table::{Aim, Row, share};
use crate::diagnosis::statistics::uniform_chance;

/// Levels at which they are counted.
const LEVELS: [f64; 5] = [0.01, 0.05, 0.1, 0.5, 0.9];
/// Least chance of their distance from a uniform law.
const LEAST: f64 = 0.05;
/// A bound is none of them.
const BOUND: &str = "suspicion";

/// Of the nulls' reports.
pub fn rows<'a>(nulls: impl Iterator<Item = &'a Report> + Clone) -> Vec<Row> {
    let all: Vec<f64> = nulls.clone().filter_map(|report| report.p_value).collect();
    let below =
        |level: f64| share(format!("nulls whose p-value is below {level}"), all.iter().map(|value| *value < level), Aim::None);
    let mut rows: Vec<Row> = LEVELS.into_iter().map(below).collect();
    rows.push(against_uniform("nulls: p-values", &all, Aim::AtLeast(LEAST)));
    let mut names: Vec<&str> = nulls.clone().flat_map(|report| report.null.keys().map(String::as_str)).collect();
    names.sort_unstable();
    names.dedup();
    rows.extend(names.into_iter().filter(|name| *name != BOUND).map(|name| {
        let values: Vec<f64> = nulls.clone().filter_map(|report| *report.null.get(name)?).collect();
        against_uniform(&format!("nulls: {}", name.replace('_', " ")), &values, Aim::None)
    }));
    rows
}

fn against_uniform(what: &str, values: &[f64], aim: Aim) -> Row {
    let estimate = (!values.is_empty()).then(|| uniform_chance(values));
    Row { what: format!("{what}, chance if uniform (Kolmogorov-Smirnov)"), n: values.len(), estimate, interval: None, aim }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_is_not_uniform() {
        let report = |p_value: f64, beside: f64| -> Report {
            serde_json::from_value(serde_json::json!({
                "verdict": "no_mismatch", "effects": [], "unexplained": [],
                "fit": { "before": {}, "after": {} },
                "p_value": p_value, "null": { "beside": beside, "along_chirp": null, "suspicion": 1.0 },
            }))
            .unwrap()
        };
        let reports: Vec<Report> = (0..100).map(|i| report(1.0 - 1e-6 * f64::from(i), (f64::from(i) + 0.5) / 100.0)).collect();
        let rows = rows(reports.iter());
        let of = |what: &str| rows.iter().find(|row| row.what.starts_with(what)).unwrap();
        assert_eq!(of("nulls whose p-value is below 0.9").estimate, Some(0.0));
        assert!(of("nulls: p-values").estimate.unwrap() < 1e-6);
        assert!(of("nulls: beside").estimate.unwrap() > 0.99);
        assert_eq!((of("nulls: along chirp").n, of("nulls: along chirp").estimate), (0, None));
        assert!(!rows.iter().any(|row| row.what.contains("suspicion")));
    }
}
