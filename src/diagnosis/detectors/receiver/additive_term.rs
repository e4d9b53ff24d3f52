//! An element of a static additive field as a candidate: what it adds to every chirp, its numbers, and what is said of it.

use std::ops::Range;

use num_complex::Complex64;

use super::elements::{Element, Images, columns, refine, templates, unknowns};
use super::field::{Field, Fitted, add};
use super::support::{beat_hz, energy, range_m};
use super::zero_beat::shortest_m;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::finding::{Candidate, Correction, Estimate, NINETY, Place};
use crate::diagnosis::statistics::{chi2_tail, corrected, deviation_at_top};
use crate::diagnosis::{Evidence, denoised};
use crate::effects::{self, Stage};

/// Half the size of a board.
const BOARD_M: f64 = 0.01;
/// Of the peak sample: beside ADC clipping, a smaller constant may be what was guessed of the lost samples.
const LEAST_BENT_OFFSET_DB: f64 = -40.0;

/// The elements that were chosen, and how they fit together.
pub struct Chosen<'a> {
    pub evidence: &'a Evidence,
    pub field: &'a Field,
    pub images: &'a Images,
    pub elements: &'a [Element],
    pub fitted: &'a Fitted,
}

impl Chosen<'_> {
    /// None for what another element stands for, and for images.
    pub fn candidate(&self, index: usize) -> Option<Candidate> {
        let (evidence, field, elements) = (self.evidence, self.field, self.elements);
        let (group, others) = self.group(index);
        if group[0] != index {
            return None;
        }
        let others: Vec<Element> = others.into_iter().map(|other| elements[other].clone()).collect();
        let without = field.fit(&templates(&others, self.images));
        let beside = |element: Element| field.fit(&templates(&[others.as_slice(), &[element]].concat(), self.images)).likelihood;
        let element = &match elements[index] {
            Element::Leakage(turns) if group.len() > 1 => {
                let step = beat_hz(evidence, BOARD_M) / evidence.radar.sample_rate_hz;
                Element::Leakage(refine(turns, step, |turns| beside(Element::Leakage(turns))))
            }
            ref alone => alone.clone(),
        };
        let freedom: f64 = group.iter().map(|&index| 2.0 * unknowns(&elements[index], field.channels())).sum();
        let p_value = corrected(chi2_tail(2.0 * (self.fitted.likelihood - without.likelihood).max(0.0), freedom), 200.0);
        let nats = field.gain(Some(&without.predicted), &self.fitted.predicted);
        let (first, chirps) = self.term(&group)?;
        let term = Term::new(evidence, element, chirps);
        if is_bent(evidence) && *element == Element::Offset && term.level_db < LEAST_BENT_OFFSET_DB {
            return None;
        }
        let Claim { id, estimates, place, statement } = match *element {
            Element::Offset => self.offset(&term, first),
            Element::Leakage(turns) => term.leakage(evidence, turns, |turns| beside(Element::Leakage(turns))),
            Element::Start(count) | Element::End(count) => term.edge(field, count, matches!(element, Element::End(_))),
            Element::Return(_) | Element::Image | Element::Square => return None,
        };
        Some(Candidate { id, estimates, statement, ..added(evidence, term.chirps, place, p_value, nats) })
    }

    /// The elements that are one with this one, and all others.
    fn group(&self, index: usize) -> (Vec<usize>, Vec<usize>) {
        let elements = self.elements;
        // Paths over the board that one chirp does not tell apart are one leakage: each of them is little beside the others.
        let together = |other: &Element| match (&elements[index], other) {
            (Element::Leakage(a), Element::Leakage(b)) => (a - b).abs() * (self.evidence.cube.dims[4] as f64) < 1.0,
            (element, other) => element == other,
        };
        (0..elements.len()).partition(|&other| together(&elements[other]))
    }

    /// What elements add, `[channel][sample]`, with the place of the first one's amplitude.
    fn term(&self, group: &[usize]) -> Option<(usize, Vec<Vec<Complex64>>)> {
        let samples = self.evidence.cube.dims[4];
        // Each with the place of its amplitude.
        let all = self.elements.iter().enumerate().flat_map(|(index, element)| {
            let own = columns(element, samples);
            own.into_iter().map(move |column| (index, column))
        });
        let own: Vec<(usize, Vec<Complex64>)> =
            all.enumerate().filter(|(_, (index, _))| group.contains(index)).map(|(at, (_, column))| (at, column)).collect();
        let &(first, _) = own.first()?;
        let term: Vec<Vec<Complex64>> = (0..self.field.channels())
            .map(|channel| {
                let mut sum = vec![Complex64::ZERO; samples];
                own.iter().for_each(|(at, column)| add(&mut sum, column, self.fitted.own[channel][*at]));
                sum
            })
            .collect();
        Some((first, term))
    }

    /// `first`: place of the amplitude.
    fn offset(&self, term: &Term, first: usize) -> Claim {
        let [_, _, rx, _, samples] = self.evidence.cube.dims;
        let (field, channels) = (self.field, self.field.channels());
        let deviation = (field.variance.iter().sum::<f64>() / channels as f64 / self.evidence.split.training.len() as f64).sqrt();
        let each = |part: fn(&Complex64) -> f64| -> Vec<f64> {
            (0..rx)
                .map(|receiver| {
                    (0..channels).filter(|c| c % rx == receiver).map(|c| part(&self.fitted.own[c][first])).sum::<f64>()
                        / (channels / rx) as f64
                })
                .collect()
        };
        let error = vec![deviation * 3.0 / (samples as f64).sqrt(); rx];
        let (i, q) = (each(|a| a.re), each(|a| a.im));
        Claim {
            id: Some(effects::dc_offset::ID),
            estimates: vec![Estimate::list("i", &i, &error), Estimate::list("q", &q, &error)],
            place: Place { range_m: Some([0.0, 0.0]), ..Place::at(Stage::Receiver) },
            statement: format!(
                "a constant was left out that each receiver adds to all its samples: {} codes in the largest, {:.1} dB \
                 relative to the signal's peak sample; it lies at beat frequency zero exactly and does not change over time",
                digits(term.largest),
                term.level_db
            ),
        }
    }
}

