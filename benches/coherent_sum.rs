//! Times the direct and the indirect signal, from positions to samples, as JSON lines.
//!
//! `cargo bench --bench coherent_sum [-- unit | scaling | DEVICE]`; a device as of `--device`, such as `wgpu`, does the unit. Every case
//! runs in a process of its own, so that its peak memory is its own. Several forms are timed in one run, because only numbers of one run
//! can be compared.

use std::time::Instant;

use burn::tensor::{DType, Device, Tensor, TensorData};
use hybridsim::complex::Complex;
use hybridsim::if_signal::{SumForm, ToWalls, direct_signal, indirect_signal};
use hybridsim::paths::{Amplitude, Dechirp, Displacement, Points};
use hybridsim::radar::{Radar, SPEED_OF_LIGHT};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// One measurement; `still` of the points do not move.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct Case {
    bench: String,
    backend: String,
    form: SumForm,
    dechirp: Dechirp,
    /// `forward`, or `amplitudes` or `positions`: with the gradients to them (positions: to both).
    mode: String,
    points: usize,
    still: usize,
    chirps: usize,
    samples: usize,
    receivers: usize,
    walls: usize,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    match arguments.first().map(String::as_str) {
        Some("--case") => println!("{}", measure(&serde_json::from_str(&arguments[1]).expect("a case"))),
        Some("unit") => unit().iter().for_each(run_apart),
        Some("scaling") => scaling().iter().for_each(run_apart),
        None => unit().iter().chain(&scaling()).for_each(run_apart),
        Some(device) => of_device(device).iter().for_each(run_apart),
    }
}

fn run_apart(case: &Case) {
    let this = std::env::current_exe().expect("this program's path");
    let case = serde_json::to_string(case).expect("a case as JSON");
    let status = std::process::Command::new(this).args(["--case", &case]).status().expect("a child process");
    assert!(status.success(), "{case} failed");
}

/// 12,000 points, 128 chirps, 256 samples, 1 TX × 4 RX.
fn base() -> Case {
    Case {
        bench: "unit".into(),
        backend: "flex".into(),
        form: SumForm::Fused,
        dechirp: Dechirp::Exact,
        mode: "forward".into(),
        points: 12_000,
        still: 0,
        chirps: 128,
        samples: 256,
        receivers: 4,
        walls: 0,
    }
}

fn unit() -> Vec<Case> {
    let mut cases = of_device("flex");
    for mode in ["forward", "positions"] {
        cases.push(Case { mode: mode.into(), dechirp: Dechirp::Paper, ..base() });
        cases.push(Case { bench: "unit, room at rest".into(), mode: mode.into(), still: 5000, ..base() });
        #[cfg(feature = "ndarray")]
        cases.push(Case { form: SumForm::Tensor, backend: "ndarray".into(), mode: mode.into(), ..base() });
    }
    // The definition, on a sixteenth of the chirps and one receiver: 64 times less.
    cases.push(Case { bench: "1/64 unit".into(), form: SumForm::Exact, chirps: 8, receivers: 1, ..base() });
    cases
}

/// The unit in both forms.
fn of_device(device: &str) -> Vec<Case> {
    let mut cases = vec![];
    for form in [SumForm::Fused, SumForm::Tensor] {
        for mode in ["forward", "amplitudes", "positions"] {
            cases.push(Case { backend: device.into(), form, mode: mode.into(), ..base() });
        }
    }
    cases
}

fn scaling() -> Vec<Case> {
    let mut cases = vec![];
    for form in [SumForm::Fused, SumForm::Tensor] {
        for mode in ["forward", "positions"] {
            let base = Case { form, mode: mode.into(), receivers: 1, ..base() };
            let mut add = |bench: &str, change: &dyn Fn(&mut Case)| {
                let mut case = Case { bench: bench.into(), ..base.clone() };
                change(&mut case);
                cases.push(case);
            };
            for points in [3000, 6000, 12_000, 24_000] {
                add("points", &|case| case.points = points);
            }
            for chirps in [16, 32, 64, 128, 256] {
                add("chirps", &|case| case.chirps = chirps);
            }
            for samples in [64, 128, 256, 512, 1024] {
                add("samples", &|case| case.samples = samples);
            }
            for receivers in [1, 2, 4, 8] {
                add("antennas", &|case| case.receivers = receivers);
            }
            for walls in [1, 2, 4, 6] {
                add("walls", &|case| (case.walls, case.receivers) = (walls, 4));
            }
        }
    }
    cases
}

