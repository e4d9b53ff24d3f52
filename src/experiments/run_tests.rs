use super::*;
use crate::experiments::{ReproduceConfig, plan::plan, report, results::collect};
use crate::person::actions::Action;
use crate::recorder::{RecorderConfig, record_to};

/// Two people doing two things, four small frames each.
fn site(folder: &Path) {
    for subject in ["s1", "s4"] {
        for action in [Action::Lunge, Action::WalkBackForthArmswing] {
            let mut config = RecorderConfig { seed: 3, frames: Some(4), ..RecorderConfig::default() };
            (config.person.subject, config.person.action) = (subject.into(), action);
            let name = format!("{subject}_{}_1", action.name());
            record_to(&config, Path::new("."), &folder.join(name), &mut |_, _| {}).unwrap();
        }
    }
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
    let config: ReproduceConfig = toml::from_str(&text).unwrap();
    config.check().unwrap();
    let out = folder.path().join("out");
    let plan = plan(&config, &out).unwrap();
    let store = Store::open(&out, "flex").unwrap();
    let once = || {
        let mut worked = vec![];
        let records = run(&plan, &store, &[Device::flex()], &mut |event| {
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

    let lost = plan.stages.iter().find(|stage| stage.key.name == "simulate/ours/s4_lunge_1").unwrap();
    let sample = |()| std::fs::read(store.folder(&lost.key).join("recording/if.npy")).unwrap();
    let before = sample(());
    std::fs::remove_dir_all(store.folder(&lost.key)).unwrap();
    assert_eq!(once().0, ["simulate/ours/s4_lunge_1"]);
    assert!(sample(()) == before, "the same samples");
}

/// That a training breaks is what the stability is asked for: its stage ends all the same, and says where.
#[test]
fn a_training_that_breaks_is_a_result() {
    let folder = tempfile::tempdir().unwrap();
    let recordings = folder.path().join("measured");
    site(&recordings);
    // So large a step takes every weight out of a float's range.
    let text = format!("site = {recordings:?}\n{CONFIG}\n    learning_rate = 1e38");
    let config: ReproduceConfig = toml::from_str(&text).unwrap();
    config.check().unwrap();
    let out = folder.path().join("out");
    let plan = plan(&config, &out).unwrap();
    let store = Store::open(&out, "flex").unwrap();
    let wanted = plan.needed(&["stability".into()]).unwrap();
    assert_eq!(run_some(&plan, &wanted, &store, &[Device::flex()], &mut |_| {}).unwrap().len(), 2);
    for &stage in &wanted {
        let path = store.folder(&plan.stages[stage].key).join("stability.json");
        let found: crate::experiments::steps::Stability = crate::experiments::steps::read_json(path).unwrap();
        assert!(found.broke.is_some() && found.steps < 4, "{found:?}");
    }
}
