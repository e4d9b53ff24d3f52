//! Elements of a static additive field, chosen one after the other by their log-likelihood less the price of what they leave open.

use num_complex::Complex64;

use super::field::{Field, Fitted, Templates, orthonormal, remove};
use super::support::{beat_hz, dot, energy, tone};
use crate::diagnosis::Evidence;
use crate::diagnosis::detectors::climb::golden_section;
use crate::effects;

/// Leakage over the board is nearer than this.
pub const NEAR_M: f64 = 0.5;
/// Longest transient at an edge, samples.
const LONGEST_EDGE: usize = 16;
const MOST_ELEMENTS: usize = 8;
/// Variance inflation factor from which on an amplitude is not estimable (Kutner, Nachtsheim & Neter 2004, section 10.5).
const MOST_INFLATED: f64 = 10.0;

#[derive(Clone, Debug, PartialEq)]
pub enum Element {
    Offset,
    /// Beat frequency in turns per sample.
    Leakage(f64),
    /// Of something at rest before the room's surfaces or behind them, at a beat frequency in turns per sample.
    Return(f64),
    Start(usize),
    End(usize),
    Image,
    Square,
}

impl Element {
    fn id(&self) -> &'static str {
        match self {
            Self::Offset => effects::dc_offset::ID,
            Self::Leakage(_) => effects::tx_leakage::ID,
            Self::Return(_) => effects::static_reflector::ID,
            Self::Start(_) | Self::End(_) => effects::ramp_edge_transient::ID,
            Self::Image => effects::iq_imbalance::ID,
            Self::Square => effects::second_harmonic::ID,
        }
    }
}

/// Price in nats of another complex number.
fn penalty(field: &Field) -> f64 {
    1.5 * field.freedom().ln().max(4.0)
}

/// What non-linear receivers make of the static scene, `[channel][sample]`.
pub struct Images {
    conjugate: Vec<Vec<Complex64>>,
    square: Vec<Vec<Complex64>>,
}

impl Images {
    pub fn new(evidence: &Evidence, field: &Field) -> Self {
        let conjugate = field.clutter.iter().map(|chirp| chirp.iter().map(Complex64::conj).collect()).collect();
        let samples = evidence.cube.dims[4];
        let mut square = vec![vec![Complex64::ZERO; samples]; field.channels()];
        // A few chirps of each frame are enough: the scene's own square hardly changes within it.
        let loops = evidence.cube.dims[3];
        let step = loops.div_ceil(8);
        let count = (evidence.split.training.len() * loops.div_ceil(step)) as f64;
        for &frame in &evidence.split.training {
            for (channel, sum) in square.iter_mut().enumerate() {
                for chirp in evidence.cube.channel(frame, channel).chunks_exact(samples).step_by(step) {
                    sum.iter_mut().zip(chirp).for_each(|(sum, value)| *sum += value * value / count);
                }
            }
        }
        Self { conjugate, square }
    }
}

pub fn templates(elements: &[Element], images: &Images) -> Templates {
    let samples = images.conjugate[0].len();
    let mut templates = Templates::default();
    for element in elements {
        match element {
            Element::Image => templates.common.push(images.conjugate.clone()),
            Element::Square => templates.common.push(images.square.clone()),
            own => templates.own.extend(columns(own, samples)),
        }
    }
    templates
}

/// Fast-time templates with an amplitude in every channel.
pub fn columns(element: &Element, samples: usize) -> Vec<Vec<Complex64>> {
    let impulse = |at: usize| (0..samples).map(|n| if n == at { Complex64::ONE } else { Complex64::ZERO }).collect();
    match *element {
        Element::Offset => vec![vec![Complex64::ONE; samples]],
        Element::Leakage(turns) | Element::Return(turns) => vec![tone(turns, samples)],
        Element::Start(count) => (0..count).map(impulse).collect(),
        Element::End(count) => (samples - count..samples).map(impulse).collect(),
        Element::Image | Element::Square => vec![],
    }
}

/// Complex numbers that an element adds.
pub fn unknowns(element: &Element, channels: usize) -> f64 {
    match element {
        Element::Offset => channels as f64,
        Element::Leakage(_) | Element::Return(_) => channels as f64 + 0.5,
        Element::Start(count) | Element::End(count) => (count * channels) as f64,
        Element::Image | Element::Square => 1.0,
    }
}

/// The elements that a recording holds. A constant only where the others leave it estimable. `returns`: whether something may stand where
/// the room has nothing, which needs no name.
pub fn choose(evidence: &Evidence, field: &Field, images: &Images, returns: bool) -> Vec<Element> {
    let is_known = |element: &Element| match element {
        Element::Return(_) => returns,
        _ => evidence.info(element.id()).is_some(),
    };
    let all = chosen(evidence, field, images, is_known);
    if inflation_of_offset(field, &all) < MOST_INFLATED {
        return all;
    }
    chosen(evidence, field, images, |element| *element != Element::Offset && is_known(element))
}

