//! The proof on concealed data, on tiny cases: sealing, tampering, running without the truth, resuming, scoring.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

use hybridsim::challenge::answer::{self, Answers, RunConfig};
use hybridsim::challenge::commitment::{Commitment, Sealed};
use hybridsim::challenge::config::Stratum;
use hybridsim::challenge::seal::seal;
use hybridsim::challenge::structures::Who;
use hybridsim::challenge::truth::Truth;
use hybridsim::challenge::{ChallengeConfig, score::score, twins};
use hybridsim::data::Recording;
use hybridsim::data::Shard;
use hybridsim::data::files::read_json;
use serde_json::{Value, json};

fn config(cases: usize) -> ChallengeConfig {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/challenge_smoke.toml");
    ChallengeConfig::read(&path, &[format!("cases={cases}")]).unwrap()
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().flatten() {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// A copy of one small challenge, sealed once.
fn challenge() -> (tempfile::TempDir, PathBuf) {
    static ONCE: OnceLock<tempfile::TempDir> = OnceLock::new();
    let sealed = ONCE.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        seal(&config(9), Some("a test"), &folder.path().join("c"), Shard::ALL, &|_| {}).unwrap();
        folder
    });
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("c");
    copy(&sealed.path().join("c"), &folder);
    (parent, folder)
}

fn names(challenge: &Path) -> Vec<String> {
    Commitment::read_all(challenge).unwrap().into_iter().flat_map(|c| c.leaves.into_keys()).collect()
}

fn truth(challenge: &Path, name: &str) -> Truth {
    Truth::of(&read_json::<Sealed>(&challenge.join(format!("sealed/{name}.json"))).unwrap()).unwrap()
}

/// A program that answers as a diagnosis would: `body` is a shell script with CASE in $2 and the answer's folder in $4.
fn program(folder: &Path, body: &str) -> RunConfig {
    let path = folder.join("diagnostician");
    fs::write(&path, format!("#!/bin/sh\nmkdir -p \"$4\"\n{body}\n")).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    RunConfig { program: path, through: vec![], arguments: vec![], shard: Shard::ALL, most: None, limit: Duration::from_secs(20) }
}

fn silent_report() -> Value {
    json!({"format": 1, "verdict": "no_mismatch", "effects": [], "unexplained": [],
           "fit": {"before": {"loglik_per_sample": -5.0, "db_mse": 30.0}, "after": {"loglik_per_sample": -5.0}}})
}

fn silent(folder: &Path) -> RunConfig {
    program(folder, &format!("printf '%s' '{}' > \"$4/report.json\"", silent_report()))
}

#[test]
fn cases_give_nothing_away_and_the_commitment_is_to_them() {
    let (_parent, challenge) = challenge();
    let commitment = &Commitment::read_all(&challenge).unwrap()[0];
    assert_eq!((commitment.cases, commitment.leaves.len()), (9, 9));
    let nulls = names(&challenge).iter().filter(|name| truth(&challenge, name).stratum == Stratum::Null).count();
    assert!(nulls >= 3, "{nulls} nulls of 9");
    let mut sizes = std::collections::BTreeSet::new();
    for name in names(&challenge) {
        let case = challenge.join("cases").join(&name);
        let recording = Recording::open(&case).unwrap();
        assert!(recording.labels.is_empty() && recording.person().is_some());
        let files: Vec<_> =
            fs::read_dir(&case).unwrap().flatten().map(|entry| entry.file_name().into_string().unwrap()).collect();
        assert_eq!(files.len(), 4, "{files:?}");
        assert!(!case.join("truth.json").exists());
        sizes.insert(fs::metadata(case.join("if.npy")).unwrap().len());
        let truth = truth(&challenge, &name);
        assert_eq!(truth.effects.is_empty(), truth.strength.is_none());
    }
    assert_eq!(sizes.len(), 1);
}

#[test]
fn equal_seeds_give_equal_cases_and_shards_are_parts_of_them() {
    let (_parent, whole) = challenge();
    let parent = tempfile::tempdir().unwrap();
    let part = parent.path().join("c");
    let sealed = seal(&config(9), Some("a test"), &part, Shard { number: 2, of: 3 }, &|_| {}).unwrap();
    assert_eq!(sealed.cases, 3);
    let all = &Commitment::read_all(&whole).unwrap()[0];
    // The very same leaves: truth, salt and every byte of the data.
    assert!(sealed.leaves.iter().all(|(name, leaf)| all.leaves[name] == *leaf));
    // All files are equally old.
    let times: std::collections::BTreeSet<_> = names(&part)
        .iter()
        .flat_map(|name| fs::read_dir(part.join("cases").join(name)).unwrap().flatten())
        .map(|entry| entry.metadata().unwrap().modified().unwrap())
        .collect();
    assert_eq!(times.len(), 1);
    let again = seal(&config(9), Some("a test"), &part, Shard { number: 2, of: 3 }, &|_| {}).unwrap_err();
    assert!(again.to_string().contains("committed to already"), "{again}");
    let other = seal(&config(9), Some("another"), &part, Shard { number: 1, of: 3 }, &|_| {}).unwrap_err();
    assert!(other.to_string().contains("another seed"), "{other}");
}

