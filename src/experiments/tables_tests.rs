use std::collections::BTreeMap;

use super::*;
use crate::experiments::results::Training;
use crate::experiments::steps::Speed;

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
        intra: Some(summary(psnr_db + 1.0, lpips)),
        cross: Some(summary(psnr_db, lpips)),
        behind: None,
        arm_swing: Some(summary(psnr_db, lpips)),
        recognition: BTreeMap::from([(Protocol::SameMotions, recognised)]),
        training: Some(Training { folder: "stages/train/x-1".into(), seconds: 12.0, resumed: false }),
        speed: Some(Speed { frames: 10, geometry_s: 1.0, signal_s: 0.2 }),
    }
}

fn results(methods: Vec<MethodResults>) -> Results {
    Results {
        methods,
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
}
