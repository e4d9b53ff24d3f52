//! The pose learns: gradients agree on every backend, and a motion that is off is found again from its recording alone.

use std::path::{Path, PathBuf};

use burn::tensor::{DType, Device, Tensor, TensorData};
use hybridsim::{
    body::{PoseCorrection, PoseTensors},
    config::Config,
    data::{Recording, write_motion},
    heatmap::{HeatmapConfig, RangeDoppler, power_db},
    person::{
        Person, Placement,
        actions::{self, Action, StyleConfig},
        procedural::{self, PersonConfig},
    },
    radar::Radar,
    recorder,
    simulator::{Mode, Scene},
    training::{RefinedPose, checkpoint, load_recordings, refine},
};

const KNOTS: usize = 2;

/// Gradient of the decibel loss to every kind of parameter of the pose: name and values.
fn gradients(device: &Device) -> Vec<(&'static str, Vec<f64>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/quickstart");
    let device = device.clone().autodiff();
    let (simulator, state) = checkpoint::open(&folder, &device).unwrap();
    let radar = Radar::small(1);
    // Coarse: where a CPU imitates the GPU, the backward pass of picked rows is serial.
    let model = procedural::person(&PersonConfig { edge_m: 0.032, ..Default::default() }).unwrap();
    let motion = actions::motion(Action::ArmSwing, &StyleConfig::default(), &model, &[], 1.0, 60.0).unwrap();
    let joints = motion.poses[0].len();
    let betas = model.shape_directions.len();
    let person = Person::Skinned { model, motion, placement: state.site.placement.clone().unwrap() };
    let mut config = state.simulator.clone();
    config.room.patches = Some(100);
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
#[cfg(feature = "ndarray")]
fn ndarray_gives_the_same_gradients_to_the_pose_as_flex() {
    assert_same_as_flex("ndarray", &hybridsim::cli::device("ndarray").unwrap());
}

#[test]
#[cfg(feature = "wgpu")]
fn wgpu_gives_the_same_gradients_to_the_pose_as_flex() {
    let device = hybridsim::cli::device("wgpu-cpu")
        .expect("a build with wgpu is tested with it: install a software Vulkan driver (Debian: mesa-vulkan-drivers)");
    assert_same_as_flex("wgpu", &device);
}

/// A person who walks to and fro at an angle to the radar's axis, in cells of 8.6 cm and 0.28 m/s.
fn settings(recordings: &[PathBuf]) -> Config {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/test.toml");
    let sets: Vec<String> = [
        "record.frames=80",
        "record.radar.samples_per_chirp=64",
        "record.radar.loops_per_frame=32",
        "record.mesh_error_m=0.002",
        "training.epochs=1",
        "training.refine_pose=true",
        "training.refine.steps=25",
        "training.refine.points=200",
    ]
    .map(String::from)
    .to_vec();
    let mut config = Config::read(&path, &sets).unwrap();
    config.data.recordings = recordings.to_vec();
    config
}

/// Where the walk begins.
const ORIGIN_M: [f64; 3] = [0.5, 2.6, -1.0];

/// Records a walk.
fn recorded(parent: &Path) -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/test.toml");
    let mut record = settings(&[]).record(&path).unwrap().clone();
    let straight = Placement { start_s: -0.5, origin_m: ORIGIN_M, ..Default::default() };
    record.person.placement = Some(straight.turned(40.0));
    let folder = parent.join("right");
    recorder::record_to(&record, parent, &folder, &mut |_, _| {}).unwrap();
    folder
}

/// A copy of a recording whose motion is late, turned and shifted.
fn misplaced(right: &Path, late_s: f64, turn_deg: f64, [x, y]: [f64; 2]) -> PathBuf {
    let wrong = right.with_file_name("wrong");
    copy(right, &wrong);
    let file = wrong.join("recording.toml");
    let mut table: toml::Table = std::fs::read_to_string(&file).unwrap().parse().unwrap();
    let truth: Placement = table["motion"].clone().try_into().unwrap();
    let mut off = truth.turned(turn_deg);
    off.start_s += late_s;
    off.origin_m = [off.origin_m[0] + x, off.origin_m[1] + y, off.origin_m[2]];
    table.insert("motion".into(), toml::Value::try_from(&off).unwrap());
    std::fs::write(&file, toml::to_string(&table).unwrap()).unwrap();
    wrong
}

