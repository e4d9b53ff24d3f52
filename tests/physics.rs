//! Laws with known answers, from positions to heatmaps, in the simulator's own signal chain.

use burn::tensor::{DType, Device, Tensor};
use hybridsim::{
    complex::Complex,
    heatmap::{Analysis, Gate, HeatmapConfig, Scan},
    if_signal::{SumForm, direct_signal},
    paths::{Amplitude, Dechirp, Displacement, Points},
    radar::Radar,
};
use num_complex::Complex32;

fn radar() -> Radar {
    let full = Radar::mmmesh(1);
    Radar { tx_m: vec![[0.0; 3]], chirp_period_s: 216e-6, samples_per_chirp: 128, loops_per_frame: 64, ..full }
}

/// Samples `[rx, loop, sample]` of one point that moves at a constant velocity.
fn point(radar: &Radar, position_m: [f64; 3], velocity_mps: [f64; 3]) -> Vec<Complex32> {
    let device = Device::flex();
    let loops = radar.loops_per_frame;
    let along = |axis: usize| {
        let values: Vec<f32> = (0..loops)
            .map(|index| ((index as f64 - 0.5 * loops as f64) * radar.loop_period_s() * velocity_mps[axis]) as f32)
            .collect();
        Tensor::<1>::from_floats(values.as_slice(), &device).reshape([1, loops])
    };
    let displacement = Displacement { x: along(0), y: along(1), z: along(2) };
    let amplitude = Amplitude::real(Tensor::ones([1, 1], (&device, DType::F32)));
    let points = Points { reference_m: &[position_m], displacement: &displacement, amplitude: &amplitude };
    let Complex { re, im } = direct_signal(points, radar, 0, Dechirp::Exact, SumForm::Auto);
    let values = |part: Tensor<3>| part.into_data().try_into_vec::<f32>().unwrap();
    values(re).into_iter().zip(values(im)).map(|(re, im)| Complex32::new(re, im)).collect()
}

fn analysis(radar: &Radar) -> Analysis {
    Analysis::new(radar, &HeatmapConfig::default())
}

#[test]
fn a_point_at_three_metres_peaks_in_its_range_bin() {
    let radar = radar();
    let map = analysis(&radar).range_doppler(&point(&radar, [0.0, 3.0, 0.0], [0.0; 3]));
    let [row, column] = map.peak();
    assert!((map.columns.values[column] - 3.0).abs() <= 0.5 * radar.range_resolution_m(), "{} m", map.columns.values[column]);
    assert_eq!(map.rows.values[row], 0.0);
}

#[test]
fn a_receding_point_has_a_positive_velocity_of_the_right_size() {
    let radar = radar();
    for velocity in [1.3, -2.1] {
        let map = analysis(&radar).range_doppler(&point(&radar, [0.0, 3.0, 0.0], [0.0, velocity, 0.0]));
        let found = map.rows.values[map.peak()[0]];
        assert!((found - velocity).abs() <= 0.5 * radar.velocity_resolution_mps() + 1e-3, "{found} m/s for {velocity} m/s");
    }
}

#[test]
fn power_falls_by_twelve_decibels_per_doubling_of_distance() {
    let radar = Radar { rx_m: vec![[0.0; 3]], ..radar() };
    let power =
        |range: f64| point(&radar, [0.0, range, 0.0], [0.0; 3]).iter().map(|value| f64::from(value.norm_sqr())).sum::<f64>();
    for range in [1.0, 2.0, 4.0] {
        let fall_db = 10.0 * (power(range) / power(2.0 * range)).log10();
        assert!((fall_db - 12.041).abs() < 0.01, "{fall_db} dB from {range} m to twice that");
    }
}

#[test]
fn swapping_transmitter_and_receiver_changes_nothing() {
    let there = Radar { tx_m: vec![[-0.02, 0.0, 0.01]], rx_m: vec![[0.03, 0.0, 0.0]], ..radar() };
    let back = Radar { tx_m: there.rx_m.clone(), rx_m: there.tx_m.clone(), ..there.clone() };
    let [there, back] = [&there, &back].map(|radar| point(radar, [0.7, 2.4, -0.3], [0.4, -0.9, 0.1]));
    let scale = there[0].norm();
    assert!(there.iter().zip(&back).all(|(a, b)| (a - b).norm() < 1e-4 * scale));
}

#[test]
fn a_point_off_boresight_appears_at_its_angle() {
    let radar = radar();
    let scan = Scan::azimuth(60.0, 1.0);
    for degrees in [-30.0f64, 0.0, 20.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let signal = point(&radar, [3.0 * sin, 3.0 * cos, 0.0], [0.0; 3]);
        let map = analysis(&radar).range_angle(&signal, &scan, &Gate::default());
        let found = map.rows.values[map.peak()[0]];
        assert!((found - degrees).abs() <= 2.0, "{found}° for {degrees}°");
    }
}
