use burn::tensor::{DType, Device, Tensor, TensorData};

use super::test_bodies::{random_body, shared_body, sphere};
use super::*;
use crate::radar::SPEED_OF_LIGHT;

const VERTICES: usize = 50;
const JOINTS: usize = 6;

fn walker() -> Person {
    let poses = (0..40)
        .map(|pose| (0..JOINTS).map(|joint| [0.0, 0.3 * (0.2 * pose as f64 + joint as f64).sin(), 0.02 * pose as f64]).collect())
        .collect();
    let motion = Motion {
        poses,
        translations: (0..40).map(|pose| [0.0, 0.9, 0.02 * pose as f64]).collect(),
        betas: vec![0.5, -0.2],
        rate_hz: 60.0,
    };
    let placement = Placement { start_s: 0.1, origin_m: [0.2, 3.5, -1.0], ..Default::default() };
    Person::Skinned { model: random_body(VERTICES, JOINTS, 11), motion, placement }
}

fn body(person: &Person, sampling: Sampling) -> PosedBody {
    PosedBody::new(person, &SurfaceConfig { sampling, edge_m: 0.3, ..Default::default() }, Interpolation::Cubic).unwrap()
}

fn chirps() -> Vec<f64> {
    (0..128).map(|chirp| 0.3 + 72e-6 * chirp as f64).collect()
}

fn values(tensor: Tensor<2>) -> Vec<f64> {
    tensor.into_data().convert::<f64>().try_to_vec().unwrap()
}

/// Where the points are at some time, from the host alone.
fn exact(body: &PosedBody, time: f64) -> Vec<[f64; 3]> {
    body.frame(&[time]).unwrap().position_m
}

#[test]
fn displacements_follow_the_motion_and_keep_the_carrier_phase_in_single_precision() {
    for sampling in [Sampling::Vertices, Sampling::Subdivided, Sampling::Facets] {
        let body = body(&walker(), sampling);
        let frame = body.frame(&chirps()).unwrap();
        let points: Vec<usize> = (0..body.surface().len()).collect();
        let moved = body.displacement(&frame, &points, 0..128, None, &Device::flex());
        assert_eq!(moved.x.dims(), [points.len(), 128]);
        let parts = [moved.x, moved.y, moved.z].map(values);
        let (mut worst, mut largest) = (0f64, 0f64);
        for chirp in [0, 40, 127] {
            for (point, position) in exact(&body, chirps()[chirp]).iter().enumerate() {
                for axis in 0..3 {
                    let found = frame.position_m[point][axis] + parts[axis][point * 128 + chirp];
                    worst = worst.max((found - position[axis]).abs());
                    largest = largest.max(parts[axis][point * 128 + chirp].abs());
                }
            }
        }
        let phase = 2.0 * std::f64::consts::TAU * worst * 77e9 / SPEED_OF_LIGHT;
        println!("{sampling:?}: {worst:.1e} m off, {phase:.1e} rad two-way at 77 GHz, displacements up to {largest:.3} m");
        assert!(worst < 1.5e-8 && largest > 1e-3, "{sampling:?}: {worst} m of {largest} m");
    }
}

#[test]
fn a_chosen_part_equals_the_same_part_of_the_whole() {
    let body = body(&walker(), Sampling::Vertices);
    let frame = body.frame(&chirps()).unwrap();
    let whole = values(body.displacement(&frame, &(0..VERTICES).collect::<Vec<_>>(), 0..128, None, &Device::flex()).y);
    let part = values(body.displacement(&frame, &[7, 3], 10..14, None, &Device::flex()).y);
    let wanted: Vec<f64> = [7, 3].iter().flat_map(|point| &whole[point * 128 + 10..point * 128 + 14]).copied().collect();
    assert!(part.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-9), "{part:?} {wanted:?}");
}

#[test]
fn velocity_is_the_derivative_of_the_displacement() {
    let body = body(&walker(), Sampling::Vertices);
    let frame = body.frame(&chirps()).unwrap();
    let options = (&Device::flex(), DType::F64);
    let velocity = values(body.velocity(&frame, &[5], 0..128, options).y);
    let moved = values(body.displacement(&frame, &[5], 0..128, None, options).y);
    for chirp in 1..127 {
        let difference = (moved[chirp + 1] - moved[chirp - 1]) / (2.0 * 72e-6);
        assert!(
            (velocity[chirp] - difference).abs() < 2e-4 * (1.0 + difference.abs()),
            "{chirp}: {} {difference}",
            velocity[chirp]
        );
    }
    let middle = 0.5 * (velocity[63] + velocity[64]);
    assert!((frame.velocity_mps[5][1] - middle).abs() < 1e-4);
}