/// A copy of a recording whose motion wanders to and fro along the radar's axis: a sine of this amplitude and period.
fn wandering(right: &Path, amplitude_m: f64, period_s: f64) -> PathBuf {
    let wrong = right.with_file_name("wandering");
    copy(right, &wrong);
    let truth = Recording::open(right).unwrap();
    let person = truth.person().unwrap();
    let knots_s: Vec<f64> = person.pose_times_s().iter().map(|time| time - person.pose_times_s()[0]).collect();
    let shift = |time: &f64| [0.0, amplitude_m * (std::f64::consts::TAU * time / period_s).sin(), 0.0];
    let wander = PoseCorrection { shifts_m: knots_s.iter().map(shift).collect(), knots_s, ..Default::default() };
    let Person::Skinned { motion, .. } = wander.apply(person) else { panic!("the recorder's person is skinned") };
    write_motion(wrong.join("motion.npz"), &motion).unwrap();
    wrong
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// Root mean square over frames and vertices of how far two scenes' bodies are apart: in range and in radial velocity.
fn apart(a: &Scene, b: &Scene) -> [f64; 2] {
    let (mut sums, mut count) = ([0.0; 2], 0.0);
    for frame in 0..a.radar.frames {
        let (a, b) = (a.view(frame).unwrap(), b.view(frame).unwrap());
        let (a, b) = (a.body.as_ref().unwrap(), b.body.as_ref().unwrap());
        for (point, (p, q)) in a.position_m.iter().zip(&b.position_m).enumerate() {
            let range = |place: &[f64; 3]| place.iter().map(|x| x * x).sum::<f64>().sqrt();
            let speed = |place: &[f64; 3], velocity: &[f64; 3]| {
                place.iter().zip(velocity).map(|(x, v)| x * v).sum::<f64>() / range(place)
            };
            sums[0] += (range(p) - range(q)).powi(2);
            sums[1] += (speed(p, &a.velocity_mps[point]) - speed(q, &b.velocity_mps[point])).powi(2);
            count += 1.0;
        }
    }
    sums.map(|sum| f64::sqrt(sum / count))
}

/// How far off a walk that wanders slowly by an amplitude is before and after its frames were refined, as [`apart`] says, and what was
/// refined.
fn refined(amplitude_m: f64) -> ([f64; 2], [f64; 2], RefinedPose) {
    let parent = tempfile::tempdir().unwrap();
    let right = recorded(parent.path());
    let wrong = wandering(&right, amplitude_m, 2.5);
    let frames = Recording::open(&wrong).unwrap().radar.frames;
    let mut config = settings(std::slice::from_ref(&wrong));
    config.training.refine.per_frame = true;
    let mut recordings = load_recordings(&config.data.recordings, &config.simulator).unwrap();
    let started = std::time::Instant::now();
    let all: Vec<usize> = (0..frames).collect();
    let pose = refine::refine(&recordings[0], &all, &config.training.refine, &config.training.heatmap, &Device::flex()).unwrap();
    let took_s = started.elapsed().as_secs_f64();
    let truth = Recording::open(&right).unwrap();
    let truth = Scene::new(&truth.radar, truth.room.as_ref(), truth.person(), &config.simulator).unwrap();
    let before = apart(&recordings[0].scene, &truth);
    let (moved, _) = refine::refined(recordings.remove(0), std::slice::from_ref(&pose)).unwrap();
    let after = apart(&moved.scene, &truth);
    println!(
        "{}\nrange {:.1} mm -> {:.1} mm, speed {:.3} m/s -> {:.3} m/s, in {took_s:.1} s",
        pose.line(),
        1e3 * before[0],
        1e3 * after[0],
        before[1],
        after[1]
    );
    (before, after, pose)
}

#[test]
fn a_motion_that_is_right_to_millimetres_stays_at_least_as_right() {
    let (before, after, pose) = refined(0.0085);
    assert!((0.004..0.008).contains(&before[0]), "the plant is {before:?}");
    assert!(after[0] <= before[0] && after[1] <= before[1], "{before:?} became {after:?}: {}", pose.line());
}

#[test]
fn single_frames_undo_a_slow_wander() {
    let (before, after, pose) = refined(0.085);
    assert!(!pose.correction.shifts_m.is_empty(), "{}", pose.line());
    // Far more than the prior of single frames allows: what is undone is a part of it.
    assert!(after[0] < 0.75 * before[0] && after[1] < before[1], "{before:?} became {after:?}: {}", pose.line());
}

#[test]
fn a_planted_pose_and_clock_error_is_undone_from_the_recording_alone() {
    let parent = tempfile::tempdir().unwrap();
    let right = recorded(parent.path());
    let wrong = misplaced(&right, 0.03, 3.0, [0.01, 0.028]);
    let config = settings(std::slice::from_ref(&wrong));
    let recordings = load_recordings(&config.data.recordings, &config.simulator).unwrap();
    let run = parent.path().join("run");
    std::fs::create_dir_all(&run).unwrap();
    let started = std::time::Instant::now();
    let (text, devices) = (config.to_toml(), [Device::flex()]);
    config.trainer(&recordings, &text, &run, &devices).unwrap().run(None, &mut |_| {}).unwrap();
    let poses = refine::read(&run).unwrap();
    poses.iter().for_each(|pose| println!("{} in {:.1} s", pose.line(), started.elapsed().as_secs_f64()));

    let truth = Recording::open(&right).unwrap();
    let truth = Scene::new(&truth.radar, truth.room.as_ref(), truth.person(), &config.simulator).unwrap();
    let [before_m, before_mps] = apart(&recordings[0].scene, &truth);
    let mut recordings = recordings;
    let (refined, moved) = refine::refined(recordings.remove(0), &poses).unwrap();
    let [after_m, after_mps] = apart(&refined.scene, &truth);
    println!("range {:.1} mm -> {:.1} mm, speed {before_mps:.3} m/s -> {after_mps:.3} m/s", 1e3 * before_m, 1e3 * after_m);
    let correction = refined.scene.body.as_ref().unwrap().correction();
    let clock_ms = 1e3 * (correction.clock_s + 0.03);
    let heading_deg = correction.heading_rad.to_degrees() + 3.0;
    println!("left: clock {clock_ms:.1} ms, heading {heading_deg:.2} degrees");
    assert!(moved, "nothing was refined");
    // Half of everything, or less, is left. Of the shift only the part along the line of sight can be seen, so ranges are
    // what is compared.
    assert!(after_m < 0.5 * before_m, "{after_m} m of {before_m} m are left in range");
    assert!(after_mps < 0.5 * before_mps, "{after_mps} m/s of {before_mps} m/s are left in radial velocity");
    assert!(clock_ms.abs() < 15.0, "{clock_ms} ms of 30 ms are left");
    assert!(heading_deg.abs() < 1.5, "{heading_deg} of 3 degrees are left");
}
