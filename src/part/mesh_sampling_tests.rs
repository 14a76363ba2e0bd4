use super::*;
use crate::geometry::{Point, Radians};
use proptest::prelude::*;

fn roof() -> TriangleMesh {
    let points = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 3.0, 2.0], [0.0, 3.0, 2.0], [4.0, 9.0, 1.0], [0.0, 6.0, 1.5]];
    let triangles = vec![[0, 1, 2], [0, 2, 3], [3, 2, 4], [3, 4, 5]];
    TriangleMesh::new(points.iter().map(|p| Point::from(*p)).collect(), triangles).unwrap()
}

/// The roof with a smooth bend over it, or with its ridge sharp.
fn curved(crease: f64) -> CurvedMesh {
    CurvedMesh::with_creases(roof(), Radians(crease)).unwrap()
}

proptest! {
    #[test]
    fn grids_of_curved_triangles_lie_on_them_and_have_no_gaps(spacing in 0.3..6.0f64, sharp: bool) {
        let mesh = curved(if sharp { 0.1 } else { 1.5 });
        let grid = sample(&Joined(&mesh), spacing);
        let points = grid.samples.iter().map(|s| s.point).collect();
        let cut = TriangleMesh::new(points, grid.triangles).unwrap();
        prop_assert!(cut.topology().is_disc());
        // Each side of the crease with its own samples, at the same places.
        let apart = sample(&mesh, spacing);
        prop_assert_eq!(apart.triangles.len(), cut.triangles().len());
        prop_assert_eq!(apart.samples.len() > cut.vertices().len(), sharp);
        for s in &apart.samples {
            let SurfacePlace::Face { index, barycentric } = s.place else { panic!("a mesh has faces") };
            prop_assert!((mesh.point(index, &barycentric) - s.point).norm() < 1e-13);
            prop_assert!((mesh.normal(index, &barycentric).into_inner() - s.normal.0.into_inner()).norm() < 1e-13);
            prop_assert!(cut.vertices().iter().any(|p| (p - s.point).norm() < 1e-12));
        }
    }

    #[test]
    fn between_samples_of_curved_triangles_lies_on_them(
        a in 0.0..1.0f64, b in 0.0..1.0f64, pick in 0usize..1000, spacing in 0.5..6.0f64,
    ) {
        let mesh = curved(1.5);
        let grid = sample(&mesh, spacing);
        let corners = grid.triangles[pick % grid.triangles.len()].map(|k| grid.samples[k as usize]);
        let s = between_curved(&mesh, [&corners[0], &corners[1], &corners[2]], [1.0 - a, a * (1.0 - b), a * b]);
        let SurfacePlace::Face { index, barycentric } = s.place else { panic!("a mesh has faces") };
        prop_assert!(barycentric.iter().all(|w| (-1e-12..1.0 + 1e-12).contains(w)));
        prop_assert!((mesh.point(index, &barycentric) - s.point).norm() < 1e-13);
    }

    #[test]
    fn grids_cover_the_mesh_without_gaps(spacing in 0.2..6.0f64) {
        let mesh = roof();
        let grid = sample(&mesh, spacing);
        for triangle in &grid.triangles {
            for k in 0..3 {
                let [a, b] = [k, (k + 1) % 3].map(|i| grid.samples[triangle[i] as usize].point);
                prop_assert!((a - b).norm() <= spacing);
            }
        }
        // The triangles are a mesh again: neighbours share whole sides, all turn alike, and the area is the same.
        let points = grid.samples.iter().map(|s| s.point).collect();
        let cut = TriangleMesh::new(points, grid.triangles.clone()).unwrap();
        prop_assert!(cut.topology().is_disc());
        prop_assert!((cut.area() - mesh.area()).abs() < 1e-11);
        for s in &grid.samples {
            prop_assert!(mesh.closest(&s.point).signed_distance.abs() < 1e-12);
            let SurfacePlace::Face { index, barycentric } = s.place else { panic!("a mesh has faces") };
            prop_assert!((mesh.point(index, barycentric) - s.point).norm() < 1e-12);
            prop_assert!((mesh.normal(index, barycentric).into_inner() - s.normal.0.into_inner()).norm() < 1.0);
        }
    }

    #[test]
    fn between_stays_on_the_mesh(a in 0.0..1.0f64, b in 0.0..1.0f64, pick in 0usize..64) {
        let mesh = roof();
        let grid = sample(&mesh, 1.0);
        let corners = grid.triangles[pick % grid.triangles.len()].map(|k| grid.samples[k as usize]);
        let s = between(&mesh, [&corners[0], &corners[1], &corners[2]], [1.0 - a, a * (1.0 - b), a * b]);
        prop_assert!(mesh.closest(&s.point).signed_distance.abs() < 1e-12);
        let SurfacePlace::Face { index, barycentric } = s.place else { panic!("a mesh has faces") };
        prop_assert!((mesh.point(index, barycentric) - s.point).norm() < 1e-12);
    }
}
