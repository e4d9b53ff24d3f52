//! Laws that a recording must keep, with known answers.

use std::f64::consts::PI;

use num_complex::Complex64;

use super::material::Material;
use super::receiver::range_doppler_power;
use super::record::Recorder;
use super::surface::{Returns, SurfaceConfig};
use super::test_support::{bare_world, gliding, plate, sphere, turning};
use super::world::{Reflector, World};
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::room::Room;

const METAL: Material = Material { permittivity: [1.0, 1e12], roughness_m: 0.0 };

fn energy(signal: &[Complex64]) -> f64 {
    signal.iter().map(Complex64::norm_sqr).sum()
}

fn difference_db(a: &[Complex64], b: &[Complex64]) -> f64 {
    let error: f64 = a.iter().zip(b).map(|(x, y)| (x - y).norm_sqr()).sum();
    10.0 * (error / energy(b)).log10()
}

/// Root mean square of the body's field in the first frame.
fn level(world: &World) -> f64 {
    let field = Recorder::new(world).unwrap().field(0).unwrap();
    (energy(&field) / field.len() as f64).sqrt()
}

#[test]
fn a_reflector_at_three_metres_peaks_in_its_bin() {
    let radar = Radar { samples_per_chirp: 256, ..Radar::small(1) };
    let world =
        World { furniture: vec![Reflector { position_m: [0.0, 3.0, 0.0], rcs_m2: 1.0 }], radar: radar.clone(), ..World::empty() };
    let field = Recorder::new(&world).unwrap().field(0).unwrap();
    let map = range_doppler_power(&field[..16 * 256], 256);
    let peak = (0..map.len()).max_by(|&a, &b| map[a].total_cmp(&map[b])).unwrap();
    assert_eq!(peak / 256, 0, "it stands still");
    assert_eq!(peak % 256, (3.0 / radar.range_resolution_m()).round() as usize);
}

#[test]
fn a_receding_body_has_a_positive_doppler_of_the_right_size() {
    let radar = Radar { samples_per_chirp: 128, loops_per_frame: 64, ..Radar::small(1) };
    for speed in [2.0, -2.0] {
        let world = bare_world(radar.clone(), gliding(sphere([0.0, 3.0, 0.0], 0.05, 3), [0.0, speed, 0.0]));
        let field = Recorder::new(&world).unwrap().field(0).unwrap();
        let map = range_doppler_power(&field[..64 * 128], 128);
        let peak = (0..map.len()).max_by(|&a, &b| map[a].total_cmp(&map[b])).unwrap() / 128;
        let doppler = if peak >= 32 { peak as f64 - 64.0 } else { peak as f64 };
        assert!((doppler - speed / radar.velocity_resolution_mps()).abs() <= 0.6, "{doppler}");
    }
}

#[test]
fn doubling_the_distance_of_a_small_reflector_costs_twelve_decibels() {
    let at = |range: f64| {
        level(&World { furniture: vec![Reflector { position_m: [0.0, range, 0.0], rcs_m2: 1.0 }], ..World::empty() })
    };
    // The antennas are a millimetre off the origin, which changes the twelve decibels by 1e-7.
    assert!((20.0 * (at(2.0) / at(4.0)).log10() - 12.0412).abs() < 1e-3);
}

#[test]
fn a_metal_sphere_has_the_cross_section_of_its_disc() {
    let (radius, range) = (0.1, 3.0);
    let radar = Radar { samples_per_chirp: 128, loops_per_frame: 1, ..Radar::small(1) };
    let mut world = bare_world(radar.clone(), gliding(sphere([0.0, range, 0.0], radius, 6), [0.0; 3]));
    world.skin = METAL;
    // From the nearest point of the sphere, with the spread of its curved mirror: r (r + a/2) instead of r².
    let nearest = range - radius;
    let wanted =
        radar.wavelength_m() * (PI * radius * radius).sqrt() / ((4.0 * PI).powf(1.5) * nearest * (nearest + 0.5 * radius));
    let db = 20.0 * (level(&world) / wanted).log10();
    assert!(db.abs() < 0.5, "{db:.2} dB from the geometric limit");
}

