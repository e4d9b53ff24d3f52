//! A chirp whose frequency is modulated: paired echoes on both sides of every return, their height in proportion to its delay.
//!
//! A return of delay τ is turned by 2πτ a cos(2π f t + φ), to first order `+ α exp(2πi f t) τx − conj(α)
//! exp(−2πi f t) τx` with α = iπa exp(iφ). The recording itself is the template; it is looked for only where no return
//! can be: nearer and farther than the room in the static Doppler cells, than the body in the others.

use std::f64::consts::{PI, TAU};

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;
use rayon::prelude::*;

use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::cube::Cube;
use crate::diagnosis::detectors::filter::Filter;
use crate::diagnosis::detectors::undo::delays_s;
use crate::diagnosis::evidence::{Evidence, blackman_harris, hann};
use crate::diagnosis::finding::{Candidate, Correction, Curve, Estimate, Place};
use crate::diagnosis::statistics;
use crate::effects::{self, Stage};
use crate::paths::distance;
use crate::radar::{Radar, SPEED_OF_LIGHT};

/// Frequencies per bin.
const PADDING: usize = 4;
/// Half of the window's main lobe down to the noise, bins.
const LOBE: usize = 3;
/// Doppler bins about zero that hold static clutter.
const CLUTTER_BINS: usize = 3;
/// Metres beyond the body's surface that its own returns may reach.
const BODY_MARGIN_M: f64 = 0.15;
/// Share of what free, unequal echoes on the two sides explain.
const PAIRED: f64 = 0.8;

/// Height of an echo at 3 m beyond which it is something else, and the first order does not do.
const LARGEST: f64 = 0.3;

/// Sums over empty cells for one shift: template times data on both sides, and the templates' energies.
#[derive(Clone, Copy, Default)]
struct Sums {
    above: Complex64,
    below: Complex64,
    energy_above: f64,
    energy_below: f64,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.above += other.above;
        self.below += other.below;
        self.energy_above += other.energy_above;
        self.energy_below += other.energy_below;
    }

    fn energy(&self) -> f64 {
        self.energy_above + self.energy_below
    }

    /// α, and the log-likelihood gained in units of the noise.
    fn paired(&self) -> (Complex64, f64) {
        let data = self.above - self.below.conj();
        // |T₊|² + |T₋|² weighs both parts of α alike: the two templates hardly overlap.
        let energy = self.energy().max(f64::MIN_POSITIVE);
        (data / energy, data.norm_sqr() / energy)
    }

    fn gain(&self, alpha: Complex64) -> f64 {
        let data = self.above - self.below.conj();
        2.0 * (alpha.conj() * data).re - alpha.norm_sqr() * self.energy()
    }

    fn free(&self) -> f64 {
        self.above.norm_sqr() / self.energy_above.max(f64::MIN_POSITIVE)
            + self.below.norm_sqr() / self.energy_below.max(f64::MIN_POSITIVE)
    }
}

/// Bins where returns can be, of the static and of the moving Doppler cells of a frame; none: not known.
fn support(evidence: &Evidence, frame: usize) -> [Option<[usize; 2]>; 2] {
    let radar = &evidence.radar;
    let bin_m = radar.range_resolution_m();
    let last = evidence.range_bins() - 1;
    let bins = |near_m: f64, far_m: f64| -> [usize; 2] {
        let near = (near_m / bin_m).floor() as i64 - LOBE as i64;
        let far = (far_m / bin_m).ceil() as i64 + LOBE as i64;
        [near.clamp(0, last as i64) as usize, far.clamp(0, last as i64) as usize]
    };
    let body = evidence.body.as_ref().and_then(|body| {
        let centre = radar.centre_m();
        let points = body.frames.get(frame)?.iter();
        let [near, far] = statistics::bounds(points.map(|point| distance(point.position_m, centre)));
        (far > 0.0).then_some([near - BODY_MARGIN_M, far + BODY_MARGIN_M])
    });
    let room = evidence.room.as_ref().and_then(|room| {
        let pair = |low: Option<f64>, high: Option<f64>| Some([low?, high?]);
        let sides = [pair(room.left_m, room.right_m)?, pair(room.back_m, room.front_m)?, pair(room.floor_m, room.ceiling_m)?];
        let far = sides.iter().map(|s| s[0].max(s[1]).powi(2)).sum::<f64>().sqrt();
        // What is behind the antennas is not seen.
        let seen = sides[0].iter().chain(&sides[1][1..]).chain(&sides[2]);
        let near = seen.fold(f64::MAX, |near, d| near.min(*d));
        Some([near, far])
    });
    // The body is there too, with its slow parts.
    let slow = room.map(|[near, far]| body.map_or([near, far], |b| [near.min(b[0]), far.max(b[1])]));
    [slow, body].map(|span| span.map(|[near, far]| bins(near, far)))
}

