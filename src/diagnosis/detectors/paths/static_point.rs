//! A static return that is stronger than the static clutter around it (`static_reflector`): in one range cell, from one direction,
//! in every frame. What the clutter's own roughness may do is the null: its power in a cell is speckle about the mean of the
//! ranges around it, times a texture, as the ranges themselves show it (`texture.rs`). Boundaries, edges and corners return more than their
//! surroundings at known ranges, and are left out.

use num_complex::Complex64;

use super::texture::Texture;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::detectors::steering::{power, steering};
use crate::diagnosis::evidence::{hann, transform};
use crate::diagnosis::statistics::corrected;
use crate::diagnosis::{Candidate, Correction, Cube, Estimate, Evidence, Place};
use crate::effects::{self, Stage};
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::room::{Boundary, Room};

/// Ranges on either side from which the clutter's mean is estimated, cells; those next to the peak belong to it.
const AROUND: usize = 10;
const PEAK: usize = 2;
const FEWEST_AROUND: usize = 8;
/// Neighbouring cells of a Hann window share their speckle.
const CELLS_PER_RANGE: f64 = 2.0;
/// Share of a cell's power that may differ from frame to frame: a body that pauses leaves more.
const UNSTEADY: f64 = 0.15;
/// Share of a cell's power that one direction must explain.
const COHERENT: f64 = 0.8;
/// Cells beside a known return of the room, and behind the nearest boundary, where clutter sets in.
const BESIDE: f64 = 1.0;
const ONSET: f64 = 4.0;
const SINES: usize = 121;

/// Mean chirps after a Hann window and a transform, `[channel][range]`.
type Spectra = Vec<Vec<Complex64>>;

struct Peak {
    range_m: f64,
    cell_m: f64,
    sine: Option<f64>,
    /// Over the mean of the ranges around it.
    ratio: f64,
    around: Vec<usize>,
    bin: usize,
    p_value: f64,
}

pub fn find(evidence: &Evidence) -> Option<Candidate> {
    let room = evidence.room.as_ref().filter(|room| !room.boundaries().is_empty())?;
    let frames: Vec<Spectra> = (0..evidence.cube.dims[0]).map(|frame| spectra(&evidence.cube, &[frame])).collect();
    let training = spectra(&evidence.cube, &evidence.split.training);
    let constant = constant(&frames);
    let (peak, texture, tried) = strongest(evidence, room, &training, &constant)?;
    let held_out = spectra(&evidence.cube, &evidence.split.held_out);
    let ratio = beam(&evidence.radar, &held_out, peak.bin, peak.sine) / mean(&held_out, &peak.around);
    let held_out_p = texture.mean_over(|texture| tail(ratio / texture, peak.around.len()));
    let p_value = corrected(peak.p_value, tried * super::TRIED);
    let nats = -(peak.p_value.max(held_out_p).max(1e-300) * tried).ln();
    (nats > super::LEAST_GAIN && p_value < 1e-3).then(|| candidate(evidence, &peak, p_value, nats))
}

fn spectra(cube: &Cube, frames: &[usize]) -> Spectra {
    let samples = cube.dims[4];
    cube.clutter(frames).chunks_exact(samples).map(|mean| transform(mean, samples)).collect()
}

/// Whether a range returns the same in every frame.
fn constant(frames: &[Spectra]) -> Vec<bool> {
    let (channels, bins, count) = (frames[0].len(), frames[0][0].len(), frames.len() as f64);
    (0..bins)
        .map(|bin| {
            let (mut power, mut spread) = (0.0, 0.0);
            for channel in 0..channels {
                let mean = frames.iter().map(|frame| frame[channel][bin]).sum::<Complex64>() / count;
                power += mean.norm_sqr();
                spread += frames.iter().map(|frame| (frame[channel][bin] - mean).norm_sqr()).sum::<f64>() / count;
            }
            spread < UNSTEADY * power
        })
        .collect()
}

