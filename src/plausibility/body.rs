//! The body by itself: how long it is, and which way its faces look.

use std::f64::consts::FRAC_1_SQRT_2;

use super::units::{LENGTHS, likely};
use super::{Facts, Finding, Kind, Part};

/// From a newborn's 0.4 m (the shortest that WHO's length-for-age standards list at birth is 0.44 m, less for a bent pose) to
/// the 2.72 m of the tallest person on record (Robert Wadlow, Guinness World Records), rounded up.
pub(super) const LENGTHS_M: [f64; 2] = [0.4, 2.8];
/// Grown people: from Guinness' shortest to its tallest, 0.55 m to 2.72 m; the units of a length are not told apart by
/// children, so it begins at a metre.
const GROWN_M: [f64; 2] = [1.0, 2.72];

/// The key of the body's vertices.
fn key(meshes: bool) -> &'static str {
    if meshes { "vertices" } else { "v_template" }
}

/// A person is between 0.4 m and 2.8 m long.
pub fn length(facts: &Facts) -> Vec<Finding> {
    let Some(body) = &facts.body else { return vec![] };
    // Of meshes: raised arms are longer than their person, and whoever curls up is shorter.
    let [least, most] = body.length_m;
    let wrong = if most < LENGTHS_M[0] { most } else { least };
    if (LENGTHS_M[0]..=LENGTHS_M[1]).contains(&wrong) {
        return vec![];
    }
    let expected = format!("a person, {} to {} m long", LENGTHS_M[0], LENGTHS_M[1]);
    let finding = Finding::new(Kind::Refuse, Part::Body, key(body.meshes), format!("a body {wrong:.4} m long"), expected);
    vec![match likely(wrong, &LENGTHS, GROWN_M) {
        Some((unit, factor)) => {
            finding.with_hint(format!("in {unit} it would be {:.2} m: multiply the body's lengths by {factor}", wrong * factor))
        }
        None => finding.with_hint("lengths are in metres"),
    }]
}

/// A face is counter-clockwise seen from outside: a mesh turned inside out hides the side that the radar sees, and its
/// return is 30 to 50 dB too weak.
pub fn faces_outwards(facts: &Facts) -> Vec<Finding> {
    let Some(body) = &facts.body else { return vec![] };
    if body.volume_m3 >= 0.0 {
        return vec![];
    }
    let field = if body.meshes { "faces" } else { "f" };
    let hint = "swap two columns of the faces, such as f[:, [0, 2, 1]]";
    vec![match &body.open {
        None => Finding::new(
            Kind::Refuse,
            Part::Body,
            field,
            format!("a mesh turned inside out (a volume of {:.4} m3)", body.volume_m3),
            "faces that are counter-clockwise seen from outside",
        )
        .with_hint(hint),
        // The volume of an open mesh says little, but a body's is never below zero by much.
        Some(why) => Finding::new(
            Kind::Note,
            Part::Body,
            field,
            format!("an open mesh ({why}) whose faces seem to look inwards (a volume of {:.4} m3)", body.volume_m3),
            "faces that are counter-clockwise seen from outside",
        )
        .with_hint(hint),
    }]
}