pub(crate) fn a_canonical_offset_turns_with_the_body_and_carries_a_gradient() {
    let person = walker();
    let body = body(&person, Sampling::Vertices);
    let frame = body.frame(&chirps()).unwrap();
    let device = Device::flex().autodiff();
    let points = [4, 9];
    let shift = [0.01, -0.02, 0.005, 0.0, 0.0, 0.0];
    let offset = Tensor::<2>::from_data(TensorData::new(shift.to_vec(), [2, 3]), (&device, DType::F64)).require_grad();
    let moved = body.displacement(&frame, &points, 0..2, Some(offset.clone()), (&device, DType::F64));
    let still = body.displacement(&frame, &points, 0..2, None, (&device, DType::F64));
    let turn: Matrix = frame.basis.row(0).iter().enumerate().map(|(pose, &weight)| body.rotation(&frame, 4, pose) * weight).sum();
    let wanted = turn * Vector::new(0.01, -0.02, 0.005);
    let change = |a: &Tensor<2>, b: &Tensor<2>| values(a.clone() - b.clone());
    let [x, y, z] = [change(&moved.x, &still.x), change(&moved.y, &still.y), change(&moved.z, &still.z)];
    assert!((Vector::new(x[0], y[0], z[0]) - wanted).norm() < 1e-12);
    assert!(x[2] == 0.0 && y[2] == 0.0 && z[2] == 0.0, "the other point has no offset");
    let gradients = moved.y.narrow(0, 0, 1).narrow(1, 0, 1).sum().backward();
    let gradient = values(offset.grad(&gradients).unwrap());
    for axis in 0..3 {
        crate::support::compared(&[turn[(1, axis)]]);
        assert!((gradient[axis] - turn[(1, axis)]).abs() < 1e-12, "d y / d offset is the rotation's second row");
    }
    assert!(gradient[3..].iter().all(|&entry| entry == 0.0));
}

#[test]
fn meshes_move_as_the_skinned_body_they_were_made_from() {
    let person = walker();
    let skinned = body(&person, Sampling::Vertices);
    let vertices = (0..40).map(|pose| skinned.vertices_at_pose(pose)).collect();
    let meshes = Person::Meshes { vertices, faces: person.faces().to_vec(), pose_times_s: person.pose_times_s() };
    let meshes = body(&meshes, Sampling::Vertices);
    let (a, b) = (skinned.frame(&chirps()).unwrap(), meshes.frame(&chirps()).unwrap());
    assert_eq!((a.position_m, a.area_m2), (b.position_m.clone(), b.area_m2.clone()));
    assert_eq!(values(meshes.displacement(&b, &[1], 0..2, None, &Device::flex()).x).len(), 2);
}

#[test]
fn offsets_of_a_rigid_mesh_turn_with_it() {
    let (ball, faces) = sphere(1, 0.3);
    let turn = |angle: f64| kinematics::rotation([0.0, 0.0, angle]);
    let posed = |angle: f64| {
        ball.iter().map(|&vertex| (turn(angle) * Vector::from(vertex) + Vector::new(0.0, 2.0, 0.0)).into()).collect()
    };
    let person = Person::Meshes {
        vertices: (0..5).map(|pose| posed(0.1 * pose as f64)).collect(),
        faces,
        pose_times_s: vec![0.0, 0.1, 0.2, 0.3, 0.4],
    };
    let body = body(&person, Sampling::Facets);
    let frame = body.frame(&[0.15, 0.16]).unwrap();
    for pose in 0..frame.basis.poses.len() {
        let wanted = turn(0.1 * (frame.basis.poses.start + pose) as f64);
        assert!((body.rotation(&frame, 3, pose) - wanted).norm() < 1e-12, "{pose}");
    }
}

#[test]
fn facet_edges_join_the_corners_at_every_chirp() {
    let body = body(&walker(), Sampling::Facets);
    let frame = body.frame(&chirps()).unwrap();
    let edges = body.facet_edges(&frame, &[6], 0..128, (&Device::flex(), DType::F64));
    // The centre is a third of the way along both edges: corner + (second + third)/3 = point.
    let corner = body.surface().corners[6][0];
    let vertices = PosedBody::new(&walker(), &SurfaceConfig::vertices(), Interpolation::Cubic).unwrap();
    for chirp in [0, 127] {
        let time = chirps()[chirp];
        let (point, corner) = (exact(&body, time)[6], exact(&vertices, time)[corner]);
        let found = values(edges.second.z.clone())[chirp] + values(edges.third.z.clone())[chirp];
        assert!((corner[2] + found / 3.0 - point[2]).abs() < 1e-12);
    }
}

#[test]
fn bad_persons_get_the_reason() {
    let refused = |change: &dyn Fn(&mut BodyModel, &mut Motion)| {
        let Person::Skinned { mut model, mut motion, placement } = walker() else { unreachable!() };
        change(&mut model, &mut motion);
        PosedBody::new(&Person::Skinned { model, motion, placement }, &SurfaceConfig::vertices(), Interpolation::Linear)
            .unwrap_err()
            .to_string()
    };
    assert!(
        refused(&|_, motion| motion.poses[3][2][1] = f64::NAN).contains("pose 3 of the motion holds numbers that are not finite")
    );
    assert!(refused(&|_, motion| motion.poses[5].truncate(2)).contains("pose 5 has 2 joints, the body 6"));
    assert!(refused(&|model, _| model.skinning.truncate(7)).contains("7 skinning weights, expected 50"));
    assert!(refused(&|model, _| model.faces[0] = [0, 1, 50]).contains("a face has the vertices [0, 1, 50]"));
    assert!(refused(&|model, _| model.parents[1] = Some(4)).contains("before its parent"));
    assert!(refused(&|model, _| model.template[0][0] = f64::INFINITY).contains("not finite"));
    let late = body(&walker(), Sampling::Vertices).frame(&[0.9]).unwrap_err().to_string();
    assert!(late.contains("outside the motion, which lasts from 0.1000 s to 0.7500 s"), "{late}");
}

