use super::*;
use proptest::prelude::*;

/// Unit cube, outward.
fn cube() -> TriangleMesh {
    let vertices =
        (0..8u8).map(|k| Point::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2))).collect::<Vec<_>>();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    TriangleMesh::new(vertices, triangles).unwrap()
}

/// Signed distance from the unit cube in closed form.
fn cube_distance(p: &Point) -> f64 {
    let outside = (p.coords - Vector::repeat(0.5)).abs() - Vector::repeat(0.5);
    outside.sup(&Vector::zeros()).norm() + outside.max().min(0.0)
}

fn sheet() -> TriangleMesh {
    let vertices = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]].map(|[x, y]| Point::new(x, y, 0.0)).to_vec();
    TriangleMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).unwrap()
}

proptest! {
    #[test]
    fn cube_has_its_closed_form(x in -2.0..3.0f64, y in -2.0..3.0f64, z in -2.0..3.0f64) {
        let p = Point::new(x, y, z);
        let foot = cube().closest(&p);
        prop_assert!((foot.signed_distance - cube_distance(&p)).abs() < 1e-14, "{:?}", foot);
        prop_assert!(!foot.past_edge);
        prop_assert!((cube().point(foot.face, foot.barycentric) - foot.point).norm() < 1e-14);
    }

    #[test]
    fn distance_is_the_least_of_all_triangles_and_moves_along(
        x in -2.0..3.0f64, y in -2.0..3.0f64, z in -2.0..3.0f64, turn in prop::array::uniform3(-3.0..3.0f64),
    ) {
        let motion = RigidMotion::new(Vector::new(3.0, -4.0, 5.0), turn.into());
        let p = Point::new(x, y, z);
        let (here, there) = (cube().closest(&p), cube().transformed(&motion).closest(&(motion * p)));
        prop_assert!((here.signed_distance.abs() - there.signed_distance.abs()).abs() < 1e-13);
    }

    #[test]
    fn beyond_the_rim_of_a_sheet_is_past_its_edge(x in -1.0..3.0f64, y in -1.0..2.0f64, z in -2.0..2.0f64) {
        let inside = (0.0..=2.0).contains(&x) && (0.0..=1.0).contains(&y);
        let foot = sheet().closest(&Point::new(x, y, z));
        prop_assert_eq!(foot.past_edge, !inside);
        prop_assert!(foot.signed_distance * z >= 0.0);
    }
}

#[test]
fn above_the_rim_itself_is_not_past_it() {
    let foot = sheet().closest(&Point::new(2.0, 0.5, 1.0));
    assert!(!foot.past_edge && (foot.signed_distance - 1.0).abs() < 1e-15);
}

#[test]
fn areas_volumes_and_vertex_normals_of_a_cube() {
    let cube = cube();
    assert!((cube.area() - 6.0).abs() < 1e-14 && (cube.signed_volume() - 1.0).abs() < 1e-14);
    // Weighted by angles, a corner's normal is the diagonal whatever way the squares are cut.
    for (p, n) in cube.vertices().iter().zip(cube.vertex_normals()) {
        let diagonal = (p.coords - Vector::repeat(0.5)).normalize();
        assert!((diagonal - n.into_inner()).norm() < 1e-14);
    }
}

#[test]
fn vertices_without_triangles_are_dropped() {
    let vertices = [[9.0, 9.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[x, y]| Point::new(x, y, 0.0)).to_vec();
    let mesh = TriangleMesh::new(vertices, vec![[1, 2, 3]]).unwrap();
    assert_eq!((mesh.vertices().len(), mesh.triangles()), (3, &[[0, 1, 2]][..]));
}