/// The least likely cell under speckle, the texture that this has, and how many were looked at.
fn strongest(evidence: &Evidence, room: &Room, spectra: &Spectra, constant: &[bool]) -> Option<(Peak, Texture, f64)> {
    let radar = &evidence.radar;
    let cell_m = SPEED_OF_LIGHT * radar.sample_rate_hz / (2.0 * radar.slope_hz_per_s * radar.samples_per_chirp as f64);
    let known = known_m(room);
    let near_m = known.iter().copied().fold(f64::INFINITY, f64::min);
    let far_m = known.iter().copied().fold(0.0, f64::max);
    let bins = evidence.range_bins();
    let inside = |bin: usize| (near_m..far_m).contains(&(bin as f64 * cell_m)) && bin + 1 < bins;
    let directions: Vec<Option<f64>> =
        if directed(radar) { (0..SINES).map(|i| Some(2.0 * i as f64 / (SINES - 1) as f64 - 1.0)).collect() } else { vec![None] };
    let texture = Texture::of(spectra, |bin| inside(bin) && constant[bin]);
    let mut best: Option<Peak> = None;
    let mut tried = 0.0;
    for bin in (1..bins).filter(|&bin| inside(bin) && constant[bin]) {
        let around: Vec<usize> =
            (bin.saturating_sub(AROUND)..=bin + AROUND).filter(|&other| other.abs_diff(bin) > PEAK && inside(other)).collect();
        if around.len() < FEWEST_AROUND {
            continue;
        }
        tried += radar.rx_m.len() as f64;
        let at = |bin: usize, sine: Option<f64>| beam(radar, spectra, bin, sine);
        let Some(&sine) = directions.iter().max_by(|a, b| at(bin, **a).total_cmp(&at(bin, **b))) else { continue };
        let [before, power, after] = [bin - 1, bin, bin + 1].map(|bin| at(bin, sine));
        if power < before || power < after || power < COHERENT * mean(spectra, &[bin]) {
            continue;
        }
        let range_m = (bin as f64 + hann_shift(before.sqrt(), power.sqrt(), after.sqrt())) * cell_m;
        let beside = known.iter().any(|known| (known - range_m).abs() < BESIDE * cell_m);
        if beside || range_m < near_m + ONSET * cell_m {
            continue;
        }
        let ratio = power / mean(spectra, &around);
        let p_value = texture.mean_over(|texture| tail(ratio / texture, around.len()));
        if best.as_ref().is_none_or(|best| p_value < best.p_value) {
            best = Some(Peak { range_m, cell_m, sine, ratio, around, bin, p_value });
        }
    }
    best.map(|best| (best, texture, tried))
}

/// Probability that speckle exceeds so many times the mean of its neighbours (one draw over a mean of draws: F law).
fn tail(ratio: f64, around: usize) -> f64 {
    let count = around as f64 / CELLS_PER_RANGE;
    (1.0 + ratio / count).powf(-count)
}

/// Mean power of a channel over some ranges.
fn mean(spectra: &Spectra, bins: &[usize]) -> f64 {
    let sum: f64 = spectra.iter().flat_map(|channel| bins.iter().map(|&bin| channel[bin].norm_sqr())).sum();
    (sum / (spectra.len() * bins.len().max(1)) as f64).max(f64::MIN_POSITIVE)
}

fn directed(radar: &Radar) -> bool {
    radar.rx_m.iter().any(|at| (at[0] - radar.rx_m[0][0]).abs() > 0.1 * radar.wavelength_m())
}

/// Power per channel that arrives from a direction (x over range); the receivers of each transmitter add coherently.
fn beam(radar: &Radar, spectra: &Spectra, bin: usize, sine: Option<f64>) -> f64 {
    let Some(sine) = sine else { return mean(spectra, &[bin]) };
    let values: Vec<Complex64> = spectra.iter().map(|channel| channel[bin]).collect();
    power(&values, &steering(radar, sine)) / (radar.rx_m.len() * spectra.len()) as f64
}

