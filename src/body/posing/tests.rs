use burn::tensor::{DType, Device, Tensor, TensorData};

use super::*;
use crate::body::test_bodies::random_body;
use crate::body::{Interpolation, PoseCorrection, Sampling, SurfaceConfig};
use crate::person::{Motion, Person, Placement};
use crate::radar::SPEED_OF_LIGHT;
use crate::support::cpu_devices;

const VERTICES: usize = 24;
const JOINTS: usize = 5;
const KNOTS: usize = 3;

fn walker() -> Person {
    let poses = (0..20)
        .map(|pose| (0..JOINTS).map(|joint| [0.1, 0.3 * (0.2 * pose as f64 + joint as f64).sin(), 0.02 * pose as f64]).collect())
        .collect();
    let motion = Motion {
        poses,
        translations: (0..20).map(|pose| [0.0, 0.9, 0.02 * pose as f64]).collect(),
        betas: vec![0.5, -0.2],
        rate_hz: 30.0,
    };
    let placement = Placement { start_s: 0.1, origin_m: [0.2, 3.5, -1.0], ..Default::default() };
    Person::Skinned { model: random_body(VERTICES, JOINTS, 11), motion, placement }
}

/// Times in radar seconds, around 0.4 s.
fn chirps() -> Vec<f64> {
    (0..6).map(|chirp| 0.4 + 2e-3 * chirp as f64).collect()
}

/// A correction of centimetres and degrees that is not the body's own.
fn correction() -> PoseCorrection {
    let wave = |seed: usize| 0.04 * (seed as f64).sin();
    PoseCorrection {
        clock_s: 0.012,
        heading_rad: 0.05,
        pivot_m: [0.3, 3.4, 0.0],
        shift_m: [0.03, -0.02, 0.01],
        betas: vec![0.3, -0.1],
        knots_s: vec![0.0, 0.3, 0.6],
        turns_rad: (0..KNOTS)
            .map(|knot| (0..JOINTS).map(|joint| std::array::from_fn(|axis| wave(7 * knot + 3 * joint + axis))).collect())
            .collect(),
        shifts_m: (0..KNOTS).map(|knot| std::array::from_fn(|axis| 0.5 * wave(5 * knot + axis))).collect(),
    }
}

/// The kinds of parameters, as flat lists.
const KINDS: [&str; 6] = ["clock", "heading", "shift", "shape", "turns per knot", "shifts per knot"];

fn flat(correction: &PoseCorrection) -> [Vec<f64>; 6] {
    [
        vec![correction.clock_s],
        vec![correction.heading_rad],
        correction.shift_m.to_vec(),
        correction.betas.clone(),
        correction.turns_rad.iter().flatten().flatten().copied().collect(),
        correction.shifts_m.iter().flatten().copied().collect(),
    ]
}

fn unflat(like: &PoseCorrection, values: &[Vec<f64>; 6]) -> PoseCorrection {
    let vectors = |flat: &[f64]| -> Vec<[f64; 3]> { flat.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect() };
    PoseCorrection {
        clock_s: values[0][0],
        heading_rad: values[1][0],
        shift_m: [values[2][0], values[2][1], values[2][2]],
        betas: values[3].clone(),
        turns_rad: vectors(&values[4]).chunks_exact(JOINTS).map(<[_]>::to_vec).collect(),
        shifts_m: vectors(&values[5]),
        ..like.clone()
    }
}

fn tracked(values: &[Vec<f64>; 6], device: &Device, dtype: DType) -> ([Tensor<1>; 6], PoseTensors) {
    let flat: [Tensor<1>; 6] = std::array::from_fn(|kind| {
        let values = values[kind].clone();
        let tensor = Tensor::from_data(TensorData::new(values.clone(), [values.len()]), (device, dtype));
        if device.is_autodiff() { tensor.require_grad() } else { tensor }
    });
    let [clock, heading, shift, betas, turns, shifts] = flat.clone();
    let pose = PoseTensors {
        clock_s: Some(clock),
        heading_rad: Some(heading),
        shift_m: Some(shift),
        betas: Some(betas),
        turns_rad: Some(turns.reshape([KNOTS, JOINTS, 3])),
        shifts_m: Some(shifts.reshape([KNOTS, 3])),
    };
    (flat, pose)
}