fn measure(case: &Case) -> String {
    let world = World::new(case);
    let runs = if case.mode == "forward" { 9 } else { 7 };
    let mut seconds = vec![];
    let mut cpu_start_s = 0.0;
    for run in 0..=runs {
        if run == 1 {
            cpu_start_s = cpu_s();
        }
        let start = Instant::now();
        world.step(case);
        // The first run fills the allocator.
        if run > 0 {
            seconds.push(start.elapsed().as_secs_f64());
        }
    }
    seconds.sort_by(f64::total_cmp);
    let mut line = serde_json::to_value(case).expect("a case as JSON");
    line["median_s"] = round(seconds[seconds.len() / 2]).into();
    line["least_s"] = round(seconds[0]).into();
    // Processor time of all threads: comparable even where the machine has other work.
    line["cpu_s"] = round((cpu_s() - cpu_start_s) / f64::from(runs)).into();
    line["runs"] = runs.into();
    line["peak_mb"] = peak_mb().into();
    line["threads"] = rayon::current_num_threads().into();
    if case.walls == 0 {
        line["relative_error"] = world.relative_error(case).into();
    }
    line.to_string()
}

fn round(seconds: f64) -> f64 {
    (seconds * 1e5).round() / 1e5
}

/// User and system time of this process so far; in steps of 10 ms.
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or("").split_whitespace().collect();
    let ticks = |index: usize| fields.get(index).and_then(|field| field.parse::<f64>().ok()).unwrap_or(0.0);
    (ticks(11) + ticks(12)) / 100.0
}

/// Highest memory this process has held, in MB.
fn peak_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or("0 kB");
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap_or(0) / 1024
}

/// A person's worth of moving points two to four metres away, and points at rest on the walls.
struct World {
    device: Device,
    radar: Radar,
    moving: Part,
    still: Part,
    proxies: Vec<[f64; 3]>,
}

struct Part {
    reference_m: Vec<[f64; 3]>,
    velocity_mps: Vec<[f64; 3]>,
    amplitude: Vec<f64>,
    chirps: usize,
    /// x, y, z `[point, chirp]`, and the amplitude `[point, 1]`: made before the clock starts.
    tensors: Option<[Tensor<2>; 4]>,
}

impl World {
    fn new(case: &Case) -> Self {
        let wavelength = SPEED_OF_LIGHT / 77e9;
        let radar = Radar {
            start_frequency_hz: 77e9,
            slope_hz_per_s: 60.012e12,
            sample_rate_hz: 4.4e6,
            sampling: Default::default(),
            samples_per_chirp: case.samples,
            loops_per_frame: case.chirps,
            adc_start_s: 6e-6,
            chirp_period_s: 216e-6,
            frame_period_s: 0.1,
            frames: 1,
            position_m: [0.0; 3],
            tx_m: vec![[0.0; 3]],
            rx_m: (0..case.receivers).map(|rx| [(rx as f64 - 6.0) * wavelength / 2.0, 0.0, 0.0]).collect(),
            full_scale_codes: None,
        };
        let device = hybridsim::cli::device(&case.backend).expect("a device of this build");
        let mut random = ChaCha8Rng::seed_from_u64(0);
        let mut part = |count: usize, speed: f64, chirps: usize| {
            let mut uniform = |low: f64, high: f64| random.random_range(low..=high);
            let mut part = Part { reference_m: vec![], velocity_mps: vec![], amplitude: vec![], chirps, tensors: None };
            for _ in 0..count {
                part.reference_m.push([uniform(-2.0, 2.0), uniform(1.0, 5.0), uniform(-1.2, 1.2)]);
                part.velocity_mps.push([uniform(-speed, speed), uniform(-speed, speed), uniform(-speed, speed)]);
                part.amplitude.push(uniform(0.2, 1.0));
            }
            part
        };
        let mut moving = part(case.points - case.still, 1.5, case.chirps);
        let mut still = part(case.still, 0.0, 1);
        moving.prepare(&radar, &device);
        still.prepare(&radar, &device);
        let proxies = (0..case.walls).map(|wall| [2.5 * (wall as f64 - 2.5), 3.0 + 0.5 * wall as f64, 0.3]).collect();
        Self { device, radar, moving, still, proxies }
    }