/// Meshes are in the radar's frame, whose z is up; files of many tools have y up.
pub fn longest_upwards(facts: &Facts) -> Vec<Finding> {
    let along_z = facts.body.as_ref().and_then(|body| body.longest_along_z);
    let Some(cosine) = along_z.filter(|cosine| *cosine < FRAC_1_SQRT_2) else { return vec![] };
    let angle = cosine.acos().to_degrees();
    let found = format!("a surface whose longest axis is {angle:.0} deg from z");
    let hint = "meshes are in the radar's frame, z up: where y is up, write (x, -z, y) in place of (x, y, z)";
    vec![Finding::new(Kind::Note, Part::Body, "vertices", found, "somebody upright").with_hint(hint)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plausibility::BodyFacts;
    use crate::plausibility::test_support::cuboid;

    fn of(vertices: &[[f64; 3]], faces: &[[usize; 3]]) -> Facts {
        Facts { body: Some(BodyFacts::of_mesh(vertices, faces)), ..Facts::default() }
    }

    #[test]
    fn a_body_in_metres_passes_and_one_in_another_unit_is_named() {
        let (vertices, faces) = cuboid([0.0; 3], [0.5, 0.3, 1.75]);
        assert!(length(&of(&vertices, &faces)).is_empty());
        for (factor, unit) in [(1e3, "in millimetres it would be 1.75 m"), (1e2, "in centimetres"), (1.0 / 0.3048, "in feet")] {
            let scaled: Vec<[f64; 3]> = vertices.iter().map(|vertex| vertex.map(|x| x * factor)).collect();
            let found = length(&of(&scaled, &faces));
            assert_eq!((found.len(), found[0].kind, found[0].field.as_str()), (1, Kind::Refuse, "v_template"));
            assert!(found[0].hint.as_ref().unwrap().contains(unit), "{found:?}");
        }
        let tiny: Vec<[f64; 3]> = vertices.iter().map(|vertex| vertex.map(|x| x * 1e-3)).collect();
        assert_eq!(length(&of(&tiny, &faces))[0].found, "a body 0.0018 m long");
    }

    #[test]
    fn a_raised_arm_makes_no_giant_of_a_mesh() {
        let body = |length_m| Facts {
            body: Some(BodyFacts { length_m, volume_m3: 0.07, open: None, meshes: true, longest_along_z: None }),
            ..Facts::default()
        };
        assert!(length(&body([0.9, 3.1])).is_empty());
        assert_eq!(length(&body([90.0, 310.0]))[0].field, "vertices");
        assert_eq!(length(&body([0.1, 0.2])).len(), 1);
    }

    #[test]
    fn meshes_that_lie_are_noted_and_those_that_stand_or_bend_a_little_are_not() {
        let of = |size: [f64; 3]| {
            let (vertices, faces) = cuboid([3.0, 2.0, 1.0], size);
            longest_upwards(&Facts { body: Some(BodyFacts::of_meshes(&[vertices], &faces)), ..Facts::default() })
        };
        assert!(of([0.5, 0.3, 1.75]).is_empty());
        let y_up = &of([0.5, 1.75, 0.3])[0];
        assert!(y_up.kind == Kind::Note && y_up.found.contains("90 deg from z"), "{y_up:?}");
        // Leaning by 30 degrees, and without any surface.
        let (mut vertices, faces) = cuboid([0.0; 3], [0.5, 0.3, 1.75]);
        vertices.iter_mut().for_each(|vertex| vertex[0] += vertex[2] * 30f64.to_radians().tan());
        let leaning = BodyFacts::of_meshes(&[vertices.clone()], &faces);
        assert!(longest_upwards(&Facts { body: Some(leaning), ..Facts::default() }).is_empty());
        assert_eq!(BodyFacts::of_meshes(&[vertices], &[]).longest_along_z, None);
    }

    #[test]
    fn faces_that_look_inwards_are_refused_and_those_of_an_open_mesh_noted() {
        let (vertices, faces) = cuboid([3.0, 2.0, 1.0], [0.5, 0.3, 1.75]);
        assert!(faces_outwards(&of(&vertices, &faces)).is_empty());
        let inwards: Vec<[usize; 3]> = faces.iter().map(|&[a, b, c]| [a, c, b]).collect();
        let found = faces_outwards(&of(&vertices, &inwards));
        assert_eq!((found[0].kind, found[0].field.as_str()), (Kind::Refuse, "f"));
        assert!(found[0].found.contains("inside out (a volume of -0.26"), "{}", found[0].found);
        assert!(faces_outwards(&of(&vertices, &faces[1..])).is_empty());
        assert_eq!(faces_outwards(&of(&vertices, &inwards[1..]))[0].kind, Kind::Note);
    }
}
