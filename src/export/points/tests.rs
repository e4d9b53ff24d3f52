//! The rate of false alarms on white noise, and a target that comes out where it is.

use num_complex::Complex32;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::heatmap::synthetic;
use crate::radar::Sampling;

fn noise(count: usize, rng: &mut ChaCha8Rng) -> Vec<Complex32> {
    let mut draw = || StandardNormal.sample(rng);
    (0..count).map(|_| Complex32::new(draw(), draw())).collect()
}

fn small(antennas: usize, sampling: Sampling) -> Radar {
    let rx_m = (0..antennas).map(|rx| [rx as f64 * 1.9e-3, 0.0, 0.0]).collect();
    Radar { samples_per_chirp: 32, loops_per_frame: 24, tx_m: vec![[0.0; 3]], rx_m, sampling, ..synthetic::radar() }
}

/// Detected and tested cells over so many frames of white noise; every fourth cell along either axis, which Hann windows do
/// not correlate.
fn alarms(radar: &Radar, config: &PointsConfig, frames: usize, seed: u64) -> [usize; 2] {
    let finder = Finder::new(radar, config).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let [_, tx, rx, loops, samples] = radar.dims();
    let (rows, bins) = (finder.velocities_mps.len(), finder.ranges_m.len());
    let apart = |row: usize, bin: usize| row.is_multiple_of(4) && bin.is_multiple_of(4);
    let tested = (0..rows * bins).filter(|cell| apart(cell / bins, cell % bins) && finder.cfar.factor(*cell).is_some()).count();
    let mut found = 0;
    for _ in 0..frames {
        let mut frame = noise(tx * rx * loops * samples, &mut rng);
        if config.remove_static {
            frame = crate::heatmap::remove_static(
                crate::heatmap::Samples::new(&frame, [1, tx, rx, loops, samples]),
                crate::heatmap::StaticRemoval::Loops,
            );
        }
        let maps = finder.analysis.range_doppler_complex(&frame);
        let power = crate::heatmap::mean_power(&maps);
        found += finder.cfar.detect(&power).iter().filter(|cell| apart(cell.row, cell.bin)).count();
    }
    [found, tested * frames]
}

#[test]
fn white_noise_is_detected_at_the_stated_rate() {
    // Ranges at the ends of a real-sampled spectrum are real numbers, whose power has another law: quadrature samples.
    for (method, antennas, rate, remove_static) in
        [(Method::Ca, 1, 0.01, false), (Method::Ca, 4, 0.01, true), (Method::Os, 1, 0.01, false), (Method::Os, 3, 0.02, false)]
    {
        let config = PointsConfig { method, false_alarm_rate: rate, remove_static, ..PointsConfig::default() };
        let [found, of] = alarms(&small(antennas, Sampling::Complex), &config, 1500, 11);
        let expected = rate * of as f64;
        // Four deviations of a binomial count, and 5 % for the law of correlated training cells, which is approximated.
        let allowed = 4.0 * (expected * (1.0 - rate)).sqrt() + 0.05 * expected;
        println!("{method:?}, {antennas} antennas: {found} of {of}, expected {expected:.0}");
        assert!(
            (found as f64 - expected).abs() < allowed,
            "{method:?}, {antennas} antennas: {found} of {of} cells, expected {expected:.0}"
        );
    }
}

#[test]
fn a_smaller_factor_would_be_noticed() {
    let config = PointsConfig { false_alarm_rate: 0.01, ..PointsConfig::default() };
    let [found, of] = alarms(&small(1, Sampling::Complex), &PointsConfig { false_alarm_rate: 0.014, ..config }, 1500, 11);
    assert!(found as f64 > 0.01 * of as f64 * 1.05 + 4.0 * (0.01 * of as f64).sqrt(), "{found} of {of}");
}

#[test]
fn a_moving_point_in_noise_comes_out_at_its_place_and_velocity() {
    let half = 0.5 * synthetic::radar().wavelength_m();
    // Four receivers in a square, two transmitters: azimuth and elevation.
    let rx_m = vec![[0.0; 3], [half, 0.0, 0.0], [0.0, 0.0, half], [half, 0.0, half]];
    let radar = Radar { tx_m: vec![[0.0; 3], [2.0 * half, 0.0, 0.0]], rx_m, ..synthetic::radar() };
    for (azimuth, elevation, velocity) in [(20.0, 0.0, 1.4), (-35.0, 15.0, -0.9)] {
        let ray = beams::unit(azimuth, elevation);
        let signal = synthetic::point(&radar, |time| ray.map(|part| part * (4.0 + velocity * time)));
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let noise = noise(signal.len(), &mut rng);
        let frame: Vec<Complex32> = signal.iter().zip(noise).map(|(point, noise)| point + 0.5 * noise).collect();
        for method in [Method::Ca, Method::Os] {
            let config = PointsConfig { method, ..PointsConfig::default() };
            let found = Finder::new(&radar, &config).unwrap().points(&frame, &config);
            let best = found.iter().max_by(|a, b| a.snr_db.total_cmp(&b.snr_db)).expect("the point is detected");
            assert!(found.len() <= 2, "{found:?}");
            // The frame's middle.
            let range = 4.0 + velocity * 0.5 * radar.loop_period_s() * radar.loops_per_frame as f64;
            let off = (0..3).map(|axis| (best.position_m[axis] - range * ray[axis]).powi(2)).sum::<f64>().sqrt();
            assert!(off < 0.25, "{azimuth}°, {elevation}°: {:?}, {off} m off", best.position_m);
            assert!((best.velocity_mps - velocity).abs() <= 0.5 * radar.velocity_resolution_mps() + 1e-3, "{best:?}");
            // One sample has the power 1 over 0.5; a Hann window keeps two thirds of the samples' number along each axis.
            let wanted = 10.0 * (2.0 * (radar.samples_per_chirp * radar.loops_per_frame) as f64 / 2.25).log10();
            assert!((best.snr_db - wanted).abs() < 3.5, "{} dB against {wanted} dB", best.snr_db);
        }
    }
}

#[test]
fn an_array_along_one_line_tells_no_elevation() {
    let radar = synthetic::radar();
    let signal = synthetic::point(&radar, |_| [1.0, 3.0, 0.0]);
    let config = PointsConfig { false_alarm_rate: 1e-9, ..PointsConfig::default() };
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let noise = noise(signal.len(), &mut rng);
    let frame: Vec<Complex32> = signal.iter().zip(noise).map(|(point, noise)| point + 0.05 * noise).collect();
    let found = Finder::new(&radar, &config).unwrap().points(&frame, &config);
    let best = found.iter().max_by(|a, b| a.snr_db.total_cmp(&b.snr_db)).unwrap();
    let [x, y, z] = best.position_m;
    assert!((x - 1.0).abs() < 0.1 && (y - 3.0).abs() < 0.1 && z == 0.0, "{best:?}");
}

#[test]
fn a_map_without_room_for_training_cells_is_refused() {
    let radar = Radar { samples_per_chirp: 4, loops_per_frame: 1, ..small(1, Sampling::Complex) };
    let config = PointsConfig { guard: [2, 8], ..PointsConfig::default() };
    let error = Finder::new(&radar, &config).err().unwrap();
    assert!(error.to_string().contains("training cells around at least one cell"), "{error}");
}
