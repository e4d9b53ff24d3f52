use std::fs;

use serde::Deserialize;

use super::*;

#[derive(Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Training {
    learning_rate: f64,
    epochs: usize,
    loss: String,
}

#[derive(Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Config {
    seed: u64,
    walls_m: Vec<f64>,
    training: Training,
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new(files: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        files.iter().for_each(|(name, text)| fs::write(folder.path().join(name), text).unwrap());
        Self(folder)
    }

    fn read(&self, name: &str, sets: &[&str]) -> Result<Config> {
        let sets: Vec<_> = sets.iter().map(|set| set.to_string()).collect();
        read_settings(self.0.path().join(name), &sets)
    }

    /// The message without the folder in front of the file's name.
    fn refused(&self, name: &str, sets: &[&str]) -> String {
        let message = self.read(name, sets).unwrap_err().to_string();
        message.replace(&format!("{}/", self.0.path().display()), "")
    }
}

#[test]
fn a_file_is_read_with_defaults() {
    let folder = Folder::new(&[("a.toml", "seed = 3\n[training]\nepochs = 7\n")]);
    let wanted = Config { seed: 3, training: Training { epochs: 7, ..Default::default() }, ..Default::default() };
    assert_eq!(folder.read("a.toml", &[]).unwrap(), wanted);
    assert_eq!(read_toml::<Config>(folder.0.path().join("a.toml")).unwrap(), wanted);
}

#[test]
fn what_is_no_toml_is_refused_with_its_line_and_column() {
    let folder = Folder::new(&[("a.toml", "seed = 3\n[training\nepochs = 7\n")]);
    let message = folder.refused("a.toml", &[]);
    assert!(message.starts_with("a.toml: line 2, column 10: "), "{message}");
    assert_eq!(message.lines().count(), 1);
}

#[test]
fn a_wrong_type_is_refused_with_its_line_and_column() {
    let text = "# größer\nseed = 3\n\n[training]\nlearning_rate = \"fast\"\n";
    let folder = Folder::new(&[("a.toml", text), ("b.toml", "extends = \"a.toml\"\nseed = 4\n")]);
    let wanted = "a.toml: line 5, column 17: invalid type: string \"fast\", expected f64";
    assert_eq!(read_toml::<Config>(folder.0.path().join("a.toml")).unwrap_err().to_string().rsplit('/').next().unwrap(), wanted);
    assert_eq!(folder.refused("a.toml", &[]), wanted);
    // Through a child, too.
    assert_eq!(folder.refused("b.toml", &["seed=5"]), wanted);
    assert_eq!(
        folder.refused("a.toml", &["training.learning_rate=slow"]),
        "--set: `training.learning_rate`: invalid type: string \"slow\", expected f64"
    );
}

#[test]
fn an_unknown_key_is_named_with_the_nearest_known_one() {
    let folder = Folder::new(&[
        ("a.toml", "seed = 3\n[training]\nlearning_rat = 0.1\n"),
        ("b.toml", "sed = 3\n"),
        ("c.toml", "extends = \"b.toml\"\n"),
        ("d.toml", "seed = 3\n"),
    ]);
    let of_training = "a.toml: unknown key `training.learning_rat`, the nearest known one is `learning_rate`";
    assert_eq!(folder.refused("a.toml", &[]), of_training);
    let error = read_toml::<Config>(folder.0.path().join("a.toml")).unwrap_err();
    assert!(
        matches!(&error, Error::UnknownKey { key, nearest: Some(nearest), .. } if key == "training.learning_rat" && nearest == "learning_rate")
    );
    assert_eq!(error.hint().unwrap(), "remove the key or correct its name");
    assert_eq!(folder.refused("b.toml", &[]), "b.toml: unknown key `sed`, the nearest known one is `seed`");
    // The file that has the key is named, not the one that was asked for.
    assert_eq!(folder.refused("c.toml", &[]), "b.toml: unknown key `sed`, the nearest known one is `seed`");
    assert_eq!(
        folder.refused("d.toml", &["training.epoch=1"]),
        "--set: unknown key `training.epoch`, the nearest known one is `epochs`"
    );
    assert_eq!(
        folder.refused("d.toml", &["trainings.epochs=1"]),
        "--set: unknown key `trainings`, the nearest known one is `training`"
    );
    // None is like it: all are listed.
    assert_eq!(folder.refused("d.toml", &["xyz=1"]), "--set: unknown key `xyz`");
}

#[test]
fn a_child_changes_only_what_it_says() {
    let folder = Folder::new(&[
        ("base.toml", "seed = 1\nwalls_m = [1.0, 2.0]\n[training]\nepochs = 7\nlearning_rate = 0.5\n"),
        ("child.toml", "extends = \"base.toml\"\nwalls_m = [3.0]\n[training]\nepochs = 8\n"),
        ("grandchild.toml", "extends = \"child.toml\"\nseed = 2\n"),
    ]);
    let training = Training { epochs: 8, learning_rate: 0.5, loss: String::new() };
    assert_eq!(folder.read("grandchild.toml", &[]).unwrap(), Config { seed: 2, walls_m: vec![3.0], training });
    let resolved = resolve(folder.0.path().join("grandchild.toml"), &[]).unwrap();
    assert!(!resolved.contains_key("extends"));
}