fn body(sampling: Sampling) -> PosedBody {
    PosedBody::new(&walker(), &SurfaceConfig { sampling, edge_m: 0.6, ..Default::default() }, Interpolation::Cubic).unwrap()
}

const SAMPLINGS: [Sampling; 3] = [Sampling::Vertices, Sampling::Subdivided, Sampling::Facets];

/// What a frame is, point by point: positions at all chirps (x, y, z), normals, areas, and where facets are sampled their edges.
fn host(body: &PosedBody, frame: &BodyFrame, origin: &BodyFrame, points: &[usize]) -> [Vec<f64>; 3] {
    let options = (&Device::flex(), DType::F64);
    let all = 0..chirps().len();
    let moved = body.displacement(frame, points, all.clone(), None, options);
    let mut positions = Vec::new();
    for (axis, part) in [moved.x, moved.y, moved.z].into_iter().enumerate() {
        let rest = |row: usize| frame.position_m[points[row]][axis] - origin.position_m[points[row]][axis];
        positions.extend(values(part).iter().enumerate().map(|(at, value)| value + rest(at / all.len())));
    }
    if body.surface().is_vertices() {
        return [
            positions,
            points.iter().flat_map(|&point| frame.normal[point]).collect(),
            points.iter().map(|&point| frame.area_m2[point]).collect(),
        ];
    }
    let edges = body.facet_edges(frame, points, all, options);
    for part in [edges.second, edges.third].into_iter().flat_map(|edge| [edge.x, edge.y, edge.z]) {
        positions.extend(values(part));
    }
    [
        positions,
        points.iter().flat_map(|&point| frame.normal[point]).collect(),
        points.iter().map(|&point| frame.area_m2[point]).collect(),
    ]
}

/// The same from tensors, one flat tensor each.
fn device(posed: &PosedFrame, points: &[usize]) -> [Tensor<1>; 3] {
    let all = 0..chirps().len();
    let flat = |part: Tensor<2>| -> Tensor<1> { part.flatten(0, 1) };
    let moved = posed.displacement(points, all.clone(), None);
    let mut positions = vec![flat(moved.x), flat(moved.y), flat(moved.z)];
    if !posed.body.surface().is_vertices() {
        let edges = posed.facet_edges(points, all);
        for edge in [edges.second, edges.third] {
            positions.extend([edge.x, edge.y, edge.z].map(flat));
        }
    }
    [Tensor::cat(positions, 0), flat(posed.normals(points)), flat(posed.areas_m2(points))]
}

fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f64> {
    tensor.into_data().convert::<f64>().try_to_vec().unwrap()
}

fn farthest(found: &[f64], wanted: &[f64]) -> f64 {
    assert_eq!(found.len(), wanted.len());
    found
        .iter()
        .zip(wanted)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, |worst, error| if error.is_nan() { error } else { f64::max(worst, error) })
}

#[test]
fn tensors_pose_as_the_host_does_in_double_precision() {
    for sampling in SAMPLINGS {
        let body = body(sampling);
        let frame = body.frame(&chirps()).unwrap();
        let points: Vec<usize> = (0..body.surface().len()).step_by(2).collect();
        for (name, on) in cpu_devices() {
            let posed = PosedFrame::new(&body, &frame, None, &on, DType::F64);
            for (part, (found, wanted)) in
                device(&posed, &points).into_iter().zip(host(&body, &frame, &frame, &points)).enumerate()
            {
                let error = farthest(&values(found), &wanted);
                assert!(error < 1e-12, "{name} {sampling:?}, part {part}: {error}");
            }
        }
    }
}