/// What is said of an element.
struct Claim {
    id: Option<&'static str>,
    estimates: Vec<Estimate>,
    place: Place,
    statement: String,
}

/// What an element adds to the mean chirps, `[channel][sample]`, and how large it is.
struct Term {
    chirps: Vec<Vec<Complex64>>,
    largest: f64,
    /// Of the strongest sample, mean over the channels: single ones hold the scene's own value too.
    level: f64,
    /// The same, relative to the signal's peak sample.
    level_db: f64,
}

impl Term {
    fn new(evidence: &Evidence, element: &Element, chirps: Vec<Vec<Complex64>>) -> Self {
        let samples = evidence.cube.dims[4];
        let skipped = match *element {
            Element::Start(count) => edge(samples, count, false),
            Element::End(count) => edge(samples, count, true),
            _ => 0..0,
        };
        let peak = denoised::peak_beside(evidence, |channel, n| (!skipped.contains(&n)).then(|| chirps[channel][n]));
        let largest = chirps.iter().flatten().map(|value| value.norm()).fold(0.0, f64::max);
        let level = (0..samples)
            .map(|n| (chirps.iter().map(|chirp| chirp[n].norm_sqr()).sum::<f64>() / chirps.len() as f64).sqrt())
            .fold(0.0, f64::max);
        let level_db = 20.0 * (level / peak.max(1e-300)).log10();
        Self { chirps, largest, level, level_db }
    }

    /// `likelihood`: of a leakage at a beat frequency beside all other elements.
    fn leakage(&self, evidence: &Evidence, turns: f64, likelihood: impl Fn(f64) -> f64) -> Claim {
        let amplitudes: Vec<f64> = self.chirps.iter().map(|chirp| energy(chirp).sqrt()).collect();
        let spread_db = 20.0
            * (amplitudes.iter().fold(0.0f64, |a, &b| a.max(b))
                / amplitudes.iter().fold(f64::INFINITY, |a, &b| a.min(b)).max(1e-300))
            .log10();
        let rate = evidence.radar.sample_rate_hz;
        let range = range_m(evidence, turns * rate);
        let nats = |further_m: f64| likelihood(turns + beat_hz(evidence, further_m) / rate);
        let error = deviation_at_top(nats, 0.0, likelihood(turns), 0.002).unwrap_or(0.05).max(5e-4);
        // A board has more than one path, within its own size.
        let reach = (1.645 * error).max(BOARD_M);
        // One level stands for channels that differ.
        let level_deviation = denoised::PEAK_DB.hypot(0.3 * spread_db / (self.chirps.len() as f64).sqrt());
        let level_db = self.level_db;
        let place = Place { range_m: Some([range - reach, range + reach]), ..Place::at(Stage::Receiver) };
        // A leakage has the delay of the way between the nearest antennas at least.
        let least = 0.5 * shortest_m(&evidence.radar);
        if range + NINETY * error < least {
            return Claim {
                id: None,
                estimates: vec![],
                place,
                statement: format!(
                    "every chirp holds a tone that never changes, {level_db:.1} dB relative to the signal's peak sample; its delay is \
                     that of a return {:.1} mm away, and the way between the nearest antennas is that of one {:.1} mm away",
                    1e3 * range,
                    1e3 * least
                ),
            };
        }
        Claim {
            id: Some(effects::tx_leakage::ID),
            estimates: vec![Estimate::normal("range_m", range, error), Estimate::normal("level_db", level_db, level_deviation)],
            place,
            statement: format!(
                "a return {range:.3} m away, nearer than anything in the room, that never changes: the transmitters leak into \
                 the receivers over the board, {level_db:.1} dB relative to the signal's peak sample, {spread_db:.1} dB apart between \
                 channels"
            ),
        }
    }

