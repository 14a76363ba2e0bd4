//! Curved triangles against spheres, cylinders and cones, flat meshes, creases and seams.

use super::*;
use proptest::prelude::*;
use std::f64::consts::PI;

pub(in crate::geometry) const CREASE: Radians = Radians(PI / 6.0);

/// A mesh over a grid of parameters in the unit square; diagonals turn with `turn`.
pub(in crate::geometry) fn grid(
    [rows, columns]: [usize; 2],
    turn: bool,
    at: impl Fn(f64, f64) -> [f64; 3],
) -> TriangleMesh {
    let share = |k: usize, count: usize| k as f64 / count as f64;
    let points = (0..=rows).flat_map(|i| (0..=columns).map(move |j| (i, j)));
    let points = points.map(|(i, j)| Point::from(at(share(i, rows), share(j, columns)))).collect();
    let index = |i: usize, j: usize| (i * (columns + 1) + j) as u32;
    let quads = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
    let triangles = quads.flat_map(|(i, j)| {
        let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
        if turn && (i + j) % 2 == 0 { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] }
    });
    TriangleMesh::new(points, triangles.collect()).unwrap()
}

/// Part of a sphere of radius 10, normals outward; its meridians' spacing is uneven.
fn sphere(n: usize) -> TriangleMesh {
    grid([n, n], true, |u, v| {
        let (polar, around) = (0.8 + 1.1 * u + 0.1 * (PI * u).sin(), 1.4 * v + 0.15 * u);
        [10.0 * polar.sin() * around.cos(), 10.0 * polar.sin() * around.sin(), 10.0 * polar.cos()]
    })
}

/// Part of a cone about Z: radius at z, angle around, length of its generators; a slope of 0 makes it a cylinder.
fn cone(slope: f64, columns: usize, rows: usize, angle: f64) -> TriangleMesh {
    grid([columns, rows], false, |u, v| {
        let (around, z) = (angle * u, 12.0 * v);
        let radius = 10.0 + slope * z;
        [radius * around.cos(), radius * around.sin(), z]
    })
}

/// Largest value of a distance over places of all patches.
fn largest(mesh: &CurvedMesh, of: impl Fn(&Point) -> f64) -> f64 {
    const STEPS: usize = 8;
    let mut most = 0.0_f64;
    for face in 0..mesh.chords().triangles().len() {
        for (i, j) in (0..=STEPS).flat_map(|i| (0..=STEPS - i).map(move |j| (i, j))) {
            let [u, v] = [i, j].map(|k| k as f64 / STEPS as f64);
            most = most.max(of(&mesh.point(face, &[1.0 - u - v, u, v])).abs());
        }
    }
    most
}

/// The same of the flat triangles.
fn largest_flat(mesh: &TriangleMesh, of: impl Fn(&Point) -> f64) -> f64 {
    let middles = (0..mesh.triangles().len()).flat_map(|face| {
        let third = 1.0 / 3.0;
        [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [third; 3]].map(|w| mesh.point(face, w))
    });
    middles.map(|p| of(&p).abs()).fold(0.0, f64::max)
}

fn off_sphere(p: &Point) -> f64 {
    p.coords.norm() - 10.0
}

fn off_cone(slope: f64) -> impl Fn(&Point) -> f64 {
    move |p| (p.x.hypot(p.y) - 10.0 - slope * p.z) / slope.hypot(1.0)
}

fn curved(mesh: &TriangleMesh) -> CurvedMesh {
    CurvedMesh::with_creases(mesh.clone(), CREASE).unwrap()
}

fn with_normals(mesh: &TriangleMesh, at: impl Fn(&Point) -> Vector) -> CurvedMesh {
    let normals: Vec<_> =
        (0..mesh.triangles().len()).map(|f| mesh.corners(f).map(|p| Direction::new_normalize(at(&p)))).collect();
    CurvedMesh::with_normals(mesh.clone(), &normals).unwrap()
}

#[test]
fn the_error_on_a_sphere_falls_by_the_fourth_power_where_that_of_flat_triangles_falls_by_the_second() {
    let given = |n| largest(&with_normals(&sphere(n), |p| p.coords), off_sphere);
    let found = |n| largest(&curved(&sphere(n)), off_sphere);
    let flat = |n| largest_flat(&sphere(n), off_sphere);
    for n in [6, 12] {
        let order = |of: &dyn Fn(usize) -> f64| (of(n) / of(2 * n)).log2();
        assert!((1.8..2.1).contains(&order(&flat)), "{}", order(&flat));
        assert!(order(&given) > 3.8, "{}", order(&given));
        assert!(order(&found) > 3.6, "{}", order(&found));
    }
}

