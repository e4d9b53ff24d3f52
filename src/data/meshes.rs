//! Meshes by themselves: `vertices.npy` with its `faces.npy`, and Wavefront OBJ.

use std::path::Path;

use super::arrays::{Array, read_npy};
use super::bodies::read_faces;
use super::files;
use crate::error::{Error, Result};

/// A mesh, or a sequence of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Meshes {
    /// Metres, as a file that states no unit is taken, `[pose][vertex]`.
    pub vertices: Vec<Vec<[f64; 3]>>,
    /// Counter-clockwise seen from outside; empty where there is no file of them.
    pub faces: Vec<[usize; 3]>,
    /// What was assumed.
    pub notes: Vec<String>,
}

/// Reads an `.obj`, or an `.npy` of `[pose, vertex, xyz]` with the `faces.npy` of its folder.
///
/// # Errors
/// A file that is neither or cannot be read, no vertices, faces of other vertices.
pub fn read_meshes(path: impl AsRef<Path>) -> Result<Meshes> {
    let path = path.as_ref();
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj")) {
        return read_obj(path);
    }
    let vertices = read_vertices(path)?;
    let faces_path = path.with_file_name("faces.npy");
    if faces_path.symlink_metadata().is_err() {
        let note = "there is no faces.npy beside it: the surface cannot be looked at".into();
        return Ok(Meshes { vertices, faces: vec![], notes: vec![note] });
    }
    let faces = read_triangles(&faces_path, vertices[0].len())?;
    Ok(Meshes { vertices, faces, notes: vec![format!("faces from {}", faces_path.display())] })
}

/// `[pose, vertex, xyz]`, at least one of each.
pub(super) fn read_vertices(path: &Path) -> Result<Vec<Vec<[f64; 3]>>> {
    let positions: Array<f64> = read_npy(path, &[("pose", None), ("vertex", None), ("xyz", Some(3))])?;
    let [poses, count, _] = positions.shape[..] else { unreachable!("three axes were asked for") };
    if poses == 0 || count == 0 {
        return Err(Error::field(path, "vertices", format!("{:?}", positions.shape), "at least one pose and one vertex"));
    }
    Ok(positions.rows().chunks(count).map(<[_]>::to_vec).collect())
}

/// `[face, corner]`, of so many vertices.
pub(super) fn read_triangles(path: &Path, vertices: usize) -> Result<Vec<[usize; 3]>> {
    let corners: Array<i64> = read_npy(path, &[("face", None), ("corner", Some(3))])?;
    read_faces(path, "faces", &corners, vertices)
}

/// All objects of the file together. Faces of more corners are cut into triangles.
fn read_obj(path: &Path) -> Result<Meshes> {
    let text = files::read(path)?;
    let options = tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, ..Default::default() };
    // Materials are of no use here: their files are not opened.
    let (models, _) = tobj::load_obj_buf(&mut text.as_slice(), &options, |_| Ok(Default::default()))
        .map_err(|error| Error::Parse { path: path.into(), message: format!("cannot be read as Wavefront OBJ: {error}") })?;
    let (mut vertices, mut faces) = (vec![], vec![]);
    for model in &models {
        let first = vertices.len();
        vertices.extend(model.mesh.positions.as_chunks::<3>().0.iter().map(|point| point.map(f64::from)));
        faces.extend(model.mesh.indices.as_chunks::<3>().0.iter().map(|corners| corners.map(|corner| first + corner as usize)));
    }
    if vertices.is_empty() || faces.is_empty() {
        let found = format!("{} vertices, {} faces", vertices.len(), faces.len());
        return Err(Error::field(path, "f", found, "a mesh of at least one face"));
    }
    if let Some(vertex) = vertices.iter().position(|point: &[f64; 3]| point.iter().any(|x| !x.is_finite())) {
        return Err(Error::field(path, "v", format!("{:?} at vertex {vertex}", vertices[vertex]), "finite numbers"));
    }
    let mut notes = vec!["an OBJ states no unit: metres are assumed".to_string()];
    if models.len() > 1 {
        notes.push(format!("{} objects are taken as one mesh", models.len()));
    }
    Ok(Meshes { vertices: vec![vertices], faces, notes })
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: &str = "o body\nv 0 0 0\nv 0.5 0 0\nv 0.5 0.3 0\nv 0 0.3 0\nv 0 0 1.7\nv 0.5 0 1.7\nv 0.5 0.3 1.7\nv 0 0.3 1.7\n\
                       f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

    fn read(text: &str) -> Result<Meshes> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("body.obj");
        std::fs::write(&path, text).unwrap();
        read_meshes(&path)
    }

    #[test]
    fn an_obj_is_one_closed_mesh_of_triangles() {
        let meshes = read(BOX).unwrap();
        assert_eq!((meshes.vertices.len(), meshes.vertices[0].len(), meshes.faces.len()), (1, 8, 12));
        assert!((crate::person::mesh::volume(&meshes.vertices[0], &meshes.faces) - 0.5 * 0.3 * 1.7).abs() < 1e-6);
        assert!(crate::person::mesh::check_closed(8, &meshes.faces).is_ok());
        // Materials that are named are not looked for.
        assert_eq!(read(&format!("mtllib /nowhere.mtl\nusemtl skin\n{BOX}")).unwrap().faces.len(), 12);
    }

    #[test]
    fn what_is_no_mesh_is_refused_by_name() {
        let refused = |text: &str| read(text).unwrap_err().to_string();
        assert!(refused("").contains("0 vertices, 0 faces"), "{}", refused(""));
        assert!(refused("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n").contains("Wavefront OBJ"));
        assert!(refused("v 0 0\nf 1 1 1\n").contains("Wavefront OBJ"));
        assert!(refused("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n").contains("body.obj"));
    }
}
