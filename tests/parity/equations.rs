//! L_p × eq. 2 and SH × eq. 3, end to end: from materials, patches and geometry to IF samples.
//!
//! A body turns within one frame before three walls; antennas are far apart, so that every pair sees other angles. The
//! simulator with the paper's equations must agree with NumPy; each setting of ours alone must not.

use burn::tensor::{DType, Device, Tensor, TensorData};
use hybridsim::{
    body::{Interpolation, SurfaceConfig},
    complex::Complex,
    features::Extent,
    if_signal::SumForm,
    paths::Dechirp,
    person::Person,
    radar::Radar,
    room::Room,
    scatterers::{material::Material, microfacet::Grazing, patches::Patch},
    simulator::{
        Amplitudes, EquationsConfig, FrameView, Gains, PathModel, Scene, Seen, SimulatorConfig, Surface, Surfaces, Weights,
    },
};
use num_complex::Complex64;

use crate::golden::{Golden, close, radar};

const GOLDEN: Golden = Golden("equations");

/// As in `scripts/golden_equations.py`.
fn radar_of_equations() -> Radar {
    Radar {
        samples_per_chirp: 10,
        loops_per_frame: 6,
        chirp_period_s: 2e-3,
        frames: 1,
        tx_m: vec![[-0.4, 0.0, 0.0], [0.3, 0.0, 0.2]],
        rx_m: vec![[0.0, 0.1, 0.0], [0.5, 0.0, -0.1], [-0.1, 0.0, 0.3]],
        ..radar()
    }
}

fn paper() -> SimulatorConfig {
    let mut config = SimulatorConfig {
        dechirp: Dechirp::Paper,
        interpolation: Interpolation::Linear,
        surface: SurfaceConfig::vertices(),
        equations: EquationsConfig::paper(),
        ..Default::default()
    };
    config.room.patch_spacing_m = 1.0;
    config.room.open_m = 2.0;
    // so that a gain that is applied shows
    config.decoders.gain_db = 3.0;
    config
}

fn scene(config: &SimulatorConfig) -> Scene {
    let vertices: Vec<[f64; 3]> = GOLDEN.points("in_mesh_m");
    let person = Person::Meshes {
        vertices: vertices.chunks_exact(vertices.len() / 2).map(<[_]>::to_vec).collect(),
        faces: GOLDEN.points("in_face").into_iter().map(|face| face.map(|vertex| vertex as usize)).collect(),
        pose_times_s: vec![-0.01, 0.05],
    };
    let room = Room { left_m: Some(1.9), front_m: Some(4.2), floor_m: Some(1.1), ..Room::default() };
    Scene::new(&radar_of_equations(), Some(&room), Some(&person), config).unwrap()
}

/// The frame, with the golden's visible points.
fn view(scene: &Scene) -> FrameView {
    let view = scene.view(0).unwrap();
    let bodies = view.body.as_ref().unwrap().position_m.len();
    let seen = |mask: &[f64]| {
        let indices = |mask: &[f64]| (0..mask.len()).filter(|&index| mask[index] > 0.0).collect();
        Seen { body: indices(&mask[..bodies]), room: indices(&mask[bodies..]) }
    };
    let (shape, masks) = GOLDEN.array("in_seen");
    let mut all = masks.chunks_exact(shape[1]).map(seen);
    FrameView { direct: all.next().unwrap(), proxies: all.collect(), ..(*view).clone() }
}

/// Rows `from..` of a golden array with one row for each point.
fn rows<const D: usize>(name: &str, from: usize, count: usize, column: Option<usize>, device: &Device) -> Tensor<D> {
    let (shape, values) = GOLDEN.array(name);
    let width = shape.get(1).copied().unwrap_or(1);
    let picked: Vec<f64> = (from..from + count)
        .flat_map(|row| match column {
            Some(column) => values[row * width + column..][..1].to_vec(),
            None => values[row * width..][..width].to_vec(),
        })
        .collect();
    let dims: Vec<usize> = if D == 1 { vec![count] } else { vec![count, picked.len() / count] };
    Tensor::from_data(TensorData::new(picked, dims).convert_dtype(DType::F32), (device, DType::F32))
}

