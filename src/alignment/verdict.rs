//! What may be said of the places that were found.

use std::collections::BTreeMap;

use super::chance::Chance;
use super::climb::Maximum;
use super::coarse::turned_rad;
use super::estimates::{estimates, numbers, placement};
use super::fit::{COHERENCE, Fitter, Score};
use super::place::{Pivot, stated};
use super::poses::Poses;
use super::readings::Readings;
use super::report::{Alignment, Alternative, ESTIMATES, Estimate, FORMAT, Gain, Verdict};
use super::tracks::{self, Track};
use crate::diagnosis::statistics::ratio_tail;
use crate::person::Person;

/// Chance below which frames in a wrong order are no explanation, and one placement is worse than another: the diagnosis' `alarm`.
const ALARM: f64 = 0.01;
/// Least share of what moves that the recorded motion explains. Of the practice recordings the right motions explain 0.78 (with a pendulum
/// beside) to 1.45, wrong motions at their best places 0.66 and less.
const EXPLAINED: f64 = 0.7;

/// All that the verdict is about.
pub struct Found<'a> {
    pub person: &'a Person,
    pub readings: &'a Readings,
    pub poses: &'a Poses,
    pub maxima: Vec<Maximum<'a>>,
    pub chance: Chance,
    /// Largest clock that was tried, seconds.
    pub lag_s: f64,
    pub notes: Vec<String>,
}

/// `recording`: its folder.
pub fn alignment(found: &Found, recording: String) -> Alignment {
    let readings = found.readings;
    let pivot = Pivot { stated_m: found.poses.middle_m(&readings.middle_s), centre_m: readings.radar.centre_m() };
    let fitter = Fitter { readings, poses: found.poses, pivot, coherence: COHERENCE }.with_best_coherence(&pivot.stated());
    let before = fitter.score_at(&pivot.stated());
    let mut notes = found.notes.clone();
    let best = found.maxima.first();
    let gain = gain(found, &before, best);
    let estimates = best.map_or_else(BTreeMap::new, |best| estimates(found.person, best));
    let alternatives = best.map_or_else(Vec::new, |best| alternatives(found, best, &estimates));
    let reason = cannot_tell(found, &gain, &estimates);
    let sentence_of = |verdict, as_stated| sentence(verdict, reason.as_deref(), &estimates, alternatives.len(), as_stated);
    let identified = identified(estimates.clone(), &alternatives);
    let verdict = match (&reason, alternatives.is_empty()) {
        (Some(_), _) => Verdict::CannotTell,
        (None, false) => Verdict::Ambiguous,
        (None, true) => Verdict::Aligned,
    };
    let holds = |estimate: &Estimate| estimate.ci90.is_none_or(|[low, high]| (low..=high).contains(&estimate.stated));
    let as_stated = verdict == Verdict::Aligned && identified.values().all(holds);
    notes.push("the vertical is the radar frame's z, and the motion's own poses and height are taken as they are".into());
    if readings.channels.len() > 1 {
        notes.push("azimuths are those of the array as stated: a phase that grows along the antennas is a direction".into());
    }
    let [range_time_db, velocity_time_db] = tracks::maps(readings);
    let after = best.map_or_else(Track::default, |best| Track::of(&best.fitter, &best.place));
    let sentence = sentence_of(verdict, as_stated);
    Alignment {
        format: FORMAT,
        recording,
        verdict,
        sentence,
        as_stated,
        held_out_frames: readings.split.held_out.clone(),
        stated: stated(found.person),
        motion: match best {
            Some(best) if verdict == Verdict::Aligned => placement(found.person, &best.fitter.pivot, &best.place),
            _ => stated(found.person),
        },
        estimates: identified,
        gain,
        alternatives,
        notes,
        range_time_db,
        velocity_time_db,
        tracks: [Track::of(&fitter, &pivot.stated()), after],
    }
}

fn gain(found: &Found, before: &Score, best: Option<&Maximum>) -> Gain {
    let split = &found.readings.split;
    let none = Score { by_frame: vec![0.0; found.readings.frames()], weights: before.weights };
    let after = best.map_or(&none, |best| &best.score);
    let over = |frames: &[usize]| after.over(frames) - before.over(frames);
    Gain {
        training_over_stated: over(&split.training),
        held_out_over_stated: over(&split.held_out),
        held_out_over_none: after.over(&split.held_out),
        explained: best.map_or(0.0, |best| best.fitter.explained(&best.place, &best.score.weights)),
        p_value_stated: worse(after, before),
        grid: found.chance.gain,
        grid_shuffled: found.chance.shuffled,
        p_value_chance: found.chance.p_value,
    }
}

/// Chance that one place is as good as another that was found to be better: Student's t over the frames of which both say something.
fn worse(better: &Score, other: &Score) -> f64 {
    let both = better.by_frame.iter().zip(&other.by_frame).filter(|(better, other)| **better != 0.0 && **other != 0.0);
    let ratios: Vec<f64> = both.map(|(better, other)| better - other).collect();
    ratio_tail(&ratios, &vec![1.0; ratios.len()]).1
}