#[test]
fn a_metal_plate_has_its_physical_optics_cross_section() {
    let (side, range) = (0.06, 20.0);
    let radar = Radar { samples_per_chirp: 64, loops_per_frame: 1, ..Radar::small(1) };
    let mut world = bare_world(radar.clone(), gliding(plate([0.0, range, 0.0], side, 4), [0.0; 3]));
    world.skin = METAL;
    let wanted = side * side / (4.0 * PI * range * range);
    let db = 20.0 * (level(&world) / wanted).log10();
    assert!(db.abs() < 0.2, "{db:.3} dB from 4 pi A^2 / lambda^2");
}

#[test]
fn a_wide_metal_plate_is_a_mirror() {
    // A large plate shows the image of the transmitter: one leg of twice the distance, λ/(4π 2d).
    let distance = 0.5;
    let radar = Radar { samples_per_chirp: 256, loops_per_frame: 1, ..Radar::small(1) };
    let mut world = bare_world(radar.clone(), gliding(plate([0.013, distance, 0.007], 0.9, 90), [0.0; 3]));
    world.skin = METAL;
    let wanted = radar.wavelength_m() / (4.0 * PI * 2.0 * distance);
    // The plate's edges ripple the sum along the sweep by some percent; the mean shows the mirror.
    let db = 20.0 * (level(&world) / wanted).log10();
    assert!(db.abs() < 0.5, "{db:.2} dB from the mirror image");
}

#[test]
fn the_surface_integral_converges_and_vertices_do_not() {
    // Coarse facets of 30 mm, tilted and curved: only the cutting changes, never the surface.
    let mesh = sphere([0.1, 2.0, 0.2], 0.2, 3);
    let radar = Radar { samples_per_chirp: 128, loops_per_frame: 1, rx_m: vec![[0.0; 3]], ..Radar::small(1) };
    let field = |returns, edge_m| {
        let mut world = bare_world(radar.clone(), gliding(mesh.clone(), [0.0; 3]));
        world.surface = SurfaceConfig { returns, edge_m, ..world.surface };
        Recorder::new(&world).unwrap().field(0).unwrap()
    };
    let converged = field(Returns::Facets, 1.0e-3);
    let errors = [1.2e-2, 5.0e-3, 2.5e-3].map(|edge_m| difference_db(&field(Returns::Facets, edge_m), &converged));
    println!("facets cut to 12, 5 and 2.5 mm against 1 mm: {errors:.1?} dB");
    assert!(errors[0] < -25.0 && errors[1] < -40.0 && errors[2] < -50.0, "{errors:.1?} dB");
    assert!(errors[0] > errors[1] && errors[1] > errors[2]);
    let vertices = difference_db(&field(Returns::Vertices, 5.0e-3), &converged);
    assert!(vertices > 0.0, "vertices 30 mm apart are not a surface: {vertices:.1} dB");
}

#[test]
fn the_fast_path_agrees_with_the_reference_to_minus_eighty_decibels() {
    // A ball on a long arm: 3 m/s and 6 rad/s, direct and over a wall, with two transmitters, across several poses.
    let radar = Radar {
        samples_per_chirp: 64,
        loops_per_frame: 6,
        tx_m: vec![[-0.02, 0.0, 0.0], [-0.016, 0.0, 0.002]],
        ..Radar::small(1)
    };
    for returns in [Returns::Facets, Returns::Vertices, Returns::Random] {
        let mut world =
            bare_world(radar.clone(), turning(sphere([0.3, 1.5, 0.1], 0.06, 2), [0.0, 1.5, 0.0], [1.0, -1.5, 0.5], 6.0));
        world.surface = SurfaceConfig { returns, variation_db: 2.0, ..world.surface };
        world.skin = Material::SKIN;
        world.room = Room { left_m: Some(1.0), ..Room::default() };
        world.walls.images = 2;
        let recorder = Recorder::new(&world).unwrap();
        let scatter = recorder.scatter().unwrap();
        let db = difference_db(&scatter.frame(0).unwrap(), &scatter.reference_frame(0, &|_, _, _| 0.0).unwrap());
        println!("{returns:?}: {db:.1} dB");
        assert!(db < -80.0, "{returns:?}: {db:.1} dB");
    }
}

