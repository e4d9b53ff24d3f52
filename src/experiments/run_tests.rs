use std::collections::BTreeMap;
use std::path::PathBuf;

use super::*;
use crate::experiments::{ReproduceConfig, plan::plan, report, results::collect, with_jobs};
use crate::person::actions::Action;
use crate::recorder::{RecorderConfig, record_to};

/// Two people doing two things, four small frames each.
fn site(folder: &Path) {
    for subject in ["s1", "s4"] {
        for action in [Action::Lunge, Action::WalkBackForthArmswing] {
            let mut config = RecorderConfig { seed: 3, frames: Some(4), ..RecorderConfig::default() };
            (config.person.subject, config.person.action) = (subject.into(), action);
            config.surface.edge_m = 1.2e-2;
            let name = format!("{subject}_{}_1", action.name());
            record_to(&config, Path::new("."), &folder.join(name), &mut |_, _| {}).unwrap();
        }
    }
}

fn run(plan: &Plan, store: &Store, notify: &mut dyn FnMut(Event)) -> Result<Vec<Record>> {
    run_some(plan, &(0..plan.stages.len()).collect(), store, &[Device::flex()], notify)
}

const CONFIG: &str = "
    seed = 2
    variants = ['ours', 'gcn_at_inference']
    baselines = ['mmgpe', 'two-bounce']
    protocols = []
    [simulator.room]
    patches = 60
    [simulator.triplane]
    resolution = 8
    features = 2
    [simulator.decoders.network]
    hidden = [8]
    [training]
    epochs = 1
    [adaptation]
    frames = [0, 1]
    steps = 2
    [stability]
    frames = 2
    repeats = 1
    epochs = 2";

