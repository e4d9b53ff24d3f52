//! Parameters as people read them: a name without its unit, and values with it.

use serde_json::Value;

use crate::effects;
use crate::pictures::page::shown;

/// Units that take prefixes.
const PREFIXED: [&str; 4] = ["Hz", "Hz/s", "m", "s"];
const PREFIXES: [(f64, &str); 9] =
    [(1e12, "T"), (1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p")];
/// Endings of names that only say the unit.
const ENDINGS: [&str; 8] = ["_hz", "_m", "_s", "_db", "_deg", "_rad", "_mps", "_ppm"];

/// Name, value and interval of an effect's parameter.
pub(super) fn row(effect: &str, name: &str, value: &Value, interval: &Value) -> [String; 3] {
    let unit = effects::info(effect).and_then(|info| info.parameter(name)).map_or("", |parameter| parameter.unit);
    let scale = Scale::of(value, unit);
    let plain = ENDINGS.iter().find_map(|ending| name.strip_suffix(ending)).unwrap_or(name).replace('_', " ");
    let unit = scale.unit(unit);
    [shown(&plain), scale.text(value) + &unit, scale.interval(interval) + &unit]
}

/// By what values are divided, and the prefix that says so.
#[derive(Clone, Copy)]
struct Scale {
    divisor: f64,
    prefix: &'static str,
}

impl Scale {
    /// So that the largest of the values has one to three digits before the point.
    fn of(value: &Value, unit: &str) -> Self {
        let size = largest(value);
        // Nobody writes mHz of a breath.
        let is_usual = |divisor: f64| divisor >= 1.0 || ["m", "s"].contains(&unit);
        let fits = |(divisor, _): &&(f64, &str)| size >= *divisor && is_usual(*divisor);
        let found = PREFIXES.iter().find(fits).filter(|_| PREFIXED.contains(&unit));
        let (divisor, prefix) = found.copied().unwrap_or((1.0, ""));
        Self { divisor, prefix }
    }

    /// With the space before it; `1` is no unit.
    fn unit(self, unit: &str) -> String {
        match unit {
            "" | "1" => String::new(),
            "deg" => " °".into(),
            unit => format!(" {}{unit}", self.prefix),
        }
    }

    fn text(self, value: &Value) -> String {
        match value {
            Value::Number(number) => short(number.as_f64().unwrap_or(0.0) / self.divisor),
            Value::Array(list) => {
                let parts: Vec<String> = list.iter().map(|value| self.text(value)).collect();
                if list.iter().any(Value::is_array) { parts.join("; ") } else { format!("({})", parts.join(", ")) }
            }
            Value::String(text) => shown(text),
            _ => "–".into(),
        }
    }

    /// `low to high`, one for each value.
    fn interval(self, value: &Value) -> String {
        match value.as_array().map(Vec::as_slice) {
            Some([low @ Value::Number(_), high @ Value::Number(_)]) if low == high => format!("exactly {}", self.text(low)),
            Some([low @ Value::Number(_), high @ Value::Number(_)]) => format!("{} to {}", self.text(low), self.text(high)),
            Some([first, others @ ..]) if others.iter().all(|other| other == first) => self.interval(first),
            Some(list) => list.iter().map(|pair| self.interval(pair)).collect::<Vec<_>>().join("; "),
            None => "–".into(),
        }
    }
}

fn largest(value: &Value) -> f64 {
    match value {
        Value::Number(number) => number.as_f64().unwrap_or(0.0).abs(),
        Value::Array(list) => list.iter().map(largest).fold(0.0, f64::max),
        _ => 0.0,
    }
}

/// Four digits, without a tail of zeros.
fn short(value: f64) -> String {
    let size = value.abs();
    let (text, power) = match size {
        _ if size >= 1e5 || (size > 0.0 && size < 1e-3) => {
            let power = size.log10().floor();
            (format!("{:.3}", value / 10f64.powf(power)), format!("·10^{power}"))
        }
        _ if size >= 100.0 => (format!("{value:.1}"), String::new()),
        _ if size >= 1.0 => (format!("{value:.3}"), String::new()),
        // −0 reads as 0
        _ => (format!("{:.4}", value + 0.0), String::new()),
    };
    (text.trim_end_matches('0').trim_end_matches('.').to_string() + &power).replace('-', "−")
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn values_have_their_unit_with_a_prefix() {
        let of = |effect: &str, name: &str, value: Value, interval: Value| row(effect, name, &value, &interval);
        let corner = of("if_highpass", "corner_hz", json!(351_100.0), json!([340_000.0, 362_000.0]));
        assert_eq!(corner, ["corner", "351.1 kHz", "340 to 362 kHz"]);
        let order = of("if_highpass", "order", json!(2.0), json!([2.0, 2.0]));
        assert_eq!(order, ["order", "2", "exactly 2"]);
        let swing = of("moving_reflector", "swing_m", json!(0.0963), json!([0.0916, 0.1107]));
        assert_eq!(swing, ["swing", "96.3 mm", "91.6 to 110.7 mm"]);
        let place = of("moving_reflector", "position_m", json!([-0.9, 3.4, 0.0]), json!([[-1.0, -0.8], [3.3, 3.5], [-1.0, 1.0]]));
        assert_eq!(place, ["position", "(−0.9, 3.4, 0) m", "−1 to −0.8; 3.3 to 3.5; −1 to 1 m"]);
        assert_eq!(of("if_delay", "delay_s", json!(5e-10), json!([4e-10, 6e-10]))[1..], ["500 ps", "400 to 600 ps"]);
        assert_eq!([short(-0.0), short(4e-5), short(-1.5e6)], ["0", "4·10^−5", "−1.5·10^6"]);
        assert_eq!(of("no_effect", "count", json!(3), Value::Null), ["count", "3", "–"]);
    }
}