#[test]
fn an_image_in_a_wall_is_the_explicit_reflected_path() {
    // A tiny facet; its first-order returns against the path over the reflection point, computed by hand.
    let (side, wall) = (2.0e-4, 1.2);
    let radar = Radar { loops_per_frame: 1, tx_m: vec![[0.0; 3]], rx_m: vec![[0.0; 3]], ..Radar::small(1) };
    let mut world = bare_world(radar.clone(), gliding(plate([0.4, 2.0, 0.1], side, 1), [0.0; 3]));
    world.skin = METAL;
    let direct = Recorder::new(&world).unwrap().field(0).unwrap();
    world.room = Room { right_m: Some(wall), ..Room::default() };
    world.walls.images = 1;
    world.walls.image_coefficient = Some(0.35);
    let both = Recorder::new(&world).unwrap().field(0).unwrap();
    // Where the ray from the antenna to the wall to the facet is reflected: similar triangles.
    let point: [f64; 3] = [0.4, 2.0, 0.1];
    let fraction = wall / (wall + (wall - point[0]));
    let bounce = [wall, fraction * point[1], fraction * point[2]];
    let norm = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let second: [f64; 3] = std::array::from_fn(|axis| point[axis] - bounce[axis]);
    let (straight, bent) = (norm(point), norm(bounce) + norm(second));
    let cosine = 0.5 * (point[1] / straight + second[1] / norm(second));
    let amplitude = 2.0 * 0.35 * side * side * cosine / (4.0 * PI * straight * bent);
    let delay = (straight + bent) / SPEED_OF_LIGHT;
    for (sample, (a, b)) in both.iter().zip(&direct).enumerate() {
        let t = sample as f64 / radar.sample_rate_hz;
        let turns = radar.carrier_hz() * delay + radar.slope_hz_per_s * (t * delay - 0.5 * delay * delay);
        // The metal plate turns the sign.
        let wanted = -amplitude * Complex64::cis(std::f64::consts::TAU * turns.fract());
        assert!(((a - b) - wanted).norm() < 5e-3 * amplitude, "sample {sample}: {} against {wanted}", a - b);
    }
}

#[test]
fn equal_seeds_give_equal_recordings_and_others_do_not() {
    let world = |seed| World {
        room: Room { front_m: Some(4.0), floor_m: Some(1.0), ..Room::default() },
        person: Some(gliding(sphere([0.0, 2.0, 0.0], 0.2, 2), [0.0, 0.5, 0.0])),
        radar: Radar::small(2),
        surface: SurfaceConfig { returns: Returns::Random, ..SurfaceConfig::default() },
        mesh_error_m: 1e-3,
        seed,
        ..World::default()
    };
    let record = |seed| super::record(&world(seed), &mut |_, _| {}).unwrap();
    let first = record(7);
    assert_eq!(first, record(7));
    assert_ne!(first, record(8));
}

#[test]
fn a_baseline_world_has_an_empty_truth_and_every_effect_is_listed() {
    let mut world =
        World { room: Room { left_m: Some(2.0), floor_m: Some(1.0), ..Room::default() }, mesh_error_m: 2e-3, ..World::default() };
    let truth = super::truth(&world, Some("lunge"));
    assert_eq!(truth["effects"], serde_json::json!([]));
    assert_eq!((truth["tier"].as_str(), truth["snr_db"].as_f64()), (Some("A"), Some(40.0)));
    world.walls.images = 1;
    world.furniture = vec![Reflector { position_m: [0.5, 3.0, 0.0], rcs_m2: 0.1 }];
    world.antenna_exponent = 2.0;
    world.surface.returns = Returns::Random;
    let truth = super::truth(&world, None);
    let names: Vec<_> = truth["effects"].as_array().unwrap().iter().map(|effect| effect["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["wall_ghost", "floor_bounce", "static_reflector", "antenna_pattern"]);
    assert_eq!(truth["tier"], "B");
}
