//! Unsigned samples: what their zero is.

use super::{CodeFacts, Facts, Finding, Kind, Part};

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
