use super::*;
use crate::experiments::config::tests::on_the_papers_side;
use crate::experiments::config::{SecondSceneConfig, StabilityConfig};
use crate::experiments::figures::Panel;

const SUBJECTS: [&str; 3] = ["s1", "s2", "s3"];
const ACTIONS: [&str; 2] = ["lunge", "walk_back_forth_armswing"];

/// Recordings that a user made.
fn place(name: &str) -> Place {
    let take = |subject: &str, action: &str| Take {
        name: format!("{subject}_{action}"),
        subject: subject.into(),
        action: action.into(),
    };
    let takes: Vec<Take> = SUBJECTS.iter().flat_map(|subject| ACTIONS.map(|action| take(subject, action))).collect();
    let recordings = Path::new("/measured").join(name);
    let again = Again { folder: "/again".into(), subjects: vec!["s1".into(), "s2".into()] };
    let board = Board { radar: crate::radar::Radar::small(24), room: None };
    Place { stage: None, key: Key::new(name, &takes, &[]), recordings, again, other_mesh: None, takes, board }
}

fn config() -> ReproduceConfig {
    on_the_papers_side("site = \"unused\"\nsplit.unseen = \"s2\"\n[adaptation]\nframes = [0, 2]\nsteps = 10")
}

fn planned(config: &ReproduceConfig) -> Plan {
    let mut planner =
        Planner { config, root: Path::new("/out"), weights: None, sequences: &site::sequences, plan: Plan::default() };
    planner.all(&place("site"), Some(&place("second_room"))).unwrap();
    planner.plan
}

fn method(plan: &Plan, wanted: Method) -> &MethodStages {
    &draws(plan, wanted)[0]
}

fn draws(plan: &Plan, wanted: Method) -> &[MethodStages] {
    &plan.methods.iter().find(|(method, _)| *method == wanted).unwrap().1
}

#[test]
fn every_stage_comes_after_those_that_it_reads() {
    let plan = planned(&config());
    for (index, stage) in plan.stages.iter().enumerate() {
        assert!(stage.parents.iter().all(|&parent| parent < index), "{}", stage.key.name);
    }
    let folders: std::collections::BTreeSet<String> = plan.stages.iter().map(|stage| stage.key.folder()).collect();
    assert_eq!(folders.len(), plan.stages.len());
}

/// No simulator learns from anybody but the training subject, and no classifier from what it is tested on.
#[test]
fn nothing_is_learned_from_what_it_is_tested_on() {
    let plan = planned(&config());
    let (mut trainings, mut classifiers) = (0, 0);
    for stage in &plan.stages {
        match &stage.task {
            Task::Train { recordings, names, .. } => {
                trainings += 1;
                assert!(names.iter().all(|name| name.starts_with("s1_")) && recordings.len() == ACTIONS.len());
            }
            Task::Calibrate { names, .. } | Task::NoiseLevel { names, .. } => {
                assert!(names.iter().all(|name| name.starts_with("s1_")))
            }
            Task::Compare { name, held_out_fraction, .. } => {
                assert_eq!(held_out_fraction.is_some(), name.starts_with("s1_"), "{name}");
            }
            Task::Recognise { train, test, .. } => {
                classifiers += 1;
                assert!(test.iter().all(|folder| folder.starts_with("/measured") && !train.contains(folder)));
                assert!(test.iter().all(|folder| folder.to_string_lossy().contains("s2_")) && test.len() == ACTIONS.len());
                let of_unseen = train.iter().filter(|folder| folder.to_string_lossy().contains("s2_")).count();
                let same_motions = stage.key.name.starts_with("recognise/same_motions/");
                assert_eq!(of_unseen, if same_motions { ACTIONS.len() } else { 0 }, "{}", stage.key.name);
                assert_eq!(train.len(), if same_motions { 2 } else { 4 }, "{}", stage.key.name);
            }
            _ => {}
        }
    }
    // Thirteen variants less the one that shares its training, and the second room's two; five baselines under two kinds of noise.
    assert_eq!((trainings, classifiers), (12 + 2, 2 * (2 * 5 + 13 + 1)));
}

