//! Numbers with their uncertainty, as rows of a table.

use serde::Serialize;

use crate::diagnosis::statistics::{binomial_interval, median};

/// What a row is to reach.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Aim {
    AtMost(f64),
    AtLeast(f64),
    Between(f64, f64),
    /// For comparison.
    None,
}

/// One number of a score, with what it is to reach.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub what: String,
    pub n: usize,
    pub estimate: Option<f64>,
    /// 95 %.
    pub interval: Option<[f64; 2]>,
    pub aim: Aim,
}

impl Aim {
    fn met(self, estimate: f64) -> Option<bool> {
        match self {
            Self::AtMost(most) => Some(estimate <= most),
            Self::AtLeast(least) => Some(estimate >= least),
            Self::Between(low, high) => Some((low..=high).contains(&estimate)),
            Self::None => None,
        }
    }

    fn text(self) -> String {
        match self {
            Self::AtMost(most) => format!("≤ {most}"),
            Self::AtLeast(least) => format!("≥ {least}"),
            Self::Between(low, high) => format!("{low} to {high}"),
            Self::None => "–".into(),
        }
    }
}

/// A share with its exact (Clopper–Pearson) interval.
pub fn share(what: impl Into<String>, hits: impl IntoIterator<Item = bool>, aim: Aim) -> Row {
    let hits: Vec<bool> = hits.into_iter().collect();
    let (count, n) = (hits.iter().filter(|&&hit| hit).count(), hits.len());
    Row {
        what: what.into(),
        n,
        estimate: (n > 0).then(|| count as f64 / n as f64),
        interval: (n > 0).then(|| binomial_interval(count, n, 0.95)),
        aim,
    }
}

/// A median with the interval of its order statistics; as exact as a share, whatever the distribution.
pub fn middle(what: impl Into<String>, values: impl IntoIterator<Item = f64>, aim: Aim) -> Row {
    let mut values: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
    let n = values.len();
    if n == 0 {
        return Row { what: what.into(), n, estimate: None, interval: None, aim };
    }
    values.sort_by(f64::total_cmp);
    let spread = 0.98 * (n as f64).sqrt();
    let at = |rank: f64| values[(rank.clamp(0.0, (n - 1) as f64)) as usize];
    let interval = [at((0.5 * n as f64 - spread).floor()), at((0.5 * n as f64 + spread).ceil())];
    Row { what: what.into(), n, estimate: Some(median(&mut values.clone())), interval: Some(interval), aim }
}

/// A table in Markdown, and whether each row reached its aim.
pub fn markdown(rows: &[Row]) -> String {
    let mut text = String::from("| | n | estimate | 95 % interval | aim | met |\n|---|---|---|---|---|---|\n");
    for row in rows {
        let estimate = row.estimate.map_or("–".into(), |value| format!("{value:.3}"));
        let interval = row.interval.map_or("–".into(), |[low, high]| format!("{low:.3} to {high:.3}"));
        let met = match row.estimate.and_then(|estimate| row.aim.met(estimate)) {
            Some(true) => "yes",
            Some(false) => "**no**",
            None => "–",
        };
        text.push_str(&format!("| {} | {} | {estimate} | {interval} | {} | {met} |\n", row.what, row.n, row.aim.text()));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_and_medians_carry_their_intervals() {
        let row = share("alarms", (0..96).map(|i| i < 1), Aim::AtMost(0.02));
        assert_eq!(row.n, 96);
        let [low, high] = row.interval.unwrap();
        // Exact limits of 1 in 96.
        assert!((low - 0.000264).abs() < 2e-5 && (high - 0.05669).abs() < 2e-4, "{low} {high}");
        let row = middle("rrr", (0..101).map(f64::from), Aim::AtLeast(40.0));
        assert_eq!((row.n, row.estimate), (101, Some(50.0)));
        assert!(row.interval.unwrap()[0] >= 38.0 && row.interval.unwrap()[1] <= 62.0);
        assert!(markdown(&[row]).contains("| rrr | 101 | 50.000 |"));
        assert!(markdown(&[middle("none", [], Aim::None)]).contains("| none | 0 | – | – | – | – |"));
    }
}