/// The strongest pair of echoes. None without quadrature or held-out frames, or once a ripple was named.
pub fn find(evidence: &Evidence) -> Option<Candidate> {
    let radar = &evidence.radar;
    if !evidence.may_name(effects::chirp_ripple::ID) || evidence.is_real() || evidence.split.held_out.is_empty() {
        return None;
    }
    let [frames, _, _, _, samples] = evidence.cube.dims;
    let shifts: Vec<usize> = (LOBE * PADDING..samples * PADDING / 4).collect();
    if shifts.len() < 16 {
        return None;
    }
    let per_frame: Vec<Vec<Sums>> = (0..frames).into_par_iter().map(|frame| of_frame(evidence, frame, &shifts)).collect();
    let over = |wanted: &[usize]| -> Vec<Sums> {
        let mut total = vec![Sums::default(); shifts.len()];
        for &frame in wanted {
            total.iter_mut().zip(&per_frame[frame]).for_each(|(t, s)| t.add(s));
        }
        total
    };
    let (training, held_out) = (over(&evidence.split.training), over(&evidence.split.held_out));
    let scores: Vec<f64> = training.iter().map(|s| s.paired().1).collect();
    if training.iter().all(|s| s.energy() <= 0.0) {
        return None;
    }
    // Windowed noise is correlated, and so is what leaks: the scale is estimated from the shifts themselves.
    let scale = (statistics::median(&mut scores.clone()) / std::f64::consts::LN_2).max(1.0);
    let best = (0..shifts.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b]))?;
    // What is highest at the shortest distance is no peak, but a return that reaches farther than it should.
    if best == 0 {
        return None;
    }
    let (alpha, score) = training[best].paired();
    let p_value = statistics::corrected((-score / scale).exp(), shifts.len() as f64);
    let nats = held_out[best].gain(alpha) / scale;
    let pair = Pair { shift: shifts[best] as f64 + summit(&scores, best), alpha, score, scale, sums: training[best] };
    if p_value > 0.01 || nats < 3.0 || pair.stated() > LARGEST {
        return None;
    }
    let bin_hz = radar.sample_rate_hz / samples as f64;
    let curve = Curve::new(
        "Paired echoes by their distance from the return",
        ["beat frequency offset, kHz", "log-likelihood gained, nats"],
        [(
            "training frames",
            shifts.iter().map(|s| 1e-3 * *s as f64 * bin_hz / PADDING as f64).collect(),
            scores.iter().map(|s| s / scale).collect(),
        )],
    );
    Some(pair.candidate(evidence, p_value, nats, curve))
}

/// Top of the parabola through a score and its neighbours, in shifts from it.
fn summit(scores: &[f64], best: usize) -> f64 {
    if best == 0 || best + 1 >= scores.len() {
        return 0.0;
    }
    let (left, right) = (scores[best - 1], scores[best + 1]);
    let bend = left - 2.0 * scores[best] + right;
    if bend < 0.0 { (0.5 * (left - right) / bend).clamp(-0.5, 0.5) } else { 0.0 }
}

/// Paired echoes of every return.
struct Pair {
    /// In units of a padded bin.
    shift: f64,
    alpha: Complex64,
    score: f64,
    /// Of scores without echoes.
    scale: f64,
    sums: Sums,
}

impl Pair {
    fn deviation_hz(&self) -> f64 {
        self.alpha.norm() / PI
    }

    /// Height of an echo at 3 m relative to its return.
    fn stated(&self) -> f64 {
        PI * self.deviation_hz() * 2.0 * 3.0 / SPEED_OF_LIGHT
    }

    fn candidate(&self, evidence: &Evidence, p_value: f64, nats: f64, curve: Curve) -> Candidate {
        let &Self { shift, alpha, score, scale, sums } = self;
        let (radar, [frames, _, _, loops, samples]) = (&evidence.radar, evidence.cube.dims);
        let (deviation_hz, stated) = (self.deviation_hz(), self.stated());
        let bin_hz = radar.sample_rate_hz / samples as f64;
        let ripple_hz = shift * bin_hz / PADDING as f64;
        let error = (0.5 * scale / sums.energy()).sqrt() / PI;
        // A line of a few cells: so well is its frequency known.
        let frequency_error = bin_hz * 0.5 / (score / scale).sqrt().max(1.0);
        let named = score >= PAIRED * sums.free();
        let clutter_energy: f64 = evidence.clutter().iter().map(|v| v.norm_sqr()).sum();
        let chirps = (frames * loops) as f64;
        let (radar_copy, turned_hz) = (radar.clone(), ripple_hz);
        Candidate {
            id: named.then_some(effects::chirp_ripple::ID),
            estimates: if named {
                vec![
                    Estimate::normal("deviation_hz", deviation_hz, error.max(0.03 * deviation_hz)),
                    Estimate::normal("ripple_hz", ripple_hz, frequency_error.max(0.02 * bin_hz)),
                ]
            } else {
                vec![]
            },
            statement: format!(
                "Every return has a pair of faint echoes {:.0} kHz ({:.2} m) before and behind it, higher the farther it is ({:.0} dB \
                 at 3 m): the chirp's frequency is modulated by {:.1} kHz, {:.0} thousand times a second.",
                1e-3 * ripple_hz,
                ripple_hz * SPEED_OF_LIGHT / (2.0 * radar.slope_hz_per_s),
                20.0 * stated.max(1e-9).log10(),
                1e-3 * deviation_hz,
                1e-3 * ripple_hz
            ),
            curve: Some(curve),
            energy: clutter_energy * chirps * 2.0 * (stated * stated),
            correction: Correction::samples(move |cube| undo(cube, &radar_copy, alpha, turned_hz)),
            ..Candidate::new(Behaviour::DelayProportionalPhase, Place::at(Stage::Waveform), p_value, nats)
        }
    }
}