    /// Forward, or forward and backward with the loss Σ|X|².
    fn step(&self, case: &Case) {
        let mut tracked = vec![];
        let mut signal: Option<Complex<3>> = None;
        for part in [&self.moving, &self.still].into_iter().filter(|part| !part.reference_m.is_empty()) {
            let (displacement, amplitude) = part.tensors(case, &mut tracked);
            let points = Points { reference_m: &part.reference_m, displacement: &displacement, amplitude: &amplitude };
            let mut parts = vec![];
            if self.proxies.is_empty() {
                parts.push(direct_signal(points, &self.radar, 0, case.dechirp, case.form));
            }
            for &proxy in &self.proxies {
                let to_walls = ToWalls { points, walls: &[(0, 0..part.reference_m.len())] };
                parts.extend(indirect_signal(&[to_walls], &[proxy], &self.radar, 0, case.dechirp, case.form));
            }
            for part in parts {
                signal = Some(match signal {
                    Some(signal) => signal.add(part),
                    None => part,
                });
            }
        }
        let signal = signal.expect("a signal");
        let results = if tracked.is_empty() {
            vec![signal.re.into_data(), signal.im.into_data()]
        } else {
            let gradients = signal.power().sum().backward();
            tracked.into_iter().map(|tensor| tensor.grad(&gradients).expect("a gradient").into_data()).collect()
        };
        std::hint::black_box(results);
        // What has been asked of a GPU is not yet done.
        self.device.sync().expect("the device's work");
    }

    /// Of two chirps at the first receiver, against f64 on the host.
    fn relative_error(&self, case: &Case) -> f64 {
        let mut found = vec![];
        let mut total: Option<Complex<3>> = None;
        let forward = Case { mode: "forward".into(), ..case.clone() };
        for part in [&self.moving, &self.still].into_iter().filter(|part| !part.reference_m.is_empty()) {
            let (displacement, amplitude) = part.tensors(&forward, &mut vec![]);
            let points = Points { reference_m: &part.reference_m, displacement: &displacement, amplitude: &amplitude };
            let signal = direct_signal(points, &self.radar, 0, case.dechirp, case.form);
            total = Some(match total {
                Some(total) => total.add(signal),
                None => signal,
            });
        }
        let total = total.expect("a signal");
        let chirps = [case.chirps / 3, case.chirps - 2];
        for chirp in chirps {
            for part in [&total.re, &total.im] {
                let row = part.clone().slice([0..1, chirp..chirp + 1, 0..case.samples]);
                found.extend(row.into_data().convert::<f64>().try_into_vec::<f64>().expect("numbers"));
            }
        }
        let mut wanted = vec![];
        for chirp in chirps {
            let mut sum = vec![(0.0, 0.0); case.samples];
            self.moving.add_exactly(&self.radar, case, chirp, &mut sum);
            self.still.add_exactly(&self.radar, case, chirp, &mut sum);
            wanted.extend(sum.iter().map(|z| z.0).chain(sum.iter().map(|z| z.1)));
        }
        let difference: f64 = found.iter().zip(&wanted).map(|(f, w)| (f - w).powi(2)).sum();
        (difference / wanted.iter().map(|w| w * w).sum::<f64>()).sqrt()
    }
}

impl Part {
    /// From the middle of the frame.
    fn time_s(&self, radar: &Radar, chirp: usize) -> f64 {
        (chirp as f64 - 0.5 * (self.chirps as f64 - 1.0)) * radar.loop_period_s()
    }

