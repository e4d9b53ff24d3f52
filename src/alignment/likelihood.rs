//! How likely a frame's moving cells are where the body is at a place.
//!
//! What arrives in a cell is speckle: complex Gaussian about zero, with a covariance over the channels that is predicted, noise and the
//! body's power there. That power comes from one direction but for the share that the extent of the points in the cell (and errors of the
//! array) scatters: R = A·1 + (B − A)·a aᴴ/C with A = 1 + P (1 − γ) and B = A + γ C P, for the expected power P over the noise, coherence
//! γ and steering vector a of C channels. The density has the heavy tails of Student's law: the expected power is itself uncertain, and
//! what the prediction leaves out counts by its logarithm. Without other channels it is the law that the diagnosis compares displaced
//! bodies by (`diagnosis/detectors/geometry/trial.rs`).

use num_complex::Complex32;

use super::poses::{GROUPS, Pose};
use super::readings::Readings;
use crate::diagnosis::power::LOBES;
use crate::diagnosis::prediction::range_and_velocity;

/// Degrees of freedom of the tail, as in the diagnosis.
pub const TAIL: f64 = 2.0;
/// Numbers of weights: groups of parts, each with the lobes of the diagnosis' power model.
pub const WEIGHTS: usize = GROUPS * LOBES.len();

/// Expected power of the body's parts in the cells that they reach, for one frame.
pub struct Predicted {
    cells: Vec<u32>,
    /// `[cell][weight]`
    templates: Vec<[f32; WEIGHTS]>,
    /// `[cell]`: mean direction of what arrives (unit vectors weighted by power).
    direction: Vec<[f64; 3]>,
    /// `[cell]`: variance of the directions along x and z.
    scatter: Vec<[f64; 2]>,
    /// `[cell]`, m/s
    velocity: Vec<f64>,
}

#[derive(Clone, Copy, Default)]
struct Sum {
    templates: [f32; WEIGHTS],
    all: f64,
    direction: [f64; 3],
    square: [f64; 2],
    velocity: f64,
}

impl Predicted {
    /// Of the vertices that are seen.
    pub fn new(readings: &Readings, pose: &Pose, group: &[usize], seen: &[u32]) -> Self {
        const NOWHERE: u32 = u32::MAX;
        let centre = readings.radar.centre_m();
        let mut place = vec![NOWHERE; readings.size()];
        let (mut cells, mut sums): (Vec<u32>, Vec<Sum>) = (vec![], vec![]);
        for vertex in seen.iter().map(|&vertex| vertex as usize) {
            let position = pose.position_m[vertex];
            let (range_m, velocity) = range_and_velocity(&readings.radar, position, pose.velocity_mps[vertex]);
            let away: [f64; 3] = std::array::from_fn(|axis| position[axis] - centre[axis]);
            let length = away.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-6);
            let direction = away.map(|x| x / length);
            let facing = -(0..3).map(|axis| direction[axis] * pose.normal[vertex][axis]).sum::<f64>();
            if facing <= 0.0 {
                continue;
            }
            let power = pose.area_m2[vertex] / range_m.max(0.1).powi(4);
            let lobes = LOBES.map(|exponent| power * facing.powi(exponent));
            let first = group[vertex] * LOBES.len();
            readings.cells.each(range_m, velocity, |cell, share| {
                if !readings.usable[cell] {
                    return;
                }
                if place[cell] == NOWHERE {
                    place[cell] = cells.len() as u32;
                    cells.push(cell as u32);
                    sums.push(Sum::default());
                }
                let sum = &mut sums[place[cell] as usize];
                lobes.iter().enumerate().for_each(|(lobe, power)| sum.templates[first + lobe] += *power as f32 * share);
                let power = f64::from(share) * lobes[0];
                sum.all += power;
                sum.velocity += power * velocity;
                (0..3).for_each(|axis| sum.direction[axis] += power * direction[axis]);
                [0, 2].into_iter().enumerate().for_each(|(i, axis)| sum.square[i] += power * direction[axis].powi(2));
            });
        }
        // What reaches a cell by side lobes only is noise.
        let least = 1e-5 * sums.iter().map(|sum| sum.all).fold(0.0, f64::max);
        let (cells, sums): (Vec<u32>, Vec<Sum>) = cells.into_iter().zip(sums).filter(|(_, sum)| sum.all > least).unzip();
        let mean = |sum: &Sum| sum.direction.map(|x| x / sum.all);
        let scatter = |sum: &Sum| {
            let mean = mean(sum);
            [0, 2].map(|axis| (sum.square[axis / 2] / sum.all - mean[axis].powi(2)).max(0.0))
        };
        Self {
            templates: sums.iter().map(|sum| sum.templates).collect(),
            direction: sums.iter().map(mean).collect(),
            scatter: sums.iter().map(scatter).collect(),
            velocity: sums.iter().map(|sum| sum.velocity / sum.all).collect(),
            cells,
        }
    }

    /// The same body and heading to the line of sight, farther to the right by an angle about the radar.
    pub fn at_azimuth(&self, later_rad: f64) -> impl Fn(usize) -> [f64; 3] + '_ {
        let (sine, cosine) = later_rad.sin_cos();
        move |cell| {
            let [x, y, z] = self.direction[cell];
            [cosine * x + sine * y, cosine * y - sine * x, z]
        }
    }

    /// Gain of the cells' mean power over the channels with this body, nats: the law of one channel.
    pub fn power_gain(&self, readings: &Readings, frame: usize, weights: &[f64; WEIGHTS]) -> f64 {
        let power = readings.power(frame);
        let of = |(&cell, templates): (&u32, &[f32; WEIGHTS])| power_gain(power[cell as usize], expected(templates, weights));
        self.cells.iter().zip(&self.templates).map(of).sum()
    }

    /// What the recording has there.
    pub fn against(&self, readings: &Readings, frame: usize, coherence: f64, later_rad: f64) -> Compared {
        let channels = readings.channels.len();
        let spread = [readings.spread_m2(0), readings.spread_m2(2)].map(|spread| readings.wave.powi(2) * spread);
        let direction = self.at_azimuth(later_rad);
        let looks = self.cells.iter().enumerate().map(|(index, &cell)| {
            let fields = readings.field(frame, cell as usize);
            let all = fields.iter().map(|field| f64::from(field.norm_sqr())).sum::<f64>();
            let scattered = (0..2).map(|axis| spread[axis] * self.scatter[index][axis]).sum::<f64>();
            let towards = direction(index);
            let beam: Complex32 = fields
                .iter()
                .enumerate()
                .map(|(channel, field)| {
                    let phase = readings.phase(channel, towards, self.velocity[index]);
                    field * Complex32::from_polar(1.0, -phase as f32)
                })
                .sum();
            let along = (f64::from(beam.norm_sqr()) / channels as f64).min(all);
            Look { along, aside: all - along, coherence: coherence * (-scattered).exp() }
        });
        Compared { channels: channels as f64, looks: looks.collect(), templates: self.templates.clone() }
    }
}