/// Factor by which the others raise the variance of the constant's amplitude; one where none is among them.
fn inflation_of_offset(field: &Field, elements: &[Element]) -> f64 {
    let samples = field.clutter[0].len();
    let project = |element: &Element| columns(element, samples).into_iter().map(|column| field.project(&column));
    let (offset, others): (Vec<&Element>, Vec<&Element>) = elements.iter().partition(|element| **element == Element::Offset);
    let Some(offset) = offset.into_iter().flat_map(project).next() else { return 1.0 };
    let mut alone = offset.clone();
    remove(&mut alone, &orthonormal(&others.into_iter().flat_map(project).collect::<Vec<_>>()));
    energy(&offset) / energy(&alone).max(f64::MIN_POSITIVE)
}

/// One after the other, of those that may be.
fn chosen(evidence: &Evidence, field: &Field, images: &Images, may_be: impl Fn(&Element) -> bool) -> Vec<Element> {
    let (near, asides) = (leakages(evidence), asides(evidence, field));
    let mut chosen: Vec<Element> = vec![];
    while chosen.len() < MOST_ELEMENTS {
        let mut options = Next::new(field, images, &chosen).options(&near, &asides);
        options.retain(|(_, element)| may_be(element));
        let best = options.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        match best {
            Some((score, element)) if score > 0.0 => chosen.push(element),
            _ => break,
        }
        if chosen.iter().filter(|element| matches!(element, Element::Leakage(_))).count() > 0 && chosen.len() > 1 {
            improve(field, images, &mut chosen, &near);
        }
    }
    chosen
}

/// Grid of a leakage's beat frequencies, turns per sample.
fn leakages(evidence: &Evidence) -> Vec<f64> {
    grid([0.01, NEAR_M].map(|range_m| turns(evidence, range_m)), evidence.cube.dims[4], 12.0)
}

/// Grids of the beat frequencies of what stands before the room's surfaces, and as far behind them, turns per sample.
fn asides(evidence: &Evidence, field: &Field) -> Vec<Vec<f64>> {
    let (low_m, high_m) = (field.support.low_m, field.support.high_m);
    let ends = [[NEAR_M, low_m], [high_m, 2.0 * high_m]].map(|ends| ends.map(|range_m| turns(evidence, range_m).min(1.0)));
    ends.into_iter().filter(|ends| ends[0] < ends[1]).map(|ends| grid(ends, evidence.cube.dims[4], 4.0)).collect()
}

fn turns(evidence: &Evidence, range_m: f64) -> f64 {
    beat_hz(evidence, range_m) / evidence.radar.sample_rate_hz
}

/// So many per bin, ends included.
fn grid([lowest, highest]: [f64; 2], samples: usize, per_bin: f64) -> Vec<f64> {
    let steps = ((highest - lowest) * samples as f64 * per_bin).ceil().max(2.0) as usize;
    (0..=steps).map(|i| lowest + (highest - lowest) * i as f64 / steps as f64).collect()
}

/// The choice of one more element beside those that were chosen.
struct Next<'a> {
    field: &'a Field,
    images: &'a Images,
    chosen: &'a [Element],
    fitted: Fitted,
    /// What they leave, `[channel][direction]`.
    rest: Vec<Vec<Complex64>>,
    /// Directions that they take.
    basis: Vec<Vec<Complex64>>,
    samples: usize,
}

impl<'a> Next<'a> {
    fn new(field: &'a Field, images: &'a Images, chosen: &'a [Element]) -> Self {
        let fitted = field.fit(&templates(chosen, images));
        let rest: Vec<Vec<Complex64>> = field
            .mean
            .iter()
            .zip(&fitted.predicted)
            .map(|(found, predicted)| found.iter().zip(predicted).map(|(found, predicted)| found - predicted).collect())
            .collect();
        let basis = orthonormal(&templates(chosen, images).own.iter().map(|own| field.project(own)).collect::<Vec<_>>());
        Self { field, images, chosen, fitted, rest, basis, samples: field.clutter[0].len() }
    }

    /// Log-likelihood that an element of fast time gains, less its price.
    fn score(&self, element: &Element) -> f64 {
        let (field, channels) = (self.field, self.field.channels());
        let mut columns: Vec<Vec<Complex64>> =
            columns(element, self.samples).iter().map(|column| field.project(column)).collect();
        columns.iter_mut().for_each(|column| remove(column, &self.basis));
        let directions = orthonormal(&columns);
        (0..channels)
            .map(|channel| field.weight(channel) * directions.iter().map(|d| dot(d, &self.rest[channel]).norm_sqr()).sum::<f64>())
            .sum::<f64>()
            - penalty(field) * unknowns(element, channels)
    }