/// Sums over the empty cells of a frame, by shift.
fn of_frame(evidence: &Evidence, frame: usize, shifts: &[usize]) -> Vec<Sums> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let radar = &evidence.radar;
    let mut sums = vec![Sums::default(); shifts.len()];
    let spans = support(evidence, frame);
    if spans.iter().all(Option::is_none) {
        return sums;
    }
    let (fast, slow) = (blackman_harris(samples), hann(loops));
    let mut planner = FftPlanner::new();
    let doppler_fft = planner.plan_fft_forward(loops);
    let padded = samples * PADDING;
    let range_fft = planner.plan_fft_forward(padded);
    let delay_of_cell = radar.sample_rate_hz / (padded as f64 * radar.slope_hz_per_s);
    for channel in 0..evidence.cube.channels() {
        let scale = 1.0 / evidence.noise()[channel].max(f64::MIN_POSITIVE).sqrt();
        let chirps = evidence.cube.channel(frame, channel);
        // `[sample][doppler]`
        let mut columns: Vec<Complex64> = (0..samples)
            .flat_map(|n| (0..loops).map(move |l| (n, l)))
            .map(|(n, l)| chirps[l * samples + n] * (slow[l] * scale))
            .collect();
        doppler_fft.process(&mut columns);
        let mut spectrum = vec![Complex64::ZERO; padded];
        let mut template = vec![Complex64::ZERO; padded];
        for doppler in 0..loops {
            let in_clutter = doppler.min(loops - doppler) <= CLUTTER_BINS;
            let Some([near, far]) = spans[usize::from(!in_clutter)] else { continue };
            spectrum.fill(Complex64::ZERO);
            for n in 0..samples {
                spectrum[n] = columns[n * loops + doppler] * fast[n];
            }
            range_fft.process(&mut spectrum);
            template.fill(Complex64::ZERO);
            for cell in near * PADDING..=far * PADDING {
                template[cell] = spectrum[cell] * (cell as f64 * delay_of_cell);
            }
            let power: f64 = template.iter().step_by(PADDING).map(|t| t.norm_sqr()).sum();
            let noise = (near..=far).map(|b| ((b * PADDING) as f64 * delay_of_cell).powi(2)).sum::<f64>();
            // Only noise to shift.
            if power < 3.0 * noise {
                continue;
            }
            for bin in (0..near.saturating_sub(1)).chain((far + 2).min(samples)..samples) {
                let value = spectrum[bin * PADDING];
                for (sum, &shift) in sums.iter_mut().zip(shifts) {
                    let above = template[(bin * PADDING + padded - shift) % padded];
                    let below = template[(bin * PADDING + shift) % padded];
                    sum.above += above.conj() * value;
                    sum.below += below.conj() * value;
                    sum.energy_above += above.norm_sqr();
                    sum.energy_below += below.norm_sqr();
                }
            }
        }
    }
    sums
}

/// Subtracts the paired echoes, of first order.
fn undo(cube: &mut Cube, radar: &Radar, alpha: Complex64, ripple_hz: f64) {
    let times_delay = Filter::new(&delays_s(radar, cube.dims[4]).map(Complex64::from).collect::<Vec<_>>());
    let sample_s = 1.0 / radar.sample_rate_hz;
    cube.each_chirp(|_, samples| {
        let mut delayed = samples.to_vec();
        times_delay.apply(&mut delayed);
        for (n, (value, delayed)) in samples.iter_mut().zip(delayed).enumerate() {
            let turn = alpha * Complex64::cis(TAU * ripple_hz * sample_s * n as f64);
            // i · 2 · imaginary part: the two echoes together are a pure phase.
            *value -= delayed * (turn - turn.conj());
        }
    });
}
