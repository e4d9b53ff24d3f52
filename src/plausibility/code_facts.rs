//! The numbers that samples are stored as.

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
    pub(super) fn lost_their_sign(&self) -> bool {
        let bits: i32 = self.number_type.trim_start_matches("uint").parse().unwrap_or(0);
        self.scale == 2f64.powi(bits) && self.steps[1] < self.steps[0]
    }
}
