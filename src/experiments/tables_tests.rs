use std::collections::BTreeMap;

use super::*;
use crate::evaluation::{ScoreSummary, SequenceSummary};
use crate::experiments::few::Material;
use crate::experiments::figures::Levels;
use crate::experiments::pairs::{On, Pair};
use crate::experiments::results::{Few, Figure, Recognised, Share, StabilityResults, Training};
use crate::experiments::steps::train::Broke;
use crate::experiments::steps::{Speed, Stability};
use crate::metrics::Spread;
use crate::training::EpochMetrics;

fn summary(psnr_db: f64, lpips: Option<f64>) -> SequenceSummary {
    let spread = |mean: f64| Spread { mean, deviation: 1.0, interval: Some(0.5), count: 8 };
    let scores = ScoreSummary {
        psnr_db: spread(psnr_db),
        ssim: spread(0.25),
        mean_absolute_error_db: spread(4.0),
        lpips: lpips.map(spread),
    };
    SequenceSummary {
        sequences: 8,
        frames: 64,
        span_db: 80.0,
        global: Some(scores.clone()),
        moving: Some(scores),
        person: None,
        lpips: None,
    }
}

fn found(method: Method, psnr_db: f64, lpips: Option<f64>) -> MethodResults {
    let share = |value: f64| Share { value, interval_sequences: [value - 0.1, value + 0.1] };
    let recognised = Recognised { accuracy: share(0.8), macro_f1: share(0.75), sequence_interval: [0.44, 0.97] };
    MethodResults {
        id: method.id(),
        method,
        draws: 1,
        intra: Some(summary(psnr_db + 1.0, lpips)),
        cross: Some(summary(psnr_db, lpips)),
        behind: None,
        additional: None,
        additional_recognition: None,
        arm_swing: Some(summary(psnr_db, lpips)),
        recognition: BTreeMap::from([(Protocol::SameMotions, recognised)]),
        behind_measured: BTreeMap::from([(
            Protocol::SameMotions,
            Spread { mean: 0.25, deviation: 0.4, interval: Some(0.125), count: 8 },
        )]),
        training: Some(Training { folder: "stages/train/x-1".into(), seconds: 12.0, resumed: false }),
        speed: Some(Speed { frames: 10, geometry_s: 1.0, signal_s: 0.2 }),
    }
}

fn results(methods: Vec<MethodResults>) -> Results {
    Results {
        methods,
        pairs: vec![],
        few: vec![],
        stability: vec![],
        figures: vec![],
        effects: None,
        seconds: BTreeMap::from([("train".into(), 12.0)]),
        device: "flex".into(),
        programs: BTreeMap::new(),
    }
}

#[test]
fn numbers_stand_beside_the_papers_with_their_intervals() {
    let text = tables(&results(vec![found(Method::Variant(Variant::Ours), 23.5, None)]));
    let row = "| HybridSim | 24.50 ± 0.50 (22.30) | 0.250 ± 0.500 (0.262) | not available (0.089) | 23.50 ± 0.50 (22.29) |";
    assert!(text.contains(row), "{text}");
    assert!(text.contains("| HybridSim | 80.0 [44.0, 97.0] (92.1) | 0.750 [0.650, 0.850] (0.922) | – | – |"), "{text}");
    assert!(
        text.contains("`hybridsim train OUT/stages/train/x-1/config.toml`") && text.contains("| 0.1000 | 0.0200 |"),
        "{text}"
    );
}

#[test]
fn lpips_is_a_number_only_with_a_network() {
    let text = tables(&results(vec![found(Method::Variant(Variant::Ours), 23.5, Some(0.1))]));
    assert!(text.contains("0.100 ± 0.500 (0.089)") && !text.contains("not available"), "{text}");
}