#[test]
fn who_diagnoses_sees_the_case_and_nothing_else() {
    let (parent, challenge) = challenge();
    let seen = parent.path().join("seen");
    let mut config = silent(parent.path());
    let script = fs::read_to_string(&config.program).unwrap();
    let spy = format!("{{ pwd; ls -R .; env | grep -v CARGO; echo \"$@\"; }} >> {} 2>/dev/null", seen.display());
    fs::write(&config.program, format!("{script}\n{spy}\n")).unwrap();
    config.most = Some(2);
    // The sealed part is elsewhere: running needs none of it.
    fs::rename(challenge.join("sealed"), parent.path().join("elsewhere")).unwrap();
    let answers = answer::run(&challenge, &parent.path().join("answers"), &config, &mut |_| {}).unwrap();
    assert_eq!((answers.reports.len(), answers.complete), (2, false));
    let seen = fs::read_to_string(&seen).unwrap();
    assert!(seen.contains("if.npy") && seen.contains("diagnose"));
    for secret in ["sealed", "truth", "commitment", parent.path().to_str().unwrap()] {
        assert!(!seen.lines().any(|line| line.contains(secret)), "{secret} was within reach:\n{seen}");
    }
    for name in names(&challenge) {
        assert!(!seen.contains(&name), "the case's name was shown");
    }
}

#[test]
fn a_run_goes_on_where_it_stopped_and_failures_stand() {
    let (parent, challenge) = challenge();
    let (out, names) = (parent.path().join("answers"), names(&challenge));
    let crash = RunConfig { most: Some(1), ..program(parent.path(), "echo it broke >&2; exit 3") };
    answer::run(&challenge, &out, &crash, &mut |_| {}).unwrap();
    let bad = RunConfig { most: Some(1), ..program(parent.path(), "echo '{\"verdict\": \"guilty\"}' > \"$4/report.json\"") };
    answer::run(&challenge, &out, &bad, &mut |_| {}).unwrap();
    let slow = RunConfig { most: Some(1), limit: Duration::from_millis(100), ..program(parent.path(), "exec sleep 5") };
    answer::run(&challenge, &out, &slow, &mut |_| {}).unwrap();
    // Also while a case is at work: how many are done before it.
    let mut done = vec![];
    let answers = answer::run(&challenge, &out, &silent(parent.path()), &mut |count| done.push(count)).unwrap();
    assert!(done.is_sorted(), "{done:?}");
    assert_eq!((done.last().copied().unwrap(), answers.reports.len(), answers.failures.len(), answers.complete), (6, 6, 3, true));
    assert!(answers.failures[&names[0]].contains("it broke"), "{:?}", answers.failures);
    assert!(answers.failures[&names[1]].contains("bad report"), "{:?}", answers.failures);
    assert!(answers.failures[&names[2]].contains("not done after"), "{:?}", answers.failures);
    // Nothing is done twice, and the same folder gives the same hash.
    let again = answer::run(&challenge, &out, &silent(parent.path()), &mut |_| panic!("nothing is left to do")).unwrap();
    assert_eq!(again.sha256, answers.sha256);
    let scored = score(&challenge, &out, None, false, &|_| {}).unwrap();
    let row = scored.rows.iter().find(|row| row.what.contains("without a usable report")).unwrap();
    assert_eq!(row.estimate, Some(3.0 / 9.0));
    assert_eq!(scored.failures.iter().filter(|line| line.contains("no usable report")).count(), 3);
    // The same program measures the same strengths again.
    let measured = score(&challenge, &out, None, true, &|_| {}).unwrap();
    for (sealed, again) in scored.judgements.iter().zip(&measured.judgements) {
        let d_prime = [sealed, again].map(|case| case.strength.map(|strength| (strength.d_prime, strength.d_prime_surviving)));
        match d_prime {
            [Some(a), Some(b)] => {
                assert!((a.0 / b.0 - 1.0).abs() < 1e-6 && (a.1 - b.1).abs() < 1e-6 * a.0, "{}: {a:?} {b:?}", sealed.case)
            }
            none => assert_eq!(none, [None, None]),
        }
    }
}

/// A challenge whose cases have two structures and are diagnosed without an effect here and there.
fn structured() -> ChallengeConfig {
    let mut config = config(20);
    let structure = |text: &str| toml::from_str(text).unwrap();
    config.structures = vec![
        structure("name = \"usual\""),
        structure("name = \"empty\"\nperson = \"nobody\"\nroom = false\nradar = { loops_per_frame = 1, frames = 40 }"),
        structure("name = \"untracked\"\nperson = \"untracked\""),
    ];
    (config.leave_one_out, config.shares.outside) = (true, 0.2);
    config
}

