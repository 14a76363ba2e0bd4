//! Feet on curved meshes against closed forms and many samples; bounds against values.

use super::super::curved_mesh::tests::{CREASE, can, cube, grid};
use super::*;
use crate::geometry::{RigidMotion, TriangleMesh};
use proptest::prelude::*;
use std::f64::consts::PI;

fn curved(mesh: TriangleMesh) -> CurvedMesh {
    CurvedMesh::with_creases(mesh, CREASE).unwrap()
}

/// A smooth open sheet of 4 x 4 mm, normal upward.
fn wave() -> CurvedMesh {
    curved(grid([5, 5], true, |u, v| [4.0 * u, 4.0 * v, 0.4 * (2.0 * u + 1.0).sin() * (2.5 * v).cos()]))
}

/// Signed distance from the cube of side 2 in closed form.
fn cube_distance(p: &Point) -> f64 {
    let outside = p.coords.abs() - Vector::repeat(1.0);
    outside.sup(&Vector::zeros()).norm() + outside.max().min(0.0)
}

fn place() -> impl Strategy<Value = Barycentric> {
    (0.0..1.0f64, 0.0..1.0f64).prop_map(|(a, b)| {
        let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
        [1.0 - a - b, a, b]
    })
}

proptest! {
    #[test]
    fn the_foot_on_a_cube_has_its_closed_form(p in prop::array::uniform3(-3.0..3.0f64)) {
        let p = Point::from(p);
        let foot = curved(cube()).closest(&p);
        prop_assert!((foot.signed_distance - cube_distance(&p)).abs() < 1e-8, "{foot:?}");
        prop_assert!(!foot.past_edge);
    }

    /// No place of the sheet is nearer, and a foot away from the border is one along the surface's own normal.
    #[test]
    fn the_foot_is_the_nearest_place(p in prop::array::uniform3(-2.0..2.0f64)) {
        let (mesh, p) = (wave(), Point::from(p) + Vector::new(2.0, 2.0, 0.0));
        let foot = mesh.closest(&p);
        prop_assert!((mesh.point(foot.face, &foot.barycentric) - foot.point).norm() < 1e-14);
        for face in 0..mesh.chords().triangles().len() {
            for (i, j) in (0..=10).flat_map(|i| (0..=10 - i).map(move |j| (f64::from(i) / 10.0, f64::from(j) / 10.0))) {
                let sample = mesh.point(face, &[1.0 - i - j, i, j]);
                prop_assert!((sample - p).norm() >= foot.signed_distance.abs() - 1e-8);
            }
        }
        if foot.feature == MeshFeature::Face {
            let jet = mesh.patches[foot.face].points.jet(&foot.barycentric);
            let offset = p - foot.point;
            prop_assert!(offset.dot(&jet.u).abs() < 1e-6 && offset.dot(&jet.v).abs() < 1e-6, "{foot:?}");
            prop_assert!(offset.dot(&jet.u.cross(&jet.v)) * foot.signed_distance > -1e-9);
        }
    }

    #[test]
    fn a_point_above_the_sheet_comes_back_to_its_place(pick in 0..50usize, w in place(), lift in -0.3..0.3f64) {
        let mesh = wave();
        let jet = mesh.patches[pick].points.jet(&w);
        let normal = jet.u.cross(&jet.v).normalize();
        let foot = mesh.closest(&Point::from(jet.point + normal * lift));
        prop_assert!((foot.signed_distance - lift).abs() < 2e-3, "{foot:?} {lift}");
        prop_assert!((foot.point.coords - jet.point).norm() < 0.05);
    }

    #[test]
    fn feet_move_along(p in prop::array::uniform3(-2.0..6.0f64), turn in prop::array::uniform3(-3.0..3.0f64)) {
        let (mesh, p, motion) = (wave(), Point::from(p), RigidMotion::new(Vector::new(3.0, -4.0, 5.0), turn.into()));
        let (here, there) = (mesh.closest(&p), mesh.transformed(&motion).closest(&(motion * p)));
        prop_assert!((here.signed_distance - there.signed_distance).abs() < 1e-8);
    }

    #[test]
    fn beyond_the_rim_is_past_the_edge(x in -2.0..6.0f64, y in -2.0..6.0f64, z in 0.6..2.0f64) {
        // Level around, a hill in the middle.
        let hill = |t: f64| if (t - 0.5).abs() < 0.15 { (PI * (t - 0.5) / 0.3).cos() } else { 0.0 };
        let mesh = curved(grid([10, 10], false, |u, v| [4.0 * u, 4.0 * v, 0.2 * hill(u) * hill(v)]));
        let clear = |t: f64| t.abs() > 1e-3 && (t - 4.0).abs() > 1e-3;
        prop_assume!(clear(x) && clear(y));
        let inside = (0.0..4.0).contains(&x) && (0.0..4.0).contains(&y);
        let foot = mesh.closest(&Point::new(x, y, z));
        prop_assert_eq!(foot.past_edge, !inside, "{:?}", foot);
        prop_assert!(foot.signed_distance > 0.0);
    }

    #[test]
    fn no_place_of_a_part_is_beyond_its_bounds(
        pick in 0..50usize, corners in prop::array::uniform3(place()), w in place(), about in place(),
    ) {
        let mesh = wave();
        let normal = mesh.normal(pick, &about).into_inner();
        let bounds = mesh.part_bounds(pick, &corners, &normal);
        let at = weighted(&corners, &w);
        let flat: Vector = (0..3).map(|k| mesh.point(pick, &corners[k]).coords * w[k]).sum();
        prop_assert!((mesh.point(pick, &at).coords - flat).norm() <= bounds.bulge + 1e-13);
        prop_assert!((mesh.normal(pick, &at).into_inner() - normal).norm() <= bounds.turn + 1e-13);
    }

    #[test]
    fn places_of_neighbours_are_seen_from_one_triangle(pick in 0..50usize, share in 0.0..1.0f64) {
        let mesh = wave();
        let own = (pick, [0.3, 0.3, 0.4]);
        for (k, other) in mesh.chords().topology().neighbours(pick).into_iter().enumerate() {
            let Some(other) = other else { continue };
            // On the common side as the neighbour has it.
            let mut w = [0.0; 3];
            (w[k], w[(k + 1) % 3]) = (share, 1.0 - share);
            let theirs = mesh.seen_from(other, pick, &w).unwrap();
            let (face, [a, b]) = mesh.together([(other, theirs), own]);
            prop_assert_eq!(face, pick);
            prop_assert!((mesh.point(face, &a) - mesh.point(other, &theirs)).norm() < 1e-14 && b == own.1);
            // A little inside the neighbour: carried over along the patch.
            let inside = std::array::from_fn(|i| 0.998 * theirs[i] + 0.002 / 3.0);
            let (face, [a, ..]) = mesh.together([(other, inside), own, own]);
            prop_assert_eq!(face, pick);
            prop_assert!((mesh.point(face, &a) - mesh.point(other, &inside)).norm() < 5e-4);
        }
    }
}

#[test]
fn a_closed_body_has_an_inside() {
    let can = curved(can(24));
    let depth = |p: [f64; 3]| can.closest(&Point::from(p)).signed_distance;
    assert!((depth([0.0, 0.0, 1.0]) + 1.0).abs() < 1e-8);
    assert!((depth([4.5, 0.0, 2.0]) + 0.5).abs() < 1e-3);
    assert!((depth([0.0, 7.0, 6.0]) - 8.0_f64.sqrt()).abs() < 1e-3);
    assert!((depth([-7.0, 0.3, 2.0]) - (7.0_f64.hypot(0.3) - 5.0)).abs() < 1e-3);
}

/// Near the middle of a sphere all places are as near as each other: the search ends nevertheless.
#[test]
fn the_middle_of_a_sphere_has_a_foot() {
    let mesh = curved(grid([8, 8], false, |u, v| {
        let (polar, around) = (1.0 + u, 1.2 * v);
        [10.0 * polar.sin() * around.cos(), 10.0 * polar.sin() * around.sin(), 10.0 * polar.cos()]
    }));
    let foot = mesh.closest(&Point::origin());
    assert!((foot.signed_distance + 10.0).abs() < 0.02, "{foot:?}");
}
