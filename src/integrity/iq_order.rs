//! I and Q exchanged: the samples are the conjugates of what was sent.
//!
//! Returns lie at the beat frequencies of their ranges, and those of a pair of frequencies ±f are those of a near and of a far range. In
//! a room whose size is stated, nothing lies beyond its farthest corner; in an unknown scene, returns weaken with range. So over the pairs
//! in which static returns stand out of the noise, and of which not both are within the room, the mean of ln(far / near) is zero at
//! most: a paired Student test over pairs of the still chirps' spectrum, power summed over the channels. Every second bin counts,
//! as the window joins neighbours. Where far returns are as strong as near ones, nothing can be decided.
//!
//! An unknown scene may also be open, with far returns alone. But the filter before the converter keeps out what would alias, and so the
//! last ninth of the band: no return there is the strongest. So something is decided only where the strongest static return lies in
//! the first or the last ninth of the band; far returns alone, as they are or as their mirror image, decide nothing.

use super::still::{Still, spectrum};
use super::stream::{Schedule, Stream};
use super::tails::student_tail;
use super::{ALARM, Finding, Inspector, Kind};

const CHECK: &str = "iq_order";
const EXPECTED: &str = "static returns at the beat frequencies of the room's ranges";
/// Bins beside 0 in which the radar's own leakage and its offset lie under the window.
const GUARD: usize = 3;
/// Bins between pairs that share nothing under a Hann window, whose main lobe is four bins wide.
const APART: usize = 2;
/// Share of the sampling rate that the filter before a complex converter passes, at most (TI, data sheets: of the AWR2243 20 MHz of
/// 22.5 Msps, of the IWR6843 10 MHz of 12.5 Msps).
const PASSED: f64 = 20.0 / 22.5;
/// A pair counts above this many times the noise: of noise alone, e⁻²⁰.
const RETURN: f64 = 20.0;

pub(super) struct IqOrder {
    schedule: Schedule,
    still: Still,
}

impl IqOrder {
    pub fn new(schedule: Schedule) -> Self {
        Self { schedule, still: Still::new(schedule) }
    }

    /// Near and far bin of each informative pair.
    fn pairs(&self) -> impl Iterator<Item = [usize; 2]> {
        let Schedule { samples, is_falling, farthest_bin, .. } = self.schedule;
        let outside = move |far: usize| farthest_bin.is_none_or(|farthest| far as f64 > farthest + GUARD as f64);
        let pairs = (GUARD..(samples / 2).saturating_sub(GUARD)).step_by(APART).map(move |near| [near, samples - near]);
        pairs.filter(move |[_, far]| outside(*far)).map(move |[near, far]| if is_falling { [far, near] } else { [near, far] })
    }
}

impl Inspector for IqOrder {
    fn see(&mut self, stream: &Stream) {
        self.still.see(stream);
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        if self.schedule.is_real {
            return None;
        }
        if !self.still.shows_noise() {
            return Some(Finding::undecided(CHECK, EXPECTED, "one chirp shows no noise to separate returns from"));
        }
        let samples = self.schedule.samples;
        let least = RETURN * self.still.noise_of_bin();
        let power = spectrum(self.still.sum.chirps(), samples);
        let of = |pair: [usize; 2]| pair.map(|bin| power[bin]);
        let pairs: Vec<[usize; 2]> = self.pairs().filter(|pair| of(*pair)[0].max(of(*pair)[1]) >= least).collect();
        let powers: Vec<[f64; 2]> = pairs.iter().map(|pair| of(*pair)).collect();
        let ratios: Vec<f64> = powers.iter().map(|[near, far]| (far / near.max(f64::MIN_POSITIVE)).ln()).collect();
        if ratios.len() < 2 {
            return Some(Finding::undecided(CHECK, EXPECTED, "static returns stand out of the noise at too few frequencies"));
        }
        let mean_db = 10.0 / std::f64::consts::LN_10 * ratios.iter().sum::<f64>() / ratios.len() as f64;
        let found = format!(
            "of {} pairs of beat frequencies with static returns, the far one is {:.1} dB {}",
            ratios.len(),
            mean_db.abs(),
            if mean_db < 0.0 { "weaker" } else { "stronger" }
        );
        let strongest = pairs.iter().flatten().copied().max_by(|a, b| power[*a].total_cmp(&power[*b])).expect("there are two");
        let from_edge = strongest.min(samples - strongest) as f64 / samples as f64;
        if self.schedule.farthest_bin.is_none() && from_edge > 1.0 - PASSED {
            let why = format!(
                "{found}, the strongest {:.0} % of the band from its edges: there may be far returns alone",
                100.0 * from_edge
            );
            return Some(Finding::undecided(CHECK, EXPECTED, why));
        }
        let exchanged = student_tail(&ratios);
        if exchanged < ALARM {
            let found = format!("{found}: I and Q are exchanged, or the samples conjugated");
            return Some(Finding::wrong(Kind::Convention, CHECK, EXPECTED, found, exchanged.ln()));
        }
        if student_tail(&ratios.iter().map(|ratio| -ratio).collect::<Vec<_>>()) >= ALARM {
            return Some(Finding::undecided(CHECK, EXPECTED, found));
        }
        Some(Finding::as_stated(CHECK, EXPECTED, found))
    }
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::data::IfFrame;
    use crate::support::numbers;

