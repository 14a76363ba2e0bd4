use super::*;
use crate::geometry::Point;
use proptest::prelude::*;

/// z = height over x in 0..30, y in 0..20, bicubic.
fn patch(height: impl Fn(f64, f64) -> f64, flip: bool) -> Result<OrientedSpline, IrregularSurface> {
    let (x, y) = (|i: usize| i as f64 * 5.0, |j: usize| j as f64 * 4.0);
    let control =
        (0..7).map(|i| (0..6).map(|j| Point::new(x(i), y(j), height(x(i), y(j)))).collect()).collect::<Vec<Vec<_>>>();
    let knots = |n| Knots::clamped_uniform(3, n).unwrap().values().to_vec();
    OrientedSpline::new(SplineSurface::new([3, 3], [knots(7), knots(6)], control, None).unwrap(), flip)
}

fn check_grid(spline: &OrientedSpline, spacing: f64) {
    let grid = spline.sample(spacing);
    let mut area = 0.0;
    for triangle in &grid.triangles {
        let [a, b, c] = triangle.map(|k| grid.samples[k as usize]);
        let cross = (b.point - a.point).cross(&(c.point - a.point));
        assert!(cross.dot(&a.normal.0) > 0.0, "triangle against its normal");
        area += cross.norm() / 2.0;
        assert!((b.point - a.point).norm() < 1.5 * spacing);
    }
    assert!((area / spline.area() - 1.0).abs() < 0.01, "{area} {}", spline.area());
    let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
    for (u, v) in corners {
        assert!(grid.samples.iter().any(|s| s.place == SurfacePlace::Parameters { u, v }), "corner {u} {v}");
    }
}

#[test]
fn grids_cover_the_surface_and_turn_with_its_normal() {
    for flip in [false, true] {
        check_grid(&patch(|x, y| 0.02 * x * y - 0.01 * x * x, flip).unwrap(), 0.7);
    }
}

#[test]
fn area_of_a_plane_is_length_times_width() {
    assert!((patch(|x, y| 3.0 * x + 4.0 * y, false).unwrap().area() - 600.0 * 26.0f64.sqrt()).abs() < 1e-9);
}

proptest! {
    #[test]
    fn the_tool_side_is_positive(u in 0.0..1.0f64, v in 0.0..1.0f64, d in -2.0..2.0f64, flip: bool) {
        let spline = patch(|x, y| 0.01 * x * y, flip).unwrap();
        let sample = spline.at(u, v);
        let foot = spline.foot(&(sample.point + sample.normal.0.into_inner() * d));
        prop_assert!((foot.signed_distance - d).abs() < 1e-10 && !foot.past_edge);
        prop_assert!((sample.normal.0.z > 0.0) != flip);
    }

    #[test]
    fn between_lies_on_the_surface_and_hits_the_corners(a in 0.0..1.0f64, b in 0.0..1.0f64) {
        let spline = patch(|x, y| 0.01 * x * y, false).unwrap();
        let grid = spline.sample(3.0);
        let triangle = grid.triangles[7].map(|k| grid.samples[k as usize]);
        let corners = [&triangle[0], &triangle[1], &triangle[2]];
        let inside = spline.between(corners, [1.0 - a, a * (1.0 - b), a * b]);
        // Feet are perpendicular to 1e-12 of the size, here 36 mm.
        prop_assert!(spline.surface().closest(&inside.point).distance < 4e-11);
        prop_assert!((spline.between(corners, [0.0, 1.0, 0.0]).point - triangle[1].point).norm() < 1e-12);
    }
}

#[test]
fn a_pole_is_named() {
    let knots = vec![0.0, 0.0, 1.0, 1.0];
    let tip = Point::new(0.0, 0.0, 0.0);
    let control = vec![vec![tip, tip], vec![Point::new(1.0, -1.0, 0.0), Point::new(1.0, 1.0, 0.0)]];
    let triangle = SplineSurface::new([1, 1], [knots.clone(), knots], control, None).unwrap();
    assert_eq!(OrientedSpline::new(triangle, false).unwrap_err(), IrregularSurface::Pole { u: 0.0, v: 0.0 });
}

#[test]
fn a_fold_is_named_and_a_sharp_bend_is_not_one() {
    // x runs forth and back: 4 x(1-x) in Bezier form.
    let knots = [vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]];
    let with_middle = |middle: [f64; 3]| {
        let rows = [[0.0, 0.0, 0.0], middle, [0.3, 0.0, 0.0]];
        let control = rows.iter().map(|[x, _, z]| vec![Point::new(*x, 0.0, *z), Point::new(*x, 1.0, *z)]).collect();
        OrientedSpline::new(SplineSurface::new([2, 1], knots.clone(), control, None).unwrap(), false)
    };
    assert!(
        matches!(with_middle([2.0, 0.0, 0.0]).unwrap_err(), IrregularSurface::Fold { u, .. } if u > 0.4 && u < 0.6)
    );
    assert!(with_middle([2.0, 0.0, 0.02]).is_ok());
}
