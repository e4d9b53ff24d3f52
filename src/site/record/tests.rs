use super::*;
use crate::person::actions::Action;
use crate::radar::Radar;
use crate::recorder::{RadarChoice, Recorder, RecorderConfig, Returns};
use crate::site::sequences;

/// Two subjects, two actions, two frames of a tiny radar.
fn tiny() -> SiteConfig {
    let mut config = SiteConfig {
        subjects: vec!["s1".into(), "s2".into()],
        unseen: vec!["s2".into()],
        again: vec!["s2".into()],
        actions: vec![Action::ArmSwing, Action::WalkClockwise],
        ..SiteConfig::default()
    };
    config.record.radar = RadarChoice::Full(Box::new(Radar::small(2)));
    config.record.surface.returns = Returns::Vertices;
    config
}

fn make(config: &SiteConfig, out: &Path, shard: Shard) -> Result<Site> {
    record(config, Path::new(""), out, shard, &mut |_, _, _| {})
}

fn samples(out: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found = Vec::new();
    for take in ["recordings", "again"] {
        for entry in fs::read_dir(out.join(take)).unwrap() {
            let path = entry.unwrap().path();
            found.push((format!("{take}/{}", path.file_name().unwrap().display()), fs::read(path.join("if.npy")).unwrap()));
        }
    }
    found.sort();
    found
}

#[test]
fn shards_make_the_whole_and_what_is_there_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, parts) = (folder.path().join("whole"), folder.path().join("parts"));
    let config = tiny();
    assert_eq!(make(&config, &whole, Shard::ALL).unwrap(), Site { sequences: 4, of: 4, kept: 0, recorded: 6 });
    for number in 1..=2 {
        make(&config, &parts, Shard { number, of: 2 }).unwrap();
    }
    assert_eq!(samples(&whole), samples(&parts));
    // Killed before the last one.
    fs::remove_dir_all(parts.join("recordings/s1_arm_swing_1")).unwrap();
    assert_eq!(make(&config, &parts, Shard::ALL).unwrap(), Site { sequences: 4, of: 4, kept: 5, recorded: 1 });
    assert_eq!(samples(&whole), samples(&parts));
    let labels = Recording::open(whole.join("recordings/s2_walk_clockwise_1")).unwrap().labels;
    let wanted = [("action", "walk_clockwise"), ("repetition", "1"), ("subject", "s2")];
    assert_eq!(labels, wanted.map(|(key, value)| (key.to_string(), value.to_string())).into());
    let read: SiteConfig = crate::data::read_toml(whole.join("site.toml")).unwrap();
    assert_eq!(read, config);
}

#[test]
fn a_second_take_differs_by_noise_alone_and_repetitions_by_their_style() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = SiteConfig { actions: vec![Action::ArmSwing], repetitions: 2, ..tiny() };
    make(&config, folder.path(), Shard::ALL).unwrap();
    let frame = |path: &str| Recording::open(folder.path().join(path)).unwrap().frame(1).unwrap().re;
    let (first, second) = (frame("recordings/s2_arm_swing_1"), frame("again/s2_arm_swing_1"));
    let power = |values: &[f32]| values.iter().map(|value| value * value).sum::<f32>();
    let difference: Vec<f32> = first.iter().zip(&second).map(|(a, b)| a - b).collect();
    assert!(power(&difference) > 0.0);
    let noise = sequences(&config, Path::new("")).unwrap()[0].recorder.receiver.level.unwrap().noise_codes;
    // Two independent noises, each rounded to codes.
    let expected = 2.0 * noise * noise + 2.0 / 12.0;
    let found = f64::from(power(&difference)) / difference.len() as f64;
    assert!((found / expected - 1.0).abs() < 0.2, "{found} {expected}");
    config.record.receiver.noise = false;
    let still = folder.path().join("still");
    make(&config, &still, Shard::ALL).unwrap();
    let read = |path: &str| fs::read(still.join(path).join("if.npy")).unwrap();
    assert_eq!(read("recordings/s2_arm_swing_1"), read("again/s2_arm_swing_1"));
    assert_ne!(read("recordings/s2_arm_swing_1"), read("recordings/s2_arm_swing_2"));
}

#[test]
fn another_draw_of_the_mesh_moves_the_body_and_not_the_receivers_gain() {
    let mut config = tiny();
    config.record.mesh_error_m = 2e-3;
    let first = |config: &SiteConfig| sequences(config, Path::new("")).unwrap()[0].recorder.clone();
    let (before, redrawn) = (first(&config), {
        config.record.redraw = 1;
        first(&config)
    });
    assert_eq!(before.receiver, redrawn.receiver);
    let field = |settings: &RecorderConfig| Recorder::new(&settings.world(Path::new("")).unwrap()).unwrap().field(0).unwrap();
    assert_ne!(field(&before), field(&redrawn));
}

#[test]
fn another_site_in_the_same_folder_is_refused_and_a_larger_one_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let config = SiteConfig { again: vec![], actions: vec![Action::ArmSwing], ..tiny() };
    make(&config, folder.path(), Shard::ALL).unwrap();
    let louder = {
        let mut louder = config.clone();
        louder.record.walls.clutter_gamma = 0.1;
        louder
    };
    let error = make(&louder, folder.path(), Shard::ALL).unwrap_err();
    assert!(error.to_string().contains("clutter_gamma") || error.to_string().contains("settings"), "{error}");
    assert!(error.hint().unwrap().contains("another folder"));
    let larger = SiteConfig { repetitions: 2, ..config.clone() };
    assert_eq!(make(&larger, folder.path(), Shard::ALL).unwrap(), Site { sequences: 4, of: 4, kept: 2, recorded: 2 });
    // A label that is not the folder's.
    let file = folder.path().join("recordings/s1_arm_swing_1/recording.toml");
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, text.replace("subject = \"s1\"", "subject = \"s3\"")).unwrap();
    let message = make(&config, folder.path(), Shard::ALL).unwrap_err().to_string();
    assert!(message.contains("labels"), "{message}");
}

#[test]
fn a_person_outside_the_room_is_refused_before_anything_is_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("site");
    let mut config = tiny();
    // The wall where they stand.
    config.style.distance_m = [3.2, 3.2];
    config.record.room.front_m = Some(3.2);
    let message = make(&config, &out, Shard::ALL).unwrap_err().to_string();
    assert!(message.contains("style of s") && message.contains("front"), "{message}");
    config = tiny();
    config.style.distance_m = [0.2, 0.2];
    config.record.room.back_m = None;
    let message = make(&config, &out, Shard::ALL).unwrap_err().to_string();
    assert!(message.contains("radar"), "{message}");
    config = tiny();
    config.subjects[0] = "nobody".into();
    assert!(make(&config, &out, Shard::ALL).unwrap_err().to_string().contains("nobody"));
    assert!(!out.exists());
}
