//! `docs/paper.md`, `configs/paper.toml` and the code say the same of the paper.

use std::{collections::BTreeMap, path::Path};

use burn::tensor::Device;
use hybridsim::{
    config::Config,
    recorder::{self, RecorderConfig},
    training::{Event, load_recordings},
};
use num_complex::Complex64;
use toml::{Table, Value};

/// What stays other than in the paper even with `configs/paper.toml`: the row's name and the settings that say so.
const LEFT: [(&str, &[&str]); 2] = [("guards", &[]), ("floor of the logarithm", &["training.heatmap.floor_db"])];

/// Every value of a table by its dotted key; lists are values.
type Leaves = BTreeMap<String, Value>;

fn leaves(table: &Table) -> Leaves {
    let mut found = Leaves::new();
    for (key, value) in table {
        match value {
            Value::Table(inner) => found.extend(leaves(inner).into_iter().map(|(rest, value)| (format!("{key}.{rest}"), value))),
            value => {
                found.insert(key.clone(), value.clone());
            }
        }
    }
    found
}

/// The settings that the paper has a say in.
fn settings(config: &Config) -> Leaves {
    let mut all = leaves(&toml::from_str(&config.to_toml()).unwrap());
    all.retain(|key, _| key.starts_with("simulator.") || key.starts_with("training."));
    all
}

fn file(name: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap()
}

fn paper(sets: &[&str]) -> Config {
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    Config::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/paper.toml"), &sets).unwrap()
}

/// A row of the table in `docs/paper.md`.
struct Row {
    what: String,
    kind: String,
    defaults: Leaves,
    /// Where `configs/paper.toml` has another value.
    papers: Leaves,
}

fn rows() -> Vec<Row> {
    let text = file("docs/paper.md");
    let rows = text.lines().filter(|line| line.starts_with("| ")).map(|line| {
        let cells: Vec<&str> = line.trim_matches('|').split(" | ").map(str::trim).collect();
        assert_eq!(cells.len(), 6, "{line}");
        cells.iter().map(|cell| cell.to_string()).collect::<Vec<_>>()
    });
    rows.filter(|cells| cells[0] != "Section")
        .map(|cells| {
            let (defaults, papers) = stated(&cells[5]);
            Row { what: cells[1].clone(), kind: cells[4].clone(), defaults, papers }
        })
        .collect()
}

/// `` `key = value` → `value`, … ``: the defaults, and what follows the arrows.
fn stated(cell: &str) -> (Leaves, Leaves) {
    let (mut defaults, mut papers) = (Leaves::new(), Leaves::new());
    let parts: Vec<&str> = cell.split('`').collect();
    let mut last = String::new();
    for (between, code) in parts.iter().step_by(2).zip(parts.iter().skip(1).step_by(2)) {
        if between.contains('→') {
            let value = toml::from_str::<Table>(&format!("value = {code}")).unwrap_or_else(|error| panic!("{code}: {error}"));
            papers.insert(last.clone(), value["value"].clone());
            continue;
        }
        let table = leaves(&toml::from_str(code).unwrap_or_else(|error| panic!("{code}: {error}")));
        last = table.keys().next().unwrap_or_else(|| panic!("{code}: no setting")).clone();
        for (key, value) in table {
            assert!(defaults.insert(key.clone(), value).is_none(), "`{key}` stands twice in a row");
        }
    }
    (defaults, papers)
}

/// All rows' settings together; none may stand twice.
fn together(rows: &[Row], of: fn(&Row) -> &Leaves) -> Leaves {
    let mut all = Leaves::new();
    for (key, value) in rows.iter().flat_map(of) {
        assert!(all.insert(key.clone(), value.clone()).is_none(), "docs/paper.md has `{key}` in two rows");
    }
    all
}

/// Every difference between two sets of settings, readable.
fn differences(found: &Leaves, wanted: &Leaves) -> Vec<String> {
    let keys: std::collections::BTreeSet<&String> = found.keys().chain(wanted.keys()).collect();
    keys.into_iter()
        .filter(|key| found.get(*key) != wanted.get(*key))
        .map(|key| format!("{key}: stated {:?}, is {:?}", found.get(key), wanted.get(key)))
        .collect()
}

#[test]
fn the_table_has_every_setting_with_its_default() {
    let wrong = differences(&together(&rows(), |row| &row.defaults), &settings(&Config::default()));
    assert!(wrong.is_empty(), "docs/paper.md does not say what the code does:\n{}", wrong.join("\n"));
}

#[test]
fn the_papers_config_is_what_follows_the_arrows_and_nothing_else() {
    let rows = rows();
    let (mut wanted, changed) = (together(&rows, |row| &row.defaults), together(&rows, |row| &row.papers));
    for (key, value) in &changed {
        let default = wanted.insert(key.clone(), value.clone());
        assert!(default.is_some_and(|default| default != *value), "`{key}` has an arrow to its default");
    }
    let wrong = differences(&wanted, &settings(&paper(&[])));
    assert!(wrong.is_empty(), "docs/paper.md does not say what configs/paper.toml resolves to:\n{}", wrong.join("\n"));
    let mut written = leaves(&toml::from_str(&file("configs/paper.toml")).unwrap());
    written.remove("seed");
    let wrong = differences(&changed, &written);
    assert!(wrong.is_empty(), "configs/paper.toml holds something else than the arrows:\n{}", wrong.join("\n"));
}

