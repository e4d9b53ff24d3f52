//! Unsigned samples: what their zero is.

use super::{Facts, Finding, Kind, Part};

/// The codes of one frame, as far as their zero shows.
#[derive(Clone, Debug, PartialEq)]
pub struct CodeFacts {
    /// NumPy's name of the stored numbers.
    pub number_type: String,
    pub mean: f64,
    /// The power of two above the largest code.
    pub scale: f64,
    /// Mean square of the step from sample to sample: of the codes as they are, and with the upper half of the type's range
    /// negative.
    steps: [f64; 2],
}

impl CodeFacts {
    /// Of samples stored as `number_type`; `None` where they have a sign.
    pub fn new<'a>(number_type: &str, codes: impl Iterator<Item = &'a f32> + Clone) -> Option<Self> {
        let bits: i32 = number_type.strip_prefix("uint")?.parse().ok()?;
        let (range, count) = (2f64.powi(bits), codes.clone().count().max(1) as f64);
        let values = || codes.clone().map(|&code| f64::from(code));
        let signed = |code: f64| if code < 0.5 * range { code } else { code - range };
        let step = |map: &dyn Fn(f64) -> f64| {
            let steps = values().zip(values().skip(1)).map(|(code, next)| (map(next) - map(code)).powi(2));
            steps.sum::<f64>() / count
        };
        Some(Self {
            number_type: number_type.into(),
            mean: values().sum::<f64>() / count,
            scale: 2f64.powf((values().fold(1.0, f64::max) + 1.0).log2().ceil()),
            steps: [step(&|code| code), step(&signed)],
        })
    }

    /// Whether these are signed codes whose type was lost: they reach the top of the type's range, and are smoother when
    /// its upper half is negative.
    fn lost_their_sign(&self) -> bool {
        let bits: i32 = self.number_type.trim_start_matches("uint").parse().unwrap_or(0);
        self.scale == 2f64.powi(bits) && self.steps[1] < self.steps[0]
    }
}

/// Samples swing about zero. Unsigned codes are offset binary, whose zero is the middle of the scale, or signed ones
/// whose type was lost.
pub fn unsigned(facts: &Facts) -> Vec<Finding> {
    let Some(codes) = &facts.codes else { return vec![] };
    let CodeFacts { number_type, mean, scale, .. } = codes;
    if codes.lost_their_sign() {
        let found = format!("{number_type} with codes at both ends of their range (mean {mean:.1})");
        let hint = format!("they look like two's complement: store array.view(np.{})", number_type.trim_start_matches('u'));
        return vec![Finding::new(Kind::Refuse, Part::Samples, "if", found, "signed codes").with_hint(hint)];
    }
    let found = format!("{number_type} of mean {mean:.1} on a scale of {scale:.0}");
    let hint = format!("if its middle is zero, as in offset binary, store array.astype(float) - {:.0}", 0.5 * scale);
    vec![
        Finding::new(Kind::Note, Part::Samples, "if", found, "samples that swing about zero: the mean is taken as an offset")
            .with_hint(hint),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(number_type: &str, codes: &[f32]) -> Vec<Finding> {
        unsigned(&Facts { codes: CodeFacts::new(number_type, codes.iter()), ..Facts::default() })
    }

    #[test]
    fn signed_samples_are_not_questioned() {
        assert!(of("int16", &[2040.0, 2050.0]).is_empty());
        assert!(of("complex128", &[0.5]).is_empty());
    }

    #[test]
    fn offset_binary_is_a_note_with_its_middle() {
        let swing: Vec<f32> = (0..100).map(|n| 2048.0 + 1500.0 * (0.3 * n as f32).sin()).collect();
        let found = of("uint16", &swing);
        assert_eq!(found[0].kind, Kind::Note);
        assert!(found[0].found.contains("on a scale of 4096") && found[0].hint.as_ref().unwrap().contains("- 2048"), "{found:?}");
        // Eight bits that use all of their range are offset binary still.
        let bytes: Vec<f32> = (0..100).map(|n| (128.0 + 120.0 * (0.3 * n as f32).sin()).round()).collect();
        assert_eq!(of("uint8", &bytes)[0].kind, Kind::Note);
    }

    #[test]
    fn twos_complement_that_lost_its_sign_is_refused() {
        let wrapped: Vec<f32> = (0..100)
            .map(|n| (1500.0 * (0.3 * n as f32).sin()).round())
            .map(|code| if code < 0.0 { code + 65536.0 } else { code })
            .collect();
        let found = of("uint16", &wrapped);
        assert_eq!(found[0].kind, Kind::Refuse);
        assert!(found[0].hint.as_ref().unwrap().contains("np.int16"));
    }
}
