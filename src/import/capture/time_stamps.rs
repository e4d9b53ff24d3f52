//! When the frames of a capture came, by its time stamps: how far apart, and which ones between them were lost.
//!
//! A radar starts its frames a period apart; a frame is stamped where it arrives, after a delay that varies. Stamps therefore lie near a
//! grid of periods. A frame that only came late is followed by shorter steps; what is never caught up was lost.

use std::path::Path;

use super::Capture;
use crate::data::IfFrame;
use crate::error::{Error, Result};
use crate::integrity::ALARM;
use crate::radar::Sampling;

/// Most by which a computer's clock runs fast or slow: 500 ppm, `MAXFREQ` of NTP (RFC 5905, appendix A) and of Linux (`timex.h`).
const CLOCK_SHARE: f64 = 500e-6;

/// The grid of frame periods that time stamps lie near.
#[derive(Debug, PartialEq)]
pub struct Grid {
    /// From one frame to the next, in the unit of the stamps.
    pub period: f64,
    /// Where the median step is, but for a chance of [`ALARM`]: by order statistics, whatever the delays are.
    interval: [f64; 2],
    /// Which period each frame came in, counted from the first one's.
    pub slots: Vec<usize>,
}

impl Grid {
    /// Of the finite times of frames in their order.
    ///
    /// # Errors
    /// Times that say nothing, and why.
    pub fn of(times: &[f64]) -> std::result::Result<Self, String> {
        let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if steps.is_empty() {
            return Err("are of one frame".into());
        }
        if let Some(at) = steps.iter().position(|step| *step < 0.0) {
            return Err(format!("go back after frame {at}"));
        }
        let Some(period) = period(times) else { return Err("stand still".into()) };
        let slots = slots(times, period);
        let single = steps.iter().zip(slots.windows(2)).map(|(step, pair)| step / (pair[1] - pair[0]) as f64).collect();
        Ok(Self { period, interval: interval(single), slots })
    }

    /// The same of stamps in seconds; a note where they say nothing.
    pub fn read(stamps: &Path, times_s: &[f64], notes: &mut Vec<String>) -> Option<Self> {
        let grid = Self::of(times_s);
        if let Err(why) = &grid {
            notes.push(format!("{}: time stamps {why}: they do not say when frames came", stamps.display()));
        }
        grid.ok()
    }

    /// How many frames were lost between those that are there.
    pub fn lost(&self) -> usize {
        self.slots.last().map_or(0, |last| last - (self.slots.len() - 1))
    }

    /// Which frames were lost, and what is done about it; none where none was.
    pub fn note(&self, file: &Path, done: &str) -> Option<String> {
        let after = self.slots.windows(2).position(|pair| pair[1] > pair[0] + 1)?;
        let (lost, file) = (self.lost(), file.display());
        Some(format!("{file}: by the time stamps {lost} frames were lost, the first after frame {after}; {done}"))
    }

    /// Holds a stated frame period against the stamps. One that `is_set` by the user is kept, with a note.
    ///
    /// # Errors
    /// A period that neither delays nor the clock explain.
    pub fn hold(&self, stamps: &Path, period_s: f64, is_set: bool, notes: &mut Vec<String>) -> Result<()> {
        let [low, high] = self.interval;
        if (low * (1.0 - CLOCK_SHARE)..=high * (1.0 + CLOCK_SHARE)).contains(&period_s) {
            return Ok(());
        }
        let found = format!("{:.6} s", self.period);
        if is_set {
            let file = stamps.display();
            notes.push(format!("{file}: frames came every {found} by their time stamps; {period_s} s is kept, as it was set"));
            return Ok(());
        }
        let expected = format!("{period_s} s, the radar's frame_period_s");
        let hint = "the settings are of another capture, or most frames were lost; --set radar.frame_period_s=VALUE states the period, \
                    that of the time stamps or another";
        Err(Error::field(stamps, "median spacing", found, expected).with_hint(hint))
    }

