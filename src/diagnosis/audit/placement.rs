//! Whether the body is where the motion, the clock and the axes as stated put it, or where another reading of them would.

use super::Check;
use super::body_place::{as_stated, elsewhere};
use super::doppler_sign::doppler_sign;
use super::energy::{Alternative, CLUTTER_CELLS, Fit, moves};
use super::frame_period::frame_period;
use super::heading::heading;
use crate::diagnosis::evidence::Evidence;
use crate::integrity::ALARM;

pub(super) const SILENT: &str = "no body is observed where the motion puts it, nor at other ranges";
/// Least energy over the noise where the motion puts the body, dB: twice what noise alone shows, E₁(1) = 0.22 nats = 0.95 dB (the mean of
/// the positive part of an exponential variable's logarithm).
const PRESENT_DB: f64 = 1.9;

/// One check for each kind of reading. Another reading is believed where it has more power, and explains the moving power better than
/// what is stated and than each effect with a name that would move the body a little (chance at most [`ALARM`] for each check, Bonferroni
/// over its readings). Where nothing is observed as stated, it must only be observed. Of several that are believed, the one that
/// explains most is reported.
pub(super) fn placement(evidence: &Evidence, origin_m: Option<[f64; 3]>) -> Vec<Check> {
    if !moves(evidence) {
        return not_asked(evidence).into_iter().collect();
    }
    let stated = as_stated(evidence);
    let mut readings = vec![doppler_sign(evidence)];
    readings.extend(heading(evidence, origin_m));
    readings.extend(frame_period(evidence));
    readings.extend(elsewhere(evidence));
    let here = &stated[0].1;
    let better = |reading: &Alternative| reading.fit.against(here).better;
    let is_silent = stated.iter().all(|(_, fit)| fit.level_db() < PRESENT_DB);
    let is_believed = |reading: &Alternative| {
        let alarm = ALARM / readings.iter().filter(|other| other.check == reading.check).count() as f64;
        let explains = |fit: &Fit| reading.fit.level_db() > fit.level_db() && reading.fit.against(fit).p_value < alarm;
        reading.fit.level_db() >= PRESENT_DB && (is_silent || stated.iter().all(|(_, fit)| explains(fit)))
    };
    let by_better = |a: &&Alternative, b: &&Alternative| better(a).total_cmp(&better(b));
    let believed = readings.iter().filter(|reading| is_believed(reading)).max_by(by_better);
    let here_db = here.level_db();
    let mut checks: Vec<Check> = vec![];
    for reading in readings.chunk_by(|a, b| a.check == b.check) {
        let wrong = believed.filter(|believed| believed.check == reading[0].check);
        let reported = wrong.or_else(|| reading.iter().max_by(by_better)).unwrap_or(&reading[0]);
        let hint = wrong.map_or(String::new(), |wrong| format!(": {}", wrong.hint));
        let found =
            format!("{here_db:.1} dB where the motion puts the body, {:.1} dB {}{hint}", reported.fit.level_db(), reported.place);
        checks.push(Check::new(reported.check, reported.expected, found, wrong.is_none()));
    }
    if believed.is_none()
        && let Some(place) = checks.iter_mut().find(|check| check.check == "body_place")
    {
        let clock =
            stated.iter().filter(|(later, fit)| later.is_some() && fit.against(here).p_value < ALARM / (stated.len() as f64));
        let clock = clock.max_by(|(_, a), (_, b)| a.against(here).better.total_cmp(&b.against(here).better));
        if is_silent {
            place.found = format!("{here_db:.1} dB over the noise there: {SILENT}");
            place.ok = false;
        } else if let Some((Some(later), fit)) = clock {
            let side = if *later > 0 { "later" } else { "earlier" };
            place.found =
                format!("{here_db:.1} dB over the noise there, but {:.1} dB {} frames {side}", fit.level_db(), later.abs());
        }
    }
    checks
}

/// What is not asked of a body that hardly moves: static clutter leaks into its velocities.
fn not_asked(evidence: &Evidence) -> Option<Check> {
    evidence.body.as_ref()?;
    let least = CLUTTER_CELLS * evidence.radar.velocity_resolution_mps();
    let found = format!(
        "not asked, nor are doppler_sign, heading, frame_period, sides and tx_order: no part of the body is faster than {least:.2} m/s, \
         below which static clutter leaks"
    );
    Some(Check::new("body_place", "moving energy where the motion puts the body", found, true))
}

/// Whether a body is observed where it is stated to be, once something was undone; none where another reading of the scene is
/// believed.
pub fn body_place(evidence: &Evidence) -> Option<Check> {
    let checks = placement(evidence, None);
    let other_reading = checks.iter().any(|check| !check.ok && check.check != "body_place");
    checks.into_iter().find(|check| !other_reading && check.check == "body_place")
}
