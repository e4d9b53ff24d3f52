use super::*;
use crate::person::mesh;

fn extent(points: &[[f64; 3]], axis: usize) -> (f64, f64) {
    points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), point| (low.min(point[axis]), high.max(point[axis])))
}

fn regressed(model: &BodyModel, betas: &[f64]) -> Vec<[f64; 3]> {
    model.rest_joints(betas)
}

#[test]
fn every_subject_is_closed_and_as_tall_and_as_heavy_as_a_person() {
    for name in SUBJECTS {
        let config = subject(name).unwrap();
        let model = person(&config).unwrap();
        assert_eq!(mesh::check_closed(model.template.len(), &model.faces), Ok(()), "{name}");
        // One piece without handles.
        assert_eq!(model.template.len() as i64 - model.faces.len() as i64 / 2, 2, "{name}");
        let (low, high) = extent(&model.template, 1);
        assert!((high - low - config.height_m).abs() < 0.015, "{name}: {} m tall", high - low);
        let litres = 1e3 * mesh::volume(&model.template, &model.faces);
        let body_mass_index = litres / config.height_m.powi(2);
        assert!((17.0..36.0).contains(&body_mass_index), "{name}: {litres:.1} l, {body_mass_index:.1} kg/m2");
        assert!((2000..7000).contains(&model.template.len()), "{name}: {} vertices", model.template.len());
    }
}

#[test]
fn finer_grids_close_too_and_keep_the_volume() {
    let volume = |edge_m: f64| {
        let model = person(&PersonConfig { edge_m, ..PersonConfig::default() }).unwrap();
        mesh::volume(&model.template, &model.faces)
    };
    let fine = volume(0.016);
    // Chords cut off a curved surface by the square of their length.
    for edge_m in [0.032, 0.025, 0.02] {
        let found = volume(edge_m);
        assert!((found / fine - 1.0).abs() < 25.0 * edge_m * edge_m, "{edge_m}: {found} against {fine}");
    }
}

#[test]
fn edges_are_even_and_faces_look_outwards() {
    let config = PersonConfig::default();
    let model = person(&config).unwrap();
    let flesh = Flesh::new(&config, &Skeleton::new(&config));
    let mut lengths = Vec::new();
    for face in &model.faces {
        let [a, b, c] = face.map(|vertex| Vector3::from(model.template[vertex]));
        lengths.extend([(b - a).norm(), (c - b).norm(), (a - c).norm()]);
        let normal = (b - a).cross(&(c - a));
        assert!(normal.dot(&flesh.gradient(&((a + b + c) / 3.0))) > 0.0, "a face at {a} looks inwards");
    }
    let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    let worst = lengths.iter().fold((f64::INFINITY, 0.0f64), |(low, high), &length| (low.min(length), high.max(length)));
    assert!((0.6..1.2).contains(&(mean / config.edge_m)), "mean {mean}");
    assert!(worst.0 > 0.15 * mean && worst.1 < 2.5 * mean, "{worst:?} around {mean}");
}

#[test]
fn weights_sum_to_one_over_at_most_four_joints_and_every_joint_moves_something() {
    let model = person(&PersonConfig::default()).unwrap();
    let mut moved = [0.0f64; 24];
    for weights in &model.skinning {
        assert!(weights.len() <= 4 && weights.iter().all(|&(_, weight)| weight > 0.0));
        assert!((weights.iter().map(|&(_, weight)| weight).sum::<f64>() - 1.0).abs() < 1e-12);
        weights.iter().for_each(|&(joint, weight)| moved[joint] = moved[joint].max(weight));
    }
    assert!(moved.iter().all(|&weight| weight > 0.5), "{moved:?}");
}

