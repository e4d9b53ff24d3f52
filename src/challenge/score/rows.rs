//! The rows of the result: what is asked of which cases, and how the answers fared.

use super::Case;
use super::usual::Scale;
use crate::challenge::baselines::{TEMPLATES, quantile};
use crate::challenge::config::Stratum;
use crate::challenge::psychometric::Logistic;
use crate::challenge::rules::*;
use crate::challenge::table::{Aim, Row, middle, share};
use crate::challenge::uniformity;

/// The cases by what is asked of them.
struct Groups<'a> {
    cases: &'a [Case],
    nulls: Vec<&'a Case>,
    /// Single effects that can be detected, and those of them that survive unknown phases and amplitudes.
    graded: Vec<&'a Case>,
    singles: Vec<&'a Case>,
    concealed: Vec<&'a Case>,
}

/// All rows, in the order of the table.
pub(super) fn all(cases: &[Case], psychometric: Option<Logistic>) -> Vec<Row> {
    let groups = Groups::of(cases);
    let mut rows = groups.nulls();
    rows.extend(groups.detected());
    rows.extend(psychometric.iter().flat_map(|fit| groups.levels(fit)));
    rows.extend(groups.names());
    rows.extend(groups.outside());
    rows.extend(groups.undetectable());
    rows.extend(groups.recovered());
    rows.extend(groups.concealed());
    rows.extend(baseline_rows(cases, &groups.nulls, &groups.singles, &groups.concealed));
    rows
}

impl<'a> Groups<'a> {
    fn of(cases: &'a [Case]) -> Self {
        let all = |keep: &dyn Fn(&Case) -> bool| -> Vec<&'a Case> { cases.iter().filter(|case| keep(case)).collect() };
        let graded = all(&|case| case.graded_single() && !case.undetectable());
        let singles = graded.iter().copied().filter(|case| case.d_prime() >= UNDETECTABLE_D_PRIME).collect();
        Self { cases, nulls: all(&|case| case.is(Stratum::Null)), graded, singles, concealed: all(&|case| case.concealed) }
    }