/// Where a tone's peak lies beside a cell of a Hann window, from its amplitude and its neighbours'.
fn hann_shift(before: f64, middle: f64, after: f64) -> f64 {
    let side = if after >= before { 1.0 } else { -1.0 };
    let neighbour = before.max(after);
    side * ((2.0 * neighbour - middle) / (neighbour + middle).max(f64::MIN_POSITIVE)).clamp(-0.5, 0.5)
}

/// Ranges at which the bare room returns more than around them: feet of perpendiculars, edges and corners. What is
/// behind the radar is not seen.
fn known_m(room: &Room) -> Vec<f64> {
    let axis = |boundaries: &[Boundary]| -> Vec<f64> {
        std::iter::once(0.0).chain(boundaries.iter().filter_map(|&boundary| room.distance_m(boundary))).collect()
    };
    let across = axis(&[Boundary::Left, Boundary::Right]);
    let along = axis(&[Boundary::Front]);
    let up = axis(&[Boundary::Floor, Boundary::Ceiling]);
    let mut known = vec![];
    for x in &across {
        for y in &along {
            known.extend(up.iter().map(|z| (x * x + y * y + z * z).sqrt()).filter(|range| *range > 0.0));
        }
    }
    known
}

/// What a peak is in the samples: one tone of the same amplitude in every chirp of a channel.
struct Tone {
    turns: Vec<Complex64>,
    /// `[channel]`
    amplitudes: Vec<Complex64>,
}

impl Tone {
    fn of(evidence: &Evidence, peak: &Peak) -> Self {
        let samples = evidence.cube.dims[4];
        let rate = std::f64::consts::TAU * peak.range_m / peak.cell_m / samples as f64;
        let turns: Vec<Complex64> = (0..samples).map(|n| Complex64::cis(rate * n as f64)).collect();
        // Through the window, so that other ranges do not leak in.
        let window: Vec<f64> = hann(samples).iter().map(|w| w * w).collect();
        let amplitudes = (evidence.clutter().chunks_exact(samples))
            .map(|mean| mean.iter().zip(&turns).zip(&window).map(|((value, turn), w)| value * turn.conj() * w).sum())
            .collect();
        Self { turns, amplitudes }
    }

    /// Of all channels.
    fn power(&self) -> f64 {
        self.amplitudes.iter().map(Complex64::norm_sqr).sum()
    }

    /// Over what moves in a channel's samples.
    fn relative(&self, evidence: &Evidence, peak: &Peak) -> Option<Estimate> {
        let amplitude = (self.power() / self.amplitudes.len() as f64).sqrt() / body_rms(evidence)?;
        // The clutter below it adds in any phase; the level of a body differs from frame to frame.
        Some(Estimate::normal("amplitude", amplitude, amplitude * peak.share().hypot(0.2)))
    }

    fn remove(&self, cube: &mut Cube) {
        cube.each_chirp(|[_, channel, _], chirp| {
            chirp.iter_mut().zip(&self.turns).for_each(|(value, turn)| *value -= self.amplitudes[channel] * turn);
        });
    }
}

impl Peak {
    /// Amplitude of the clutter around it over its own.
    fn share(&self) -> f64 {
        1.0 / self.ratio.sqrt()
    }

    /// Of the sine.
    fn sine_error(&self) -> f64 {
        0.03 + 0.3 * self.share()
    }

    fn place(&self, radar: &Radar) -> Place {
        let azimuths = |sine: f64| [degrees(sine - self.sine_error()), degrees(sine + self.sine_error())];
        Place {
            range_m: Some([self.range_m - 0.5 * self.cell_m, self.range_m + 0.5 * self.cell_m]),
            velocity_mps: Some([0.0, 0.0]),
            position_m: self.sine.map(|sine| self.position_m(radar, sine)),
            azimuth_deg: self.sine.map(azimuths),
            ..Place::at(Stage::Scene)
        }
    }

    fn position_m(&self, radar: &Radar, sine: f64) -> [f64; 3] {
        let (at, range) = (radar.centre_m(), self.range_m);
        [at[0] + range * sine, at[1] + range * (1.0 - sine * sine).max(0.0).sqrt(), at[2]]
    }