#[test]
fn weights_do_not_leak_from_one_side_to_the_other() {
    let model = person(&PersonConfig::default()).unwrap();
    for (vertex, weights) in model.template.iter().zip(&model.skinning) {
        let left = weights.iter().any(|&(joint, _)| [4, 7, 10, 16, 18, 20, 22].contains(&joint));
        let right = weights.iter().any(|&(joint, _)| [5, 8, 11, 17, 19, 21, 23].contains(&joint));
        let leaked = (left && vertex[0] < 0.0) || (right && vertex[0] > 0.0);
        assert!(!leaked, "{vertex:?}: {weights:?}");
    }
}

#[test]
fn the_regressor_reproduces_the_joints_of_any_shape() {
    for name in SUBJECTS {
        let config = subject(name).unwrap();
        let model = person(&config).unwrap();
        for (parameter, label) in SHAPE_PARAMETERS.iter().enumerate().map(|(n, l)| (Some(n), *l)).chain([(None, "template")]) {
            let mut betas = [0.0; 5];
            let wanted = match parameter {
                Some(parameter) => {
                    betas[parameter] = 1.0;
                    Skeleton::new(&config.with_shape_unit(parameter))
                }
                None => Skeleton::new(&config),
            };
            for (joint, (found, wanted)) in regressed(&model, &betas).iter().zip(&wanted.joints).enumerate() {
                let error = (Vector3::from(*found) - wanted).norm();
                let tolerance = if parameter.is_none() { 1e-6 } else { 5e-4 };
                assert!(error < tolerance, "{name} {label} {}: {error}", crate::person::JOINT_NAMES[joint]);
            }
        }
        let largest = model.joint_regressor.iter().flatten().fold(0.0f64, |largest, &(_, weight)| largest.max(weight.abs()));
        assert!(largest < 1.0, "{name}: a weight of {largest}");
    }
}

#[test]
fn shape_parameters_do_what_they_are_called() {
    let model = person(&PersonConfig::default()).unwrap();
    let measure = |betas: &[f64]| {
        let (shaped, joints) = (model.shaped(betas), model.rest_joints(betas));
        let (low, high) = extent(&shaped, 1);
        [
            high - low,
            mesh::volume(&shaped, &model.faces),
            -joints[7][1],
            joints[16][0] - joints[17][0],
            joints[1][0] - joints[2][0],
        ]
    };
    let rest = measure(&[0.0; 5]);
    let grown = |parameter: usize| {
        let mut betas = [0.0; 5];
        betas[parameter] = 1.0;
        let changed = measure(&betas);
        std::array::from_fn::<f64, 5, _>(|n| changed[n] - rest[n])
    };
    assert!((grown(0)[0] - 0.04).abs() < 2e-3, "{:?}", grown(0));
    assert!(grown(1)[1] > 0.005 && grown(1)[0].abs() < 4e-3, "{:?}", grown(1));
    assert!((grown(2)[2] - 0.02 * 0.535 * 1.75).abs() < 2e-3 && grown(2)[0].abs() < 2e-3, "{:?}", grown(2));
    assert!((grown(3)[3] - 0.05 * 0.204 * 1.75).abs() < 2e-3, "{:?}", grown(3));
    assert!((grown(4)[4] - 0.05 * 0.104 * 1.75).abs() < 2e-3, "{:?}", grown(4));
}

#[test]
fn equal_measures_give_equal_bodies() {
    assert_eq!(person(&PersonConfig::default()).unwrap(), person(&PersonConfig::default()).unwrap());
}

#[test]
fn measures_that_nobody_has_are_refused() {
    let message = |config: PersonConfig| person(&config).unwrap_err().to_string();
    let plain = PersonConfig::default;
    assert_eq!(message(PersonConfig { height_m: 3.0, ..plain() }), "`person.height_m` is 3, expected 1.2 to 2.2 metres");
    assert_eq!(message(PersonConfig { edge_m: f64::NAN, ..plain() }), "`person.edge_m` is NaN, expected 0.006 to 0.032 metres");
    assert_eq!(subject("s9").unwrap_err().to_string(), "`subject` is s9, expected one of s1, s2, s3, s4, s5, s6");
}
