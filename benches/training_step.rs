//! Times a whole training step and a frame's inference of the whole model, as JSON lines.
//!
//! `cargo bench --bench training_step`. SMPL's size, about 6,890 vertices; mmMesh's public code has the others: 5,000 room
//! points, 128 chirps, 256 samples; 6 walls. Once with one of the board's three transmitters, once with all of them, 4
//! receivers each. The graph convolution is drawn in every step, not in a half of them as in training. Visibility is computed
//! once per frame and kept, so it is timed apart. `-- wgpu` times another device; a step ends when the device has done it. `of_step_s`
//! are the parts of a step, each waited for, which costs a little more than the whole.

use std::time::Instant;

use burn::{
    module::Module,
    optim::{AdamConfig, GradientsParams, ModuleOptimizer},
    tensor::{Device, Tensor},
};
use hybridsim::{
    body::{PoseCorrection, PoseTensors, Posing, SurfaceConfig},
    features::Extent,
    heatmap::{HeatmapConfig, RangeDoppler, power_db},
    person::{
        Person,
        actions::{self, Action, StyleConfig},
        procedural::{self, PersonConfig},
    },
    radar::Radar,
    recorder::RecorderConfig,
    simulator::{Mode, PathModel, Scene, Simulator, SimulatorConfig},
};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const REPETITIONS: usize = 5;

fn main() {
    let device = std::env::args().skip(1).find(|argument| argument != "--bench").unwrap_or("flex".into());
    let device = hybridsim::cli::device(&device).expect("a device of this build");
    for transmitters in [1, 3] {
        for paths in [PathModel::Decoupled, PathModel::Direct] {
            for pose in [Pose::Host, Pose::Tensor, Pose::Learning] {
                measure(paths, transmitters, pose, &device);
            }
        }
    }
}

/// Where the body is posed, and whether its pose learns.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pose {
    Host,
    Tensor,
    Learning,
}

/// What is measured: a walk seen from some of the paper's transmitters.
struct Case {
    scene: Scene,
    config: SimulatorConfig,
    vertices: usize,
    joints: usize,
}

impl Case {
    fn new(paths: PathModel, transmitters: usize, pose: Pose) -> Self {
        let board = Radar::mmmesh(2);
        // The loops last as long as with all transmitters.
        let chirp_period_s = board.loop_period_s() / transmitters as f64;
        let radar = Radar { tx_m: board.tx_m[..transmitters].to_vec(), chirp_period_s, ..board };
        let room = RecorderConfig::default().room;
        let model = procedural::person(&PersonConfig { edge_m: 0.0198, ..Default::default() }).expect("a person");
        let vertices = model.template.len();
        let motion =
            actions::motion(Action::WalkBackForthArmswing, &StyleConfig::default(), &model, &[], 2.0, 60.0).expect("a motion");
        let joints = motion.poses[0].len();
        let person = Person::Skinned { model, motion, placement: actions::placement(1.0, 3.0) };
        let mut config = SimulatorConfig { paths, surface: SurfaceConfig::vertices(), ..Default::default() };
        config.room.patches = Some(5000);
        config.graph.used = 1.0;
        config.surface.posing = if pose == Pose::Host { Posing::Host } else { Posing::Tensor };
        let scene = Scene::new(&radar, Some(&room), Some(&person), &config).expect("a scene");
        let knots = PoseCorrection { knots_s: vec![0.0, 1.0], ..Default::default() };
        let scene = scene.corrected(&person, knots).expect("a scene");
        Self { scene, config, vertices, joints }
    }
}

fn measure(paths: PathModel, transmitters: usize, pose: Pose, device: &Device) {
    let Case { scene, config, vertices, joints } = Case::new(paths, transmitters, pose);
    let started = Instant::now();
    let view = scene.view(0).expect("a frame");
    let visibility_s = started.elapsed().as_secs_f64();
    let extent = Extent::around(scene.body.as_ref().expect("a body").canonical_vertices(), 0.05);

    let plain = config.init(extent, 1, device);
    let constants = plain.constants(&scene);
    let inference_s = median(|| {
        let surfaces = plain.surfaces(&constants, Mode::Inference);
        let signal = plain.with_noise(&scene.radar, plain.clean_signal(&scene, &view, &surfaces), 1);
        assert!(signal.power().sum().into_scalar::<f32>() > 0.0);
    });

    let autodiff = device.clone().autodiff();
    let transform = RangeDoppler::new(128, 256, scene.radar.sampling, &HeatmapConfig::default(), &autodiff);
    let mut simulator: Option<Simulator> = Some(config.init(extent, 1, &autodiff));
    let leaf = |shape: usize| Tensor::<1>::zeros([shape], &autodiff).require_grad();
    let pose_tensors = || PoseTensors {
        clock_s: Some(leaf(1)),
        heading_rad: Some(leaf(1)),
        shift_m: Some(leaf(3)),
        betas: None,
        turns_rad: Some(leaf(2 * joints * 3).reshape([2, joints, 3])),
        shifts_m: Some(leaf(6).reshape([2, 3])),
    };
    let mut optimizer = ModuleOptimizer::from(AdamConfig::new().build());
    let sync = || device.sync().expect("the device's work");
    let mut step = |lap: &mut dyn FnMut(&str)| {
        let current = simulator.take().expect("put back below");
        let surfaces = current.surfaces(&constants, Mode::Training { seed: 3 });
        lap("surfaces");
        let learning = (pose == Pose::Learning).then(pose_tensors);
        let clean = current.signal_of_pose(&scene, &view, &surfaces, learning.as_ref());
        lap("signal");
        let signal = current.with_noise(&scene.radar, clean, 1);
        let loss = power_db(transform.map(signal).power(), 1e-6).powi_scalar(2).mean();
        lap("noise and loss");
        let mut gradients = loss.backward();
        let gradients = GradientsParams::from_module(&mut gradients, &current);
        lap("gradients");
        simulator = Some(optimizer.step(1e-3, current, gradients));
        lap("optimiser");
    };
    let step_s = median(|| {
        step(&mut |_| ());
        sync();
    });
    let mut of_step_s = serde_json::Map::new();
    let mut started = Instant::now();
    step(&mut |part| {
        sync();
        of_step_s.insert(part.into(), started.elapsed().as_secs_f64().into());
        started = Instant::now();
    });
    println!(
        "{}",
        serde_json::json!({
            "bench": "training_step", "paths": paths, "pose": format!("{pose:?}").to_lowercase(), "device": format!("{device:?}"), "vertices": vertices,
            "room_points": scene.patches.position_m.len(), "walls": scene.proxies.len(),
            "transmitters": transmitters, "receivers": scene.radar.rx_m.len(), "graph_used": config.graph.used, "visible_body": view.direct.body.len(),
            "parameters": plain.num_params(), "step_s": step_s, "of_step_s": of_step_s, "inference_s": inference_s, "visibility_s": visibility_s,
            "peak_mb": peak_mb(),
        })
    );
}

fn median(mut work: impl FnMut()) -> f64 {
    work();
    let mut seconds: Vec<f64> = (0..REPETITIONS)
        .map(|_| {
            let started = Instant::now();
            work();
            started.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds[REPETITIONS / 2]
}

/// Peak resident memory of this process, MB; Linux only.
fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}
