use super::*;

/// Settings as reproductions have them, that extend `configs/paper_model.toml`.
pub(in crate::experiments) fn on_the_papers_side(settings: &str) -> ReproduceConfig {
    crate::data::settings::read_text(&format!("{settings}\n{}", include_str!("../../configs/paper_model.toml"))).unwrap()
}

#[test]
fn a_variant_that_is_trained_as_ours_is_refused() {
    let error = refused(|config| {
        config.variants = vec![Variant::Ours, Variant::WithEffects, Variant::Likelihood];
        config.check().unwrap();
        config.training.loss.scale = crate::loss::Scale::Likelihood;
    });
    assert!(error.contains("`variants` is likelihood"), "{error}");
}

fn refused(change: impl FnOnce(&mut ReproduceConfig)) -> String {
    let mut config = on_the_papers_side("site = \"site.toml\"");
    config.check().unwrap();
    change(&mut config);
    config.check().unwrap_err().to_string()
}

#[test]
fn what_cannot_be_reproduced_is_refused_by_name() {
    assert!(refused(|config| config.split.unseen = "s1".into()).contains("`split.unseen`"));
    assert!(refused(|config| config.split.additional = Some("s4".into())).contains("`split.additional` is s4"));
    let scene = |training: &[&str], evaluated: &[&str]| {
        let names = |names: &[&str]| names.iter().map(ToString::to_string).collect();
        let scene = SecondSceneConfig { site: "x".into(), training: names(training), evaluated: names(evaluated) };
        refused(|config| config.second_scene = Some(scene))
    };
    assert!(scene(&["bow"], &[]).contains("`second_scene.evaluated` is empty"));
    assert!(scene(&["bow", "jab"], &["jab"]).contains("`second_scene.evaluated` is jab"));
    let stability = StabilityConfig { epochs: 0, ..Default::default() };
    assert!(refused(|config| config.stability = Some(stability)).contains("`stability.epochs` is 0"));
    assert!(refused(|config| config.seeds = 0).contains("`seeds` is 0"));
    let few = |recordings: Vec<usize>| FewConfig { recordings, simulated_by: Variant::Physical };
    assert!(refused(|config| config.few_measured = Some(few(vec![1, 0]))).contains("`few_measured.recordings` is [1, 0]"));
    let error = refused(|config| {
        config.few_measured = Some(few(vec![1]));
        config.variants = vec![Variant::Ours];
    });
    assert!(error.contains("`few_measured.simulated_by` is physical"), "{error}");
    assert!(refused(|config| config.variants = vec![Variant::Coupled]).contains("`variants`"));
    assert!(refused(|config| config.training.split = Split::Random).contains("`training.split`"));
    assert!(refused(|config| config.training.frames = Some(3)).contains("`training.frames`"));
    let error = refused(|config| {
        config.second_room = Some("room2.toml".into());
        config.adaptation.frames.clear();
    });
    assert!(error.contains("`adaptation`"));
    assert!(refused(|config| config.simulator.surface.sampling = Sampling::Facets).contains("coupled"));
}

#[test]
fn nothing_tames_the_training_whose_stability_is_asked_for() {
    let training = StabilityConfig::default().training(&TrainingConfig::default());
    training.check().unwrap();
    assert_eq!(training.learning_rate_at(0, 100), training.learning_rate_at(99, 100));
    assert!(training.gradient_clip > 1e20 && training.validation_fraction == 0.0);
    // More than the paper's number, if its epoch is a step.
    assert!(training.epochs * training.repeats * training.frames.unwrap() > 7400);
}

#[test]
fn the_resolved_settings_are_read_again_as_they_are() {
    let config = on_the_papers_side("site = \"site.toml\"\nvariants = [\"ours\", \"coupled\"]");
    assert_eq!(crate::data::settings::read_text::<ReproduceConfig>(&config.to_toml()).unwrap(), config);
}