#[test]
fn a_frame_of_a_full_body_takes_tens_of_milliseconds() {
    let Some(model) = shared_body("neutral_lite") else { return };
    let poses = (0..10).map(|pose| (0..24).map(|joint| [0.02 * pose as f64, 0.1 * joint as f64, 0.0]).collect()).collect();
    let motion = Motion { poses, translations: vec![[0.0; 3]; 10], betas: vec![0.2; 10], rate_hz: 60.0 };
    let person = Person::Skinned { model, motion, placement: Placement::default() };
    let body = PosedBody::new(&person, &SurfaceConfig::vertices(), Interpolation::Cubic).unwrap();
    let times: Vec<f64> = (0..128).map(|chirp| 0.06 + 72e-6 * chirp as f64).collect();
    let points: Vec<usize> = (0..6890).collect();
    let best = |run: &dyn Fn()| {
        let time = |_| {
            let start = std::time::Instant::now();
            run();
            start.elapsed().as_secs_f64()
        };
        (0..3).map(time).fold(f64::INFINITY, f64::min)
    };
    let frame = body.frame(&times).unwrap();
    let host = best(&|| drop(body.frame(&times).unwrap()));
    let device = best(&|| drop(body.displacement(&frame, &points, 0..128, None, &Device::flex())));
    println!(
        "frame {:.1} ms ({} poses), displacement of 6890 points {:.1} ms",
        1e3 * host,
        frame.basis.poses.len(),
        1e3 * device
    );
    assert!(host < 1.0 && device < 1.0, "an order of magnitude slower than it should be: {host} s, {device} s");
}

#[test]
fn facets_in_closed_form_come_close_to_the_finely_split_surface() {
    /// Real and imaginary part per point, or none for 1.
    type Factor = dyn Fn(&PosedBody, &BodyFrame) -> Option<(Vec<f64>, Vec<f64>)>;
    const WAVELENGTH_M: f64 = 3.8e-3;
    let (ball, faces) = sphere(4, 0.15);
    let ball: Vec<[f64; 3]> = ball.iter().map(|p| [p[0] + 0.1, p[1] + 2.0, p[2] + 0.05]).collect();
    let person = Person::Meshes { vertices: vec![ball.clone(), ball], faces, pose_times_s: vec![0.0, 1.0] };
    let k = std::f64::consts::TAU / WAVELENGTH_M;
    // Coherent return of the lit side, with the cosine of incidence as amplitude.
    let coherent_return = |sampling: Sampling, factor: &Factor| {
        let body =
            PosedBody::new(&person, &SurfaceConfig { sampling, edge_m: 0.9e-3, ..Default::default() }, Interpolation::Linear)
                .unwrap();
        let frame = body.frame(&[0.5]).unwrap();
        let factor = factor(&body, &frame);
        (0..body.surface().len()).fold(nalgebra::Complex::new(0.0, 0.0), |sum, point| {
            let position = Vector::from(frame.position_m[point]);
            let cosine = (-Vector::from(frame.normal[point]).dot(&position.normalize())).max(0.0);
            let factor =
                factor.as_ref().map_or(nalgebra::Complex::new(1.0, 0.0), |(re, im)| nalgebra::Complex::new(re[point], im[point]));
            sum + factor * nalgebra::Complex::from_polar(frame.area_m2[point] * cosine, 2.0 * k * position.norm())
        })
    };
    let split = coherent_return(Sampling::Subdivided, &|_, _| None);
    let centres = coherent_return(Sampling::Facets, &|_, _| None);
    let closed = coherent_return(Sampling::Facets, &|body, frame| {
        let points: Vec<usize> = (0..body.surface().len()).collect();
        let options = (&Device::flex(), DType::F32);
        let still = body.displacement(frame, &points, 0..1, None, options);
        let wave = facets::wavevector(&frame.position_m, &still, [[0.0; 3]; 2], WAVELENGTH_M);
        let mean = facet_integral(&body.facet_edges(frame, &points, 0..1, options), &wave);
        Some((values(mean.re), values(mean.im)))
    });
    let db = |found: nalgebra::Complex<f64>| 20.0 * ((found - split).norm() / split.norm()).log10();
    println!("11 mm facets at 2 m: closed form {:.1} dB, their centres alone {:.1} dB", db(closed), db(centres));
    assert!(db(closed) < -32.0 && db(centres) > 0.0);
}
