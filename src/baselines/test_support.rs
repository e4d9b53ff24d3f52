//! Persons so simple that the answer is known.

use num_complex::Complex32;

use crate::{
    body::test_bodies::sphere,
    complex::Complex,
    heatmap::{Analysis, HeatmapConfig, synthetic},
    person::Person,
    radar::Radar,
};

/// 48 loops of two transmitters in 7.7 ms of a 50 ms frame.
pub fn radar() -> Radar {
    synthetic::radar()
}

/// A ball that starts at `centre_m` and moves for half a second.
pub fn moving_ball(centre_m: [f64; 3], radius_m: f64, velocity_mps: [f64; 3]) -> Person {
    let (ball, faces) = sphere(3, radius_m);
    let pose_times_s: Vec<f64> = (0..31).map(|pose| pose as f64 / 60.0).collect();
    let at = |time: &f64| -> Vec<[f64; 3]> {
        let place = |vertex: &[f64; 3]| std::array::from_fn(|axis| vertex[axis] + centre_m[axis] + velocity_mps[axis] * time);
        ball.iter().map(place).collect()
    };
    Person::Meshes { vertices: pose_times_s.iter().map(at).collect(), faces, pose_times_s }
}

/// Velocity and range of the strongest cell.
pub fn peak(radar: &Radar, signal: Complex<4>) -> [f64; 2] {
    let signal: Vec<Complex32> = signal.to_host();
    assert!(signal.iter().all(|value| value.is_finite()), "every sample is finite");
    let map = Analysis::new(radar, &HeatmapConfig::default()).range_doppler(&signal);
    let [row, column] = map.peak();
    [map.rows.values[row], map.columns.values[column]]
}
