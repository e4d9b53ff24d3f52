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
    say!("  {}", verdict(findings.iter().filter(|finding| !finding.ok).count(), rows_undecided(findings) + undecided.len()));
    for finding in findings.iter().filter(|finding| !finding.ok) {
        let what = if finding.kind == Kind::Convention { "wrong" } else { "damaged" };
        remark!("{what}: {}", finding.found);
    }
}

fn rows_undecided(findings: &[Finding]) -> usize {
    findings.iter().filter(|finding| finding.ok && !finding.decided).count()
}

/// All of the table in a line.
fn verdict(wrong: usize, undecided: usize) -> String {
    let rows = |count: usize| if count == 1 { "1 row".to_string() } else { format!("{count} rows") };
    let found = match wrong {
        0 => "nothing contradicts what is stated".to_string(),
        1 => "1 row contradicts what is stated".to_string(),
        _ => format!("{wrong} rows contradict what is stated"),
    };
    match undecided {
        0 => found,
        1 => format!("{found}; {} is undecided, for the reason that it names", rows(1)),
        _ => format!("{found}; {} are undecided, each for the reason that it names", rows(undecided)),
    }
}

fn row(finding: &Finding, against: Against) -> [String; 4] {
    [finding.name(), finding.kept(against).into(), finding.expected.into(), finding.found.clone()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_ends_in_what_it_says() {
        assert_eq!(verdict(0, 0), "nothing contradicts what is stated");
        assert_eq!(verdict(0, 4), "nothing contradicts what is stated; 4 rows are undecided, each for the reason that it names");
        assert_eq!(verdict(2, 1), "2 rows contradict what is stated; 1 row is undecided, for the reason that it names");
    }
}
