//! One trained checkpoint gives the same signal and the same gradients on every backend.

use std::path::Path;

use burn::{
    module::{Module, ModuleVisitor, Param},
    optim::GradientsParams,
    tensor::{Device, Tensor},
};
use hybridsim::{
    heatmap::{HeatmapConfig, RangeDoppler, power_db},
    person::{
        Person,
        actions::{self, Action, StyleConfig},
        procedural::{self, PersonConfig},
    },
    radar::Radar,
    simulator::{Mode, Scene, Simulator},
    training::checkpoint,
};

/// Relative differences of the signal, and of the gradient of every parameter tensor by itself (L2). f32 sums of 10⁵ terms
/// in another order.
const SIGNAL_TOLERANCE: f64 = 1e-4;
const GRADIENT_TOLERANCE: f64 = 1e-3;

struct Answer {
    signal: Vec<f64>,
    /// (name, gradient) of every parameter tensor; `None` where the loss does not depend on it.
    gradients: Vec<(String, Option<Vec<f64>>)>,
}

/// A frame of the embedded person in the checkpoint's room, small enough for a GPU that a CPU imitates.
fn answer(device: &Device) -> Answer {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/quickstart");
    let device = device.clone().autodiff();
    let (simulator, state) = checkpoint::open(&folder, &device).unwrap();
    let radar = Radar::small(1);
    let model = procedural::person(&PersonConfig::default()).unwrap();
    let motion = actions::motion(Action::ArmSwing, &StyleConfig::default(), &model, &[], 1.0, 60.0).unwrap();
    let placement = state.site.placement.clone().unwrap();
    let person = Person::Skinned { model, motion, placement };
    let mut config = state.simulator.clone();
    config.room.patches = Some(300);
    // Drawn in every step, so that its gradients are compared too.
    config.graph.used = 1.0;
    let effects = simulator.effects.clone();
    let simulator = simulator.with_effects(&config, effects);
    let scene = Scene::new(&radar, state.site.room.as_ref(), Some(&person), &config).unwrap();

    let surfaces = simulator.surfaces(&simulator.constants(&scene), Mode::Training { seed: 5 });
    let clean = simulator.clean_signal(&scene, &scene.view(0).unwrap(), &surfaces);
    let flat = |tensor: Tensor<4>| tensor.into_data().convert::<f64>().try_into_vec::<f64>().unwrap();
    let mut signal = flat(clean.re.clone());
    signal.extend(flat(clean.im.clone()));
    let noisy = simulator.with_noise(&radar, clean, 7);
    let transform = RangeDoppler::new(16, 32, radar.sampling, &HeatmapConfig::default(), &device);
    let loss = power_db(transform.map(noisy).power(), 1e-3).powi_scalar(2).mean();
    let mut backward = loss.backward();
    let mut collected = GradientsParams::from_module(&mut backward, &simulator);
    Answer { signal, gradients: by_parameter(&simulator, &mut collected) }
}

fn by_parameter(simulator: &Simulator, gradients: &mut GradientsParams) -> Vec<(String, Option<Vec<f64>>)> {
    struct Collect<'a> {
        gradients: &'a mut GradientsParams,
        path: Vec<String>,
        found: Vec<(String, Option<Vec<f64>>)>,
    }
    impl ModuleVisitor for Collect<'_> {
        fn enter_module(&mut self, name: &str, _: &str) {
            self.path.push(name.into());
        }
        fn exit_module(&mut self, _: &str, _: &str) {
            self.path.pop();
        }
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            let gradient = self.gradients.remove::<D>(param.id);
            let values = gradient.map(|gradient| gradient.into_data().convert::<f64>().try_into_vec::<f64>().unwrap());
            self.found.push((self.path.join("."), values));
        }
    }
    let mut collect = Collect { gradients, path: Vec::new(), found: Vec::new() };
    simulator.visit(&mut collect);
    collect.found
}

fn relative_difference(found: &[f64], wanted: &[f64]) -> f64 {
    assert_eq!(found.len(), wanted.len());
    let squares = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>();
    (squares(&mut found.iter().zip(wanted).map(|(a, b)| a - b)) / squares(&mut wanted.iter().copied())).sqrt()
}

