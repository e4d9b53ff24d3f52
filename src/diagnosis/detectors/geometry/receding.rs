//! A body that walks away, as a radar receives it: for tests.

use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::diagnosis::cube::Loaded;
use crate::diagnosis::prediction::{Echo, range_and_velocity};
use crate::diagnosis::{BodyPrediction, Evidence, Point};
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::room::Room;

/// A body of half a metre that walks away, and its echo. As the prediction has it, points have no phase.
pub fn evidence(echo: Option<Echo>) -> Evidence {
    let mut radar = Radar { samples_per_chirp: 64, loops_per_frame: 64, ..Radar::mmmesh(16) };
    radar.tx_m.truncate(1);
    radar.chirp_period_s *= 3.0;
    radar.rx_m.truncate(2);
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut uniform = || random.random::<f64>();
    let [frames, _, receivers, loops, count] = radar.dims();
    let (mut samples, mut bodies) = (vec![], vec![]);
    for frame in 0..frames {
        let points: Vec<Point> = (0..60)
            .map(|_| Point {
                position_m: [0.2 * uniform(), 1.6 + 0.05 * frame as f64 + 0.5 * uniform(), uniform() - 0.5],
                velocity_mps: [0.0, 1.2 + 0.4 * uniform(), 0.0],
                normal: [0.0, -1.0, 0.0],
                area_m2: 0.01,
                part: 0,
            })
            .collect();
        let seen: Vec<Point> = points.iter().copied().chain(echo.iter().flat_map(|echo| echo.points(&radar, &points))).collect();
        for _ in 0..receivers {
            let paths: Vec<(f64, f64, Complex64)> = (seen.iter())
                .map(|point| {
                    let (range, velocity) = range_and_velocity(&radar, point.position_m, point.velocity_mps);
                    let amplitude = 60.0 * point.area_m2.sqrt() / (range * range);
                    (range, velocity, Complex64::from_polar(amplitude, std::f64::consts::TAU * uniform()))
                })
                .collect();
            for index in 0..loops {
                for n in 0..count {
                    let of = |(range, velocity, amplitude): &(f64, f64, Complex64)| {
                        let beat = 2.0 * radar.slope_hz_per_s * range / SPEED_OF_LIGHT / radar.sample_rate_hz * n as f64;
                        let doppler = 2.0 * velocity / radar.wavelength_m() * radar.loop_period_s() * index as f64;
                        amplitude * Complex64::cis(std::f64::consts::TAU * (beat + doppler))
                    };
                    let noise = Complex64::from_polar((-(1.0 - uniform()).ln()).sqrt(), std::f64::consts::TAU * uniform());
                    samples.push(paths.iter().map(of).sum::<Complex64>() + noise);
                }
            }
        }
        bodies.push(points);
    }
    let starts = (0..frames).map(|frame| frame as f64 * radar.frame_period_s);
    let middle_s = starts.map(|start| start + 0.5 * radar.frame_duration_s()).collect();
    let body = BodyPrediction { parts: vec!["body".into()], frames: bodies, middle_s, ..BodyPrediction::default() };
    let room = Room { right_m: Some(2.4), floor_m: Some(1.1), front_m: Some(4.0), ..Room::default() };
    Evidence::new(Loaded::of_samples(radar, samples, [-1e3, 1e3]), Some(room), Some(body))
}
