//! Fewer transmitters than fired: loops that take turns.
//!
//! Where several transmitters fire in turn and one is stated, every m-th loop shows the room from one of them. Each static return then
//! differs between the m kinds of loops, by other phases in other directions. At a return, the energy between the kinds against that
//! within them has an F distribution where loops differ at random (analysis of variance); how many returns exceed its 5 % by chance is
//! binomial, Bonferroni over m. What moves, or vibrates at a harmonic of the loops' rate, does so at its range alone: most returns must
//! take turns. Loops of another gain or phase share one factor at all returns, as a receiver or a synthesiser that takes turns has; they
//! must take turns beyond the best such factor, too. Turns are those of all frames that were looked at: what moves, a burst or a rail that
//! cuts differs from frame to frame, and that scatter is what turns must exceed.
//!
//! The loops of a frame are counted from its first one, as many whole rounds of the m kinds as it has. What frames are too short for, the
//! frames themselves show where they split the rounds: the first loops of frames of n loops are of m / gcd(m, n) kinds. From frame to
//! frame a vibration changes all returns together, so that they count once: most of them must exceed the whole alarm, and as a radar that
//! is shaken does the same, that decides nothing. What neither shows is not decided.

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;

use super::stream::{Schedule, Stream};
use super::turns::{Sequence, TakenTurns, all_together, each_by_itself};
use super::{Finding, Inspector, Kind, listed};

const CHECK: &str = "transmitter_count";
const EXPECTED: &str = "one loop like the next";
/// Frames that are looked at: loops take the same turns in all.
const FRAMES: usize = 4;
/// Kinds of loops that are tried, and transmitters and receivers that are named, at most: those of four chips (AWR2243 cascade: twelve
/// and sixteen).
const MOST: usize = 16;
/// Channels that are kept, at most: all channels show the same turns.
const CHANNELS: usize = 16;

pub(super) struct Alternation {
    schedule: Schedule,
    loops: Sequence,
    /// Kinds of loops that the loops of one frame do not show, and spectra of the first loops of frames that follow one another, of some
    /// of their channels.
    others: Vec<usize>,
    firsts: Vec<Complex64>,
    next: usize,
}

impl Alternation {
    pub fn new(schedule: Schedule) -> Self {
        let loops = Sequence::new(kept(schedule), schedule.loops, 2..=MOST);
        let others = (2..=MOST).filter(|kinds| !loops.has(*kinds)).collect();
        Self { schedule, loops, others, firsts: vec![], next: 0 }
    }

    /// Kinds of first loops where there are so many kinds of loops.
    fn of_frames(&self, kinds: usize) -> usize {
        kinds / gcd(kinds, self.schedule.loops)
    }

    /// The first loops in a row, with the kinds that the loops of one frame do not show.
    fn frames(&self) -> Sequence {
        let mut kinds: Vec<usize> = self.others.iter().map(|&kinds| self.of_frames(kinds)).filter(|kinds| *kinds > 1).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let kept = kept(self.schedule);
        let mut frames = Sequence::new(kept, self.firsts.len() / kept.period(), kinds.into_iter());
        if !frames.is_empty() {
            frames.add(&self.firsts, 0);
        }
        frames
    }

    /// Which counts of transmitters, and of receivers, make so many kinds of items, of which each is `loops` loops.
    fn counts(&self, kinds: usize, loops: usize) -> String {
        let Schedule { tx, rx, .. } = self.schedule;
        let of =
            |stated: usize| -> Vec<usize> { (1..=MOST).filter(|count| count / gcd(*count, stated * loops) == kinds).collect() };
        let listed = [(of(tx), "transmitters that fired in turn", tx), (of(rx), "receivers", rx)];
        let listed = listed.iter().filter(|(counts, ..)| !counts.is_empty());
        let listed = listed.map(|(counts, what, stated)| format!("{} {what}, not {stated}", either(counts)));
        listed.chain([format!("{kinds} kinds of chirps")]).collect::<Vec<_>>().join("; or ")
    }
}

/// What is kept of a loop: channels evenly spread over all.
fn kept(schedule: Schedule) -> Schedule {
    Schedule { tx: 1, rx: schedule.channels().min(CHANNELS), ..schedule }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// `3, 6 or 12`
fn either(counts: &[usize]) -> String {
    let listed: Vec<String> = counts.iter().map(usize::to_string).collect();
    match listed.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        _ => listed.concat(),
    }
}