/// Each draw has trainings, simulations, scores and classifiers of its own; what does not learn is there once.
#[test]
fn what_learns_is_drawn_as_often_as_asked_for() {
    let once = planned(&config());
    let plan = planned(&ReproduceConfig { seeds: 3, ..config() });
    assert!(once.stages.iter().all(|stage| plan.stages.iter().any(|other| other.key == stage.key)), "the first draw stays");
    let ours = draws(&plan, Method::Variant(Variant::Ours));
    assert_eq!((ours.len(), draws(&plan, Method::Again).len()), (3, 1));
    assert_eq!(draws(&plan, Method::Baseline(crate::experiments::config::BaselineName::TwoBounce)).len(), 1);
    assert_eq!(draws(&plan, Method::Variant(Variant::GcnAtInference))[2].train, ours[2].train);
    let seeds = |stages: &MethodStages| {
        let task = |stage: usize| &plan.stages[stage].task;
        let (train, simulate) = (task(stages.train.unwrap()), task(stages.simulate[0]));
        let learned = task(stages.recognition[&Protocol::SameMotions]);
        let Task::Train { seed: trained, .. } = train else { unreachable!() };
        let Task::Simulate { seed: simulated, checkpoint, .. } = simulate else { unreachable!() };
        let Task::Recognise { train, recognition, .. } = learned else { unreachable!() };
        assert!(checkpoint.starts_with(Path::new("/out/stages").join(plan.stages[stages.train.unwrap()].key.folder())));
        let of_draw = |folder: &PathBuf| {
            stages.simulate.iter().any(|&s| folder.starts_with(stage_folder(Path::new("/out"), &plan.stages[s].key)))
        };
        assert!(train.iter().all(of_draw));
        [*trained, *simulated, recognition.seed]
    };
    assert_eq!(ours.iter().map(seeds).collect::<Vec<_>>(), [[0, 0, 1], [1, 1, 2], [2, 2, 3]]);
    for stages in ours {
        assert_eq!((&stages.cross_takes, stages.intra.len()), (&ours[0].cross_takes, 2));
    }
}

#[test]
fn few_recordings_are_others_and_more_of_them_hold_the_fewer() {
    let few = |recordings: Vec<usize>| {
        let few_measured = Some(crate::experiments::few::FewConfig { recordings, simulated_by: Variant::Ours });
        ReproduceConfig { few_measured, seeds: 2, ..config() }
    };
    let plan = planned(&few(vec![1, 2]));
    assert_eq!(plan.few.len(), 2 * Material::ALL.len());
    let mut known: BTreeMap<(Material, usize), Vec<String>> = BTreeMap::new();
    for FewStages { recordings: count, material, stages } in &plan.few {
        assert_eq!(stages.len(), 2);
        for (draw, &stage) in stages.iter().enumerate() {
            let Task::Recognise { train, train_names, test, recognition, .. } = &plan.stages[stage].task else { unreachable!() };
            let all = SUBJECTS.len() * ACTIONS.len() - ACTIONS.len();
            let of_few = count * ACTIONS.len();
            let learned = if *material == Material::Both { of_few + all } else { of_few };
            assert_eq!((train.len(), train_names.len()), (learned, learned));
            assert!(train_names.iter().all(|name| !name.starts_with("s2_")) && test.len() == ACTIONS.len());
            assert_eq!(recognition.epochs, (config().recognition.epochs * all).div_ceil(learned));
            let measured = train.iter().filter(|folder| folder.starts_with("/measured")).count();
            assert_eq!(measured, if *material == Material::Simulated { 0 } else { of_few });
            let fewer = known.insert((*material, draw), train_names.clone()).unwrap_or_default();
            assert!(fewer.iter().all(|name| train_names.contains(name)), "{fewer:?} {train_names:?}");
        }
    }
    let sorted = |material| {
        let mut names = known[&(material, 0)].clone();
        names.sort();
        names
    };
    assert_eq!(sorted(Material::Measured), sorted(Material::Simulated));
    let mut planner = Planner {
        config: &few(vec![3]),
        root: Path::new("/out"),
        weights: None,
        sequences: &site::sequences,
        plan: Plan::default(),
    };
    let error = planner.all(&place("site"), None).unwrap_err().to_string();
    assert!(error.contains("`few_measured.recordings` is 3") && error.contains("at most 2"), "{error}");
}

