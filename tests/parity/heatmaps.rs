//! Maps, axes and loss.

use burn::tensor::{DType, Device};
use hybridsim::complex::Complex;
use hybridsim::heatmap::{Analysis, Gate, HeatmapConfig, RangeDoppler, Samples, Scan, StaticRemoval, remove_static};
use hybridsim::loss::{Combine, DbLoss, LossConfig, Scale};
use hybridsim::radar::{Radar, Sampling};
use num_complex::{Complex32, Complex64};

use crate::golden::{Golden, close, radar};

fn read_signal(golden: &Golden, name: &str, device: &Device) -> Complex<5> {
    Complex::new(golden.tensor(&format!("{name}_re"), device), golden.tensor(&format!("{name}_im"), device))
}

fn narrow(signal: &[Complex64]) -> Vec<Complex32> {
    signal.iter().map(|value| Complex32::new(value.re as f32, value.im as f32)).collect()
}

fn parts(values: &[Complex64]) -> Vec<f64> {
    values.iter().flat_map(|value| [value.re, value.im]).collect()
}

#[test]
fn range_doppler_maps_and_axes_are_those_of_numpy_on_the_host_and_in_the_graph() {
    let golden = Golden("heatmap");
    let radar = radar();
    let analysis = Analysis::new(&radar, &HeatmapConfig::default());
    let signal = narrow(&golden.complex("in_signal"));
    let frame = Samples::new(&signal, radar.dims()).frame(0);
    let wanted = parts(&golden.complex("map"));
    close("host", &parts(analysis.range_doppler_complex(frame).values()), &wanted, 1e-13);
    close("velocity", &analysis.velocity_axis().values, &golden.values("velocity_mps"), 1e-14);
    close("range", &analysis.range_axis().values, &golden.values("range_m"), 1e-14);

    let device = Device::flex();
    let config = HeatmapConfig::default();
    for (dtype, tolerance) in [(DType::F64, 1e-13), (DType::F32, 1e-6)] {
        let transform = RangeDoppler::new(15, 18, Sampling::Complex, &config, (&device, dtype));
        let signal = read_signal(&golden, "in_signal", &device).narrow(0, 0, 1);
        let map = transform.map(Complex::new(signal.re.cast(dtype), signal.im.cast(dtype)));
        let (re, im) = (map.re.into_data(), map.im.into_data());
        let found: Vec<f64> = re.iter::<f64>().zip(im.iter::<f64>()).flat_map(|(re, im)| [re, im]).collect();
        close("graph", &found, &wanted, tolerance);
    }
    let real = Radar { sampling: Sampling::Real, ..radar };
    let map = Analysis::new(&real, &config).range_doppler_complex(frame);
    close("real-sampled", &parts(map.values()), &parts(&golden.complex("real_map")), 1e-13);
}

#[test]
fn powers_static_removal_and_beams_are_those_of_numpy() {
    let golden = Golden("heatmap");
    let radar = radar();
    let analysis = Analysis::new(&radar, &HeatmapConfig::default());
    let signal = narrow(&golden.complex("in_signal"));
    let samples = Samples::new(&signal, radar.dims());
    for (name, removal, tolerance) in [
        ("power", StaticRemoval::None, 1e-13),
        // the samples less their mean are f32 again
        ("power_without_loop_mean", StaticRemoval::Loops, 1e-6),
        ("power_without_frame_mean", StaticRemoval::Frames, 1e-6),
    ] {
        let values = remove_static(samples, removal);
        let samples = Samples::new(&values, radar.dims());
        let found: Vec<f64> = (0..2).flat_map(|frame| analysis.range_doppler(samples.frame(frame)).values).collect();
        close(name, &found, &golden.values(name), tolerance);
    }
    let scan = Scan::azimuth(60.0, 10.0);
    assert_eq!(scan.axis().values, golden.values("in_azimuth_deg"));
    let beams = analysis.range_angle(samples.frame(0), &scan, &Gate::default());
    close("azimuth", &beams.values, &golden.values("azimuth_power"), 1e-12);
}

#[test]
fn the_loss_is_that_of_numpy_for_every_setting() {
    let golden = Golden("heatmap");
    let device = Device::flex();
    let heatmap = HeatmapConfig { floor_db: -60.0, ..Default::default() };
    let transform = RangeDoppler::new(15, 18, Sampling::Complex, &heatmap, (&device, DType::F64));
    let peak = transform.peak_amplitude(read_signal(&golden, "in_signal", &device));
    close("peak", &[peak], &golden.values("peak_amplitude"), 1e-13);
    let db = || LossConfig { scale: Scale::Db, ..Default::default() };
    for (name, config) in [
        ("loss_each", db()),
        ("loss_mean", LossConfig { combine: Combine::Mean, ..db() }),
        ("loss_clamped", LossConfig { clamp_db: Some(-25.0), ..db() }),
        ("loss_without_static", LossConfig { static_removed: true, ..db() }),
    ] {
        let loss = DbLoss::new(&radar(), &heatmap, &config, peak, (&device, DType::F64)).unwrap();
        let measured = loss.maps_db(read_signal(&golden, "in_signal", &device));
        let found = loss.loss(read_signal(&golden, "in_simulated", &device), measured).into_scalar::<f64>();
        close(name, &[found], &golden.values(name), 1e-10);
    }
}
