//! Additive fields that stand still outside the delays of the room: offsets, leakage, transients at the chirps' edges.
//!
//! Elements are chosen one after the other by their log-likelihood on the training frames less the Bayesian information
//! criterion's penalty, together with the images that non-linear receivers make of the static scene (which belong to
//! other suspects, but must not be taken for a leakage). Named elements are believed only if all together explain most
//! of what a free field does.

use std::sync::Arc;

use num_complex::Complex64;

use super::field::{Field, Fitted, Templates, add, orthonormal, remove};
use super::response;
use super::support::{beat_hz, dot, energy, range_m, tone};
use crate::diagnosis::finding::{Candidate, Correction, Estimate, Place};
use crate::diagnosis::statistics::{chi2_tail, corrected};
use crate::diagnosis::{Cube, Evidence, denoised};

/// Leakage over the board is nearer than this.
const NEAR_M: f64 = 0.5;
/// Half the size of a board.
const BOARD_M: f64 = 0.01;
/// Longest transient at an edge, samples.
const LONGEST_EDGE: usize = 16;
/// Share of what a free field explains that named elements must reach.
const ENOUGH: f64 = 0.8;
const MOST_ELEMENTS: usize = 8;
/// Of the peak sample: beside a converter at its rail, a smaller constant may be what was guessed of the lost samples.
const LEAST_BENT_OFFSET_DB: f64 = -40.0;

#[derive(Clone, Debug, PartialEq)]
enum Element {
    Offset,
    /// Beat frequency in turns per sample.
    Leakage(f64),
    Start(usize),
    End(usize),
    Image,
    Square,
}

pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let Some(field) = Field::new(evidence) else { return vec![] };
    let free = field.free_likelihood();
    let p_free = chi2_tail(2.0 * free, field.freedom());
    if p_free > 1e-4 {
        return vec![];
    }
    let images = Images::new(evidence, &field);
    let elements = choose(evidence, &field, &images);
    let fitted = field.fit(&templates(&elements, &images));
    let free_gain = field.gain(None, &field.mean);
    let explained = field.gain(None, &fitted.predicted);
    let named = elements.iter().any(|element| !matches!(element, Element::Image | Element::Square));
    let without = residual(&elements, &fitted, &field, &images);
    // A field far stronger than any filter's traces needs no second thought.
    let plain = explained >= 0.98 * free_gain && fitted.likelihood > 1e5;
    let bent = is_bent(evidence);
    let filter = if plain || bent { None } else { response::find(evidence, &field, &without) };
    // What is added explains itself as well as any filter does; a filter's traces it does not.
    if let Some(found) = &filter
        && found.likelihood > 12.0
        && found.likelihood >= ENOUGH * (free - 0.5 * field.freedom())
        && (!named || found.likelihood > found.additive)
    {
        return vec![found.candidate.clone()];
    }
    if explained >= ENOUGH * free_gain {
        // The field is sure; what an element's numbers are is another question.
        let found = (0..elements.len()).filter_map(|index| candidate(evidence, &field, &images, &elements, &fitted, index));
        return found.map(Candidate::named_if_sure).collect();
    }
    if free_gain < 20.0 || bent {
        return vec![];
    }
    unexplained(evidence, &field, p_free, free_gain).into_iter().collect()
}

/// A converter at its rail bends everything; what remains of it has no shape of its own, least of all a filter's.
fn is_bent(evidence: &Evidence) -> bool {
    evidence.accepted.contains(&"adc_saturation")
}

/// Still chirps less what the elements make of them.
fn residual(elements: &[Element], fitted: &Fitted, field: &Field, images: &Images) -> Vec<Vec<Complex64>> {
    let templates = templates(elements, images);
    let mut rest = field.still.clone();
    for (channel, chirp) in rest.iter_mut().enumerate() {
        templates.own.iter().zip(&fitted.own[channel]).for_each(|(template, amplitude)| add(chirp, template, -amplitude));
        templates.common.iter().zip(&fitted.common).for_each(|(template, amplitude)| add(chirp, &template[channel], -amplitude));
    }
    rest
}

/// Price in nats of another complex number.
fn penalty(field: &Field) -> f64 {
    1.5 * field.freedom().ln().max(4.0)
}