#[test]
fn single_precision_keeps_the_carrier_phase_also_of_a_correction() {
    let body = body(Sampling::Vertices);
    let frame = body.frame(&chirps()).unwrap();
    let points: Vec<usize> = (0..VERTICES).collect();
    // The clock enters to first order; everything else is exact.
    let planted = PoseCorrection { clock_s: 0.0, ..correction() };
    let (_, pose) = tracked(&flat(&planted), &Device::flex(), DType::F32);
    // The body knows the pivot and the knots, but not yet how far.
    let still = PoseCorrection { knots_s: planted.knots_s.clone(), pivot_m: planted.pivot_m, ..Default::default() };
    let body = body.corrected(&walker(), still).unwrap();
    let moved = body.corrected(&walker(), planted).unwrap();
    let wanted = host(&moved, &moved.frame(&chirps()).unwrap(), &frame, &points);
    let posed = PosedFrame::new(&body, &frame, Some(&pose), &Device::flex(), DType::F32);
    let [positions, normals, areas] = device(&posed, &points).map(values);
    let worst = farthest(&positions, &wanted[0]);
    let phase = 2.0 * std::f64::consts::TAU * worst * 77e9 / SPEED_OF_LIGHT;
    println!("{worst:.1e} m off, {phase:.1e} rad of the two-way phase at 77 GHz");
    assert!(worst < 3e-8, "{worst} m");
    assert!(farthest(&normals, &wanted[1]) < 2e-6 && farthest(&areas, &wanted[2]) < 1e-6);
}

#[test]
fn a_correction_on_the_device_equals_the_corrected_body_on_the_host() {
    for sampling in SAMPLINGS {
        let own = correction();
        let halved = flat(&own).map(|values| values.into_iter().map(|value| 0.5 * value).collect());
        // The body has half of it already, the device adds the other half; of the clock it adds none.
        let mut before = unflat(&own, &halved);
        before.clock_s = own.clock_s;
        let body = body(sampling).corrected(&walker(), before).unwrap();
        let moved = body.corrected(&walker(), own.clone()).unwrap();
        let (frame, wanted) = (body.frame(&chirps()).unwrap(), moved.frame(&chirps()).unwrap());
        let points: Vec<usize> = (0..body.surface().len()).step_by(3).collect();
        let (_, pose) = tracked(&flat(&own), &Device::flex(), DType::F64);
        let posed = PosedFrame::new(&body, &frame, Some(&pose), &Device::flex(), DType::F64);
        for (part, (found, wanted)) in device(&posed, &points).into_iter().zip(host(&moved, &wanted, &frame, &points)).enumerate()
        {
            let error = farthest(&values(found), &wanted);
            assert!(error < 1e-12, "{sampling:?}, part {part}: {error}");
        }
    }
}

pub(crate) fn gradients_of_positions_normals_and_areas_agree_with_central_differences_for_every_kind_of_parameter() {
    let own = correction();
    for (name, on) in cpu_devices() {
        let on = on.autodiff();
        for sampling in SAMPLINGS {
            let body = body(sampling).corrected(&walker(), own.clone()).unwrap();
            let frame = body.frame(&chirps()).unwrap();
            let points: Vec<usize> = (0..body.surface().len()).step_by(body.surface().len() / 7).collect();
            let at = flat(&own);
            for part in 0..3 {
                let (leaves, pose) = tracked(&at, &on, DType::F64);
                let posed = PosedFrame::new(&body, &frame, Some(&pose), &on, DType::F64);
                let output = device(&posed, &points)[part].clone();
                let weights: Vec<f64> = (0..output.dims()[0]).map(|at| (0.7 * at as f64 + 0.3).cos()).collect();
                let weighing = Tensor::<1>::from_data(TensorData::new(weights.clone(), [weights.len()]), (&on, DType::F64));
                let gradients = (output * weighing).sum().backward();
                let loss = |values: &[Vec<f64>; 6]| -> f64 {
                    // On the host alone: another implementation than the one under test.
                    let moved = body.corrected(&walker(), unflat(&own, values)).unwrap();
                    let found = &host(&moved, &moved.frame(&chirps()).unwrap(), &frame, &points)[part];
                    found.iter().zip(&weights).map(|(value, weight)| value * weight).sum()
                };
                for (kind, name_of_kind) in KINDS.into_iter().enumerate() {
                    let found = leaves[kind].grad(&gradients).map_or(vec![0.0; at[kind].len()], values);
                    let central = |entry: usize| {
                        let moved = |step: f64| {
                            let mut values = at.clone();
                            values[kind][entry] += step;
                            loss(&values)
                        };
                        (moved(1e-6) - moved(-1e-6)) / 2e-6
                    };
                    let wanted: Vec<f64> = (0..at[kind].len()).map(central).collect();
                    crate::support::compared(&wanted);
                    let largest = wanted.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
                    // A shift changes positions alone; a turn of the whole changes no area.
                    let rigid = name_of_kind.starts_with("shift") || (part == 2 && name_of_kind == "heading");
                    assert!(part > 0 && rigid || largest > 1e-4, "{sampling:?} part {part}: {name_of_kind} moves nothing");
                    let error = farthest(&found, &wanted);
                    assert!(
                        error < 1e-6 * largest.max(1e-2),
                        "{name} {sampling:?} part {part}, {name_of_kind}: off by {error:e} of {largest:e}"
                    );
                }
            }
        }
    }
}

