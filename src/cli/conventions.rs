//! The table of what is stated of a recording's samples, what they say themselves, and what was kept.

use crate::{
    integrity::{Finding, Kind, never_decided},
    radar::Radar,
};

/// What becomes of a statement that the samples contradict.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Against {
    /// Nothing is decided: a recording is only looked at.
    Questioned,
    /// It is refused.
    Refused,
    /// The user keeps his word.
    Kept,
}

/// One row for each convention on standard output, what is wrong on standard error too.
pub(super) fn show(radar: &Radar, findings: &[Finding], against: Against) {
    let undecided = never_decided(radar);
    let rows: Vec<[String; 4]> = findings.iter().chain(&undecided).map(|finding| row(finding, against)).collect();
    let heads = ["convention", "kept", "stated", "the data say"].map(String::from);
    let width = |column: usize| rows.iter().chain([&heads]).map(|row| row[column].chars().count()).max().unwrap_or(0);
    let [name, kept, stated] = [0, 1, 2].map(width);
    for [a, b, c, d] in std::iter::once(&heads).chain(&rows) {
        say!("  {a:name$}  {b:kept$}  {c:stated$}  {d}");
    }
    for finding in findings.iter().filter(|finding| !finding.ok) {
        let what = if finding.kind == Kind::Convention { "wrong" } else { "damaged" };
        remark!("{what}: {}", finding.found);
    }
}

fn row(finding: &Finding, against: Against) -> [String; 4] {
    let kept = match (finding.ok, finding.kind, against) {
        (true, ..) if finding.decided => "as stated",
        (true, ..) => "as stated, undecided",
        (false, Kind::Lost, Against::Questioned) => "questioned",
        (false, Kind::Lost, _) => "what was lost is left out",
        (false, _, Against::Questioned) => "questioned",
        (false, _, Against::Refused) => "refused",
        (false, _, Against::Kept) => "as stated, against the data",
    };
    [finding.name(), kept.into(), finding.expected.into(), finding.found.clone()]
}
