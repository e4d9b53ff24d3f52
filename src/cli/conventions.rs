//! The table of what is stated of a recording's samples, what they say themselves, and what was kept.

use crate::{
    integrity::{Against, Finding, Kind, never_decided},
    radar::Radar,
};

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
    [finding.name(), finding.kept(against).into(), finding.expected.into(), finding.found.clone()]
}