#[test]
fn structures_differ_in_what_is_recorded_and_told_and_an_effect_left_out_is_published_and_obeyed() {
    let parent = tempfile::tempdir().unwrap();
    let challenge = parent.path().join("c");
    seal(&structured(), Some("structures"), &challenge, Shard::ALL, &|_| {}).unwrap();
    let commitment = Commitment::read_all(&challenge).unwrap().remove(0);
    let mut of_structure = std::collections::BTreeMap::<String, usize>::new();
    let mut left_out = [0; 2];
    for name in names(&challenge) {
        let (truth, recording) = (truth(&challenge, &name), Recording::open(challenge.join("cases").join(&name)).unwrap());
        *of_structure.entry(truth.structure.name.clone()).or_default() += 1;
        let loops = recording.radar.loops_per_frame;
        let found = (loops, recording.person().is_some(), recording.room.is_some(), truth.structure.person == Who::Untracked);
        let expected = match truth.structure.name.as_str() {
            "usual" => (16, true, true, false),
            "empty" => (1, false, false, false),
            _ => (16, false, true, true),
        };
        assert_eq!(found, expected, "{}", truth.structure.name);
        assert_eq!(truth.left_out.as_ref(), commitment.left_out.get(&name));
        if let Some(id) = &truth.left_out {
            let planted = truth.stratum == Stratum::Outside;
            left_out[usize::from(planted)] += 1;
            assert_eq!(truth.effects.first().map(|effect| effect["name"] == **id), planted.then_some(true));
            assert_eq!(truth.ids(), vec![None; truth.effects.len()]);
        }
    }
    assert!(of_structure.values().all(|count| (6..=7).contains(count)) && of_structure.len() == 3, "{of_structure:?}");
    assert!(left_out[0] == left_out[1] && left_out[1] >= 3, "{left_out:?}");
    // Whoever diagnoses is given what to leave out, and of which case.
    let arguments = parent.path().join("arguments");
    let config = program(
        parent.path(),
        &format!("echo \"$@\" >> {}; printf '%s' '{}' > \"$4/report.json\"", arguments.display(), silent_report()),
    );
    answer::run(&challenge, &parent.path().join("answers"), &config, &mut |_| {}).unwrap();
    let arguments = fs::read_to_string(&arguments).unwrap();
    let lines: Vec<&str> = arguments.lines().filter(|line| line.contains("diagnosis.left_out=")).collect();
    assert_eq!((lines.len(), arguments.lines().count()), (commitment.left_out.len(), 20));
    assert!(commitment.left_out.values().all(|id| lines.iter().any(|line| line.contains(&format!("left_out=[\"{id}\"]")))));
    let text = score(&challenge, &parent.path().join("answers"), None, false, &|_| {}).unwrap().markdown();
    assert!(text.contains("### By structure") && text.contains("| untracked | "), "{text}");
    // What was published is what is in the truths.
    let path = challenge.join("commitment.json");
    let (name, id) = commitment.left_out.first_key_value().unwrap();
    let other = if id == "spur" { "compression" } else { "spur" };
    let swapped =
        fs::read_to_string(&path).unwrap().replace(&format!("\"{name}\": \"{id}\""), &format!("\"{name}\": \"{other}\""));
    fs::write(&path, swapped).unwrap();
    let refused = score(&challenge, &parent.path().join("answers"), None, false, &|_| {}).unwrap_err().to_string();
    assert!(refused.contains(name) && refused.contains("left_out"), "{refused}");
}

