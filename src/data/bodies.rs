//! Bodies in SMPL layout: `.npz` with SMPL's own keys.

use std::path::Path;

use crate::data::arrays::{Array, Member, Npz, Values, write_npz};
use crate::error::{Error, Result};
use crate::person::BodyModel;

/// Weights whose sum is this close to 1 are brought to it; farther off, something else is wrong.
const WEIGHT_TOLERANCE: f64 = 1e-3;

/// Reads a body and checks that it can be posed.
///
/// Keys: `v_template [vertex, xyz]`, `shapedirs [vertex, xyz, shape]`, optional `posedirs [vertex, xyz, 9 (J − 1)]`,
/// `J_regressor [joint, vertex]`, `weights [vertex, joint]`, `kintree_table [2, joint]`, `f [face, 3]`. Others are
/// left alone.
pub fn read_body(path: impl AsRef<Path>) -> Result<BodyModel> {
    let path = path.as_ref();
    let mut npz = Npz::open(path)?;
    if npz.has("poses") && !npz.has("v_template") {
        return Err(Error::Parse { path: path.into(), message: "this is a motion (it has `poses`), expected a body".into() });
    }
    let template = npz.lengths("v_template", &[("vertex", None), ("xyz", Some(3))])?;
    let vertices = template.shape[0];
    let tree: Array<i64> = npz.read("kintree_table", &[("parent and child", Some(2)), ("joint", None)])?;
    let joints = tree.shape[1];
    if vertices == 0 || joints == 0 {
        let empty = if vertices == 0 { "v_template" } else { "kintree_table" };
        return Err(Error::field(path, empty, "empty", "at least one entry"));
    }
    let shapes = npz.lengths("shapedirs", &[("vertex", Some(vertices)), ("xyz", Some(3)), ("shape", None)])?;
    let entries = 9 * (joints - 1);
    let poses: Option<Array<f64>> = if npz.has("posedirs") {
        Some(npz.lengths("posedirs", &[("vertex", Some(vertices)), ("xyz", Some(3)), ("entries of R - 1", Some(entries))])?)
    } else {
        None
    };
    let regressor: Array<f64> = npz.read("J_regressor", &[("joint", Some(joints)), ("vertex", Some(vertices))])?;
    let weights: Array<f64> = npz.read("weights", &[("vertex", Some(vertices)), ("joint", Some(joints))])?;
    let faces: Array<i64> = npz.read("f", &[("face", None), ("corner", Some(3))])?;
    Ok(BodyModel {
        template: template.rows(),
        shape_directions: directions(&shapes),
        pose_directions: poses.as_ref().map(directions).unwrap_or_default(),
        joint_regressor: regressor.values.chunks(vertices).map(nonzero).collect(),
        skinning: skinning(path, &weights)?,
        parents: parents(path, &tree)?,
        faces: read_faces(path, "f", &faces, vertices)?,
    })
}

/// Writes a body so that `read_body` gives the same one.
pub fn write_body(path: impl AsRef<Path>, model: &BodyModel) -> Result<()> {
    let (vertices, joints) = (model.template.len(), model.parents.len());
    let interleaved = |directions: &[Vec<[f64; 3]>]| -> Vec<f64> {
        let of = |vertex: usize, axis: usize| directions.iter().map(move |direction| direction[vertex][axis]);
        (0..vertices).flat_map(|vertex| (0..3).flat_map(move |axis| of(vertex, axis))).collect()
    };
    let dense = |rows: &[Vec<(usize, f64)>], columns: usize| {
        let mut values = vec![0.0; rows.len() * columns];
        for (row, entries) in rows.iter().enumerate() {
            entries.iter().for_each(|&(column, value)| values[row * columns + column] += value);
        }
        values
    };
    let parent = |joint: &Option<usize>| joint.map_or(-1, |parent| parent as i64);
    let tree: Vec<i64> = model.parents.iter().map(parent).chain(0..joints as i64).collect();
    let faces: Vec<u32> = model.faces.iter().flatten().map(|&vertex| vertex as u32).collect();
    let real = [
        ("v_template", vec![vertices, 3], model.template.concat()),
        ("shapedirs", vec![vertices, 3, model.shape_directions.len()], interleaved(&model.shape_directions)),
        ("posedirs", vec![vertices, 3, model.pose_directions.len()], interleaved(&model.pose_directions)),
        ("J_regressor", vec![joints, vertices], dense(&model.joint_regressor, vertices)),
        ("weights", vec![vertices, joints], dense(&model.skinning, joints)),
    ];
    let narrow: Vec<Option<Vec<f32>>> = real.iter().map(|(_, _, values)| exactly_f32(values)).collect();
    let mut members: Vec<_> = real
        .iter()
        .zip(&narrow)
        .filter(|((name, ..), _)| *name != "posedirs" || !model.pose_directions.is_empty())
        .map(|((name, shape, values), narrow)| Member {
            name,
            shape: shape.clone(),
            values: narrow.as_ref().map_or(Values::F64(values), |narrow| Values::F32(narrow)),
        })
        .collect();
    members.push(Member { name: "kintree_table", shape: vec![2, joints], values: Values::I64(&tree) });
    members.push(Member { name: "f", shape: vec![model.faces.len(), 3], values: Values::U32(&faces) });
    write_npz(path, &members)
}

