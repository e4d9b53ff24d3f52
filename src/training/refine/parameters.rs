//! What is refined as one list of numbers: each in standard deviations of its prior, so that one step suits all.

use burn::tensor::{DType, Device, Tensor, TensorData};

use super::RefineConfig;
use crate::body::{PoseCorrection, PoseTensors};

/// Prior of the logarithmic gain of a part of the body, nepers of power: a factor of 4.5 either way.
pub const GAIN: f64 = 1.5;

/// Parts of a whole recording's correction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Parts {
    pub clock: bool,
    /// Place and heading.
    pub place: bool,
}

impl Parts {
    pub fn name(self) -> &'static str {
        match (self.clock, self.place) {
            (false, false) => "the motion as given",
            (true, false) => "a clock",
            (false, true) => "a place and heading",
            (true, true) => "a clock, place and heading",
        }
    }
}

/// Kinds of numbers, in their order in the list.
pub struct Layout {
    parts: Parts,
    clock_s: f64,
    heading_rad: f64,
    shift_m: f64,
    turn_rad: f64,
    knot_shift_m: f64,
    joints: usize,
    gains: usize,
    /// Correlation of a knot with the one before; the first has none. Empty without knots.
    correlation: Vec<f64>,
}

const WHOLE: usize = 5;

impl Layout {
    /// `parts`: of the whole recording, those that are corrected; `knots_s`: empty where single frames are not.
    pub fn new(config: &RefineConfig, parts: Parts, knots_s: &[f64], joints: usize, gains: usize) -> Self {
        let before = std::iter::once(f64::NEG_INFINITY).chain(knots_s.iter().copied());
        Self {
            parts,
            clock_s: config.clock_s,
            heading_rad: config.heading_deg.to_radians(),
            shift_m: config.shift_m,
            turn_rad: config.frame_turn_deg.to_radians(),
            knot_shift_m: config.frame_shift_m,
            joints,
            gains,
            correlation: knots_s.iter().zip(before).map(|(knot, before)| (-(knot - before) / config.smooth_s).exp()).collect(),
        }
    }

    pub fn knots(&self) -> usize {
        self.correlation.len()
    }

    /// Numbers of one knot: turns, then shift.
    fn knot_width(&self) -> usize {
        3 * self.joints + 3
    }

    /// Whether a number changes; the others stay as they are.
    pub fn moves(&self, at: usize) -> bool {
        match at {
            0 => self.parts.clock,
            1..WHOLE => self.parts.place,
            _ => true,
        }
    }

    /// Where the gains are in the list.
    pub fn gains(&self) -> std::ops::Range<usize> {
        WHOLE..WHOLE + self.gains
    }

    pub fn len(&self) -> usize {
        WHOLE + self.gains + self.knots() * self.knot_width()
    }

    /// The correction that the numbers stand for; knots and pivot are those of `like`.
    pub fn correction(&self, values: &[f64], like: &PoseCorrection) -> PoseCorrection {
        let vector = |at: usize, unit: f64| -> [f64; 3] { std::array::from_fn(|axis| unit * values[at + axis]) };
        let start = |knot: usize| WHOLE + self.gains + knot * self.knot_width();
        let turns = |knot: usize| (0..self.joints).map(|joint| vector(start(knot) + 3 * joint, self.turn_rad)).collect();
        PoseCorrection {
            clock_s: values[0] * self.clock_s,
            heading_rad: values[1] * self.heading_rad,
            shift_m: vector(2, self.shift_m),
            turns_rad: (0..self.knots()).map(turns).collect(),
            shifts_m: (0..self.knots()).map(|knot| vector(start(knot) + 3 * self.joints, self.knot_shift_m)).collect(),
            ..like.clone()
        }
    }

    /// Leaves of the graph of gradients.
    pub fn leaves(&self, values: &[f64], device: &Device) -> Leaves {
        let leaf = |values: &[f64]| -> Tensor<1> {
            Tensor::from_data(TensorData::new(values.to_vec(), [values.len()]), (device, DType::F32)).require_grad()
        };
        Leaves {
            whole: leaf(&values[..WHOLE]),
            gains: leaf(&values[WHOLE..WHOLE + self.gains]),
            knots: (self.knots() > 0).then(|| leaf(&values[WHOLE + self.gains..])),
        }
    }

