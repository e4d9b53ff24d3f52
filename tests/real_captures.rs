//! Recordings of real radars show what their descriptions say.
//!
//! The wanted numbers were found with NumPy, independently of this crate. The recordings lie in `$HYBRIDSIM_SHARED`, or in
//! `../shared` beside the crate; without them these tests count as skipped.

use crate::support;

use hybridsim::data::Recording;
use hybridsim::evaluation::measured_frame;
use hybridsim::heatmap::{Analysis, Gate, HeatmapConfig, Map, Samples, Scan, StaticRemoval, remove_static};
use hybridsim::radar::Radar;
use num_complex::Complex32;

struct Capture {
    radar: Radar,
    values: Vec<Complex32>,
}

impl Capture {
    fn read(name: &str) -> Option<Self> {
        let recording = Recording::open(support::shared(&format!("recordings/real/{name}"))?).unwrap();
        let frame = |index| measured_frame(&recording, index).unwrap();
        let values = (0..recording.frames()).flat_map(frame).collect();
        let radar = recording.radar;
        Some(Self { radar, values })
    }

    fn samples(&self) -> Samples<'_> {
        Samples::new(&self.values, self.radar.dims())
    }

    fn without_static(&self, removal: StaticRemoval) -> Self {
        Self { radar: self.radar.clone(), values: remove_static(self.samples(), removal) }
    }

    fn analysis(&self) -> Analysis {
        Analysis::new(&self.radar, &HeatmapConfig::default())
    }

    fn map(&self) -> Map {
        self.analysis().range_doppler(self.samples().frame(0))
    }
}

#[track_caller]
fn close(what: &str, found: f64, wanted: f64, tolerance: f64) {
    assert!((found - wanted).abs() <= tolerance, "{what}: found {found}, wanted {wanted} ± {tolerance}");
}

#[test]
fn two_people_at_one_range_move_with_opposite_velocities() {
    let Some(capture) = Capture::read("two_people_77ghz") else { return };
    let moving = capture.without_static(StaticRemoval::Loops);
    let map = moving.map();
    // range, velocity and azimuth of each
    let people = [(2.93, 0.56, -7.0), (2.98, -0.48, 16.0)];
    for (range, velocity, azimuth) in people {
        let sign = f64::signum(velocity);
        let [row, column] = map.peak_where(|v, _| v * sign > 0.3).unwrap();
        close("velocity", map.rows.values[row], velocity, 0.09);
        close("range", map.columns.values[column], range, 0.05);
        let over_noise = 10.0 * (map.at(row, column) / map.median()).log10();
        assert!(over_noise > 40.0, "{over_noise:.1} dB over the median cell");
        let gate = Gate { range_m: Some([range - 0.1, range + 0.1]), velocity_mps: Some([velocity - 0.09, velocity + 0.09]) };
        let angles = moving.analysis().range_angle(moving.samples().frame(0), &Scan::azimuth(75.0, 1.0), &gate);
        close("azimuth", angles.rows.values[angles.peak()[0]], azimuth, 2.0);
    }
}