/// From recordings to tables; again, where nothing is left to do; and again with one stage lost.
#[test]
fn a_reproduction_is_done_once_and_what_is_lost_is_made_again_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let recordings = folder.path().join("measured");
    site(&recordings);
    let text = format!("site = {recordings:?}\nsecond_room = {recordings:?}\n{CONFIG}");
    let config: ReproduceConfig = crate::data::settings::read_text(&text).unwrap();
    config.check().unwrap();
    let out = folder.path().join("out");
    let plan = plan(&config, &out).unwrap();
    let store = Store::open(&out, "flex").unwrap();
    let once = || {
        let mut worked = vec![];
        let records = run(&plan, &store, &mut |event| {
            if let Event::Done { name, .. } = event {
                worked.push(name.to_string());
            }
        });
        let results = collect(&plan, &store, &records.unwrap()).unwrap();
        report::write(&out, &config, &results, "hybridsim reproduce x.toml").unwrap();
        (worked, results)
    };
    let (worked, results) = once();
    assert_eq!(worked.len(), plan.stages.len());
    let titles = std::fs::read_to_string(out.join("results.md")).unwrap();
    for title in ["HybridSim", "mmGPE-like", "HybridSim, GCN at inference", "HybridSim, adapted to 1 frames"] {
        assert!(titles.contains(&format!("| {title} |")), "{title}:\n{titles}");
    }
    for picture in ["adaptation", "decomposition", "stability_loss", "stability_gradient"] {
        assert!(out.join(format!("{picture}.png")).is_file(), "{picture}");
    }
    let csv = std::fs::read_to_string(out.join("stability.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 2 * 2, "{csv}");
    assert!(csv.lines().skip(1).all(|line| line.rsplit(',').next().unwrap().parse::<f64>().unwrap() > 0.0), "{csv}");
    let ours = results.methods.iter().find(|found| found.id == "ours").unwrap();
    let cross = ours.cross.as_ref().unwrap();
    assert_eq!((cross.sequences, cross.frames), (2, 8));
    // One of four frames of each recording was held out.
    assert_eq!(ours.intra.as_ref().unwrap().frames, 2);
    assert!(cross.global.as_ref().unwrap().psnr_db.mean.is_finite());

    assert!(once().0.is_empty());

    // The held-out frames, scored without being kept, have the scores that they have in a recording.
    let task = |name: &str| &plan.stages.iter().find(|stage| stage.key.name == name).unwrap().task;
    for name in ["compare/ours/s1_lunge_1", "compare/mmgpe/s1_lunge_1"] {
        let Task::HeldOut { simulation, fraction, comparison, .. } = task(name) else { panic!("{name}") };
        let (kept, mut bench) = (folder.path().join(name), Bench::new(&[Device::flex()]));
        std::fs::create_dir_all(&kept).unwrap();
        simulated(simulation, &mut bench, &mut |source| simulate::keep(source, &kept, &mut |_, _| {})).unwrap();
        compare(&recordings.join("s1_lunge_1"), &kept.join("recording"), Some(*fraction), comparison, &kept, &mut bench).unwrap();
        let scored = plan.stages.iter().find(|stage| stage.key.name == name).unwrap();
        let [scored, kept] = [&store.folder(&scored.key), &kept].map(|at| std::fs::read(at.join("scores.json")).unwrap());
        assert!(scored == kept, "{name}");
    }

    let lost = plan.stages.iter().find(|stage| stage.key.name == "simulate/ours/s4_lunge_1").unwrap();
    let sample = |()| std::fs::read(store.folder(&lost.key).join("recording/if.npy")).unwrap();
    let before = sample(());
    std::fs::remove_dir_all(store.folder(&lost.key)).unwrap();
    assert_eq!(once().0, ["simulate/ours/s4_lunge_1"]);
    assert!(sample(()) == before, "the same samples");
}

/// Every file below a folder but those that hold times; texts may name the folder.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let unnamed = |bytes| match String::from_utf8(bytes) {
        Ok(text) => text.replace(folder.to_str().unwrap(), "").into_bytes(),
        Err(binary) => binary.into_bytes(),
    };
    let (mut found, mut folders) = (BTreeMap::new(), vec![folder.to_path_buf()]);
    while let Some(at) = folders.pop() {
        for path in std::fs::read_dir(at).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
            } else if !path.ends_with("stage.json") && !path.ends_with("speed.json") {
                found.insert(path.strip_prefix(folder).unwrap().into(), unnamed(std::fs::read(&path).unwrap()));
            }
        }
    }
    found
}