/// How much of the sag of flat triangles is left.
fn share_left(slope: f64, columns: usize, rows: usize) -> f64 {
    let (mesh, off) = (cone(slope, columns, rows, 1.6), off_cone(slope));
    largest(&curved(&mesh), &off) / largest_flat(&mesh, &off)
}

#[test]
fn cylinders_and_cones_come_out_of_coarse_open_meshes_by_a_small_share_of_the_sag() {
    for rows in [3, 8] {
        // A quarter of the share at half the size: the fourth power in all.
        let shares = [8, 16, 32].map(|columns| share_left(0.0, columns, rows));
        assert!(shares[0] < 0.08 && shares[1] < 0.3 * shares[0] && shares[2] < 0.3 * shares[1], "{shares:?}");
        for slope in [0.2, -0.3] {
            let shares = [8, 16].map(|columns| share_left(slope, columns, rows));
            assert!(shares[0] < 0.12 && shares[1] < shares[0], "{slope} {rows}: {shares:?}");
        }
    }
    // One row of long triangles, as modellers write such faces: normals are settled among neighbours alone.
    assert!(share_left(0.0, 8, 1) < 0.08);
    assert!(share_left(0.2, 8, 1) < 0.2 && share_left(-0.3, 8, 1) < 0.2);
    // With the surface's own normals the same mesh is met.
    for slope in [0.0, 0.2, -0.3] {
        let mesh = cone(slope, 8, 1, 1.6);
        let own = with_normals(&mesh, |p| Vector::new(p.x, p.y, -slope * p.x.hypot(p.y)));
        let off = off_cone(slope);
        assert!(largest(&own, &off) < 0.035 * largest_flat(&mesh, &off), "{slope}: {}", largest(&own, &off));
    }
}

/// Cube of side 2 about the origin, outward.
pub(in crate::geometry) fn cube() -> TriangleMesh {
    let corner = |k: u8| Point::from([0, 1, 2].map(|i| f64::from(k >> i & 1) * 2.0 - 1.0));
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    TriangleMesh::new((0..8).map(corner).collect(), triangles).unwrap()
}

/// A closed cylinder of radius 5 about Z between 0 and 4.
pub(in crate::geometry) fn can(sectors: u32) -> TriangleMesh {
    let ring = |z: f64| {
        (0..sectors).map(move |k| {
            let around = 2.0 * PI * f64::from(k) / f64::from(sectors);
            Point::new(5.0 * around.cos(), 5.0 * around.sin(), z)
        })
    };
    let mut points: Vec<Point> = ring(0.0).chain(ring(4.0)).collect();
    points.extend([Point::origin(), Point::new(0.0, 0.0, 4.0)]);
    let [bottom, top] = [2 * sectors, 2 * sectors + 1];
    let triangles = (0..sectors).flat_map(|k| {
        let (a, b) = (k, (k + 1) % sectors);
        let (c, d) = (a + sectors, b + sectors);
        [[a, b, d], [a, d, c], [bottom, b, a], [top, c, d]]
    });
    TriangleMesh::new(points, triangles.collect()).unwrap()
}

#[test]
fn flat_faces_stay_flat_to_the_last_bit() {
    let cube = curved(&cube());
    for face in 0..12 {
        let normal = cube.chords().face_normals()[face];
        let axis = normal.iamax();
        for w in [[0.2, 0.3, 0.5], [0.7, 0.1, 0.2], [0.5, 0.5, 0.0]] {
            assert_eq!(cube.point(face, &w)[axis], normal[axis]);
            assert_eq!(cube.normal(face, &w), normal);
            assert!((cube.point(face, &w) - cube.chords().point(face, w)).norm() < 1e-15);
        }
    }
    assert!((cube.area() - 24.0).abs() < 1e-13);
}

/// The rim of a closed cylinder is a crease: the wall's edges there follow the circle, and the caps' with them.
#[test]
fn a_crease_is_one_curve_for_both_sides_and_lies_on_the_circle() {
    let can = curved(&can(24));
    let sag = 5.0 * (1.0 - (PI / 24.0).cos());
    let off = |p: &Point| {
        let (wall, cap) = (p.x.hypot(p.y) - 5.0, (p.z - 2.0).abs() - 2.0);
        wall.abs().min(cap.abs())
    };
    assert!(largest(&can, off) < 0.014 * sag, "{} {sag}", largest(&can, off));
    let beyond = largest(&can, |p| (p.x.hypot(p.y) - 5.0).max(0.0));
    assert!(beyond < 0.014 * sag, "{beyond}");
}