    /// Of a stratum, as far as nobody can miss them.
    fn obvious(&self, stratum: Stratum) -> Vec<&'a Case> {
        self.cases.iter().filter(|case| case.is(stratum) && case.d_prime() >= OBVIOUS_D_PRIME).collect()
    }

    /// False alarms.
    fn nulls(&self) -> Vec<Row> {
        let nulls = &self.nulls;
        let mut rows = vec![
            share(
                "nulls on which anything is claimed (false alarms)",
                nulls.iter().map(|case| case.judgement.claims),
                Aim::AtMost(0.02),
            ),
            share("nulls with a confident wrong name", nulls.iter().map(|case| case.overclaims()), Aim::AtMost(0.01)),
            share(
                "nulls answered `no_mismatch`",
                nulls.iter().map(|case| case.judgement.verdict == "no_mismatch"),
                Aim::AtLeast(0.95),
            ),
        ];
        // Somebody who is there and whom nobody tracks is no null.
        let empty = nulls.iter().filter(|case| !case.untracked);
        rows.extend(uniformity::rows(empty.filter_map(|case| case.report.as_ref())));
        rows
    }

    /// Single effects by strength.
    fn detected(&self) -> Vec<Row> {
        let mut rows = vec![];
        for (low, high, aim) in [(2.0, 8.0, Aim::None), (8.0, 30.0, Aim::AtLeast(0.8)), (30.0, f64::INFINITY, Aim::AtLeast(0.95))]
        {
            let within = self.singles.iter().filter(|case| (low..high).contains(&case.d_prime()));
            let name = if high.is_finite() {
                format!("single effects detected, d′ {low} to {high}")
            } else {
                format!("single effects detected, d′ ≥ {low}")
            };
            rows.push(share(name, within.map(|case| case.judgement.claims), aim));
        }
        let hidden = self.graded.iter().filter(|case| case.d_prime() < UNDETECTABLE_D_PRIME);
        rows.push(share(
            format!("single effects detected, d′ below {UNDETECTABLE_D_PRIME}: unknown phases and amplitudes can be all of it"),
            hidden.map(|case| case.judgement.claims),
            Aim::None,
        ));
        let strong = self.graded.iter().filter(|case| case.coherent_d_prime() >= OBVIOUS_D_PRIME);
        rows.push(share(
            format!("single effects detected, coherent d′ ≥ {OBVIOUS_D_PRIME}: nothing but the effect is unknown"),
            strong.map(|case| case.judgement.claims),
            Aim::None,
        ));
        rows
    }

    /// How strong effects must be to be detected.
    fn levels(&self, fit: &Logistic) -> [Row; 2] {
        [0.5, 0.9].map(|part| {
            let level = 10f64.powf(fit.level(part));
            Row {
                what: format!("d′ at which {:.0} % are detected (logistic fit)", 100.0 * part),
                n: self.cases.iter().filter(|case| case.graded_single()).count(),
                estimate: level.is_finite().then_some(level),
                interval: None,
                aim: Aim::None,
            }
        })
    }

    /// Names, places and parameters of what was planted.
    fn names(&self) -> [Row; 10] {
        let detected: Vec<&Case> = self.singles.iter().copied().filter(|case| case.judgement.claims).collect();
        let pairs = self.obvious(Stratum::Pair);
        let decoys = self.obvious(Stratum::LookAlike);
        let planted = || self.cases.iter().filter(|case| case.planted());
        [
            share(
                "detected singles whose first name is right, look-alikes allowed",
                detected.iter().map(|case| case.judgement.first_right),
                Aim::AtLeast(0.85),
            ),
            share(
                "detected singles whose first name is the very effect",
                detected.iter().map(|case| case.judgement.first_exact),
                Aim::None,
            ),
            share("detected singles that are named at all", detected.iter().map(|case| case.all_found()), Aim::None),
            share("planted cases with a confident wrong name (overclaims)", planted().map(Case::overclaims), Aim::AtMost(0.05)),
            share(
                "planted cases that name a look-alike as the only possibility",
                planted().map(|case| !case.judgement.twins_overclaimed.is_empty()),
                Aim::AtMost(0.02),
            ),
            share("look-alikes with a confident wrong name", decoys.iter().map(|case| case.overclaims()), Aim::AtMost(0.05)),
            share("pairs, both named", pairs.iter().map(|case| case.all_found()), Aim::None),
            share(
                "pairs, at least one named",
                pairs.iter().map(|case| case.judgement.found.iter().any(|&found| found)),
                Aim::AtLeast(0.8),
            ),
            share(
                "named effects at the right place",
                self.cases.iter().filter_map(|case| case.judgement.located),
                Aim::AtLeast(0.9),
            ),
            share(
                "90 % intervals that hold the truth",
                self.cases.iter().flat_map(|case| &case.judgement.parameters).map(|p| p.covered),
                Aim::Between(0.85, 0.95),
            ),
        ]
    }

    fn outside(&self) -> [Row; 3] {
        let outside = self.obvious(Stratum::Outside);
        [
            share(
                "outside the library: found, at its place, left unnamed",
                outside.iter().map(|case| case.judgement.left_unnamed == Some(true)),
                Aim::AtLeast(0.8),
            ),
            share("outside the library: detected in any way", outside.iter().map(|case| case.judgement.claims), Aim::None),
            share("outside the library: confident wrong name", outside.iter().map(|case| case.overclaims()), Aim::AtMost(0.05)),
        ]
    }

    fn undetectable(&self) -> [Row; 2] {
        let undetectable = self.cases.iter().filter(|case| case.undetectable());
        [
            share(
                "undetectable effects that nothing was claimed for",
                undetectable.map(|case| case.judgement.failure.is_none() && !case.judgement.claims),
                Aim::AtLeast(0.95),
            ),
            share(
                "limits on undetected effects that hold",
                self.cases.iter().filter_map(|case| case.judgement.limit_holds),
                Aim::AtLeast(0.9),
            ),
        ]
    }

    fn recovered(&self) -> [Row; 2] {
        [
            middle(
                "removable held-out misfit recovered where an effect was named, median",
                self.cases.iter().filter(|case| case.judgement.found.contains(&true)).filter_map(Case::recovered),
                Aim::AtLeast(0.9),
            ),
            middle(
                "removable held-out misfit recovered, missed cases too, median",
                self.cases.iter().filter(|case| !case.is(Stratum::Outside)).filter_map(Case::recovered),
                Aim::None,
            ),
        ]
    }

    /// Concealed effects; and cases without a report.
    fn concealed(&self) -> [Row; 4] {
        let concealed = &self.concealed;
        let library = concealed.iter().filter(|case| !case.is(Stratum::Outside));
        [
            share("concealed effects detected", concealed.iter().map(|case| case.judgement.claims), Aim::AtLeast(0.8)),
            share(
                "concealed effects detected, or said to be such that no recording of this kind can show them",
                concealed.iter().map(|case| case.judgement.claims || case.judgement.said_hidden),
                Aim::None,
            ),
            share(
                "concealed effects of the library, detected and named, look-alikes allowed",
                library.map(|case| case.all_found()),
                Aim::None,
            ),
            share(
                "cases without a usable report",
                self.cases.iter().map(|case| case.judgement.failure.is_some()),
                Aim::AtMost(0.0),
            ),
        ]
    }
}