/// The values in half the space, where nothing is lost.
pub(super) fn exactly_f32(values: &[f64]) -> Option<Vec<f32>> {
    let narrow: Vec<f32> = values.iter().map(|&value| value as f32).collect();
    narrow.iter().zip(values).all(|(&narrow, &value)| f64::from(narrow) == value).then_some(narrow)
}

/// From `[vertex, xyz, direction]` to `[direction][vertex, xyz]`.
fn directions(array: &Array<f64>) -> Vec<Vec<[f64; 3]>> {
    let [vertices, _, count] = array.shape[..] else { unreachable!("three axes were asked for") };
    let at = |vertex: usize, axis: usize, direction: usize| array.values[(vertex * 3 + axis) * count + direction];
    (0..count).map(|d| (0..vertices).map(|v| std::array::from_fn(|axis| at(v, axis, d))).collect()).collect()
}

fn nonzero(row: &[f64]) -> Vec<(usize, f64)> {
    row.iter().copied().enumerate().filter(|&(_, value)| value != 0.0).collect()
}

fn skinning(path: &Path, weights: &Array<f64>) -> Result<Vec<Vec<(usize, f64)>>> {
    let of_vertex = |(vertex, row): (usize, &[f64])| {
        let refuse =
            |found: String, hint: &str| Err(Error::field(path, "weights", found, "weights that sum to 1").with_hint(hint));
        if let Some(joint) = row.iter().position(|&weight| weight < -WEIGHT_TOLERANCE) {
            return refuse(format!("{} at vertex {vertex}, joint {joint}", row[joint]), "skinning weights are not negative");
        }
        let sum: f64 = row.iter().sum();
        if (sum - 1.0).abs() > WEIGHT_TOLERANCE {
            return refuse(format!("a sum of {sum} at vertex {vertex}"), "divide the weights of each vertex by their sum");
        }
        Ok(nonzero(row).into_iter().map(|(joint, weight)| (joint, weight / sum)).collect())
    };
    weights.values.chunks(weights.shape[1]).enumerate().map(of_vertex).collect()
}

/// The first row of SMPL's tree: parents; the root's is −1, or the same as an unsigned number.
fn parents(path: &Path, tree: &Array<i64>) -> Result<Vec<Option<usize>>> {
    let (parents, children) = tree.values.split_at(tree.shape[1]);
    if let Some(joint) = (0..children.len()).find(|&joint| children[joint] != joint as i64) {
        let found = format!("joint {} in column {joint}", children[joint]);
        return Err(Error::field(path, "kintree_table", found, "the joints 0, 1, 2, … in the second row"));
    }
    let of_joint = |(joint, &parent): (usize, &i64)| match (joint, parent) {
        (0, parent) if parent < 0 || parent == i64::from(u32::MAX) => Ok(None),
        (1.., 0..) if parent < joint as i64 => Ok(Some(parent as usize)),
        _ => Err(Error::field(
            path,
            "kintree_table",
            format!("{parent} as the parent of joint {joint}"),
            if joint == 0 { "no parent for the root (-1)" } else { "a parent that comes before its child" },
        )),
    };
    parents.iter().enumerate().map(of_joint).collect()
}

/// Corners as indices, all below `vertices`.
pub(super) fn read_faces(path: &Path, field: &str, faces: &Array<i64>, vertices: usize) -> Result<Vec<[usize; 3]>> {
    if faces.values.is_empty() {
        return Err(Error::field(path, field, "empty", "at least one face"));
    }
    if let Some(position) = faces.values.iter().position(|&corner| !(0..vertices as i64).contains(&corner)) {
        let found = format!("vertex {} in face {}", faces.values[position], position / 3);
        return Err(Error::field(path, field, found, format!("vertices 0 to {}", vertices - 1)));
    }
    Ok(faces.values.as_chunks().0.iter().map(|corners: &[i64; 3]| corners.map(|corner| corner as usize)).collect())
}

#[cfg(test)]
mod tests;