#[test]
fn every_deviation_left_is_named() {
    let rows = rows();
    for row in &rows {
        assert!(["exact", "reading", "left"].contains(&row.kind.as_str()), "{}: kind {}", row.what, row.kind);
        // What the paper says cannot be a setting that its config leaves out.
        assert!(row.kind != "left" || row.papers.is_empty(), "{}: left, and yet configs/paper.toml changes it", row.what);
    }
    let found: Vec<(&str, Vec<&str>)> = rows
        .iter()
        .filter(|row| row.kind == "left")
        .map(|row| (row.what.as_str(), row.defaults.keys().map(String::as_str).collect()))
        .collect();
    let wanted: Vec<(&str, Vec<&str>)> = LEFT.iter().map(|(what, keys)| (*what, keys.to_vec())).collect();
    assert_eq!(found, wanted);
}

#[test]
fn a_drift_is_noticed() {
    let code = settings(&Config::default());
    let (defaults, papers) = stated("`simulator.dechirp = \"exact\"` → `\"paper\"`, `training.epochs = 41`");
    assert_eq!(papers, Leaves::from([("simulator.dechirp".into(), Value::from("paper"))]));
    let wrong = differences(&defaults, &code);
    assert!(wrong.iter().any(|line| line.starts_with("training.epochs: stated Some(Integer(41))")), "{wrong:?}");
    assert!(!wrong.iter().any(|line| line.starts_with("simulator.dechirp")));
    assert!(wrong.iter().any(|line| line.starts_with("simulator.sum: stated None")), "what is not listed counts");
}

#[test]
fn the_papers_config_trains() {
    let config = paper(&[
        "simulator.room.patch_spacing_m=1.0",
        "simulator.triplane.resolution=16",
        "training.epochs=4",
        "training.learning_rate=1e-2",
        "training.final_learning_rate=1e-2",
    ]);
    let test = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/test.toml");
    let record = Config::read(&test, &["record.frames=3".into()]).unwrap();
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("recording");
    recorder::record_to(record.record(&test).unwrap(), parent.path(), &folder, &mut |_, _| {}).unwrap();
    let recordings = load_recordings(&[folder], &config.simulator).unwrap();
    let run = parent.path().join("run");
    let (text, devices) = (config.to_toml(), [Device::flex()]);
    let trainer = config.trainer(&recordings, &text, &run, &devices).unwrap();
    let mut losses = Vec::new();
    let outcome = trainer.run(None, &mut |event| {
        if let Event::Epoch(metrics) = &event {
            losses.push(metrics.training_loss);
        }
    });
    let outcome = outcome.unwrap();
    println!("losses {losses:.0?}");
    assert!(losses[3] < 0.9 * losses[0], "{losses:?}");
    // No gain is applied, so none has learned.
    for gain in [&outcome.simulator.decoders.body_gain, &outcome.simulator.decoders.room_gain] {
        assert_eq!(gain.db(), config.simulator.decoders.gain_db);
    }
}

/// Relative permittivity of dry skin, ε' − jε'': four Cole-Cole terms, of which dry skin has two, and conduction (Gabriel et al.
/// 1996, III, table 1).
fn dry_skin(frequency_hz: f64) -> Complex64 {
    let turn = |seconds: f64| Complex64::new(0.0, std::f64::consts::TAU * frequency_hz * seconds);
    let vacuum = 8.854_187_812_8e-12;
    4.0 + 32.0 / (1.0 + turn(7.23e-12)) + 1100.0 / (1.0 + turn(32.48e-9).powf(0.8)) + 2e-4 / turn(vacuum)
}

#[test]
fn simulator_and_recorder_have_gabriels_dry_skin_at_77_ghz() {
    let near = |name: &str, found: f64, wanted: f64| {
        assert!((found - wanted).abs() <= 0.005, "{name} is {found}, Gabriel's is {wanted}");
    };
    let wanted = dry_skin(77e9);
    let [real, imaginary] = RecorderConfig::default().skin.permittivity;
    near("record.skin.permittivity[0]", real, wanted.re);
    near("record.skin.permittivity[1]", imaginary, -wanted.im);
    let index = wanted.sqrt();
    let skin = Config::default().simulator.decoders.body_material;
    near("body_material.refraction.initial", skin.refraction.initial, index.re);
    near("body_material.extinction.initial", skin.extinction.initial, -index.im);
    // as docs/paper.md says
    let text = file("docs/paper.md");
    for frequency in [77e9, 60e9] {
        let value = dry_skin(frequency);
        let written = format!("{:.2} − {:.2}j", value.re, -value.im);
        assert!(text.contains(&written), "docs/paper.md does not have {written} at {frequency} Hz");
    }
}