#[test]
fn a_room_shows_leakage_and_walls_and_nobody_who_moves_fast() {
    let Some(capture) = Capture::read("room_60ghz") else { return };
    let map = capture.map();
    let still = map.dims()[0] / 2;
    // 85 loops: zero Doppler is row 42, and it holds the strongest cell
    assert_eq!((still, map.peak()[0]), (42, 42));
    let power = |rows: std::ops::RangeInclusive<usize>| -> f64 {
        rows.map(|row| (0..map.dims()[1]).map(|column| map.at(row, column)).sum::<f64>()).sum()
    };
    // a Hann window spreads what is still over three rows
    let share = power(still - 1..=still + 1) / power(0..=84);
    assert!(share > 0.99, "{share} of the power does not move");
    // the transmitter's leakage, between the bins 2 and 3, and reflections of the room
    let profile: Vec<f64> = (0..map.dims()[1]).map(|column| 10.0 * map.at(still, column).log10()).collect();
    let local_peak = |wanted_m: f64| {
        let near = map.columns.nearest(wanted_m);
        let peak = (near - 2..=near + 2).max_by(|&a, &b| profile[a].total_cmp(&profile[b])).unwrap();
        assert!(profile[peak] > profile[peak - 2] && profile[peak] > profile[peak + 2], "no peak near {wanted_m} m");
        (map.columns.values[peak], profile[peak])
    };
    let mut sorted = profile.clone();
    sorted.sort_by(f64::total_cmp);
    let background = sorted[sorted.len() / 2];
    let (leakage, strength) = local_peak(0.12);
    assert!(leakage < 0.2 && strength > background + 25.0, "leakage at {leakage} m, {strength} over {background} dB");
    for wall_m in [1.06, 1.57, 8.48, 16.80] {
        let (found, strength) = local_peak(wall_m);
        close("reflection", found, wall_m, 0.05);
        assert!(strength > background + 15.0, "{strength} over {background} dB at {found} m");
    }
    // what is left moves by less than the breathing of a person
    let moving = capture.without_static(StaticRemoval::Loops).map();
    let speed = moving.rows.values[moving.peak()[0]].abs();
    assert!(speed < 0.05, "{speed} m/s");
}

#[test]
fn a_seated_person_breathes_fourteen_times_a_minute_a_third_of_a_metre_away() {
    let Some(capture) = Capture::read("breathing_60ghz") else { return };
    // offset binary codes: the middle of the scale is not zero
    let mean = capture.values.iter().map(|v| v.re).sum::<f32>() / capture.values.len() as f32;
    close("mean code", mean.into(), 1870.7, 1.0);
    let changing = capture.without_static(StaticRemoval::Frames);
    let map = changing.analysis().time_range(changing.samples(), &Gate::default());
    assert_eq!(map.dims(), [32, 256]);
    let totals: Vec<f64> = map.values.chunks_exact(256).map(|row| row.iter().sum()).collect();
    let bin = (0..32).max_by(|&a, &b| totals[a].total_cmp(&totals[b])).unwrap();
    close("range", map.rows.values[bin], 0.333, 0.03);

    // the phase of that bin over the frames, of the recording as it is, follows the chest
    let profiles = capture.analysis().range_profiles(&capture.values);
    let [frames, _, receivers, loops, _] = capture.radar.dims();
    for rx in 0..receivers {
        let value = |frame: usize| -> num_complex::Complex64 {
            (0..loops).map(|index| profiles[((frame * receivers + rx) * loops + index) * 32 + bin]).sum()
        };
        let phase = unwrapped((0..frames).map(|frame| value(frame).arg()).collect());
        let rate = 60.0 * strongest_rate_hz(&phase, capture.radar.frame_period_s);
        close("breaths a minute", rate, 14.3, 0.5);
    }
}

fn unwrapped(mut phase: Vec<f64>) -> Vec<f64> {
    for index in 1..phase.len() {
        let step = phase[index] - phase[index - 1];
        phase[index] -= (step / std::f64::consts::TAU).round() * std::f64::consts::TAU;
    }
    phase
}

/// Of a signal without its line, between 6 and 42 a minute, under a Hann window.
fn strongest_rate_hz(signal: &[f64], period_s: f64) -> f64 {
    let count = signal.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let mean = signal.iter().sum::<f64>() / count;
    let slope = signal.iter().enumerate().map(|(n, value)| (n as f64 - middle) * value).sum::<f64>()
        / (0..signal.len()).map(|n| (n as f64 - middle).powi(2)).sum::<f64>();
    let power = |rate_hz: f64| {
        let sum: num_complex::Complex64 = signal
            .iter()
            .enumerate()
            .map(|(n, value)| {
                let window = 0.5 - 0.5 * (std::f64::consts::TAU * n as f64 / count).cos();
                let left = value - mean - slope * (n as f64 - middle);
                num_complex::Complex64::from_polar(window * left, -std::f64::consts::TAU * rate_hz * n as f64 * period_s)
            })
            .sum();
        sum.norm_sqr()
    };
    (100..700).map(|step| step as f64 * 1e-3).max_by(|&a, &b| power(a).total_cmp(&power(b))).unwrap()
}