    const LOOPS: usize = 16;
    const SAMPLES: usize = 128;
    const SCHEDULE: Schedule =
        Schedule { tx: 1, rx: 2, loops: LOOPS, samples: SAMPLES, is_real: false, is_falling: false, farthest_bin: None };

    /// Static returns at so many bins, falling with range, under noise.
    fn seen(schedule: Schedule, bins: std::ops::Range<usize>, sign: f32) -> Finding {
        of_law(schedule, bins, sign, |bin| 100.0 / bin as f64)
    }

    /// The same of another law of their amplitudes.
    fn of_law(schedule: Schedule, bins: std::ops::Range<usize>, sign: f32, law: fn(usize) -> f64) -> Finding {
        let noise = numbers(9, 4 * LOOPS * SAMPLES, -3.0, 3.0);
        let phases = numbers(10, 2 * SAMPLES, 0.0, std::f64::consts::TAU);
        let value = |place: usize| -> Complex64 {
            let (channel, sample) = (place / SAMPLES / LOOPS, place % SAMPLES);
            let tone = |bin: usize| {
                let phase = std::f64::consts::TAU * (bin * sample) as f64 / SAMPLES as f64 + phases[channel * SAMPLES + bin];
                Complex64::from_polar(law(bin), phase)
            };
            bins.clone().map(tone).sum::<Complex64>() + Complex64::new(noise[2 * place], noise[2 * place + 1])
        };
        let values: Vec<Complex64> = (0..2 * LOOPS * SAMPLES).map(value).collect();
        let (re, im) = values.iter().map(|value| (value.re as f32, sign * value.im as f32)).unzip();
        let mut inspector = Box::new(IqOrder::new(schedule));
        inspector.see(&Stream::of(schedule, 0, &IfFrame::new([1, 2, LOOPS, SAMPLES], re, Some(im))));
        inspector.conclude().unwrap()
    }

    #[test]
    fn a_room_is_on_its_side_and_its_mirror_image_is_not() {
        for (schedule, bins) in
            [(SCHEDULE, 2..60), (Schedule { farthest_bin: Some(60.0), ..SCHEDULE }, 2..60), (SCHEDULE, 2..110)]
        {
            let right = seen(schedule, bins.clone(), 1.0);
            assert!(right.ok && right.decided, "{right:?}");
            let exchanged = seen(schedule, bins.clone(), -1.0);
            assert!(exchanged.is_refusal() && exchanged.kind == Kind::Convention, "{exchanged:?}");
            // A falling chirp has the mirror image of its room.
            assert!(seen(Schedule { is_falling: true, ..schedule }, bins, -1.0).ok);
        }
    }

    /// Fields, a yard, a car park: far returns alone, which weaken with range or, as of a wall behind a lawn, do not.
    #[test]
    fn an_open_scene_with_far_returns_alone_is_not_accused() {
        for bins in [70..114, 64..100, 100..110] {
            for sign in [1.0, -1.0] {
                for law in [|bin: usize| 100.0 / bin as f64, |bin: usize| 1e-2 * bin as f64] {
                    let open = of_law(SCHEDULE, bins.clone(), sign, law);
                    assert!(open.ok && !open.decided, "{bins:?}, {sign}: {open:?}");
                }
            }
        }
    }

    #[test]
    fn noise_and_a_room_up_to_the_last_bin_tell_nothing() {
        let noise = seen(SCHEDULE, 0..0, 1.0);
        assert!(noise.ok && !noise.decided, "{noise:?}");
        let full = seen(Schedule { farthest_bin: Some(126.0), ..SCHEDULE }, 2..126, -1.0);
        assert!(full.ok && !full.decided, "{full:?}");
    }
}