/// A sheet with bumps; `None` where they are too wild to be curved.
fn bumpy(heights: &[f64], scale: f64) -> Option<CurvedMesh> {
    let mesh = grid([4, 4], true, |u, v| {
        let (i, j) = ((4.0 * u).round() as usize, (4.0 * v).round() as usize);
        [4.0 * u, 4.0 * v, scale * heights[5 * i + j]]
    });
    CurvedMesh::with_creases(mesh, CREASE).ok()
}

proptest! {
    /// With heights as large, some edges are creases, some end within the mesh.
    #[test]
    fn neighbours_share_the_curve_over_their_edge(
        heights in prop::collection::vec(-1.0..1.0f64, 25), scale in 0.0..0.5f64, t in 0.0..1.0f64,
    ) {
        let mesh = bumpy(&heights, scale);
        prop_assume!(mesh.is_some());
        let mesh = mesh.unwrap();
        for face in 0..mesh.chords().triangles().len() {
            for (k, other) in mesh.chords().topology().neighbours(face).into_iter().enumerate() {
                let Some(other) = other else { continue };
                let corners = mesh.chords().triangles()[face];
                let place = |of: usize| {
                    let weight = |v: &u32| {
                        if *v == corners[k] { 1.0 - t } else if *v == corners[(k + 1) % 3] { t } else { 0.0 }
                    };
                    mesh.chords().triangles()[of].each_ref().map(weight)
                };
                let (here, there) = (mesh.point(face, &place(face)), mesh.point(other, &place(other)));
                prop_assert!((here - there).norm() < 1e-14);
            }
        }
    }

    #[test]
    fn rigid_motions_change_nothing(
        heights in prop::collection::vec(-1.0..1.0f64, 25), turn in prop::array::uniform3(-3.0..3.0f64),
        shift in prop::array::uniform3(-50.0..50.0f64),
    ) {
        let motion = RigidMotion::new(Vector::from(shift), Vector::from(turn));
        let mesh = bumpy(&heights, 0.15);
        prop_assume!(mesh.is_some());
        let mesh = mesh.unwrap();
        let moved = [mesh.transformed(&motion), curved(&mesh.chords().transformed(&motion))];
        for other in &moved {
            prop_assert!((other.area() - mesh.area()).abs() < 1e-10);
            for face in 0..mesh.chords().triangles().len() {
                let w = [0.2, 0.5, 0.3];
                prop_assert!((motion * mesh.point(face, &w) - other.point(face, &w)).norm() < 1e-11);
                prop_assert!((motion * mesh.normal(face, &w).into_inner() - other.normal(face, &w).into_inner()).norm() < 1e-9);
            }
        }
    }
}

#[test]
fn areas_are_those_of_the_surface() {
    let truth = 2.0 * PI * 5.0 * (5.0 + 4.0);
    let mesh = curved(&can(24));
    let [curved, flat] = [mesh.area(), mesh.chords().area()].map(|area| (area - truth).abs());
    assert!(curved < 0.02 * flat, "{curved} {flat}");
}

#[test]
fn normals_that_a_triangle_does_not_face_are_refused() {
    let mesh = cube();
    let own: Vec<_> = mesh.face_normals().iter().map(|n| [*n; 3]).collect();
    let mut turned = own.clone();
    turned[7][2] = -turned[7][2];
    let error = CurvedMesh::with_normals(mesh.clone(), &turned).unwrap_err();
    assert!(matches!(error, CurvedMeshError::Leaning { triangle: 7, degrees, .. } if degrees > 179.9), "{error}");
    assert_eq!(error.triangle(), 7);
    assert!(CurvedMesh::with_normals(mesh, &own).is_ok());
}

#[test]
fn triangles_that_fold_are_refused() {
    // A low triangle whose normals lean toward each other along its long side.
    let points = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [5.0, 1.0, 0.0]].map(Point::from).to_vec();
    let mesh = TriangleMesh::new(points, vec![[0, 1, 2]]).unwrap();
    let lean = |degrees: f64| {
        let (around, tilt) = (degrees.to_radians(), 60.0_f64.to_radians());
        Direction::new_normalize(Vector::new(tilt.sin() * around.cos(), tilt.sin() * around.sin(), tilt.cos()))
    };
    let error = CurvedMesh::with_normals(mesh, &[[lean(330.0), lean(330.0), lean(150.0)]]).unwrap_err();
    assert!(matches!(error, CurvedMeshError::Folded { triangle: 0, .. }), "{error}");
}