/// Who teaches no classifier is simulated for scores alone, on the frames that are scored.
#[test]
fn simulations_that_nobody_learns_from_are_not_kept() {
    let few_measured = Some(crate::experiments::few::FewConfig { recordings: vec![1], simulated_by: Variant::Physical });
    let config = ReproduceConfig { protocols: vec![Protocol::SameMotions], few_measured, seeds: 2, ..config() };
    let plan = planned(&config);
    let named = |beginning: &str| -> Vec<&Task> {
        plan.stages.iter().filter(|stage| stage.key.name.starts_with(beginning)).map(|stage| &stage.task).collect()
    };
    for (method, kept) in [("ours", 2), ("physical", 6), ("mmgpe", 2), ("physical/draw_2", 6)] {
        assert_eq!(named(&format!("simulate/{method}/s")).len(), kept, "{method}");
        let scored = named(&format!("compare/{method}/s1"));
        assert_eq!(scored.len(), 2, "{method}");
        let right = |task: &&Task| match task {
            Task::HeldOut { fraction, .. } => kept == 2 && *fraction == config.training.validation_fraction,
            Task::Compare { held_out_fraction, .. } => kept == 6 && held_out_fraction.is_some(),
            _ => false,
        };
        assert!(scored.iter().all(right), "{method}");
    }
}

#[test]
fn without_protocols_no_classifier_learns() {
    let config = ReproduceConfig { protocols: vec![], ..config() };
    let mut planner =
        Planner { config: &config, root: Path::new("/out"), weights: None, sequences: &site::sequences, plan: Plan::default() };
    planner.all(&Place { other_mesh: Some(0), ..place("site") }, None).unwrap();
    assert!(!planner.plan.stages.iter().any(|stage| matches!(stage.task, Task::Recognise { .. })));
}

#[test]
fn the_graph_at_inference_is_ours_used_differently() {
    let plan = planned(&config());
    let (ours, graph) = (method(&plan, Method::Variant(Variant::Ours)), method(&plan, Method::Variant(Variant::GcnAtInference)));
    assert_eq!(ours.train, graph.train);
    assert!(ours.simulate.iter().zip(&graph.simulate).all(|(a, b)| a != b));
    assert_eq!((ours.intra.len(), ours.cross.len()), (2, 2));
    assert_eq!(ours.cross_actions, ACTIONS);
}

#[test]
fn a_changed_setting_remakes_what_depends_on_it_and_nothing_else() {
    let names = |change: fn(&mut ReproduceConfig)| -> Vec<String> {
        let before = planned(&config());
        let mut changed = config();
        change(&mut changed);
        let known = |key: &Key| before.stages.iter().any(|stage| stage.key == *key);
        planned(&changed).stages.into_iter().filter(|stage| !known(&stage.key)).map(|stage| stage.key.name).collect()
    };
    assert!(names(|_| {}).is_empty());
    let learning = names(|config| config.training.epochs = 7);
    assert!(learning.contains(&"train/coupled".into()) && learning.contains(&"compare/two-bounce/s2_lunge".into()));
    assert!(learning.contains(&"recognise/same_motions/ours".into()));
    assert!(!learning.iter().any(|name| name.starts_with("calibrate") || name.contains("/mmgpe")));
    let classifier = names(|config| config.comparison.metrics.span_db = 60.0);
    assert!(!classifier.is_empty() && classifier.iter().all(|name| name.starts_with("compare/")));
    let dense = names(|config| config.dense_surface.sampling = crate::body::Sampling::Subdivided);
    assert!(!dense.is_empty() && dense.iter().all(|name| name.contains("dense_surface") || name.contains("physical")));
}

#[test]
fn adaptations_start_from_ours_and_take_as_many_steps_whatever_the_frames() {
    let plan = planned(&config());
    let train = |wanted| &plan.stages[method(&plan, wanted).train.unwrap()];
    let Task::Train { training, start_from, .. } = &train(Method::Adapted(2)).task else { unreachable!() };
    assert_eq!((training.frames, training.epochs, training.repeats), (Some(2), 1, 5));
    assert!(start_from.as_ref().unwrap().to_string_lossy().contains("train/ours-"));
    let Task::Train { start_from, .. } = &train(Method::FromScratch(2)).task else { unreachable!() };
    assert_eq!(*start_from, None);
    // Untouched, it is ours.
    assert_eq!(train(Method::Adapted(0)).key, train(Method::Variant(Variant::Ours)).key);
    assert!(!plan.methods.iter().any(|(method, _)| *method == Method::FromScratch(0)));
}