/// What non-linear receivers make of the static scene, `[channel][sample]`.
struct Images {
    conjugate: Vec<Vec<Complex64>>,
    square: Vec<Vec<Complex64>>,
}

impl Images {
    fn new(evidence: &Evidence, field: &Field) -> Self {
        let conjugate = field.still.iter().map(|chirp| chirp.iter().map(Complex64::conj).collect()).collect();
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

fn templates(elements: &[Element], images: &Images) -> Templates {
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
fn columns(element: &Element, samples: usize) -> Vec<Vec<Complex64>> {
    let impulse = |at: usize| (0..samples).map(|n| if n == at { Complex64::ONE } else { Complex64::ZERO }).collect();
    match *element {
        Element::Offset => vec![vec![Complex64::ONE; samples]],
        Element::Leakage(turns) => vec![tone(turns, samples)],
        Element::Start(count) => (0..count).map(impulse).collect(),
        Element::End(count) => (samples - count..samples).map(impulse).collect(),
        Element::Image | Element::Square => vec![],
    }
}

/// Complex numbers that an element adds.
fn unknowns(element: &Element, channels: usize) -> f64 {
    match element {
        Element::Offset => channels as f64,
        Element::Leakage(_) => channels as f64 + 0.5,
        Element::Start(count) | Element::End(count) => (count * channels) as f64,
        Element::Image | Element::Square => 1.0,
    }
}

fn choose(evidence: &Evidence, field: &Field, images: &Images) -> Vec<Element> {
    let samples = evidence.cube.dims[4];
    let channels = field.channels();
    let penalty = penalty(field);
    let highest = beat_hz(evidence, NEAR_M) / evidence.radar.sample_rate_hz;
    let lowest = beat_hz(evidence, 0.01) / evidence.radar.sample_rate_hz;
    let grid = (highest * samples as f64 * 12.0).ceil().max(2.0) as usize;
    let near: Vec<f64> = (0..=grid).map(|i| lowest + (highest - lowest) * i as f64 / grid as f64).collect();
    let mut chosen: Vec<Element> = vec![];
    while chosen.len() < MOST_ELEMENTS {
        let fitted = field.fit(&templates(&chosen, images));
        let rest: Vec<Vec<Complex64>> = field
            .mean
            .iter()
            .zip(&fitted.predicted)
            .map(|(found, predicted)| found.iter().zip(predicted).map(|(found, predicted)| found - predicted).collect())
            .collect();
        let basis = orthonormal(&templates(&chosen, images).own.iter().map(|own| field.project(own)).collect::<Vec<_>>());
        let score = |element: &Element| {
            let mut columns: Vec<Vec<Complex64>> = columns(element, samples).iter().map(|column| field.project(column)).collect();
            columns.iter_mut().for_each(|column| remove(column, &basis));
            let directions = orthonormal(&columns);
            (0..channels)
                .map(|channel| field.weight(channel) * directions.iter().map(|d| dot(d, &rest[channel]).norm_sqr()).sum::<f64>())
                .sum::<f64>()
                - penalty * unknowns(element, channels)
        };
        let mut options: Vec<(f64, Element)> = vec![];
        if !chosen.contains(&Element::Offset) {
            options.push((score(&Element::Offset), Element::Offset));
        }
        if chosen.iter().filter(|element| matches!(element, Element::Leakage(_))).count() < 3 {
            let best = near.iter().map(|&turns| (score(&Element::Leakage(turns)), turns)).max_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, turns)) = best {
                let turns = refine(turns, near[1] - near[0], |turns| score(&Element::Leakage(turns)));
                options.push((score(&Element::Leakage(turns)), Element::Leakage(turns)));
            }
        }
        for edge in [Element::Start as fn(usize) -> Element, Element::End] {
            if chosen.iter().any(|element| std::mem::discriminant(element) == std::mem::discriminant(&edge(1))) {
                continue;
            }
            for count in 1..=LONGEST_EDGE.min(samples / 8) {
                options.push((score(&edge(count)), edge(count)));
            }
        }
        for image in [Element::Image, Element::Square] {
            if !chosen.contains(&image) {
                let with: Vec<Element> = chosen.iter().cloned().chain([image.clone()]).collect();
                let gain = field.fit(&templates(&with, images)).likelihood - fitted.likelihood;
                options.push((gain - penalty, image));
            }
        }
        let best = options.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        match best {
            Some((score, element)) if score > 0.0 => chosen.push(element),
            _ => break,
        }
        if chosen.iter().filter(|element| matches!(element, Element::Leakage(_))).count() > 0 && chosen.len() > 1 {
            improve(field, images, &mut chosen, near[1] - near[0]);
        }
    }
    chosen
}

/// Moves each leakage's beat frequency where all elements together fit best.
fn improve(field: &Field, images: &Images, chosen: &mut [Element], step: f64) {
    for index in 0..chosen.len() {
        if let Element::Leakage(turns) = chosen[index] {
            let mut tried = chosen.to_vec();
            let best = refine(turns, step, |turns| {
                tried[index] = Element::Leakage(turns);
                field.fit(&templates(&tried, images)).likelihood
            });
            chosen[index] = Element::Leakage(best);
        }
    }
}

/// Golden-section search of a maximum near a grid's best.
fn refine(at: f64, step: f64, mut value: impl FnMut(f64) -> f64) -> f64 {
    const RATIO: f64 = 0.618_033_988_749_895;
    let (mut low, mut high) = (at - step, at + step);
    for _ in 0..18 {
        let (a, b) = (high - RATIO * (high - low), low + RATIO * (high - low));
        if value(a) > value(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}

fn candidate(
    evidence: &Evidence,
    field: &Field,
    images: &Images,
    elements: &[Element],
    fitted: &Fitted,
    index: usize,
) -> Option<Candidate> {
    // Paths over the board that one chirp does not tell apart are one leakage: each of them is little beside the others.
    let together = |other: &Element| match (&elements[index], other) {
        (Element::Leakage(a), Element::Leakage(b)) => (a - b).abs() * (evidence.cube.dims[4] as f64) < 1.0,
        (element, other) => element == other,
    };
    let (group, others): (Vec<usize>, Vec<usize>) = (0..elements.len()).partition(|&other| together(&elements[other]));
    if group[0] != index {
        return None;
    }
    let others: Vec<Element> = others.into_iter().map(|other| elements[other].clone()).collect();
    let without = field.fit(&templates(&others, images));
    let beside = |element: Element| field.fit(&templates(&[others.as_slice(), &[element]].concat(), images)).likelihood;
    let element = &match elements[index] {
        Element::Leakage(turns) if group.len() > 1 => {
            let step = beat_hz(evidence, BOARD_M) / evidence.radar.sample_rate_hz;
            Element::Leakage(refine(turns, step, |turns| beside(Element::Leakage(turns))))
        }
        ref alone => alone.clone(),
    };
    let channels = field.channels();
    let freedom: f64 = group.iter().map(|&index| 2.0 * unknowns(&elements[index], channels)).sum();
    let p_value = corrected(chi2_tail(2.0 * (fitted.likelihood - without.likelihood).max(0.0), freedom), 200.0);
    let gain = field.gain(Some(&without.predicted), &fitted.predicted);
    let samples = evidence.cube.dims[4];
    // Each with the place of its amplitude.
    let all = elements.iter().enumerate().flat_map(|(index, element)| {
        let own = columns(element, samples);
        own.into_iter().map(move |column| (index, column))
    });
    let own: Vec<(usize, Vec<Complex64>)> =
        all.enumerate().filter(|(_, (index, _))| group.contains(index)).map(|(at, (_, column))| (at, column)).collect();
    let &(first, _) = own.first()?;
    let term: Vec<Vec<Complex64>> = (0..channels)
        .map(|channel| {
            let mut sum = vec![Complex64::ZERO; samples];
            own.iter().for_each(|(at, column)| add(&mut sum, column, fitted.own[channel][*at]));
            sum
        })
        .collect();
    let amplitudes: Vec<f64> = term.iter().map(|chirp| energy(chirp).sqrt()).collect();
    let skipped = match *element {
        Element::Start(count) => 0..count,
        Element::End(count) => samples - count..samples,
        _ => 0..0,
    };
    let peak = denoised::peak_beside(evidence, |channel, n| (!skipped.contains(&n)).then(|| term[channel][n]));
    let scene = (field.still.iter().map(|chirp| energy(chirp)).sum::<f64>() / (channels * samples) as f64).sqrt();
    let largest = term.iter().flatten().map(|value| value.norm()).fold(0.0, f64::max);
    // Of the strongest sample, mean over the channels: single ones hold the scene's own value too.
    let level = (0..samples)
        .map(|n| (term.iter().map(|chirp| chirp[n].norm_sqr()).sum::<f64>() / channels as f64).sqrt())
        .fold(0.0, f64::max);
    let level_db = 20.0 * (level / peak.max(1e-300)).log10();
    let spread_db = 20.0
        * (amplitudes.iter().fold(0.0f64, |a, &b| a.max(b))
            / amplitudes.iter().fold(f64::INFINITY, |a, &b| a.min(b)).max(1e-300))
        .log10();
    if is_bent(evidence) && *element == Element::Offset && level_db < LEAST_BENT_OFFSET_DB {
        return None;
    }
    let mut place = Place::at("receiver");
    let deviation = (field.variance.iter().sum::<f64>() / channels as f64 / evidence.split.training.len() as f64).sqrt();
    let (id, estimates, statement) = match *element {
        Element::Offset => {
            let rx = evidence.cube.dims[2];
            let each = |part: fn(&Complex64) -> f64| -> Vec<f64> {
                (0..rx)
                    .map(|receiver| {
                        (0..channels).filter(|c| c % rx == receiver).map(|c| part(&fitted.own[c][first])).sum::<f64>()
                            / (channels / rx) as f64
                    })
                    .collect()
            };
            let error = vec![deviation * 3.0 / (samples as f64).sqrt(); rx];
            place.range_m = Some([0.0, 0.0]);
            let (i, q) = (each(|a| a.re), each(|a| a.im));
            let statement = format!(
                "a constant was left out that each receiver adds to all its samples: {} codes in the largest, {level_db:.1} dB \
                 relative to the signal's peak sample; it lies at beat frequency zero exactly and does not change over time",
                digits(largest)
            );
            ("dc_offset", vec![Estimate::list("i", &i, &error), Estimate::list("q", &q, &error)], statement)
        }
        Element::Leakage(turns) => {
            let rate = evidence.radar.sample_rate_hz;
            let range = range_m(evidence, turns * rate);
            let step = beat_hz(evidence, 0.002) / rate;
            let at = |turns: f64| beside(Element::Leakage(turns));
            let curvature = (2.0 * at(turns) - at(turns + step) - at(turns - step)) / (0.002f64 * 0.002);
            let error = if curvature > 0.0 { curvature.recip().sqrt() } else { 0.05 }.max(5e-4);
            // A board has more than one path, within its own size.
            let reach = (1.645 * error).max(BOARD_M);
            place.range_m = Some([range - reach, range + reach]);
            // One level stands for channels that differ.
            let level_deviation = denoised::PEAK_DB.hypot(0.3 * spread_db / (channels as f64).sqrt());
            let statement = format!(
                "a return {range:.3} m away, nearer than anything in the room, that never changes: the transmitters leak into \
                 the receivers over the board, {level_db:.1} dB relative to the signal's peak sample, {spread_db:.1} dB apart between \
                 channels"
            );
            (
                "tx_leakage",
                vec![Estimate::normal("range_m", range, error), Estimate::normal("level_db", level_db, level_deviation)],
                statement,
            )
        }
        Element::Start(count) | Element::End(count) => {
            let at_end = matches!(element, Element::End(_));
            let indices: Vec<usize> = if at_end { (samples - count..samples).collect() } else { (0..count).collect() };
            let statement = format!(
                "the {} {} of every chirp hold{} a value that is added and never changes, up to {} codes \
                 ({level_db:.1} dB relative to the signal's peak sample): the ADC runs into the {} of the ramp",
                if at_end { "last" } else { "first" },
                if count == 1 { "sample".into() } else { format!("{count} samples") },
                if count == 1 { "s" } else { "" },
                digits(largest),
                if at_end { "end" } else { "beginning" },
            );
            place.samples = Some(indices);
            (
                "ramp_edge_transient",
                vec![
                    Estimate {
                        name: "samples",
                        values: vec![count as f64],
                        ci90: vec![[count as f64 - 0.5, count as f64 + 0.5]],
                    },
                    Estimate::normal(
                        "level_db",
                        level_db,
                        denoised::PEAK_DB.hypot(8.7 * 0.7 * scene / (level * (channels as f64).sqrt())),
                    ),
                ],
                statement,
            )
        }
        Element::Image | Element::Square => return None,
    };
    let energy = term.iter().map(|chirp| energy(chirp)).sum::<f64>() * (evidence.cube.dims[0] * evidence.cube.dims[3]) as f64;
    Some(Candidate {
        id: Some(id),
        behaves_like: "additive fast-time",
        estimates,
        choice: None,
        place,
        p_value,
        gain,
        errs_alike: false,
        look_alikes: vec![],
        statement,
        curve: None,
        energy,
        correction: subtract(term),
    })
}

/// What remains that no name explains.
fn unexplained(evidence: &Evidence, field: &Field, p_value: f64, gain: f64) -> Option<Candidate> {
    let samples = evidence.cube.dims[4];
    let term: Vec<Vec<Complex64>> = field
        .mean
        .iter()
        .map(|coordinates| {
            let mut sum = vec![Complex64::ZERO; samples];
            field.support.outside.iter().zip(coordinates).for_each(|(direction, value)| add(&mut sum, direction, *value));
            sum
        })
        .collect();
    let energy_of_chirp = term.iter().map(|chirp| energy(chirp)).sum::<f64>();
    let power_db = 10.0 * (energy_of_chirp / field.still.iter().map(|chirp| energy(chirp)).sum::<f64>().max(1e-300)).log10();
    Some(Candidate {
        id: None,
        behaves_like: "additive fast-time",
        estimates: vec![],
        choice: None,
        place: Place::at("receiver"),
        p_value,
        gain,
        errs_alike: false,
        look_alikes: vec![],
        statement: format!(
            "every chirp holds something that never changes at beat frequencies where the room ({:.1} to {:.1} m) has nothing, \
             {power_db:.1} dB to all static clutter; no effect of the library explains its shape",
            field.support.low_m, field.support.high_m
        ),
        curve: None,
        energy: energy_of_chirp * (evidence.cube.dims[0] * evidence.cube.dims[3]) as f64,
        correction: subtract(term),
    })
}

/// Takes a still chirp away from every chirp of its channel.
pub fn subtract(term: Vec<Vec<Complex64>>) -> Correction {
    Correction::Samples(Arc::new(move |cube: &mut Cube| {
        cube.each_chirp(|[_, channel, _], chirp| chirp.iter_mut().zip(&term[channel]).for_each(|(value, term)| *value -= term));
    }))
}

/// A number with three significant digits.
fn digits(value: f64) -> String {
    if value >= 100.0 { format!("{value:.0}") } else { format!("{value:.2}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::Radar;
    use crate::room::Room;

    #[test]
    fn a_leakage_that_no_single_tone_describes_is_one_and_is_taken_out_in_full() {
        let radar = Radar { samples_per_chirp: 128, loops_per_frame: 16, ..Radar::small(12) };
        let turns = |range_m: f64| 2.0 * range_m * radar.slope_hz_per_s / crate::radar::SPEED_OF_LIGHT / radar.sample_rate_hz;
        let (wall, leak) = (turns(3.0), turns(0.08));
        let mut evidence = Evidence::in_noise(radar.clone(), 7, |[_, rx, _, n]| {
            let tone = |turns: f64| Complex64::cis(std::f64::consts::TAU * turns * n as f64 + rx as f64);
            // It falls by 2.8 dB along the chirp.
            tone(wall) * 30.0 + tone(leak) * 100.0 * (-0.32 * n as f64 / 128.0).exp()
        });
        let walls = Room { left_m: Some(2.0), right_m: Some(2.0), floor_m: Some(1.0), ceiling_m: Some(1.5), ..Room::default() };
        evidence.room = Some(Room { front_m: Some(4.0), back_m: Some(1.0), ..walls });
        let likelihood = |evidence: &Evidence| Field::new(evidence).expect("a field").free_likelihood();
        let found = find(&evidence);
        let leaks: Vec<&Candidate> = found.iter().filter(|found| found.id == Some("tx_leakage")).collect();
        assert_eq!(leaks.len(), 1, "{found:?}");
        let [low, high] = leaks[0].place.range_m.expect("a range");
        assert!(low < 0.08 && 0.08 < high, "{low} to {high}");
        let (before, after) = (likelihood(&evidence), likelihood(&evidence.with(leaks[0])));
        assert!(after < 1e-3 * before, "{after} of {before}");
    }
}