/// The same of all usable cells with what is expected of a cell read from the recording: the mean of it and its neighbours, where that
/// is clearly above the noise.
pub fn most_power_gain(readings: &Readings, frame: usize) -> f64 {
    /// Over the noise: a mean of nine such cells exceeds it by chance in one of 10⁷ cells.
    const CLEAR: f64 = 3.5;
    let (power, samples, loops) = (readings.power(frame), readings.cells.samples, readings.cells.loops);
    let of = |cell: usize| {
        let around = [loops - 1, 0, 1]
            .into_iter()
            .flat_map(|row| [samples - 1, 0, 1].map(|bin| (row, bin)))
            .map(|(row, bin)| f64::from(power[(cell / samples + row) % loops * samples + (cell % samples + bin) % samples]));
        let mean = around.sum::<f64>() / 9.0;
        if mean < CLEAR { 0.0 } else { power_gain(power[cell], mean - 1.0) }
    };
    (0..readings.size()).filter(|&cell| readings.usable[cell]).map(of).sum()
}

fn power_gain(power: f32, expected: f64) -> f64 {
    let look = Look { along: f64::from(power), aside: 0.0, coherence: 1.0 };
    look.log_likelihood(expected, 1.0) - look.log_likelihood(0.0, 1.0)
}

fn expected(templates: &[f32; WEIGHTS], weights: &[f64; WEIGHTS]) -> f64 {
    templates.iter().zip(weights).map(|(template, weight)| f64::from(*template) * weight).sum()
}

/// One cell of the recording, split by the predicted direction.
#[derive(Clone, Copy)]
struct Look {
    /// Power along the steering vector, and all other.
    along: f64,
    aside: f64,
    coherence: f64,
}

/// A frame's measured cells beside its prediction.
pub struct Compared {
    channels: f64,
    looks: Vec<Look>,
    templates: Vec<[f32; WEIGHTS]>,
}

impl Look {
    /// A, B, and the quadratic form of the cell.
    fn law(&self, power: f64, channels: f64) -> [f64; 3] {
        let a = 1.0 + power * (1.0 - self.coherence);
        let b = a + power * self.coherence * channels;
        [a, b, self.aside / a + self.along / b]
    }