    /// Puts the frames of a capture where they came. Those that were lost between them are zeros and marked as lost.
    ///
    /// Where more were lost than are there, the clock may have been set, or the capture paused: then frames stay one after the other.
    pub fn place(mut self, stamps: &Path, mut capture: Capture) -> Capture {
        // The first ones, where fewer were asked for.
        self.slots.truncate(capture.radar.frames);
        let frames = self.slots.len() + self.lost();
        if self.lost() > self.slots.len() {
            let done =
                "more than are there, as where the clock was set or the capture paused: frames are taken to be evenly spaced";
            capture.notes.extend(self.note(stamps, done));
            return capture;
        }
        let done = "they are zeros here and marked as lost (valid.npy), so that the others keep their times";
        capture.notes.extend(self.note(stamps, done));
        let slots = self.slots;
        let gaps = (0..frames).filter(|frame| slots.binary_search(frame).is_err());
        capture.lost = capture.lost.iter().map(|&frame| slots[frame]).chain(gaps).collect();
        capture.lost.sort_unstable();
        capture.radar.frames = frames;
        let [_, tx, rx, loops, samples] = capture.radar.dims();
        let count = tx * rx * loops * samples;
        let is_complex = capture.radar.sampling == Sampling::Complex;
        let mut read = capture.frame;
        capture.frame = Box::new(move |frame| match slots.binary_search(&frame) {
            Ok(index) => read(index),
            Err(_) => Ok(IfFrame::new([tx, rx, loops, samples], vec![0.0; count], is_complex.then(|| vec![0.0; count]))),
        });
        capture
    }
}

/// The period by ever longer spans, of which shorter ones tell how many periods they are: a span twice as long halves what delays at
/// its ends do to the period. Each median is over half of the frames at least. None where most frames have one time.
fn period(times: &[f64]) -> Option<f64> {
    let mut period = lower_median(times.windows(2).map(|pair| pair[1] - pair[0]).collect()).filter(|step| *step > 0.0)?;
    let mut span = 1;
    while 2 * span <= times.len() {
        let of_span = |times: &[f64]| {
            let length = times[span] - times[0];
            let count = (length / period).round();
            (count >= 1.0 && count.is_finite()).then_some(length / count)
        };
        period = lower_median(times.windows(span + 1).filter_map(of_span).collect())?;
        span *= 2;
    }
    Some(period)
}

/// The median; of two the lower one, as gaps are longer.
fn lower_median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len().checked_sub(1)? / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The period in which each frame came, at least one after that of the frame before it.
///
/// The grid begins where the circular mean of the stamps puts it (Mardia and Jupp, Directional Statistics, 2000, section 2.2), whichever
/// frames were lost. A frame is at the latest where all frames after it leave room for it.
fn slots(times: &[f64], period: f64) -> Vec<usize> {
    let phases = times.iter().map(|time| (time - times[0]) / period);
    let (sine, cosine) = phases.clone().fold((0.0, 0.0), |(sine, cosine), phase| {
        let (own_sine, own_cosine) = (std::f64::consts::TAU * phase).sin_cos();
        (sine + own_sine, cosine + own_cosine)
    });
    let origin = f64::atan2(sine, cosine) / std::f64::consts::TAU;
    let mut places: Vec<i64> = phases.map(|phase| (phase - origin).round() as i64).collect();
    for index in (1..places.len()).rev() {
        places[index - 1] = places[index - 1].min(places[index].saturating_sub(1));
    }
    places.iter().map(|place| place.saturating_sub(places[0]) as usize).collect()
}

