//! The pose learns: gradients to it agree on every backend.

use std::path::Path;

use burn::tensor::{DType, Device, Tensor, TensorData};
use hybridsim::{
    body::{PoseCorrection, PoseTensors},
    heatmap::{HeatmapConfig, RangeDoppler, power_db},
    person::{
        Person,
        actions::{self, Action, StyleConfig},
        procedural::{self, PersonConfig},
    },
    radar::Radar,
    simulator::{Mode, Scene},
    training::checkpoint,
};

const KNOTS: usize = 2;

/// Gradient of the decibel loss to every kind of parameter of the pose: name and values.
fn gradients(device: &Device) -> Vec<(&'static str, Vec<f64>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/quickstart");
    let device = device.clone().autodiff();
    let (simulator, state) = checkpoint::open(&folder, &device).unwrap();
    let radar = Radar::small(1);
    let model = procedural::person(&PersonConfig::default()).unwrap();
    let motion = actions::motion(Action::ArmSwing, &StyleConfig::default(), &model, &[], 1.0, 60.0).unwrap();
    let joints = motion.poses[0].len();
    let betas = model.shape_directions.len();
    let person = Person::Skinned { model, motion, placement: state.site.placement.clone().unwrap() };
    let mut config = state.simulator.clone();
    config.room.patches = Some(300);
    let scene = Scene::new(&radar, state.site.room.as_ref(), Some(&person), &config).unwrap();
    let known = PoseCorrection { knots_s: vec![0.0, 0.4], betas: vec![0.0; betas], ..Default::default() };
    let scene = scene.corrected(&person, known).unwrap();

    let sizes =
        [("clock", 1), ("heading", 1), ("shift", 3), ("shape", betas), ("turns", KNOTS * joints * 3), ("shifts", KNOTS * 3)];
    let leaves = sizes.map(|(_, size)| {
        let small: Vec<f64> = (0..size).map(|at| 1e-3 * (at as f64 + 0.5).sin()).collect();
        Tensor::<1>::from_data(TensorData::new(small, [size]), (&device, DType::F32)).require_grad()
    });
    let [clock, heading, shift, shape, turns, shifts] = leaves.clone();
    let pose = PoseTensors {
        clock_s: Some(clock),
        heading_rad: Some(heading),
        shift_m: Some(shift),
        betas: Some(shape),
        turns_rad: Some(turns.reshape([KNOTS, joints, 3])),
        shifts_m: Some(shifts.reshape([KNOTS, 3])),
    };
    let surfaces = simulator.surfaces(&simulator.constants(&scene), Mode::Inference);
    let clean = simulator.signal_of_pose(&scene, &scene.view(0).unwrap(), &surfaces, Some(&pose));
    let noisy = simulator.with_noise(&radar, clean, 7);
    let transform = RangeDoppler::new(16, 32, radar.sampling, &HeatmapConfig::default(), &device);
    let loss = power_db(transform.map(noisy).power(), 1e-3).powi_scalar(2).mean();
    let gradients = loss.backward();
    let of = |leaf: &Tensor<1>| -> Vec<f64> {
        let found: Tensor<1> = leaf.grad(&gradients).expect("a gradient");
        found.into_data().iter::<f64>().collect()
    };
    sizes.iter().zip(&leaves).map(|((name, _), leaf)| (*name, of(leaf))).collect()
}

/// Relative difference (L2) of the gradient to each kind of parameter. f32 sums of phases in another order.
const TOLERANCE: f64 = 2e-3;

fn assert_same_as_flex(name: &str, device: &Device) {
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>().sqrt();
    let rows: Vec<String> = gradients(device)
        .into_iter()
        .zip(gradients(&Device::flex()))
        .filter_map(|((kind, found), (_, wanted))| {
            let size = norm(&mut wanted.iter().copied());
            assert!(size.is_finite() && (size > 0.0 || wanted.is_empty()), "no gradient to {kind}");
            let difference = norm(&mut found.iter().zip(&wanted).map(|(a, b)| a - b)) / size.max(f64::MIN_POSITIVE);
            println!("{name}: gradients to {kind} differ by {difference:.1e}");
            (difference.is_nan() || difference > TOLERANCE).then(|| format!("{kind}: {difference:.1e}"))
        })
        .collect();
    assert!(rows.is_empty(), "{name} differs from flex by more than {TOLERANCE:.0e}:\n{}", rows.join("\n"));
}

#[test]
fn ndarray_gives_the_same_gradients_to_the_pose_as_flex() {
    assert_same_as_flex("ndarray", &hybridsim::cli::device("ndarray").unwrap());
}

#[test]
#[cfg(feature = "wgpu")]
#[ignore = "more than five minutes where a CPU imitates the GPU: the backward pass of picked rows is serial there"]
fn wgpu_gives_the_same_gradients_to_the_pose_as_flex() {
    let device = hybridsim::cli::device("wgpu-cpu")
        .expect("a build with wgpu is tested with it: install a software Vulkan driver (Debian: mesa-vulkan-drivers)");
    assert_same_as_flex("wgpu", &device);
}