    fn log_likelihood(&self, power: f64, channels: f64) -> f64 {
        let [a, b, form] = self.law(power, channels);
        -(channels - 1.0) * a.ln() - b.ln() - (TAIL + channels) * (form / TAIL).ln_1p()
    }

    /// Of the derivative of the logarithm of likelihood to the power: what raises it, and what lowers it.
    fn slopes(&self, power: f64, channels: f64) -> [f64; 2] {
        let [a, b, form] = self.law(power, channels);
        let (aside, along) = (1.0 - self.coherence, 1.0 - self.coherence + self.coherence * channels);
        let kept = (TAIL + channels) / (TAIL + form);
        [kept * (self.aside * aside / (a * a) + self.along * along / (b * b)), (channels - 1.0) * aside / a + along / b]
    }
}

impl Compared {
    /// Logarithm of how much likelier the frame's cells are with this body than with none, nats.
    pub fn gain(&self, weights: &[f64; WEIGHTS]) -> f64 {
        let of = |(look, templates): (&Look, &[f32; WEIGHTS])| {
            look.log_likelihood(expected(templates, weights), self.channels) - look.log_likelihood(0.0, self.channels)
        };
        self.looks.iter().zip(&self.templates).map(of).sum()
    }

    fn step(&self, weights: &[f64; WEIGHTS]) -> [[f64; 2]; WEIGHTS] {
        let mut sums = [[0.0; 2]; WEIGHTS];
        for (look, templates) in self.looks.iter().zip(&self.templates) {
            let [up, down] = look.slopes(expected(templates, weights), self.channels);
            for (sum, template) in sums.iter_mut().zip(templates) {
                let template = f64::from(*template);
                *sum = [sum[0] + template * up, sum[1] + template * down];
            }
        }
        sums
    }
}

/// A common weight: measured over predicted energy.
pub fn first_weights(frames: &[&Compared]) -> [f64; WEIGHTS] {
    let (mut power, mut energy) = (0.0, 0.0);
    for frame in frames {
        power += frame.looks.iter().map(|look| ((look.along + look.aside) / frame.channels - 1.0).max(0.0)).sum::<f64>();
        energy += frame.templates.iter().flatten().map(|template| f64::from(*template)).sum::<f64>();
    }
    [if energy > 0.0 { (power / energy).max(f64::MIN_POSITIVE) } else { 0.0 }; WEIGHTS]
}

/// Multiplicative steps towards the weights that make the frames likeliest (Févotte, Bertin, Durrieu 2009, with this law's slopes).
pub fn improve(frames: &[&Compared], weights: &mut [f64; WEIGHTS], steps: usize) {
    use rayon::prelude::*;
    for _ in 0..steps {
        let add = |mut a: [[f64; 2]; WEIGHTS], b: [[f64; 2]; WEIGHTS]| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a = [a[0] + b[0], a[1] + b[1]]);
            a
        };
        // In the order of the frames, whichever thread had which.
        let of_frames: Vec<_> = frames.par_iter().map(|frame| frame.step(weights)).collect();
        let sums = of_frames.into_iter().fold([[0.0; 2]; WEIGHTS], add);
        for (weight, [up, down]) in weights.iter_mut().zip(sums) {
            if down > 0.0 {
                // The square root makes every step safe.
                *weight *= (up / down).sqrt();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_the_derivative_of_the_logarithm_of_likelihood() {
        let look = Look { along: 30.0, aside: 5.0, coherence: 0.9 };
        for power in [0.0, 0.7, 12.0] {
            let [up, down] = look.slopes(power, 4.0);
            let difference = (look.log_likelihood(power + 1e-5, 4.0) - look.log_likelihood((power - 1e-5).max(0.0), 4.0))
                / if power > 0.0 { 2e-5 } else { 1e-5 };
            assert!((up - down - difference).abs() < 1e-3 * (1.0 + difference.abs()), "{power}: {} {difference}", up - down);
        }
    }

    #[test]
    fn power_from_the_predicted_direction_is_likelier_than_from_another() {
        let along = Look { along: 40.0, aside: 4.0, coherence: 0.95 };
        let aside = Look { along: 4.0, aside: 40.0, coherence: 0.95 };
        assert!(along.log_likelihood(10.0, 4.0) > aside.log_likelihood(10.0, 4.0) + 3.0);
        // One channel knows no direction, and has the diagnosis' law.
        let one = Look { along: 7.0, aside: 0.0, coherence: 0.9 };
        let (power, expected) = (3.0, 4.0f64);
        let wanted = -expected.ln() - (TAIL + 1.0) * (7.0 / (TAIL * expected)).ln_1p();
        assert!((one.log_likelihood(power, 1.0) - wanted).abs() < 1e-12);
    }
}
