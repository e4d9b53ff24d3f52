use std::path::PathBuf;

use super::*;
use crate::data::test_support::{shared, small_body};

/// Arrays of a body of four vertices and two joints, one of which a test can spoil.
struct Raw {
    template: Vec<f64>,
    shapes: Vec<f64>,
    regressor: Vec<f64>,
    weights: Vec<f64>,
    tree: Vec<i64>,
    faces: Vec<i32>,
}

impl Raw {
    fn good() -> Self {
        Self {
            template: vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            shapes: vec![0.1; 12],
            regressor: vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0],
            weights: vec![1.0, 0.0, 0.5, 0.5, 0.25, 0.75, 0.0, 1.0],
            tree: vec![-1, 0, 0, 1],
            faces: vec![0, 1, 2, 0, 2, 3],
        }
    }

    fn read(&self) -> (tempfile::TempDir, PathBuf, Result<BodyModel>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("body.npz");
        let member = |name, shape: &[usize], values| Member { name, shape: shape.to_vec(), values };
        write_npz(
            &path,
            &[
                member("v_template", &[4, 3], Values::F64(&self.template)),
                member("shapedirs", &[4, 3, 1], Values::F64(&self.shapes)),
                member("J_regressor", &[2, 4], Values::F64(&self.regressor)),
                member("weights", &[4, 2], Values::F64(&self.weights)),
                member("kintree_table", &[2, 2], Values::I64(&self.tree)),
                member("f", &[2, 3], Values::I32(&self.faces)),
            ],
        )
        .unwrap();
        let body = read_body(&path);
        (folder, path, body)
    }

    fn refused(&self) -> String {
        let (_folder, path, body) = self.read();
        let message = body.unwrap_err().to_string();
        message.strip_prefix(&format!("{}: ", path.display())).unwrap().to_string()
    }
}

#[test]
fn a_body_is_read_with_its_tree_and_sparse_weights() {
    let body = Raw::good().read().2.unwrap();
    assert_eq!(body.template[1], [1.0, 0.0, 0.0]);
    assert_eq!(body.shape_directions, [vec![[0.1; 3]; 4]]);
    assert!(body.pose_directions.is_empty());
    assert_eq!(body.joint_regressor, [vec![(0, 1.0)], vec![(1, 0.5), (2, 0.5)]]);
    assert_eq!(body.skinning[2], [(0, 0.25), (1, 0.75)]);
    assert_eq!(body.parents, [None, Some(0)]);
    assert_eq!(body.faces, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn a_body_comes_back_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.npz");
    let mut body = small_body();
    write_body(&path, &body).unwrap();
    assert_eq!(read_body(&path).unwrap(), body);
    body.pose_directions.clear();
    // 0.1 is no f32: it must survive all the same.
    body.template[0] = [0.1, 0.2, 0.3];
    write_body(&path, &body).unwrap();
    assert_eq!(read_body(&path).unwrap(), body);
}

#[test]
fn a_root_may_be_unsigned() {
    let raw = Raw { tree: vec![i64::from(u32::MAX), 0, 0, 1], ..Raw::good() };
    assert_eq!(raw.read().2.unwrap().parents, [None, Some(0)]);
}

#[test]
fn a_face_beyond_the_vertices_is_named() {
    let raw = Raw { faces: vec![0, 1, 2, 0, 2, 4], ..Raw::good() };
    assert_eq!(raw.refused(), "`f` is vertex 4 in face 1, expected vertices 0 to 3");
    let raw = Raw { faces: vec![0, -1, 2, 0, 2, 3], ..Raw::good() };
    assert_eq!(raw.refused(), "`f` is vertex -1 in face 0, expected vertices 0 to 3");
}

#[test]
fn weights_are_brought_to_one_when_nearly_there_and_refused_otherwise() {
    let mut raw = Raw::good();
    raw.weights[2] = 0.5005;
    let sum: f64 = raw.read().2.unwrap().skinning[1].iter().map(|(_, weight)| weight).sum();
    assert!((sum - 1.0).abs() < 1e-15);
    raw.weights[2] = 0.625;
    assert_eq!(raw.refused(), "`weights` is a sum of 1.125 at vertex 1, expected weights that sum to 1");
    raw.weights[2..4].copy_from_slice(&[1.5, -0.5]);
    assert_eq!(raw.refused(), "`weights` is -0.5 at vertex 1, joint 1, expected weights that sum to 1");
}

#[test]
fn a_tree_that_cannot_be_walked_is_refused() {
    let raw = Raw { tree: vec![-1, 1, 0, 1], ..Raw::good() };
    assert_eq!(raw.refused(), "`kintree_table` is 1 as the parent of joint 1, expected a parent that comes before its child");
    let raw = Raw { tree: vec![-1, -1, 0, 1], ..Raw::good() };
    assert_eq!(raw.refused(), "`kintree_table` is -1 as the parent of joint 1, expected a parent that comes before its child");
    let raw = Raw { tree: vec![1, 0, 0, 1], ..Raw::good() };
    assert_eq!(raw.refused(), "`kintree_table` is 1 as the parent of joint 0, expected no parent for the root (-1)");
    let raw = Raw { tree: vec![-1, 0, 1, 0], ..Raw::good() };
    assert_eq!(raw.refused(), "`kintree_table` is joint 1 in column 0, expected the joints 0, 1, 2, … in the second row");
}

#[test]
fn a_vertex_that_is_not_finite_is_named() {
    let mut raw = Raw::good();
    raw.template[4] = f64::NAN;
    assert_eq!(raw.refused(), "`v_template` is NaN at vertex 1, xyz 1, expected finite numbers");
}

#[test]
fn a_body_beyond_the_atmosphere_is_refused_with_its_place() {
    let mut raw = Raw::good();
    raw.template[4] = 1e300;
    assert_eq!(raw.refused(), "`v_template` is 1e300 m at vertex 1, xyz 1, expected at most 1e5 m");
}

#[test]
fn a_motion_is_not_taken_for_a_body() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("motion.npz");
    write_npz(&path, &[Member { name: "poses", shape: vec![1, 3], values: Values::F64(&[0.0; 3]) }]).unwrap();
    let message = read_body(&path).unwrap_err().to_string();
    assert_eq!(message, format!("{}: this is a motion (it has `poses`), expected a body", path.display()));
}