#[test]
fn a_second_room_without_the_training_subject_is_refused() {
    let config = config();
    let mut planner =
        Planner { config: &config, root: Path::new("/out"), weights: None, sequences: &site::sequences, plan: Plan::default() };
    let mut second = place("second_room");
    second.takes.retain(|take| take.subject != "s1");
    let error = planner.all(&place("site"), Some(&second)).unwrap_err().to_string();
    assert!(error.contains("`second_room`") && error.contains("recordings of s1"), "{error}");
}

/// A run that is started again must find what it did.
#[test]
fn takes_are_planned_in_the_order_in_which_they_are_found() {
    let config = SiteConfig::read(Path::new("configs/site_reproduce_smoke.toml"), &[]).unwrap();
    let names: Vec<String> = super::place::planned(site::sequences(&config, Path::new("configs")).unwrap())
        .into_iter()
        .map(|take| take.name)
        .collect();
    let mut sorted = names.clone();
    sorted.sort();
    assert!(names == sorted && names.len() == 12, "{names:?}");
}

#[test]
fn another_mesh_is_recorded_of_the_compared_subjects_only() {
    let config = config();
    let mut planner =
        Planner { config: &config, root: Path::new("/out"), weights: None, sequences: &site::sequences, plan: Plan::default() };
    let mut site = SiteConfig { unseen: vec!["s2".into()], again: vec!["s2".into()], ..SiteConfig::default() };
    assert_eq!(planner.other_mesh(FIRST, &site, Path::new("")), None);
    site.record.mesh_error_m = 2e-3;
    assert_eq!(planner.other_mesh("second_room", &site, Path::new("")), None);
    let stage = planner.other_mesh(FIRST, &site, Path::new("")).unwrap();
    let Task::Site { config: other, .. } = &planner.plan.stages[stage].task else { panic!("a site") };
    assert_eq!((&other.subjects[..], &other.again[..], other.record.redraw), (&["s1".to_string(), "s2".into()][..], &[][..], 1));
    other.check().unwrap();
}

/// The second scene as recordings of `s1`.
fn scene() -> Place {
    let mut scene = place("second_scene");
    let take = |action: &str| Take { name: format!("s1_{action}"), subject: "s1".into(), action: action.into() };
    scene.takes = ["bow", "clap", "hand_wave", "jab"].map(take).to_vec();
    scene
}

fn scene_config() -> ReproduceConfig {
    let names = |names: [&str; 2]| names.map(String::from).to_vec();
    let second_scene =
        SecondSceneConfig { site: "unused".into(), training: names(["bow", "hand_wave"]), evaluated: names(["clap", "jab"]) };
    ReproduceConfig { second_scene: Some(second_scene), stability: Some(StabilityConfig::default()), ..config() }
}

fn planned_further(config: &ReproduceConfig) -> Result<Plan> {
    let mut planner =
        Planner { config, root: Path::new("/out"), weights: None, sequences: &site::sequences, plan: Plan::default() };
    let first = place("site");
    let trained = planner.all(&first, None)?;
    planner.beyond(&first, Some(&scene()), &trained[&Variant::Ours][0])?;
    Ok(planner.plan)
}

#[test]
fn the_second_scene_is_learned_from_some_actions_and_scored_on_others() {
    let plan = planned_further(&scene_config()).unwrap();
    let ours = method(&plan, Method::SceneOurs);
    let Task::Train { names, start_from, .. } = &plan.stages[ours.train.unwrap()].task else { unreachable!() };
    assert_eq!((&names[..], start_from), (&["s1_bow".to_string(), "s1_hand_wave".into()][..], &None));
    for wanted in [Method::SceneOurs, Method::SceneUnadapted, Method::SceneAgain] {
        let stages = method(&plan, wanted);
        assert_eq!(stages.cross_takes, ["s1_clap", "s1_jab"]);
        let Task::Recognise { train, test, .. } = &plan.stages[stages.recognition[&Protocol::SameMotions]].task else {
            unreachable!()
        };
        assert!(train.len() == 2 && test.len() == 2 && test.iter().all(|folder| folder.starts_with("/measured/second_scene")));
        assert!(train.iter().all(|folder| !test.contains(folder)));
        for &stage in &stages.cross {
            let Task::Compare { held_out_fraction, .. } = &plan.stages[stage].task else { unreachable!() };
            assert_eq!(*held_out_fraction, None);
        }
    }
    // Its simulators are not the first site's.
    assert_ne!(ours.train, method(&plan, Method::Variant(Variant::Ours)).train);
    assert_eq!(method(&plan, Method::SceneUnadapted).train, method(&plan, Method::Variant(Variant::Ours)).train);
    let mut config = scene_config();
    config.second_scene.as_mut().unwrap().evaluated.push("lunge".into());
    let error = planned_further(&config).unwrap_err().to_string();
    assert!(error.contains("`second_scene.evaluated` is lunge"), "{error}");
}