    fn edge(&self, field: &Field, count: usize, at_end: bool) -> Claim {
        let (channels, samples) = (self.chirps.len(), self.chirps[0].len());
        let scene = (field.clutter.iter().map(|chirp| energy(chirp)).sum::<f64>() / (channels * samples) as f64).sqrt();
        let level_deviation = denoised::PEAK_DB.hypot(8.7 * 0.7 * scene / (self.level * (channels as f64).sqrt()));
        let (number, words) = counted(count, at_end);
        Claim {
            id: Some(effects::ramp_edge_transient::ID),
            estimates: vec![number, Estimate::normal("level_db", self.level_db, level_deviation)],
            place: Place { samples: Some(edge(samples, count, at_end).collect()), ..Place::at(Stage::Receiver) },
            statement: format!(
                "{words} of every chirp hold{} a value that is added and never changes, up to {} codes \
                 ({:.1} dB relative to the signal's peak sample): the ADC runs into the {} of the ramp",
                if count == 1 { "s" } else { "" },
                digits(self.largest),
                self.level_db,
                if at_end { "end" } else { "beginning" },
            ),
        }
    }
}

/// Samples at the beginning or the end of a chirp.
pub fn edge(samples: usize, count: usize, at_end: bool) -> Range<usize> {
    if at_end { samples - count..samples } else { 0..count }
}

/// How many these are, and which, in words.
pub fn counted(count: usize, at_end: bool) -> (Estimate, String) {
    let middle = count as f64;
    let number = Estimate { name: "samples", values: vec![middle], ci90: vec![[middle - 0.5, middle + 0.5]] };
    let samples = if count == 1 { "sample".into() } else { format!("{count} samples") };
    (number, format!("the {} {samples}", if at_end { "last" } else { "first" }))
}

/// An ADC that clips distorts everything; the residual has no shape of its own, least of all a filter's.
pub fn is_bent(evidence: &Evidence) -> bool {
    evidence.accepted.contains(&effects::adc_saturation::ID)
}

/// Held-out log-likelihood gained by subtracting a static term, `[channel][sample]`.
pub fn gain(evidence: &Evidence, term: &[Vec<Complex64>]) -> f64 {
    let [.., loops, samples] = evidence.cube.dims;
    let mut gain = 0.0;
    for &frame in &evidence.split.held_out {
        let found = evidence.cube.clutter(&[frame]);
        for (channel, term) in term.iter().enumerate() {
            let found = &found[channel * samples..][..samples];
            let better: f64 = found.iter().zip(term).map(|(value, term)| value.norm_sqr() - (value - term).norm_sqr()).sum();
            gain += better * loops as f64 / evidence.noise()[channel].max(1e-300);
        }
    }
    gain
}

/// A static term that nobody has named yet: its energy, and that it is subtracted from every chirp of its channel.
pub fn added(evidence: &Evidence, term: Vec<Vec<Complex64>>, place: Place, p_value: f64, nats: f64) -> Candidate {
    Candidate {
        energy: term.iter().map(|chirp| energy(chirp)).sum::<f64>() * evidence.cube.chirps(),
        correction: Correction::samples(move |cube| {
            cube.each_chirp(|[_, channel, _], chirp| {
                chirp.iter_mut().zip(&term[channel]).for_each(|(value, term)| *value -= term);
            });
        }),
        ..Candidate::new(Behaviour::AdditiveFastTime, place, p_value, nats)
    }
}

/// A number with three significant digits.
pub fn digits(value: f64) -> String {
    let decimals = 2.0 - value.abs().max(1e-9).log10().floor();
    format!("{value:.*}", decimals.clamp(0.0, 9.0) as usize)
}
