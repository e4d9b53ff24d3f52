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

/// Relative difference of the signals, and of all gradients together (L2). f32 sums of 10⁵ terms in another order.
const SIGNAL_TOLERANCE: f64 = 1e-4;
const GRADIENT_TOLERANCE: f64 = 1e-3;

struct Answer {
    signal: Vec<f64>,
    gradients: Vec<f64>,
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
    Answer { signal, gradients: flatten(&simulator, &mut collected) }
}

fn flatten(simulator: &Simulator, gradients: &mut GradientsParams) -> Vec<f64> {
    struct Collect<'a>(&'a mut GradientsParams, Vec<f64>);
    impl ModuleVisitor for Collect<'_> {
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            match self.0.remove::<D>(param.id) {
                Some(gradient) => self.1.extend(gradient.into_data().convert::<f64>().try_into_vec::<f64>().unwrap()),
                None => self.1.extend(std::iter::repeat_n(0.0, param.val().dims().iter().product())),
            }
        }
    }
    let mut collect = Collect(gradients, Vec::new());
    simulator.visit(&mut collect);
    collect.1
}

fn relative_difference(found: &[f64], wanted: &[f64]) -> f64 {
    assert_eq!(found.len(), wanted.len());
    let squares = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>();
    (squares(&mut found.iter().zip(wanted).map(|(a, b)| a - b)) / squares(&mut wanted.iter().copied())).sqrt()
}

fn assert_same_as_flex(name: &str, device: &Device) {
    let (found, wanted) = (answer(device), answer(&Device::flex()));
    assert!(wanted.signal.iter().chain(&wanted.gradients).all(|value| value.is_finite()));
    assert!(wanted.gradients.iter().any(|&value| value != 0.0), "no gradient at all");
    let (signal, gradients) =
        (relative_difference(&found.signal, &wanted.signal), relative_difference(&found.gradients, &wanted.gradients));
    println!("{name}: signal differs by {signal:.1e}, gradients by {gradients:.1e}");
    assert!(signal < SIGNAL_TOLERANCE, "{name}: the signal differs by {signal:.1e} from flex, tolerance {SIGNAL_TOLERANCE:.1e}");
    assert!(
        gradients < GRADIENT_TOLERANCE,
        "{name}: gradients differ by {gradients:.1e} from flex, tolerance {GRADIENT_TOLERANCE:.1e}"
    );
}

#[test]
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