/// One after the other, each as a process of its own would, and always the last of the plan that can be done; its site in pieces.
#[test]
fn stages_come_out_the_same_in_any_order() {
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("site.toml");
    let base = concat!(env!("CARGO_MANIFEST_DIR"), "/configs/site_smoke.toml");
    let small = "subjects = ['s1', 's4']\nunseen = ['s4']\nagain = ['s4']\nactions = ['lunge', 'arm_swing']\nrepetitions = 1\n\
        record.frames = 4\nrecord.surface.returns = 'vertices'\nrecord.walls.patch_m = 0.2\n[record.radar]\nsamples_per_chirp = 64\n\
        loops_per_frame = 16";
    std::fs::write(&site, format!("extends = {base:?}\n{small}")).unwrap();
    let text = format!("site = {site:?}\nother_mesh = false\n{}", CONFIG.split("[adaptation]").next().unwrap());
    let config: ReproduceConfig = crate::data::settings::read_text(&text).unwrap();
    config.check().unwrap();
    let [together, apart] = ["together", "apart"].map(|name| folder.path().join(name));
    let whole = plan(&config, &together).unwrap();
    run(&whole, &Store::open(&together, "flex").unwrap(), &mut |_| {}).unwrap();

    let plan = crate::experiments::plan_again(&config, &apart).unwrap();
    let do_one = |stage: usize, pieces: Shard| {
        let name = format!("{}-{}", plan.stages[stage].key.hash, pieces.number);
        let store = Store::open_for(&apart, "flex", &name).unwrap();
        run_one(&plan, stage, pieces, &store, &[Device::flex()], &mut |_| {})
    };
    let last = plan.stages.len() - 1;
    assert!(do_one(last, Shard::ALL).unwrap_err().to_string().contains("which is not done"));
    assert_eq!(plan.stages[0].pieces().unwrap(), 4);
    for number in [3, 1, 2] {
        do_one(0, Shard { number, of: 4 }).unwrap();
    }
    let mut open: Vec<usize> = (0..plan.stages.len()).collect();
    while !open.is_empty() {
        let ready = |&stage: &usize| plan.stages[stage].parents.iter().all(|parent| !open.contains(parent));
        let next = open.iter().rposition(ready).unwrap();
        do_one(open.remove(next), Shard::ALL).unwrap();
    }
    assert!(do_one(1, Shard { number: 1, of: 2 }).unwrap_err().to_string().contains("no pieces"));

    // And by three workers of one process.
    let beside = folder.path().join("beside");
    let plan = crate::experiments::plan(&config, &beside).unwrap();
    let (store, all) = (Store::open(&beside, "flex").unwrap(), (0..plan.stages.len()).collect());
    let mut worked = vec![];
    let mut notify = |event: Event| worked.extend(matches!(event, Event::Done { .. }).then_some(()));
    let records = with_jobs(&plan, &all, &store, &[Device::flex()], 3, &mut notify).unwrap();
    assert_eq!((records.len(), worked.len()), (plan.stages.len(), plan.stages.len()));
    assert!(records.iter().zip(&plan.stages).all(|(record, stage)| record.name == stage.key.name));
    drop(store);

    let one = files(&together);
    for other in [files(&apart), files(&beside)] {
        assert_eq!(one.keys().collect::<Vec<_>>(), other.keys().collect::<Vec<_>>());
        let different: Vec<_> = one.keys().filter(|name| one[*name] != other[*name]).collect();
        assert!(different.is_empty(), "{different:?}");
    }
}

/// A worker that fails ends all of them with its error.
#[test]
fn side_by_side_an_error_is_returned_and_nobody_waits_for_what_never_comes() {
    let folder = tempfile::tempdir().unwrap();
    let recordings = folder.path().join("measured");
    site(&recordings);
    let config: ReproduceConfig = crate::data::settings::read_text(&format!("site = {recordings:?}\n{CONFIG}")).unwrap();
    let out = folder.path().join("out");
    let (plan, store) = (plan(&config, &out).unwrap(), Store::open(&out, "flex").unwrap());
    std::fs::remove_file(recordings.join("s1_lunge_1/if.npy")).unwrap();
    let wanted = plan.needed(&["compare".into()]).unwrap();
    let error = with_jobs(&plan, &wanted, &store, &[Device::flex()], 2, &mut |_| {}).unwrap_err().to_string();
    assert!(error.contains("s1_lunge_1") && error.contains("if.npy"), "{error}");
}

/// That a training breaks is what the stability is asked for: its stage ends all the same, and says where.
#[test]
fn a_training_that_breaks_is_a_result() {
    let folder = tempfile::tempdir().unwrap();
    let recordings = folder.path().join("measured");
    site(&recordings);
    // So large a step takes every weight out of a float's range.
    let text = format!("site = {recordings:?}\n{CONFIG}\n    learning_rate = 1e38");
    let config: ReproduceConfig = crate::data::settings::read_text(&text).unwrap();
    config.check().unwrap();
    let out = folder.path().join("out");
    let plan = plan(&config, &out).unwrap();
    let store = Store::open(&out, "flex").unwrap();
    let wanted = plan.needed(&["stability".into()]).unwrap();
    assert_eq!(run_some(&plan, &wanted, &store, &[Device::flex()], &mut |_| {}).unwrap().len(), 2);
    for &stage in &wanted {
        let path = store.folder(&plan.stages[stage].key).join("stability.json");
        let found: crate::experiments::steps::Stability = crate::data::files::read_json(path).unwrap();
        assert!(found.broke.is_some() && found.steps < 4, "{found:?}");
    }
}