/// Windowed range spectra of chirps, `[chirp, bin]`: Hann, so that a strong return does not take the place of the others.
fn spectra(mut values: Vec<Complex64>, samples: usize) -> Vec<Complex64> {
    let angle = |n: usize| std::f64::consts::TAU * (n as f64 + 0.5) / samples as f64;
    let window: Vec<f64> = (0..samples).map(|n| 0.5 - 0.5 * angle(n).cos()).collect();
    for chirp in values.chunks_exact_mut(samples) {
        chirp.iter_mut().zip(&window).for_each(|(value, weight)| *value *= weight);
    }
    FftPlanner::new().plan_fft_forward(samples).process(&mut values);
    values
}

impl Inspector for Alternation {
    fn see(&mut self, stream: &Stream) {
        let period = self.schedule.period();
        let needs_all = self.loops.rows < FRAMES && !self.loops.is_empty();
        let kept = kept(self.schedule);
        let needs_first = !self.others.is_empty() && self.firsts.len() < FRAMES * MOST * kept.period();
        if !needs_all && !needs_first {
            return;
        }
        let mut loops = stream.centred();
        if !needs_all {
            loops.truncate(period);
        }
        let of_loop = |values: &[Complex64]| -> Vec<Complex64> {
            let channels: Vec<&[Complex64]> = values.chunks_exact(kept.samples).collect();
            (0..kept.rx).flat_map(|channel| channels[channel * channels.len() / kept.rx]).copied().collect()
        };
        let spectra = spectra(loops.chunks_exact(period).flat_map(of_loop).collect(), self.schedule.samples);
        if needs_all {
            self.loops.add(&spectra, stream.frame * self.schedule.loops);
        }
        if needs_first {
            if stream.frame != self.next {
                self.firsts.clear();
            }
            self.next = stream.frame + 1;
            self.firsts.extend(&spectra[..kept.period()]);
        }
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        let frames = self.frames();
        let (by_loops, returns) = self.loops.found(each_by_itself);
        let (by_frames, of_frames) = frames.found(all_together);
        let sentence = |what: &str, loops: usize, found: &TakenTurns| {
            let TakenTurns { kinds, places, .. } = found;
            format!("{what} of {kinds} kinds take turns {places}: {}", self.counts(*kinds, loops))
        };
        if let Some(found) = by_loops {
            return Some(Finding::wrong(Kind::Misread, CHECK, EXPECTED, sentence("loops", 1, &found), found.log_p));
        }
        // A radar that is shaken at a part of the frames' rate does the same.
        if let Some(found) = by_frames {
            let found = sentence("frames", self.schedule.loops, &found) + "; or a vibration";
            return Some(Finding::undecided(CHECK, EXPECTED, found));
        }
        let most = returns.max(of_frames);
        if most == 0 {
            return Some(Finding::undecided(CHECK, EXPECTED, "no static return stands out of the noise"));
        }
        let is_hidden = |kinds: &&usize| !frames.has(self.of_frames(**kinds));
        let hidden: Vec<usize> = self.others.iter().filter(is_hidden).copied().collect();
        let found = format!("loops take no turns (static returns that were looked at: {most})");
        if !self.loops.is_empty() && returns < self.loops.fewest_returns() {
            return Some(Finding::undecided(
                CHECK,
                EXPECTED,
                format!("too few static returns stand out of the noise: {returns}"),
            ));
        }
        if hidden.is_empty() {
            return Some(Finding::as_stated(CHECK, EXPECTED, found));
        }
        let why = format!("{found}, but {} kinds of them would not show: too few loops and frames", listed(&hidden));
        Some(Finding::undecided(CHECK, EXPECTED, why))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::IfFrame;
    use crate::support::numbers;

    const SAMPLES: usize = 64;
    const RX: usize = 2;

    /// What multiplies a return of a direction (−1 … 1) in a loop, counted through all frames.
    type Turn = fn(usize, f64) -> Complex64;

    /// Eight static returns from several directions, and a stronger one that turns by half a turn from loop to loop, in so many frames
    /// of so many loops.
    fn seen(shape: [usize; 2], turn: Turn, noise: f64) -> Finding {
        seen_by(shape, turn, noise, 1.0, false)
    }

    /// The same in other units, and with a second receiver that sends one code.
    fn seen_by(shape: [usize; 2], turn: Turn, noise: f64, scale: f64, is_dead: bool) -> Finding {
        inspector(RX, shape, turn, noise, scale, is_dead).conclude().unwrap()
    }

    /// By so many receivers.
    fn inspector(rxs: usize, [frames, loops]: [usize; 2], turn: Turn, noise: f64, scale: f64, is_dead: bool) -> Box<Alternation> {
        let schedule =
            Schedule { tx: 1, rx: rxs, loops, samples: SAMPLES, is_real: false, is_falling: false, farthest_bin: None };
        let length = rxs * loops * SAMPLES;
        let (phases, drawn) = (numbers(3, 16, 0.0, std::f64::consts::TAU), numbers(4, 2 * frames * length, -noise, noise));
        let value = |rx: usize, index: usize, sample: usize| {
            let tone =
                |bin: f64, phase: f64| Complex64::from_polar(1.0, std::f64::consts::TAU * bin * sample as f64 / 64.0 + phase);
            let still = (0..8).map(|at| {
                let direction = (at as f64 * 0.37).sin();
                let phase = phases[at] + std::f64::consts::PI * direction * rx as f64;
                tone(5.0 + 7.0 * at as f64, phase) * turn(index, direction)
            });
            // Its side lobes take turns at all returns, which the noise covers.
            let vibrating = if noise > 0.0 { 3.0 } else { 0.0 } * tone(37.3, phases[9]) * [1.0, -1.0][index % 2];
            still.sum::<Complex64>() + vibrating
        };
        let mut inspector = Box::new(Alternation::new(schedule));
        for frame in 0..frames {
            let (mut re, mut im) = (vec![], vec![]);
            for (rx, index) in (0..rxs).flat_map(|rx| (0..loops).map(move |index| (rx, index))) {
                for sample in 0..SAMPLES {
                    let value = value(rx, frame * loops + index, sample);
                    let place = 2 * (frame * length + (rx * loops + index) * SAMPLES + sample);
                    let seen = [value.re + drawn[place], value.im + drawn[place + 1]].map(|value| (scale * value) as f32);
                    let [i, q] = if is_dead && rx == 1 { [3.0; 2] } else { seen };
                    re.push(i);
                    im.push(q);
                }
            }
            inspector.see(&Stream::of(schedule, frame, &IfFrame::new([1, rxs, loops, SAMPLES], re, Some(im))));
        }
        inspector
    }

    /// As transmitters two wavelengths apart see it.
    fn by_transmitter(kinds: usize, index: usize, direction: f64) -> Complex64 {
        Complex64::from_polar(1.0, 4.0 * std::f64::consts::PI * direction * (index % kinds) as f64)
    }

    const TURNS: [(usize, Turn); 3] = [
        (2, |index, direction| by_transmitter(2, index, direction)),
        (3, |index, direction| by_transmitter(3, index, direction)),
        (4, |index, direction| by_transmitter(4, index, direction)),
    ];

    #[test]
    fn transmitters_that_take_turns_are_counted_whatever_the_loops() {
        for (kinds, turn) in TURNS {
            // Whole rounds, and frames that split them.
            for (shape, noise) in [([1, 24], 0.05), ([1, 24], 0.5), ([1, 32], 0.5), ([3, 25], 0.5)] {
                let found = seen(shape, turn, noise);
                assert!(
                    found.is_refusal() && found.found.contains(&format!("loops of {kinds} kinds")),
                    "{kinds}, {shape:?}, {noise}: {found:?}"
                );
                assert!(found.found.contains(&format!(": {kinds} transmitters that fired in turn, not 1; or ")), "{found:?}");
            }
        }
    }

    #[test]
    fn frames_of_a_few_loops_show_turns_where_they_split_them() {
        let split = seen([24, 4], TURNS[1].1, 0.1);
        assert!(split.ok && !split.decided && split.found.contains("frames of 3 kinds"), "{split:?}");
        // Frames of four loops do not split four kinds.
        let still = seen([40, 4], |_, _| Complex64::ONE, 0.1);
        assert!(still.ok && !still.decided && still.found.contains("but 4 kinds"), "{still:?}");
        // Something that moves from frame to frame, and a first loop of another gain.
        let turns: [Turn; 2] = [
            |index, direction| Complex64::from_polar(1.0, 3.0 * direction * ((index / 4 * index) as f64).sin()),
            |index, _| Complex64::from([0.6, 0.9, 1.0, 1.0][index % 4]),
        ];
        for turn in turns {
            for shape in [[24, 4], [40, 1]] {
                let found = seen(shape, turn, 0.1);
                assert!(found.ok, "{shape:?}: {found:?}");
            }
        }
    }

    /// Other turns in every frame, as what moves or a burst has them.
    #[test]
    fn loops_that_differ_otherwise_in_every_frame_accuse_nobody() {
        let turn: Turn = |index, direction| {
            let (frame, kind) = ((index / 24) as f64, (index % 4) as f64);
            Complex64::from_polar(1.0, 2.0 * direction * (17.0 * frame + 5.0 * kind * (1.0 + frame)).sin())
        };
        for noise in [0.05, 0.5] {
            let found = seen([4, 24], turn, noise);
            assert!(found.ok, "{noise}: {found:?}");
            // In one frame alone nothing tells them.
            assert!(seen([1, 24], turn, 0.05).is_refusal());
        }
    }

    /// The oscillator's phase may drift from frame to frame.
    #[test]
    fn turns_are_seen_whatever_the_phase_of_a_frame() {
        let turn: Turn = |index, direction| by_transmitter(2, index, direction) * Complex64::cis(1.7 * (index / 24) as f64);
        let found = seen([4, 24], turn, 0.05);
        assert!(found.is_refusal() && found.found.contains("loops of 2 kinds"), "{found:?}");
    }

    /// However many channels and frames there are, and they still show the turns.
    #[test]
    fn of_many_channels_some_are_kept() {
        let seen = inspector(40, [70, 2], TURNS[1].1, 0.1, 1.0, false);
        assert_eq!(seen.firsts.len(), FRAMES * MOST * CHANNELS * SAMPLES);
        let found = seen.conclude().unwrap();
        assert!(found.ok && !found.decided && found.found.contains("frames of 3 kinds"), "{found:?}");
        assert_eq!(inspector(3, [5, 2], TURNS[1].1, 0.1, 1.0, false).firsts.len(), 5 * 3 * SAMPLES);
    }

    /// Equal loops differ by rounding alone, and a dead receiver by nothing: neither tells kinds of them.
    #[test]
    fn loops_without_noise_and_a_dead_receiver_accuse_nobody() {
        for (shape, scale) in [([1, 24], 1e-3), ([1, 50], 1e-3), ([1, 24], 1e3)] {
            let found = seen_by([shape[0], shape[1]], |_, _| Complex64::ONE, 0.0, scale, false);
            assert!(found.ok, "{shape:?}, {scale}: {found:?}");
        }
        let gains: Turn = |index, _| Complex64::from([1.3, 1.0, 1.0][index % 3]);
        assert!(seen_by([1, 24], gains, 0.05, 1.0, true).ok);
        let found = seen_by([1, 24], TURNS[1].1, 0.05, 1.0, true);
        assert!(found.is_refusal() && found.found.contains("loops of 3 kinds"), "{found:?}");
    }

    #[test]
    fn what_was_not_looked_at_is_not_as_stated() {
        let found = seen([1, 8], |_, _| Complex64::ONE, 0.1);
        assert!(found.ok && !found.decided && found.found.contains("5, 6, 7"), "{found:?}");
        assert!(seen([1, 32], |_, _| Complex64::ONE, 0.1).decided);
    }

    #[test]
    fn a_still_scene_another_gain_and_a_vibration_are_not_accused() {
        let turns: [Turn; 3] = [
            |_, _| Complex64::ONE,
            |index, _| Complex64::from([1.3, 1.0, 1.0][index % 3]),
            |index, _| Complex64::from_polar(1.0, [0.7, 0.0][index % 2]),
        ];
        for (case, turn) in turns.into_iter().enumerate() {
            for shape in [[1, 24], [1, 32]] {
                for noise in [0.02, 0.5, 5.0] {
                    let found = seen(shape, turn, noise);
                    assert!(found.ok, "{case}, {shape:?}, {noise}: {found:?}");
                }
            }
        }
        let found = seen([1, 24], |_, _| Complex64::ZERO, 1.0);
        assert!(found.ok, "{found:?}");
    }

    /// Three kinds of loops of two transmitters: three or six; four receivers of two.
    #[test]
    fn all_counts_that_fit_are_named() {
        let counts = |tx, rx, kinds| {
            let schedule = Schedule { tx, rx, loops: 24, samples: 8, is_real: false, is_falling: false, farthest_bin: None };
            Alternation::new(schedule).counts(kinds, 1)
        };
        assert_eq!(
            counts(2, 5, 3),
            "3 or 6 transmitters that fired in turn, not 2; or 3 or 15 receivers, not 5; or 3 kinds of chirps"
        );
        assert_eq!(counts(3, 2, 2), "2 or 6 transmitters that fired in turn, not 3; or 4 receivers, not 2; or 2 kinds of chirps");
    }
}
