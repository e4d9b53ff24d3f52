use super::*;

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
    toml::from_str("site = \"unused\"\nsplit.unseen = \"s2\"\n[adaptation]\nframes = [0, 2]\nsteps = 10").unwrap()
}

fn planned(config: &ReproduceConfig) -> Plan {
    let mut planner = Planner { config, root: Path::new("/out"), weights: None, plan: Plan::default() };
    planner.all(&place("site"), Some(&place("second_room"))).unwrap();
    planner.plan
}

fn method(plan: &Plan, wanted: Method) -> &MethodStages {
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
    // Ten variants less the one that shares its training, and the second room's two; five baselines under two kinds of noise.
    assert_eq!((trainings, classifiers), (9 + 2, 2 * (2 * 5 + 10 + 1)));
}

#[test]
fn without_protocols_no_classifier_learns() {
    let config = ReproduceConfig { protocols: vec![], ..config() };
    let mut planner = Planner { config: &config, root: Path::new("/out"), weights: None, plan: Plan::default() };
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
    assert!(!dense.is_empty() && dense.iter().all(|name| name.contains("dense_surface")));
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
    let mut planner = Planner { config: &config, root: Path::new("/out"), weights: None, plan: Plan::default() };
    let mut second = place("second_room");
    second.takes.retain(|take| take.subject != "s1");
    let error = planner.all(&place("site"), Some(&second)).unwrap_err().to_string();
    assert!(error.contains("`second_room`") && error.contains("recordings of s1"), "{error}");
}

/// A run that is started again must find what it did.
#[test]
fn takes_are_planned_in_the_order_in_which_they_are_found() {
    let config = SiteConfig::read(Path::new("configs/site_reproduce_smoke.toml"), &[]).unwrap();
    let names: Vec<String> = super::planned(&config, Path::new("configs")).unwrap().into_iter().map(|take| take.name).collect();
    let mut sorted = names.clone();
    sorted.sort();
    assert!(names == sorted && names.len() == 8, "{names:?}");
}

#[test]
fn another_mesh_is_recorded_of_the_compared_subjects_only() {
    let config = config();
    let mut planner = Planner { config: &config, root: Path::new("/out"), weights: None, plan: Plan::default() };
    let mut site = SiteConfig { unseen: vec!["s2".into()], again: vec!["s2".into()], ..SiteConfig::default() };
    assert_eq!(planner.other_mesh(FIRST, &site, Path::new("")), None);
    site.record.mesh_error_m = 2e-3;
    assert_eq!(planner.other_mesh("second_room", &site, Path::new("")), None);
    let stage = planner.other_mesh(FIRST, &site, Path::new("")).unwrap();
    let Task::Site { config: other, .. } = &planner.plan.stages[stage].task else { panic!("a site") };
    assert_eq!((&other.subjects[..], &other.again[..], other.record.redraw), (&["s1".to_string(), "s2".into()][..], &[][..], 1));
    other.check().unwrap();
}