    fn prepare(&mut self, radar: &Radar, device: &Device) {
        let points = self.reference_m.len();
        let tensor = |values: Vec<f32>, columns: usize| -> Tensor<2> {
            Tensor::from_data(TensorData::new(values, [points, columns]), (device, DType::F32))
        };
        let times_s: Vec<f64> = (0..self.chirps).map(|chirp| self.time_s(radar, chirp)).collect();
        let axis = |axis: usize| {
            let moved = |velocity: &[f64; 3]| times_s.iter().map(|time_s| (velocity[axis] * time_s) as f32).collect::<Vec<_>>();
            tensor(self.velocity_mps.iter().flat_map(moved).collect(), self.chirps)
        };
        let amplitude = tensor(self.amplitude.iter().map(|&a| a as f32).collect(), 1);
        self.tensors = Some([axis(0), axis(1), axis(2), amplitude]);
    }

    /// With gradients for the case's mode; what has them is added to `tracked`.
    fn tensors(&self, case: &Case, tracked: &mut Vec<Tensor<2>>) -> (Displacement, Amplitude) {
        let [x, y, z, amplitude] = self.tensors.clone().expect("prepared tensors");
        let mut track = |tensor: Tensor<2>, modes: &[&str]| {
            if case.mode == "forward" {
                return tensor;
            }
            let tensor = tensor.autodiff();
            if !modes.contains(&case.mode.as_str()) {
                return tensor;
            }
            tracked.push(tensor.require_grad());
            tracked.last().expect("just pushed").clone()
        };
        let [x, y, z] = [x, y, z].map(|axis| track(axis, &["positions"]));
        (Displacement { x, y, z }, Amplitude::real(track(amplitude, &["positions", "amplitudes"])))
    }

    /// The definition in f64, at the first receiver.
    fn add_exactly(&self, radar: &Radar, case: &Case, chirp: usize, sum: &mut [(f64, f64)]) {
        let length = |a: [f64; 3], b: [f64; 3]| (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt();
        let middle_s = 0.5 * radar.samples_per_chirp as f64 / radar.sample_rate_hz;
        for (point, &reference) in self.reference_m.iter().enumerate() {
            let at = |time_s: f64| {
                let x: [f64; 3] = std::array::from_fn(|axis| {
                    // As the f32 displacement has it.
                    let moved = (self.velocity_mps[point][axis] * time_s) as f32;
                    reference[axis] + f64::from(moved)
                });
                (length(x, radar.tx_position_m(0)), length(x, radar.rx_position_m(0)))
            };
            let time_s = if self.chirps == 1 { 0.0 } else { self.time_s(radar, chirp) };
            let (from_tx, to_rx) = at(time_s);
            let delay = (from_tx + to_rx) / SPEED_OF_LIGHT;
            let rate = {
                let step = radar.loop_period_s();
                let path = |time_s: f64| at(time_s).0 + at(time_s).1;
                (path(time_s + step) - path(time_s - step)) / (2.0 * step * SPEED_OF_LIGHT)
            };
            let exact = case.dechirp == Dechirp::Exact;
            let amplitude = f64::from(self.amplitude[point] as f32) / (from_tx * to_rx);
            for (sample, sum) in sum.iter_mut().enumerate() {
                let t = sample as f64 / radar.sample_rate_hz;
                let delay = if exact { delay + rate * (t - middle_s) } else { delay };
                let residual = if exact { 0.5 * radar.slope_hz_per_s * delay * delay } else { 0.0 };
                // Numerical error is what is looked for: without the curvature that the phasors leave out.
                let curvature = if exact { radar.slope_hz_per_s * rate * (t - middle_s).powi(2) } else { 0.0 };
                let turns = radar.carrier_hz() * delay + radar.slope_hz_per_s * t * delay - residual - curvature;
                let (sin, cos) = (std::f64::consts::TAU * turns.fract()).sin_cos();
                sum.0 += amplitude * cos;
                sum.1 += amplitude * sin;
            }
        }
    }
}