    pub fn pose(&self, leaves: &Leaves) -> PoseTensors {
        let whole = |start: usize, count: usize, unit: f64| leaves.whole.clone().narrow(0, start, count) * unit;
        let knots = leaves.knots.clone().map(|knots| -> Tensor<2> { knots.reshape([self.knots(), self.knot_width()]) });
        let turns = knots
            .clone()
            .map(|knots| (knots.narrow(1, 0, 3 * self.joints) * self.turn_rad).reshape([self.knots(), self.joints, 3]));
        PoseTensors {
            clock_s: Some(whole(0, 1, self.clock_s)),
            heading_rad: Some(whole(1, 1, self.heading_rad)),
            shift_m: Some(whole(2, 3, self.shift_m)),
            betas: None,
            turns_rad: turns,
            shifts_m: knots.map(|knots| knots.narrow(1, 3 * self.joints, 3) * self.knot_shift_m),
        }
    }

    /// `[part, lobe]`, nepers of power.
    pub fn log_gain(&self, leaves: &Leaves, lobes: usize, level: f64) -> Tensor<2> {
        (leaves.gains.clone() * GAIN + level).reshape([self.gains / lobes, lobes])
    }

    /// Gradient of the prior in nats: ½ x² of whole-recording numbers and gains; of each number of the knots an
    /// Ornstein-Uhlenbeck process of deviation 1.
    pub fn prior_gradient(&self, values: &[f64]) -> Vec<f64> {
        let knots = WHOLE + self.gains;
        let mut gradient: Vec<f64> = values[..knots].to_vec();
        gradient.resize(values.len(), 0.0);
        let width = self.knot_width();
        for (knot, &correlation) in self.correlation.iter().enumerate() {
            for at in knots + knot * width..knots + (knot + 1) * width {
                let before = if knot == 0 { 0.0 } else { values[at - width] };
                let pull = (values[at] - correlation * before) / (1.0 - correlation * correlation);
                gradient[at] += pull;
                if knot > 0 {
                    gradient[at - width] -= correlation * pull;
                }
            }
        }
        gradient
    }
}

/// The numbers on a device.
pub struct Leaves {
    pub whole: Tensor<1>,
    pub gains: Tensor<1>,
    pub knots: Option<Tensor<1>>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_become_the_correction_in_its_units() {
        let config = RefineConfig { shift_m: 0.1, clock_s: 0.2, frame_shift_m: 0.03, ..Default::default() };
        let layout = Layout::new(&config, Parts::default(), &[0.0, 0.5], 2, 4);
        let mut values = vec![0.0; layout.len()];
        (values[0], values[1], values[4]) = (0.5, -1.0, 2.0);
        let knot = WHOLE + 4 + 9;
        (values[knot + 4], values[knot + 6]) = (1.0, -1.0);
        let found = layout.correction(&values, &PoseCorrection::default());
        assert_eq!((found.clock_s, found.heading_rad, found.shift_m), (0.1, -10f64.to_radians(), [0.0, 0.0, 0.2]));
        assert_eq!(found.turns_rad[1], [[0.0; 3], [0.0, 3f64.to_radians(), 0.0]]);
        assert_eq!(found.shifts_m, [[0.0; 3], [-0.03, 0.0, 0.0]]);
    }

    #[test]
    fn the_prior_s_gradient_agrees_with_central_differences() {
        let layout = Layout::new(&RefineConfig::default(), Parts::default(), &[0.0, 0.1, 0.5], 1, 2);
        let value = |values: &[f64]| -> f64 {
            let knots = WHOLE + 2;
            let whole: f64 = values[..knots].iter().map(|x| 0.5 * x * x).sum();
            let knot = |knot: usize, at: usize| values[knots + 6 * knot + at];
            let pair = |later: usize, at: usize| {
                let rho = layout.correlation[later];
                0.5 * (knot(later, at) - rho * knot(later - 1, at)).powi(2) / (1.0 - rho * rho)
            };
            whole + (0..6).map(|at| 0.5 * knot(0, at).powi(2) + pair(1, at) + pair(2, at)).sum::<f64>()
        };
        let values: Vec<f64> = (0..layout.len()).map(|at| (at as f64).sin()).collect();
        for (at, found) in layout.prior_gradient(&values).into_iter().enumerate() {
            let moved = |step: f64| {
                let mut values = values.clone();
                values[at] += step;
                value(&values)
            };
            assert!((found - (moved(1e-5) - moved(-1e-5)) / 2e-5).abs() < 1e-8, "{at}");
        }
    }
}