fn surface(from: usize, count: usize, device: &Device) -> Surface {
    let material = |column| rows::<1>("in_material", from, count, Some(column), device);
    Surface {
        material: Some(Material {
            roughness: material(0),
            metallic: material(1),
            refraction: material(2),
            extinction: material(3),
            polarisation: material(4),
        }),
        patch: Some(Patch {
            offset_m: rows("in_offset_m", from, count, None, device),
            rotation_rad: rows("in_rotation_rad", from, count, None, device),
            scale_m: rows("in_scale_m", from, count, None, device),
            reflectance: rows("in_reflectance", from, count, None, device),
            lobes: rows("in_lobes", from, count, None, device),
        }),
    }
}

fn signal(config: &SimulatorConfig) -> Complex<4> {
    config.check().unwrap();
    let device = Device::flex();
    let scene = scene(config);
    let view = view(&scene);
    let extent = Extent::around(scene.body.as_ref().unwrap().canonical_vertices(), 0.05);
    let (bodies, patches) = (view.body.as_ref().unwrap().position_m.len(), scene.patches.position_m.len());
    let surfaces = Surfaces { body: Some(surface(0, bodies, &device)), room: Some(surface(bodies, patches, &device)) };
    config.init(extent, 1, &device).clean_signal(&scene, &view, &surfaces)
}

/// Energy of the difference over the energy of what was wanted, dB.
fn error_db(config: &SimulatorConfig, wanted: &[Complex64]) -> f64 {
    let found = signal(config);
    let (re, im) = (found.re.into_data(), found.im.into_data());
    let found: Vec<Complex64> = re.iter::<f64>().zip(im.iter::<f64>()).map(|(re, im)| Complex64::new(re, im)).collect();
    assert_eq!(found.len(), wanted.len());
    let difference: f64 = found.iter().zip(wanted).map(|(a, b)| (a - b).norm_sqr()).sum();
    10.0 * (difference / wanted.iter().map(|value| value.norm_sqr()).sum::<f64>()).log10()
}

#[test]
fn the_scene_is_that_of_numpy() {
    let scene = scene(&paper());
    let flat = |points: &[[f64; 3]]| points.iter().flatten().copied().collect::<Vec<f64>>();
    close("patches", &flat(&scene.patches.position_m), &GOLDEN.values("in_room_m"), 1e-12);
    let proxies: Vec<[f64; 3]> = scene.proxies.iter().map(|proxy| proxy.position_m).collect();
    close("proxies", &flat(&proxies), &GOLDEN.values("in_proxy_m"), 1e-12);
}

#[test]
fn the_papers_equations_are_those_of_numpy_in_every_form() {
    for (paths, name) in [(PathModel::Direct, "direct"), (PathModel::Indirect, "indirect")] {
        let wanted = GOLDEN.complex(name);
        for sum in [SumForm::Exact, SumForm::Tensor, SumForm::Fused] {
            let error = error_db(&SimulatorConfig { paths, sum, ..paper() }, &wanted);
            println!("{name}, {sum:?}: {error:.1} dB");
            // amplitudes are f32
            assert!(error < -90.0, "{name}, {sum:?}: {error:.1} dB");
        }
    }
    let both: Vec<Complex64> = GOLDEN
        .complex("direct")
        .into_iter()
        .zip(GOLDEN.complex("indirect"))
        .map(|(direct, indirect)| direct + indirect)
        .collect();
    let error = error_db(&SimulatorConfig { paths: PathModel::Decoupled, ..paper() }, &both);
    assert!(error < -90.0, "both: {error:.1} dB");
}