#[test]
fn parents_are_found_beside_their_child() {
    let folder = Folder::new(&[("base.toml", "seed = 9\n")]);
    let below = folder.0.path().join("below");
    fs::create_dir(&below).unwrap();
    fs::write(below.join("a.toml"), "extends = \"../base.toml\"").unwrap();
    assert_eq!(folder.read("below/a.toml", &[]).unwrap().seed, 9);
}

#[test]
fn a_circle_of_parents_is_refused() {
    let folder = Folder::new(&[("a.toml", "extends = \"b.toml\""), ("b.toml", "extends = \"a.toml\"")]);
    assert_eq!(folder.refused("a.toml", &[]), "a.toml: `extends` comes back to this file: a.toml -> b.toml -> a.toml");
}

#[test]
fn a_parent_that_is_absent_or_no_name_is_refused() {
    let folder = Folder::new(&[("a.toml", "extends = \"none.toml\""), ("b.toml", "extends = 3")]);
    assert!(folder.refused("a.toml", &[]).starts_with("none.toml: cannot be read: "));
    assert_eq!(
        folder.refused("b.toml", &[]),
        "b.toml: `extends` is 3, expected the name of another config, such as \"base.toml\""
    );
}

#[test]
fn overrides_are_toml_or_else_text() {
    let folder = Folder::new(&[("a.toml", "seed = 1\n")]);
    let sets = ["seed = 2", "training.learning_rate=1e-3", "walls_m=[1.5, 2.5]", "training.loss=plain words"];
    let config = folder.read("a.toml", &sets).unwrap();
    let training = Training { learning_rate: 1e-3, epochs: 0, loss: "plain words".into() };
    assert_eq!(config, Config { seed: 2, walls_m: vec![1.5, 2.5], training });
    assert_eq!(folder.read("a.toml", &["training.loss=\"a=b\""]).unwrap().training.loss, "a=b");
    assert_eq!(parse_value("1\nseed = 3"), Value::String("1\nseed = 3".into()));
}

#[test]
fn an_override_that_is_none_is_refused() {
    let folder = Folder::new(&[("a.toml", "seed = 1\n")]);
    assert_eq!(folder.refused("a.toml", &["seed"]), "`--set seed` is no setting");
    assert_eq!(folder.refused("a.toml", &["training..epochs=1"]), "`--set training..epochs=1` is no setting");
    assert_eq!(folder.refused("a.toml", &["seed.x=1"]), "`seed` is 1, expected a table, as --set seed.x=1 has it");
}

#[test]
fn a_number_that_nothing_can_have_is_refused_with_its_key_and_file() {
    let folder = Folder::new(&[
        ("a.toml", "walls_m = [1.0, nan]\n"),
        ("b.toml", "extends = \"c.toml\"\n[training]\nepochs = 3\n"),
        ("c.toml", "[training]\nlearning_rate = 1e300\n"),
        ("d.toml", "seed = 9223372036854775807\n[training]\nepochs = 9223372036854775807\n"),
    ]);
    assert_eq!(folder.refused("a.toml", &[]), "a.toml: `walls_m.1` is NaN, expected a finite number");
    let largest = "at most 3.403e38";
    assert_eq!(folder.refused("b.toml", &[]), format!("c.toml: `training.learning_rate` is 1e300, expected {largest}"));
    let counted = "is 9223372036854775807, expected a whole number of at most 2147483648";
    assert_eq!(folder.refused("d.toml", &[]), format!("d.toml: `training.epochs` {counted}"));
    // Whoever set it is not a file.
    let set = ["training.learning_rate=0.1", "training.epochs=3", "walls_m=[1e300]"];
    assert_eq!(folder.refused("d.toml", &set), "`walls_m.0` is 1e300, expected at most 1.000e5 metres");
    // Seeds may be anything.
    assert_eq!(folder.read("d.toml", &["training.epochs=3"]).unwrap().seed, i64::MAX as u64);
}

#[test]
fn a_path_of_a_set_is_from_where_it_was_typed_and_one_of_a_file_from_its_folder() {
    let placed = |set: &str| {
        let mut path = PathBuf::from("runs/capture");
        place_path(&mut path, "data.recordings", Path::new("configs"), &[set.to_string()]).unwrap();
        path
    };
    assert_eq!(placed("training.epochs=3"), Path::new("configs/runs/capture"));
    assert_eq!(placed("data.recordings_m=3"), Path::new("configs/runs/capture"));
    let here = std::env::current_dir().unwrap().join("runs/capture");
    assert_eq!(placed("data.recordings=[\"runs/capture\"]"), here);
    assert_eq!(placed("data={recordings=[\"runs/capture\"]}"), here);
}