/// Other maxima that are places of their own, and not worse beyond chance.
fn alternatives(found: &Found, best: &Maximum, estimates: &BTreeMap<&'static str, Estimate>) -> Vec<Alternative> {
    let of = |other: &Maximum| {
        let p_value = worse(&best.score, &other.score);
        // Each climb has a pivot of its own.
        let (pivot, place) = other.fitter.pivot.restated(&other.place, best.fitter.pivot.stated_m);
        let values: BTreeMap<&'static str, f64> =
            ESTIMATES.iter().map(|(name, ..)| *name).zip(numbers(found.person, &pivot, &place)).collect();
        let apart = estimates.iter().any(|(name, estimate)| {
            // Within one and the same peak, the climbs end within its interval.
            estimate.ci90.is_some_and(|[low, high]| difference(name, values[name], estimate.value).abs() > high - low)
        });
        let motion = placement(found.person, &pivot, &place);
        let frames = other.score.by_frame.iter().filter(|gain| **gain != 0.0).count();
        (apart && p_value > ALARM).then_some(Alternative { values, motion, p_value, frames })
    };
    found.maxima.iter().skip(1).filter_map(of).collect()
}

fn difference(name: &str, a: f64, b: f64) -> f64 {
    if name.ends_with("_deg") { turned_rad((a - b).to_radians()).to_degrees() } else { a - b }
}

/// A number is not identified where an alternative has another one.
fn identified(mut estimates: BTreeMap<&'static str, Estimate>, alternatives: &[Alternative]) -> BTreeMap<&'static str, Estimate> {
    for (name, estimate) in &mut estimates {
        let Some([low, high]) = estimate.ci90 else { continue };
        let others = alternatives.iter().map(|alternative| alternative.values[name]);
        let others: Vec<String> = others
            .filter(|other| difference(name, *other, estimate.value).abs() > high - low)
            .map(|other| format!("{other:.2}"))
            .collect();
        if !others.is_empty() {
            estimate.why_not = Some(format!("{:.2} or {}: both explain the recording", estimate.value, others.join(" or ")));
            (estimate.identified, estimate.ci90) = (false, None);
        }
    }
    estimates
}

fn cannot_tell(found: &Found, gain: &Gain, estimates: &BTreeMap<&'static str, Estimate>) -> Option<String> {
    let lag_s = found.lag_s;
    let Some(best) = found.maxima.first() else {
        return Some(format!(
            "nowhere, and at no clock within {lag_s} s, does the motion explain what moves in the recording (does the person move, and \
             is the recording of this motion?)"
        ));
    };
    let informative = best.score.by_frame.iter().filter(|gain| **gain != 0.0).count();
    if informative < 4 {
        return Some("the person hardly moves: in less than four frames is any part faster than the static clutter".into());
    }
    if gain.p_value_chance.is_nan() || gain.p_value_chance > ALARM {
        return Some(format!(
            "the motion explains what moves no better than with its frames in a wrong order (chance {:.2})",
            gain.p_value_chance
        ));
    }
    if gain.explained < EXPLAINED {
        return Some(format!(
            "the best placement explains {:.0} % of what moves; the motion that was recorded explains {:.0} % and more",
            100.0 * gain.explained,
            100.0 * EXPLAINED
        ));
    }
    if gain.held_out_over_none <= 0.0 {
        return Some("the placement that explains the fitted frames does not explain the others".into());
    }
    let any = estimates.values().any(|estimate| estimate.identified);
    (!any).then(|| "no number of the placement is estimated well enough".into())
}

/// `estimates`: those of the best placement by itself; `others`: how many explain as much.
fn sentence(
    verdict: Verdict,
    reason: Option<&str>,
    estimates: &BTreeMap<&'static str, Estimate>,
    others: usize,
    as_stated: bool,
) -> String {
    if let Some(reason) = reason {
        return format!("Where the body is cannot be determined: {reason}.");
    }
    let of = |name: &str| estimates.get(name).filter(|estimate| estimate.identified);
    let mut parts = vec![];
    if let Some(start) = of("start_s") {
        let later = start.value - start.stated;
        parts.push(format!("the motion starts {:.3} s {}", later.abs(), if later >= 0.0 { "later" } else { "earlier" }));
    }
    if let (Some(x), Some(y)) = (of("origin_x_m"), of("origin_y_m")) {
        let moved = (x.value - x.stated).hypot(y.value - y.stated);
        parts.push(format!("its origin is {moved:.2} m away"));
    } else if let Some(range) = of("range_m") {
        let farther = range.value - range.stated;
        parts.push(format!("the body is {:.2} m {}", farther.abs(), if farther >= 0.0 { "farther" } else { "nearer" }));
    }
    if let Some(turn) = of("rotation_deg").or(of("facing_deg")) {
        let to_sight = if of("rotation_deg").is_some() { "" } else { " against the line of sight" };
        let way = if turn.value >= 0.0 { "counter-clockwise" } else { "clockwise" };
        parts.push(format!("it is turned by {:.1} degrees {way}{to_sight}", turn.value.abs()));
    }
    let estimated = if parts.is_empty() { "what is identified is below".to_string() } else { parts.join(", ") };
    match verdict {
        Verdict::Ambiguous => {
            let count = others + 1;
            format!(
                "{count} placements explain the recording equally well: by the likeliest, against what is stated, {estimated}."
            )
        }
        _ if as_stated => format!("The recording agrees with the placement as stated: {estimated}, each within its interval."),
        _ => format!("The placement as stated is wrong: {estimated}."),
    }
}