/// A baseline's favourite template and how far it stands out.
type Pick<'a> = &'a dyn Fn(&Case) -> Option<(usize, f64)>;

/// Each baseline with the threshold that the nulls of this very set give it.
fn baseline_rows(cases: &[Case], nulls: &[&Case], singles: &[&Case], concealed: &[&Case]) -> Vec<Row> {
    let part = 1.0 - BASELINE_FALSE_ALARMS;
    let over_nulls =
        |of: &dyn Fn(&Case) -> Option<f64>| quantile(&nulls.iter().filter_map(|case| of(case)).collect::<Vec<_>>(), part);
    let strong: Vec<&&Case> = singles.iter().filter(|case| case.d_prime() >= OBVIOUS_D_PRIME).collect();
    // Everything on the scale of a structure's own nulls: by their middle and spread, not by their largest, beyond which one of many
    // templates soon is; templates by their logarithms.
    let of_template = |case: &Case, k: usize| Some(case.baseline.as_ref()?.templates[k].max(1e-3).ln());
    let scales: Vec<Scale> = (0..TEMPLATES.len()).map(|k| Scale::of(cases, |case| of_template(case, k), 0.1)).collect();
    let beyond = |case: &Case, k: usize, value: f64| scales[k].place(case, value.max(1e-3).ln());
    let best = |case: &Case| -> Option<(usize, f64)> {
        let all =
            case.baseline.as_ref()?.templates.iter().enumerate().filter_map(|(k, &value)| Some((k, beyond(case, k, value)?)));
        all.max_by(|a, b| a.1.total_cmp(&b.1))
    };
    let sparse = |case: &Case| -> Option<(usize, f64)> {
        let picked = case.baseline.as_ref()?.sparse.iter().filter_map(|&(k, gain)| Some((k, beyond(case, k, gain)?)));
        // Nothing picked is as far from an alarm as can be.
        Some(picked.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::MIN)))
    };
    let (error, misfit) = (|case: &Case| case.before.db_mse, |case: &Case| Some(case.baseline.as_ref()?.chi2));
    let [errors, misfits] = [Scale::of(cases, error, f64::MIN_POSITIVE), Scale::of(cases, misfit, f64::MIN_POSITIVE)];
    let global = |case: &Case| errors.place(case, error(case)?);
    let chi2 = |case: &Case| misfits.place(case, misfit(case)?);
    let mut rows = vec![];
    let mut add = |name: &str, value: &dyn Fn(&Case) -> Option<f64>, pick: Option<Pick>| {
        let limit = over_nulls(value);
        let alarm = |case: &Case| value(case).is_some_and(|value| value > limit);
        rows.push(share(
            format!("{name}: singles with d′ ≥ {OBVIOUS_D_PRIME} detected"),
            strong.iter().map(|case| alarm(case)),
            Aim::None,
        ));
        rows.push(share(format!("{name}: concealed effects detected"), concealed.iter().map(|case| alarm(case)), Aim::None));
        if let Some(pick) = pick {
            let named =
                |case: &Case| pick(case).is_some_and(|(k, _)| case.judgement.truth.iter().any(|id| look_alike(TEMPLATES[k], id)));
            let all = strong.iter().filter(|case| alarm(case));
            rows.push(share(format!("{name}: of those, the right name"), all.map(|case| named(case)), Aim::None));
            let wrong = cases.iter().filter(|case| case.planted() && alarm(case)).map(|case| !named(case));
            rows.push(share(format!("{name}: planted alarms with a wrong name"), wrong, Aim::None));
        }
    };
    let is_trained = cases.iter().any(|case| case.report.as_ref().is_some_and(|report| report.simulator.is_some()));
    let of = if is_trained { "trained simulator" } else { "prediction without training" };
    add(&format!("baseline, error of the {of}"), &global, None);
    add("baseline, χ² outside the scene", &chi2, None);
    add("baseline, templates one by one", &|case| best(case).map(|(_, ratio)| ratio), Some(&best));
    add("baseline, sparse regression", &|case| sparse(case).map(|(_, ratio)| ratio), Some(&sparse));
    rows
}