#[test]
fn the_shared_bodies_have_the_layout_of_smpl() {
    for name in ["female", "male", "neutral"] {
        let Some(path) = shared(&format!("bodies/{name}_lite.npz")) else { return };
        let body = read_body(path).unwrap();
        assert_eq!((body.template.len(), body.faces.len(), body.parents.len()), (6890, 13776, 24));
        assert_eq!((body.shape_directions.len(), body.pose_directions.len()), (10, 207));
        assert_eq!((body.parents[0], body.parents[1], body.parents[22], body.parents[23]), (None, Some(0), Some(20), Some(21)));
        let height = |select: fn(f64, f64) -> f64| body.template.iter().map(|vertex| vertex[1]).reduce(select).unwrap();
        assert!((1.4..2.1).contains(&(height(f64::max) - height(f64::min))), "{name}");
        assert!(body.joint_regressor.iter().all(|row| (row.iter().map(|(_, weight)| weight).sum::<f64>() - 1.0).abs() < 1e-5));
    }
}

fn has_numpy() -> bool {
    let numpy = std::process::Command::new("python3").args(["-c", "import numpy"]).output();
    let found = numpy.is_ok_and(|output| output.status.success());
    if !found {
        crate::support::skip("python3 with NumPy");
    }
    found
}

/// Pickles of our own: right ones in every protocol, some made to do harm, and seeded mutants of both.
#[test]
fn the_converter_gives_a_right_body_or_a_clean_error_for_every_pickle() {
    if !has_numpy() {
        return;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/fuzz_smpl_to_npz.py");
    let output = std::process::Command::new("python3").arg(&script).args(["3000", "1"]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("3000 mutants (seed 1)") && said.contains(" 0 failures"), "{said}");
}

#[test]
fn the_converter_reads_every_dialect_of_smpl() {
    let Some(expected) = shared("fixtures/smpl_formats/expected.npz") else { return };
    if !has_numpy() {
        return;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/smpl_to_npz.py");
    let folder = tempfile::tempdir().unwrap();
    let wanted = read_body(&expected).unwrap();
    let convert = |model: &Path, body: &Path| {
        let output = std::process::Command::new("python3").arg(&script).args([model, body]).output().unwrap();
        (output.status.success(), String::from_utf8(output.stderr).unwrap())
    };
    for dialect in ["plain_p2", "plain_py2", "chumpy_p2", "chumpy_py2"] {
        let body = folder.path().join(format!("{dialect}.npz"));
        let (done, said) = convert(&expected.with_file_name(format!("{dialect}.pkl")), &body);
        assert!(done, "{dialect}: {said}");
        assert!(read_body(&body).unwrap() == wanted, "{dialect} differs from the expected body");
    }
    // Whatever else a pickle asks for is neither run nor taken for a model.
    let (model, trap) = (folder.path().join("trap.pkl"), folder.path().join("sprung"));
    std::fs::write(&model, format!("cos\nsystem\n(S'touch {}'\ntR.", trap.display())).unwrap();
    let (done, said) = convert(&model, &folder.path().join("trap.npz"));
    assert!(!done && !trap.exists() && said.contains("lacks v_template"), "{said}");
    assert!(read_body(&model).unwrap_err().to_string().contains("expected a NumPy archive (.npz)"));
}