#[test]
fn whatever_is_changed_after_sealing_or_answering_is_noticed_and_named() {
    let (parent, challenge) = challenge();
    let (out, names) = (parent.path().join("answers"), names(&challenge));
    let answers = answer::run(&challenge, &out, &silent(parent.path()), &mut |_| {}).unwrap();
    let refused = || score(&challenge, &out, None, false, &|_| {}).unwrap_err().to_string();
    let tamper = |path: PathBuf, change: &dyn Fn(Vec<u8>) -> Vec<u8>, wanted: &str| {
        let whole = fs::read(&path).unwrap();
        fs::write(&path, change(whole.clone())).unwrap();
        let message = refused();
        assert!(message.contains(wanted), "{}: {message}", path.display());
        fs::write(&path, whole).unwrap();
    };
    let flip = |mut bytes: Vec<u8>| {
        let last = bytes.len() - 1;
        bytes[last] ^= 1;
        bytes
    };
    tamper(challenge.join("cases").join(&names[4]).join("if.npy"), &flip, &names[4]);
    let weaker = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap().replacen("\"tier\": \"", "\"tier\": \"x", 1).into_bytes();
    tamper(challenge.join(format!("sealed/{}.json", names[2])), &weaker, &names[2]);
    let other_salt = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap().replacen("\"salt\": \"", "\"salt\": \"0", 1).into_bytes();
    tamper(challenge.join(format!("sealed/{}.json", names[3])), &other_salt, &names[3]);
    let louder = |bytes: Vec<u8>| [bytes, b" ".to_vec()].concat();
    tamper(out.join(&names[1]).join("report.json"), &louder, &names[1]);
    let complete =
        |bytes: Vec<u8>| String::from_utf8(bytes).unwrap().replace("\"complete\": true", "\"complete\": false").into_bytes();
    tamper(out.join("answers.json"), &complete, "sha256");
    // A leaf that was exchanged with its root left as it was.
    let leaf = Commitment::read_all(&challenge).unwrap()[0].leaves[&names[0]].clone();
    let exchanged = move |bytes: Vec<u8>| String::from_utf8(bytes).unwrap().replace(&leaf, &"0".repeat(64)).into_bytes();
    tamper(challenge.join("commitment.json"), &exchanged, "root");
    // A case that nobody committed to.
    fs::create_dir(challenge.join("cases/0000")).unwrap();
    assert!(refused().contains("0000"));
    fs::remove_dir(challenge.join("cases/0000")).unwrap();
    assert_eq!(score(&challenge, &out, None, false, &|_| {}).unwrap().answers, answers.sha256);
}

/// Writes a report for a case into the answers, as if it had been diagnosed.
fn answer_by_hand(out: &Path, name: &str, report: &Value) {
    fs::create_dir_all(out.join(name)).unwrap();
    fs::write(out.join(name).join("report.json"), report.to_string()).unwrap();
}

#[test]
fn made_up_answers_get_the_score_that_they_deserve() {
    let (parent, challenge) = challenge();
    let (out, names) = (parent.path().join("answers"), names(&challenge));
    let truths: Vec<Truth> = names.iter().map(|name| truth(&challenge, name)).collect();
    // One false alarm; every effect of the library named by its id, with half of the misfit removed; the rest silent.
    let first_null = names.iter().zip(&truths).find(|(_, truth)| truth.stratum == Stratum::Null).unwrap().0;
    for (name, truth) in names.iter().zip(&truths) {
        let effects: Vec<Value> = truth.ids().into_iter().flatten().map(|id| json!({"id": id, "probability": 0.9})).collect();
        let mut report = silent_report();
        if name == first_null {
            report["effects"] = json!([{"id": "spur", "probability": 0.95}]);
            report["verdict"] = "explained".into();
        } else if !effects.is_empty() {
            report["effects"] = effects.into();
            report["verdict"] = "explained".into();
            report["fit"]["before"]["loglik_per_sample"] = json!(-9.0);
            report["fit"]["after"]["loglik_per_sample"] = json!(-7.0);
        }
        answer_by_hand(&out, name, &report);
    }
    let config = silent(parent.path());
    assert!(answer::run(&challenge, &out, &config, &mut |_| panic!("all is answered")).unwrap().complete);
    let folder = parent.path().join("twins");
    twins::run(&challenge, &out, &folder, &config, &mut |_| {}).unwrap();
    let scored = score(&challenge, &out, Some(&folder), false, &|_| {}).unwrap();
    let row = |what: &str| scored.rows.iter().find(|row| row.what.contains(what)).unwrap_or_else(|| panic!("{what}"));
    let nulls = truths.iter().filter(|truth| truth.stratum == Stratum::Null).count();
    let alarms = row("false alarms");
    assert_eq!((alarms.n, alarms.estimate), (nulls, Some(1.0 / nulls as f64)));
    assert!(alarms.interval.unwrap()[1] > 0.7);
    assert_eq!(row("nulls with a confident wrong name").estimate, Some(1.0 / nulls as f64));
    let right = row("first name is right");
    assert!(right.n > 0 && right.estimate == Some(1.0), "{right:?}");
    // The twin's likelihood is −5 by the same program, but for the receiver's scale; half of 9 − 5 was removed.
    let recovered = row("misfit recovered");
    assert!(recovered.n > 0 && (recovered.estimate.unwrap() - 0.5).abs() < 0.1, "{recovered:?}");
    assert!(scored.failures.iter().any(|line| line.contains(first_null) && line.contains("false alarm")));
    scored.write(&parent.path().join("score")).unwrap();
    for file in ["results.md", "score.json", "psychometric.png"] {
        assert!(fs::metadata(parent.path().join("score").join(file)).unwrap().len() > 500, "{file}");
    }
    let answers = Answers::read(&out).unwrap();
    assert!(fs::read_to_string(parent.path().join("score/results.md")).unwrap().contains(&answers.sha256));
}