#[test]
fn each_setting_of_ours_is_another_formula() {
    let (direct, indirect) = (GOLDEN.complex("direct"), GOLDEN.complex("indirect"));
    let with = |change: fn(&mut EquationsConfig)| {
        let mut config = paper();
        change(&mut config.equations);
        config
    };
    // The rounded-off edge is felt in the direct path alone, and only beside it.
    let cases = [
        ("weights", with(|equations| equations.weights = Weights::Area), -30.0, -30.0),
        ("gains", with(|equations| equations.gains = Gains::Learned), -30.0, -30.0),
        ("grazing", with(|equations| equations.grazing = Grazing::Smooth), -60.0, f64::NEG_INFINITY),
        ("amplitudes", with(|equations| equations.amplitudes = Amplitudes::Frame), -30.0, -30.0),
        ("dechirp", SimulatorConfig { dechirp: Dechirp::Exact, ..paper() }, -40.0, -40.0),
    ];
    for (name, config, least_direct, least_indirect) in cases {
        let direct = error_db(&SimulatorConfig { paths: PathModel::Direct, ..config.clone() }, &direct);
        let indirect = error_db(&SimulatorConfig { paths: PathModel::Indirect, ..config }, &indirect);
        println!("{name}: direct {direct:.1} dB, indirect {indirect:.1} dB");
        assert!(direct > least_direct && indirect > least_indirect, "{name}: direct {direct:.1} dB, indirect {indirect:.1} dB");
    }
}

/// Along one direction in every input at once: Σ|X|², whose gradient the paper's settings must pass on.
#[test]
fn gradients_of_the_papers_equations_agree_with_differences() {
    let config = SimulatorConfig { sum: SumForm::Exact, ..paper() };
    let device = Device::flex().autodiff();
    let scene = scene(&config);
    let view = view(&scene);
    let extent = Extent::around(scene.body.as_ref().unwrap().canonical_vertices(), 0.05);
    let simulator = config.init(extent, 1, &device);
    let (bodies, patches) = (view.body.as_ref().unwrap().position_m.len(), scene.patches.position_m.len());
    let plain = [surface(0, bodies, &device), surface(bodies, patches, &device)];
    // What is moved, and by how much along its direction.
    type Part = (&'static str, f64, fn(Surface, Tensor<1>) -> Surface);
    fn roughness(Surface { material, patch }: Surface, step: Tensor<1>) -> Surface {
        let rougher = |material: Material| Material { roughness: material.roughness * (step + 1.0), ..material };
        Surface { material: material.map(rougher), patch }
    }
    fn extinction(Surface { material, patch }: Surface, step: Tensor<1>) -> Surface {
        let lossier = |material: Material| Material { extinction: material.extinction * (step + 1.0), ..material };
        Surface { material: material.map(lossier), patch }
    }
    fn offset(Surface { material, patch }: Surface, step: Tensor<1>) -> Surface {
        let moved = |patch: Patch| Patch { offset_m: patch.offset_m + step.unsqueeze_dim::<2>(1), ..patch };
        Surface { material, patch: patch.map(moved) }
    }
    fn rotation(Surface { material, patch }: Surface, step: Tensor<1>) -> Surface {
        let turned = |patch: Patch| Patch { rotation_rad: patch.rotation_rad + step, ..patch };
        Surface { material, patch: patch.map(turned) }
    }
    let parts: [Part; 4] = [
        ("roughness", 1e-2, roughness),
        ("extinction", 1e-2, extinction),
        ("offset", 1e-5, offset),
        ("rotation", 1e-2, rotation),
    ];
    for (name, step, change) in parts {
        let loss = |at: Tensor<1>| {
            let [body, room] = plain.clone().map(|plain| {
                let [points] = plain.material.as_ref().unwrap().roughness.dims();
                change(plain, at.clone().expand([points]))
            });
            let signal = simulator.clean_signal(&scene, &view, &Surfaces { body: Some(body), room: Some(room) });
            signal.power().sum()
        };
        let at = |value: f64| Tensor::<1>::from_data([value as f32], &device);
        let zero = at(0.0).require_grad();
        let found: f32 = zero.grad(&loss(zero.clone()).backward()).expect("the gradient flows").into_scalar();
        let ends = [step, -step].map(|step| f64::from(loss(at(step)).into_scalar::<f32>()));
        let wanted = (ends[0] - ends[1]) / (2.0 * step);
        assert!((f64::from(found) / wanted - 1.0).abs() < 0.02, "{name}: gradient {found}, by differences {wanted}");
    }
}