    fn position(&self, radar: &Radar) -> Option<Estimate> {
        let (sine, sine_error) = (self.sine?, self.sine_error());
        let (at, range) = (radar.centre_m(), self.range_m);
        let [x, y, z] = self.position_m(radar, sine);
        let error_m = 0.3 * self.cell_m;
        // A line of receivers does not see the height; as far up or down as it is off, y is shorter.
        let height = 1.0f64;
        let square = |off: f64| (range * range * (1.0 - (sine.abs() + off).clamp(0.0, 1.0).powi(2))).max(0.0);
        let lowest = (square(sine_error) - height * height).max(0.0).sqrt() - error_m;
        Some(Estimate {
            name: "position_m",
            values: vec![x, y, z],
            ci90: vec![
                [x - range * sine_error - error_m, x + range * sine_error + error_m],
                [at[1] + lowest, at[1] + square(-sine_error).sqrt() + error_m],
                [z - height, z + height],
            ],
        })
    }

    fn statement(&self) -> String {
        let towards =
            self.sine.map_or(String::new(), |sine| format!(" at {:.0}° azimuth (its height is not seen)", degrees(sine)));
        format!(
            "A static return {:.2} m away{towards}: all receivers see one direction, {:.0} dB above the clutter of \
             the ranges around it, in every frame, and no boundary, edge or corner of the room is there.",
            self.range_m,
            10.0 * self.ratio.log10()
        )
    }
}

fn degrees(sine: f64) -> f64 {
    sine.clamp(-1.0, 1.0).asin().to_degrees()
}

fn candidate(evidence: &Evidence, peak: &Peak, p_value: f64, nats: f64) -> Candidate {
    let (radar, [frames, _, _, loops, samples]) = (&evidence.radar, evidence.cube.dims);
    let tone = Tone::of(evidence, peak);
    Candidate {
        id: Some(effects::static_reflector::ID),
        estimates: peak.position(radar).into_iter().chain(tone.relative(evidence, peak)).collect(),
        statement: peak.statement(),
        energy: tone.power() * (frames * loops * samples) as f64,
        correction: Correction::samples(move |cube| tone.remove(cube)),
        ..Candidate::new(Behaviour::PathLike, peak.place(radar), p_value, nats)
    }
}

/// Root mean square of what moves, in a channel's samples, without the noise.
pub fn body_rms(evidence: &Evidence) -> Option<f64> {
    evidence.body.as_ref()?;
    let (mut sum, mut noise) = (0.0, 0.0);
    for channel in 0..evidence.cube.channels() {
        for frame in 0..evidence.cube.dims[0] {
            let moving = evidence.moving(frame, channel);
            sum += moving.iter().map(Complex64::norm_sqr).sum::<f64>();
            noise += evidence.noise()[channel] * moving.len() as f64;
        }
    }
    let power = (sum - noise) / evidence.cube.samples.len() as f64;
    (power > 0.0).then(|| power.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speckle_hardly_stands_out_of_speckle_and_a_shift_is_read_back() {
        assert!((tail(0.0, 16) - 1.0).abs() < 1e-12 && tail(50.0, 16) < 1e-6 && tail(5.0, 16) > 1e-3);
        // A Hann window's main lobe a third of a cell beside the middle one.
        let lobe = |x: f64| (std::f64::consts::PI * x).sin() / (std::f64::consts::PI * x * (1.0 - x * x));
        let shift = hann_shift(lobe(-1.3).abs(), lobe(-0.3).abs(), lobe(0.7).abs());
        assert!((shift - 0.3).abs() < 1e-9, "{shift}");
    }

    #[test]
    fn feet_edges_and_corners_are_known() {
        let known = known_m(&Room { front_m: Some(4.0), floor_m: Some(3.0), ..Room::default() });
        assert_eq!(known.len(), 3);
        assert!(known.iter().any(|range| (range - 5.0).abs() < 1e-12));
    }
}