/// A line for every parameter whose gradient differs by more than the tolerance of its own norm, exists on one side only,
/// or is not finite. A gradient that is zero on one must be zero on the other.
fn disagreements(found: &Answer, wanted: &Answer) -> Vec<String> {
    assert_eq!(found.gradients.len(), wanted.gradients.len());
    let mut rows = Vec::new();
    for ((name, found), (other, wanted)) in found.gradients.iter().zip(&wanted.gradients) {
        assert_eq!(name, other);
        match (found, wanted) {
            (None, None) => {}
            (Some(found), Some(wanted)) if found == wanted => {}
            (Some(found), Some(wanted)) => {
                let difference = relative_difference(found, wanted);
                // NaN is no agreement.
                if difference.is_nan() || difference > GRADIENT_TOLERANCE {
                    rows.push(format!("{name}: differs by {difference:.1e}, tolerance {GRADIENT_TOLERANCE:.1e}"));
                }
            }
            _ => rows.push(format!("{name}: has a gradient on one of the two")),
        }
    }
    rows
}

fn assert_same_as_flex(name: &str, device: &Device) {
    let (found, wanted) = (answer(device), answer(&Device::flex()));
    assert!(wanted.signal.iter().chain(wanted.gradients.iter().filter_map(|g| g.1.as_ref()).flatten()).all(|v| v.is_finite()));
    let moving = |gradient: &&(String, Option<Vec<f64>>)| gradient.1.iter().flatten().any(|&value| value != 0.0);
    let moving: Vec<&str> = wanted.gradients.iter().filter(moving).map(|gradient| gradient.0.as_str()).collect();
    for stage in ["triplane", "graph", "body_material", "room_patch", "gain", "noise"] {
        assert!(moving.iter().any(|name| name.contains(stage)), "no gradient reaches `{stage}`; it reaches {moving:?}");
    }
    let signal = relative_difference(&found.signal, &wanted.signal);
    println!(
        "{name}: signal differs by {signal:.1e}; gradients of {} parameters, {} of them not zero",
        wanted.gradients.len(),
        moving.len()
    );
    assert!(signal < SIGNAL_TOLERANCE, "{name}: the signal differs by {signal:.1e} from flex, tolerance {SIGNAL_TOLERANCE:.1e}");
    let rows = disagreements(&found, &wanted);
    assert!(rows.is_empty(), "{name}: gradients differ from flex:\n{}", rows.join("\n"));
}

/// Parameters far smaller than the rest of the gradient count as much.
#[test]
fn a_wrong_gradient_of_the_smallest_parameter_is_found_by_name() {
    let answer = |small: f64, lost: Option<Vec<f64>>| Answer {
        signal: vec![],
        gradients: vec![("large".into(), Some(vec![1e6, -2e6])), ("small".into(), Some(vec![small])), ("lost".into(), lost)],
    };
    assert!(disagreements(&answer(1e-6, None), &answer(1e-6, None)).is_empty());
    assert!(disagreements(&answer(1.0002e-6, None), &answer(1e-6, None)).is_empty());
    for wrong in [2e-6, -1e-6, 0.0, f64::NAN] {
        let rows = disagreements(&answer(wrong, None), &answer(1e-6, None));
        assert!(rows.len() == 1 && rows[0].starts_with("small: differs"), "{wrong}: {rows:?}");
    }
    let rows = disagreements(&answer(1e-6, Some(vec![0.0])), &answer(1e-6, None));
    assert_eq!(rows, ["lost: has a gradient on one of the two"]);
    assert_eq!(disagreements(&answer(1e-9, None), &answer(0.0, None)).len(), 1, "zero on one side only");
}

#[test]
#[cfg(feature = "ndarray")]
fn ndarray_gives_the_same_signal_and_gradients_as_flex() {
    assert_same_as_flex("ndarray", &hybridsim::cli::device("ndarray").unwrap());
}

#[test]
#[cfg(feature = "wgpu")]
fn wgpu_gives_the_same_signal_and_gradients_as_flex() {
    let device = hybridsim::cli::device("wgpu-cpu")
        .expect("a build with wgpu is tested with it: install a software Vulkan driver (Debian: mesa-vulkan-drivers)");
    assert_same_as_flex("wgpu", &device);
}