#[test]
fn meshes_are_placed_by_tensors_too() {
    let skinned = body(Sampling::Vertices);
    let vertices = (0..20).map(|pose| skinned.vertices_at_pose(pose)).collect();
    let person = Person::Meshes { vertices, faces: walker().faces().to_vec(), pose_times_s: walker().pose_times_s() };
    let meshes = PosedBody::new(&person, &SurfaceConfig::vertices(), Interpolation::Cubic).unwrap();
    let frame = meshes.frame(&chirps()).unwrap();
    let points: Vec<usize> = (0..VERTICES).collect();
    let own = correction();
    let still = PoseCorrection { knots_s: own.knots_s.clone(), pivot_m: own.pivot_m, ..Default::default() };
    let meshes = meshes.corrected(&person, still).unwrap();
    let moved = meshes.corrected(&person, PoseCorrection { clock_s: 0.0, ..own.clone() }).unwrap();
    let (_, pose) = tracked(&flat(&own), &Device::flex(), DType::F64);
    let pose = PoseTensors { clock_s: None, ..pose };
    let posed = PosedFrame::new(&meshes, &frame, Some(&pose), &Device::flex(), DType::F64);
    let wanted = host(&moved, &moved.frame(&chirps()).unwrap(), &frame, &points);
    for (found, wanted) in device(&posed, &points).into_iter().zip(wanted) {
        assert!(farthest(&values(found), &wanted) < 1e-12);
    }
}

#[test]
fn a_canonical_offset_and_axis_turn_with_the_body_and_the_heading() {
    let own = PoseCorrection { clock_s: 0.0, ..correction() };
    let still = PoseCorrection { knots_s: own.knots_s.clone(), pivot_m: own.pivot_m, ..Default::default() };
    let body = body(Sampling::Facets).corrected(&walker(), still).unwrap();
    let moved = body.corrected(&walker(), own.clone()).unwrap();
    let (frame, there) = (body.frame(&chirps()).unwrap(), moved.frame(&chirps()).unwrap());
    let on = Device::flex();
    let (points, axes) = ([3, 8, 1], [0, 2, 1]);
    let offset = || {
        Tensor::<2>::from_data(
            TensorData::new(vec![0.01, -0.02, 0.005, 0.0, 0.01, 0.0, 0.02, 0.0, 0.0], [3, 3]),
            (&on, DType::F64),
        )
    };
    let (_, pose) = tracked(&flat(&own), &on, DType::F64);
    let posed = PosedFrame::new(&body, &frame, Some(&pose), &on, DType::F64);
    let of = |moved: Displacement, still: Displacement| [moved.x - still.x, moved.y - still.y, moved.z - still.z].map(values);
    let found = of(posed.displacement(&points, 0..6, Some(offset())), posed.displacement(&points, 0..6, None));
    let options = (&on, DType::F64);
    let wanted = of(
        moved.displacement(&there, &points, 0..6, Some(offset()), options),
        moved.displacement(&there, &points, 0..6, None, options),
    );
    assert!((0..3).all(|axis| farthest(&found[axis], &wanted[axis]) < 1e-12), "{found:?} {wanted:?}");
    let turned = values(posed.turned_axes(&points, &axes));
    for (row, (&point, &axis)) in points.iter().zip(&axes).enumerate() {
        let rotation = moved.rotation(&there, point, there.basis.poses.len() / 2);
        assert!((0..3).all(|xyz| (turned[row * 3 + xyz] - rotation[(xyz, axis)]).abs() < 1e-12));
    }
}