    /// The best of a kind of tones with a beat frequency of a grid, with what it gains.
    fn tone(&self, grid: &[f64], of: fn(f64) -> Element) -> (f64, Element) {
        let score = |turns: f64| self.score(&of(turns));
        let scores = grid.iter().map(|&turns| (score(turns), turns));
        let best = scores.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(grid[0], |(_, turns)| turns);
        let turns = within(grid, refine(best, grid[1] - grid[0], score));
        (score(turns), of(turns))
    }

    /// All that may be added, with what it gains; `near`: a grid of leakages' beat frequencies, `asides`: of returns beside the room.
    fn options(&self, near: &[f64], asides: &[Vec<f64>]) -> Vec<(f64, Element)> {
        let chosen = self.chosen;
        let mut options: Vec<(f64, Element)> = vec![];
        if !chosen.contains(&Element::Offset) {
            options.push((self.score(&Element::Offset), Element::Offset));
        }
        if chosen.iter().filter(|element| matches!(element, Element::Leakage(_))).count() < 3 {
            options.push(self.tone(near, Element::Leakage));
        }
        options.extend(asides.iter().map(|grid| self.tone(grid, Element::Return)));
        for edge in [Element::Start as fn(usize) -> Element, Element::End] {
            if chosen.iter().any(|element| std::mem::discriminant(element) == std::mem::discriminant(&edge(1))) {
                continue;
            }
            for count in 1..=LONGEST_EDGE.min(self.samples / 8) {
                options.push((self.score(&edge(count)), edge(count)));
            }
        }
        for image in [Element::Image, Element::Square] {
            if !chosen.contains(&image) {
                let with: Vec<Element> = chosen.iter().cloned().chain([image.clone()]).collect();
                let gain = self.field.fit(&templates(&with, self.images)).likelihood - self.fitted.likelihood;
                options.push((gain - penalty(self.field), image));
            }
        }
        options
    }
}

/// Moves each leakage's beat frequency, of a grid's, where all elements together fit best.
fn improve(field: &Field, images: &Images, chosen: &mut [Element], near: &[f64]) {
    for index in 0..chosen.len() {
        if let Element::Leakage(turns) = chosen[index] {
            let mut tried = chosen.to_vec();
            let best = refine(turns, near[1] - near[0], |turns| {
                tried[index] = Element::Leakage(turns);
                field.fit(&templates(&tried, images)).likelihood
            });
            chosen[index] = Element::Leakage(within(near, best));
        }
    }
}

/// No farther than a grid's ends.
fn within(grid: &[f64], value: f64) -> f64 {
    value.clamp(grid[0], grid[grid.len() - 1])
}

/// A maximum near a grid's best.
pub fn refine(at: f64, step: f64, value: impl FnMut(f64) -> f64) -> f64 {
    golden_section([at - step, at + step], 18, value)
}

/// A recording for tests of static fields.
#[cfg(test)]
pub(super) mod scene {
    use num_complex::Complex64;

    use crate::diagnosis::Evidence;
    use crate::radar::{Radar, SPEED_OF_LIGHT};
    use crate::room::Room;

    /// A wall at 3 m and a leakage at 0.08 m that falls by 2.8 dB along the chirp, in a room, and turns per sample of a metre.
    pub fn leaking() -> (Evidence, f64) {
        let radar = Radar { samples_per_chirp: 128, loops_per_frame: 16, ..Radar::small(12) };
        let turns_per_m = 2.0 * radar.slope_hz_per_s / SPEED_OF_LIGHT / radar.sample_rate_hz;
        let mut evidence = Evidence::in_noise(radar, 7, |[_, rx, _, n]| {
            let tone = |range_m: f64| Complex64::cis(std::f64::consts::TAU * turns_per_m * range_m * n as f64 + rx as f64);
            tone(3.0) * 30.0 + tone(0.08) * 100.0 * (-0.32 * n as f64 / 128.0).exp()
        });
        let walls = Room { left_m: Some(2.0), right_m: Some(2.0), floor_m: Some(1.0), ceiling_m: Some(1.5), ..Room::default() };
        evidence.room = Some(Room { front_m: Some(4.0), back_m: Some(1.0), ..walls });
        (evidence, turns_per_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tones_about_zero_leave_no_constant_estimable() {
        let (evidence, turns_per_m) = scene::leaking();
        let field = Field::new(&evidence).expect("a field");
        let leakages = |ranges_m: &[f64]| -> Vec<Element> {
            let tones = ranges_m.iter().map(|range_m| Element::Leakage(turns_per_m * range_m));
            std::iter::once(Element::Offset).chain(tones).collect()
        };
        assert!(inflation_of_offset(&field, &leakages(&[0.4])) < MOST_INFLATED);
        assert!(inflation_of_offset(&field, &leakages(&[0.02, 0.06, 0.1])) > MOST_INFLATED);
        assert_eq!(inflation_of_offset(&field, &leakages(&[0.1])[1..]), 1.0);
    }
}