#[test]
fn the_long_trainings_differ_by_the_graph_alone() {
    let plan = planned_further(&scene_config()).unwrap();
    let simulators: Vec<crate::simulator::SimulatorConfig> = plan
        .stability
        .iter()
        .map(|&(_, stage)| match &plan.stages[stage].task {
            Task::Stability { simulator, training, .. } => {
                assert_eq!(training.patience_epochs, 0);
                (**simulator).clone()
            }
            _ => unreachable!(),
        })
        .collect();
    let [with, without] = simulators.as_slice() else { panic!("two") };
    assert!(with.graph.used > 0.0 && without.graph.used == 0.0);
    let mut same = without.clone();
    same.graph.used = with.graph.used;
    assert_eq!(same, *with);
}

#[test]
fn an_additional_subject_is_simulated_by_the_full_simulator_alone() {
    let mut config = config();
    config.split.additional = Some("s3".into());
    config.protocols = vec![Protocol::SameMotions];
    let mut planner =
        Planner { config: &config, root: Path::new("/out"), weights: None, sequences: &site::sequences, plan: Plan::default() };
    planner.all(&place("site"), None).unwrap();
    let plan = planner.plan;
    let of_additional: Vec<&str> =
        plan.stages.iter().map(|stage| stage.key.name.as_str()).filter(|name| name.contains("s3_")).collect();
    assert_eq!(
        of_additional,
        [
            "simulate/ours/s3_lunge",
            "compare/ours/s3_lunge",
            "simulate/ours/s3_walk_back_forth_armswing",
            "compare/ours/s3_walk_back_forth_armswing",
        ]
    );
    let ours = method(&plan, Method::Variant(Variant::Ours));
    assert_eq!((ours.additional.len(), ours.cross.len()), (2, 2));
    let Task::Recognise { train, names, .. } = &plan.stages[ours.additional_recognition.unwrap()].task else { unreachable!() };
    assert!(train.len() == 2 && train.iter().all(|folder| folder.to_string_lossy().contains("simulate/ours/s3_")));
    assert_eq!(*names, ["s3_lunge", "s3_walk_back_forth_armswing"]);
    // What is learned and scored of the others is as without it.
    assert!(ours.cross_takes.iter().all(|name| name.starts_with("s2_")));
}

#[test]
fn figures_show_what_was_simulated_before() {
    let plan = planned_further(&scene_config()).unwrap();
    let names: Vec<&str> = plan.figures.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["decomposition", "noise", "loss_scale", "graph", "found_effects"]);
    for (name, stage) in &plan.figures {
        let stage = &plan.stages[*stage];
        let Task::Figure(task) = &stage.task else { unreachable!() };
        assert_eq!(task.measured.len(), if name == "decomposition" { ACTIONS.len() } else { 1 }, "{name}");
        let simulated = task.columns.iter().filter(|column| matches!(column.panel, Panel::Simulated(_))).count();
        // Ours, and a stage for each column that shows recordings.
        assert_eq!(stage.parents.len(), 1 + simulated, "{name}");
    }
    // Without the variants that a figure compares, there is none.
    let plan = planned_further(&ReproduceConfig { variants: vec![Variant::Ours], ..scene_config() }).unwrap();
    assert_eq!(plan.figures.len(), 1);
}

#[test]
fn some_stages_bring_along_what_they_need_and_nothing_else() {
    let plan = planned_further(&scene_config()).unwrap();
    let needed = plan.needed(&["figure/noise".into()]).unwrap();
    let names: Vec<&str> = needed.iter().map(|&stage| plan.stages[stage].key.name.as_str()).collect();
    assert_eq!(names.iter().filter(|name| name.starts_with("train/")).count(), 3, "{names:?}");
    assert_eq!(names.iter().filter(|name| name.starts_with("simulate/")).count(), 3, "{names:?}");
    assert!(names.last() == Some(&"figure/noise") && names.len() == 7, "{names:?}");
    assert!(plan.needed(&["nothing".into()]).unwrap_err().to_string().contains("--stages nothing"));
}