/// Between which of the values their distribution's median is, but for a chance of [`ALARM`]; of few values, between all of them.
///
/// As many as `n / 2 - t` of `n` values lie on one side of it with a chance of at most `exp(-2 t² / n)` (Hoeffding, Probability inequalities
/// for sums of bounded random variables, 1963).
fn interval(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_unstable_by(f64::total_cmp);
    let count = values.len() as f64;
    let outside = (count / 2.0 - (count / 2.0 * (2.0 / ALARM).ln()).sqrt()).max(0.0) as usize;
    [values[outside], values[values.len() - 1 - outside]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::support::numbers;

    /// Times of these slots at a period, each late by up to `delay` of it.
    fn stamps(slots: &[usize], period: f64, delay: f64) -> Vec<f64> {
        let delays = numbers(7, slots.len(), 0.0, delay);
        slots.iter().zip(delays).map(|(&slot, late)| 1.7e9 + (slot as f64 + late) * period).collect()
    }

    #[test]
    fn lost_frames_are_found_in_long_captures_whose_stamps_vary() {
        for (count, delay) in [(5, 0.0), (60, 0.3), (20_000, 0.4)] {
            let wanted: Vec<usize> = (0..count).filter(|slot| slot % 29 != 1).collect();
            let grid = Grid::of(&stamps(&wanted, 0.077, delay)).unwrap();
            assert_eq!(grid.slots, wanted, "{count} frames, delays of {delay}");
            assert_eq!(grid.lost(), wanted[wanted.len() - 1] + 1 - wanted.len());
            assert!((grid.period / 0.077 - 1.0).abs() < 1e-3, "{}", grid.period);
        }
    }

    #[test]
    fn frames_that_only_came_late_were_not_lost() {
        let mut times = stamps(&(0..50).collect::<Vec<_>>(), 0.05, 0.05);
        // One frame late by most of a period, three that came at once with a fourth, and steps that catch up little by little.
        times[10] += 0.9 * 0.05;
        (20..23).for_each(|index| times[index] = times[23]);
        for (index, late) in [(30, 0.8), (31, 0.7), (32, 0.6), (33, 0.3)] {
            times[index] += late * 0.05;
        }
        assert_eq!(Grid::of(&times).unwrap().lost(), 0);
        times[40..].iter_mut().for_each(|time| *time += 2.0 * 0.05);
        let grid = Grid::of(&times).unwrap();
        assert_eq!((grid.lost(), grid.slots[39], grid.slots[40]), (2, 39, 42));
    }

    #[test]
    fn a_period_is_refused_where_neither_delays_nor_the_clock_explain_it() {
        let wanted: Vec<usize> = (0..1000).filter(|slot| slot % 7 != 3).collect();
        let (file, mut notes) = (Path::new("times.csv"), vec![]);
        for (delay, near, far) in [(0.0, 1.0004, 1.0006), (0.2, 1.002, 1.05)] {
            let grid = Grid::of(&stamps(&wanted, 0.05, delay)).unwrap();
            for sign in [1.0, -1.0] {
                let stated = |share: f64| 0.05 * (1.0 + sign * (share - 1.0));
                grid.hold(file, stated(near), false, &mut notes).unwrap();
                let error = grid.hold(file, stated(far), false, &mut notes).unwrap_err();
                assert!(error.to_string().starts_with("times.csv: `median spacing` is 0.05"), "{error}");
                assert!(error.hint().is_some() && notes.is_empty());
            }
        }
        Grid::of(&stamps(&wanted, 0.05, 0.0)).unwrap().hold(file, 0.1, true, &mut notes).unwrap();
        assert_eq!(notes, ["times.csv: frames came every 0.050000 s by their time stamps; 0.1 s is kept, as it was set"]);
    }

    #[test]
    fn stamps_that_say_nothing_say_why() {
        for (times, why) in
            [(&[1.0][..], "are of one frame"), (&[1.0, 2.0, 1.5], "go back after frame 1"), (&[1.0, 1.0, 1.0], "stand still")]
        {
            assert_eq!(Grid::of(times).unwrap_err(), why);
        }
        assert!(Grid::of(&[0.0, 1e-3, 2e-3, 1e300]).unwrap().lost() > 1 << 60);
    }
}
