use super::*;
use crate::baselines::test_support::{moving_ball, peak, radar};

fn baseline(person: &Person, config: RfGenesisConfig) -> RfGenesis {
    RfGenesis::new(&radar(), person, &config, &Device::flex()).unwrap()
}

/// A triangle that faces the radar across one pixel's ray.
fn triangle(distance_m: f64, velocity_mps: f64) -> Person {
    let pose_times_s: Vec<f64> = (0..31).map(|pose| pose as f64 / 60.0).collect();
    let at = |time: &f64| {
        let y = distance_m + velocity_mps * time;
        vec![[-0.05, y, -0.05], [0.05, y, -0.05], [0.0, y, 0.08]]
    };
    Person::Meshes { vertices: pose_times_s.iter().map(at).collect(), faces: vec![[0, 1, 2]], pose_times_s }
}

#[test]
fn one_triangle_is_in_its_range_and_doppler_bin() {
    let radar = radar();
    for velocity in [1.0, -2.5] {
        let signal = baseline(&triangle(3.0, velocity), RfGenesisConfig::default()).clean_signal(0).unwrap();
        let [found, range] = peak(&radar, signal);
        assert!((range - 3.0).abs() <= 0.5 * radar.range_resolution_m() + 0.01, "{range} m");
        assert!((found - velocity).abs() <= 0.55 * radar.velocity_resolution_mps(), "{found} m/s, wanted {velocity} m/s");
    }
}

#[test]
fn the_released_code_multiplies_doppler_by_frame_period_over_chirping_time() {
    let radar = radar();
    let ratio = radar.frame_period_s / (radar.loops_per_frame as f64 * radar.loop_period_s());
    assert!((ratio - 6.51).abs() < 0.01);
    let person = moving_ball([0.0, 3.0, 0.0], 0.1, [0.0, 0.6, 0.0]);
    let velocity = |config| peak(&radar, baseline(&person, config).clean_signal(1).unwrap())[0];
    let (corrected, released) = (velocity(RfGenesisConfig::default()), velocity(RfGenesisConfig::released()));
    let bin = radar.velocity_resolution_mps();
    assert!((corrected - 0.6).abs() <= 0.55 * bin, "{corrected} m/s");
    assert!((released - 0.6 * ratio).abs() <= 0.55 * bin, "{released} m/s, wanted {}", 0.6 * ratio);
}

#[test]
fn amplitude_falls_with_intensity_and_two_way_spreading() {
    let path = Path::new(&radar());
    let size = |distance_m: f64| {
        let [re, im] = path.amplitude([0.0, distance_m, 0.0], 1.0);
        // As the coherent sum divides it.
        re.hypot(im) / (distance_m * distance_m)
    };
    let wavelength_m = SPEED_OF_LIGHT / 77e9;
    assert!((size(3.0) / (wavelength_m / (4.0 * std::f64::consts::PI * 6.0)).powi(2) - 1.0).abs() < 1e-4);
    // −Sτ²/2 at 20 ns and 60 MHz/µs: 0.012 turns.
    let [re, im] = path.amplitude([0.0, 10e-9 * SPEED_OF_LIGHT, 0.0], 1.0);
    assert!((im.atan2(re) / std::f64::consts::TAU + 0.012).abs() < 1e-5);

    let image = |distance_m: f64| {
        let rendered = baseline(&triangle(distance_m, 0.0), RfGenesisConfig { pixels: 129, ..Default::default() });
        let images = rendered.images.lock().unwrap().range(0..1).unwrap();
        images[0].iter().flatten().copied().min_by(|a, b| a.distance_m.total_cmp(&b.distance_m)).unwrap()
    };
    let (near, far) = (image(2.0), image(4.0));
    assert!((near.distance_m - 2.0).abs() < 1e-3 && (near.intensity - 0.25).abs() < 1e-3, "{near:?}");
    assert!((near.intensity / far.intensity - 4.0).abs() < 0.01, "{far:?}");
}

#[test]
fn a_pixel_that_the_body_left_goes_dark_unless_released() {
    // Two ball's widths to the right in half a second.
    let person = moving_ball([-0.4, 2.5, 0.0], 0.2, [1.6, 0.0, 0.0]);
    let lit = |config: RfGenesisConfig, image: usize| {
        let rendered = baseline(&person, RfGenesisConfig { pixels: 64, ..config });
        let found = rendered.images.lock().unwrap().range(image..image + 1).unwrap();
        found[0].iter().flatten().count()
    };
    let (first, last) = (lit(RfGenesisConfig::default(), 0), lit(RfGenesisConfig::default(), 14));
    assert!(first > 20 && (first as f64 / last as f64 - 1.0).abs() < 0.2, "{first} and {last} pixels");
    assert!(lit(RfGenesisConfig::released(), 14) > 2 * last, "the trail stays");
}

#[test]
fn the_camera_widens_for_a_body_that_would_leave_it() {
    let width = |person: Person| baseline(&person, RfGenesisConfig::default()).images.lock().unwrap().camera().half_width;
    assert_eq!(width(triangle(3.0, 0.0)), 30f64.to_radians().tan());
    let aside = width(moving_ball([2.0, 2.0, 0.0], 0.1, [0.0; 3]));
    assert!(aside > 1.1 && aside < 1.3, "{aside}");
}

#[test]
fn the_last_frame_of_the_released_schedule_outlasts_the_motion_and_stays_finite() {
    let person = moving_ball([0.0, 3.0, 0.0], 0.1, [0.0, 1.0, 0.0]);
    // Frame 9 chirps from 0.45 s for 8 ms, or as released until 0.499 s; the motion ends at 0.5 s.
    let released = baseline(&person, RfGenesisConfig::released());
    peak(&radar(), released.clean_signal(9).unwrap());
    let error = baseline(&person, RfGenesisConfig::default()).clean_signal(10).err().unwrap();
    assert!(error.to_string().contains("outside the motion"), "{error}");
}

#[test]
fn settings_that_cannot_work_are_named() {
    let refused = |config: RfGenesisConfig| config.check().unwrap_err().to_string();
    assert!(refused(RfGenesisConfig { pixels: 0, ..Default::default() }).starts_with("`pixels` is 0"));
    assert!(refused(RfGenesisConfig { fov_deg: 180.0, ..Default::default() }).starts_with("`fov_deg` is 180"));
    assert!(refused(RfGenesisConfig { image_rate_hz: 0.0, ..Default::default() }).starts_with("`image_rate_hz` is 0"));
}