#[test]
fn an_ablation_is_shown_where_both_sides_are_there() {
    let ours = || found(Method::Variant(Variant::Ours), 23.5, None);
    let alone = tables(&results(vec![ours()]));
    assert!(!alone.contains("table 3") && !alone.contains("table 6") && !alone.contains("Second room"));
    let methods = vec![found(Method::Variant(Variant::Coupled), 21.0, None), ours(), found(Method::Adapted(4), 20.0, None)];
    let text = tables(&results(methods));
    assert!(text.contains("| HybridSim, coupled Gaussian patches | 21.00 ± 0.50 (19.12) |"), "{text}");
    assert!(text.contains("| HybridSim, adapted to 4 frames | 21.00 ± 0.50 |"), "{text}");
    assert!(text.contains("| HybridSim, coupled Gaussian patches | 25.0 ± 12.5 | – |"), "{text}");
}

#[test]
fn what_goes_beyond_the_comparison_has_tables_with_the_papers_numbers() {
    let mut ours = found(Method::Variant(Variant::Ours), 23.5, Some(0.1));
    ours.additional = ours.cross.clone();
    ours.additional_recognition = ours.recognition.get(&Protocol::SameMotions).copied();
    let epoch = |epoch: usize, largest_gradient: f64| EpochMetrics {
        epoch,
        learning_rate: 1e-3,
        training_loss: 30.0 - epoch as f64,
        validation_loss: None,
        noise_rate: None,
        largest_loss: Some(40.0),
        largest_gradient: Some(largest_gradient),
    };
    let mut results = results(vec![ours, found(Method::SceneOurs, 21.0, None)]);
    let run =
        |broke: Option<Broke>| Stability { steps: 120, broke, history: vec![epoch(0, 3.0), epoch(1, 7000.0), epoch(2, 5.0)] };
    let broke = Broke { step: 120, stage: "direct path".into() };
    results.stability = vec![
        StabilityResults { variant: Variant::Ours, run: run(None) },
        StabilityResults { variant: Variant::WithoutGcn, run: run(Some(broke)) },
    ];
    let spread = |mean: f64| Some(Spread { mean, deviation: 0.1, interval: Some(0.2), count: 8 });
    let difference = Behind { global: spread(0.5), moving: spread(-0.25), person: None };
    let methods = (Method::Variant(Variant::DenseSurface), Method::OtherMesh);
    results.pairs = vec![Pair { first: "a".into(), second: "b".into(), methods, on: On::UnseenHuman, difference }];
    let recognised = results.methods[0].recognition[&Protocol::SameMotions];
    results.few = vec![Few { recordings: 4, material: Material::Measured, recognised }];
    let levels = Levels {
        columns: vec!["direct".into(), "indirect".into()],
        rows: vec!["lunge".into()],
        all_db: vec![vec![Some(-0.5), None]],
        moving_db: vec![vec![Some(-1.25), Some(-20.0)]],
    };
    results.figures = vec![Figure { name: "decomposition".into(), picture: "x".into(), levels }];
    let text = tables(&results);
    for row in [
        "| HybridSim | 23.50 ± 0.50 (22.37) | 0.250 ± 0.500 (0.262) | 0.100 ± 0.500 (0.092) | 23.50 ± 0.50 | – | 80.0 [44.0, 97.0] (97.0) | 0.750 [0.650, 0.850] (0.970) |",
        "| HybridSim, trained there on other actions | 21.00 ± 0.50 (22.01) | 0.250 ± 0.500 (0.241) | not available (0.108) | 21.00 ± 0.50 | – | 80.0 [44.0, 97.0] (88.7) | 0.750 [0.650, 0.850] (0.887) |",
        "| with GCN | 120 | no | 30.0, 28.0 | 40.0 | 5.000e0 | 7.000e3 |",
        "| without GCN | 120 | at step 120: direct path | 30.0, 28.0 | 40.0 | 5.000e0 | 7.000e3 |",
        "| HybridSim, dense surface | measured with another mesh error | unseen human | 0.50 ± 0.20 | -0.25 ± 0.20 | – |",
        "| lunge | -0.5; -1.2 | none; -20.0 |",
        "| 4 | 80.0 [44.0, 97.0] | – | – |",
    ] {
        assert!(text.contains(row), "{row}\n{text}");
    }
}
