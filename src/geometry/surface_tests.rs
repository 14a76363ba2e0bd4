use super::*;
use proptest::prelude::*;

/// A surface with random control points and weights between 0.5 and 2.
fn surface(degree: [usize; 2], numbers: &[f64], rational: bool) -> SplineSurface {
    let [rows, columns] = [degree[0] + 3, degree[1] + 2];
    let number = |k: usize| numbers[k % numbers.len()];
    let point = |i: usize, j: usize| {
        Point::new(3.0 * i as f64 + number(i * 7 + j), 2.0 * j as f64 + number(i + 5 * j), 3.0 * number(i * 3 + j * 11))
    };
    let control = (0..rows).map(|i| (0..columns).map(|j| point(i, j)).collect()).collect();
    let weight = |i: usize, j: usize| 2.0f64.powf(number(i * 13 + j * 17));
    let weights = rational.then(|| (0..rows).map(|i| (0..columns).map(|j| weight(i, j)).collect()).collect());
    let knots = |p, n| Knots::clamped_uniform(p, n).unwrap().values().to_vec();
    SplineSurface::new(degree, [knots(degree[0], rows), knots(degree[1], columns)], control, weights).unwrap()
}

/// Central differences of `jet` against its own derivatives.
fn assert_consistent(jet: impl Fn(f64, f64) -> SurfaceJet, u: f64, v: f64) {
    let h = 1e-5;
    let here = jet(u, v);
    let (du, dv) = ([jet(u - h, v), jet(u + h, v)], [jet(u, v - h), jet(u, v + h)]);
    let slope = |pair: &[SurfaceJet; 2], f: &dyn Fn(&SurfaceJet) -> Vector| (f(&pair[1]) - f(&pair[0])) / (2.0 * h);
    for (found, exact, name) in [
        (slope(&du, &|j| j.point.coords), here.su, "su"),
        (slope(&dv, &|j| j.point.coords), here.sv, "sv"),
        (slope(&du, &|j| j.su), here.suu, "suu"),
        (slope(&du, &|j| j.sv), here.suv, "suv"),
        (slope(&dv, &|j| j.su), here.suv, "suv"),
        (slope(&dv, &|j| j.sv), here.svv, "svv"),
    ] {
        assert!((found - exact).norm() < 1e-5 * (1.0 + exact.norm()), "{name} at {u} {v}: {found} {exact}");
    }
}

proptest! {
    #[test]
    fn derivatives_match_central_differences(
        p in 1usize..6, q in 1usize..6, numbers in prop::collection::vec(-1.0..1.0f64, 60), rational: bool,
        s in 0.05..0.95f64, t in 0.05..0.95f64,
    ) {
        let surface = surface([p, q], &numbers, rational);
        // Stay inside one polynomial piece: three along u, two along v.
        let (u, v) = ((1.0 + s) / 3.0, t / 2.0);
        assert_consistent(|u, v| surface.jet(u, v), u, v);
    }

    #[test]
    fn the_extension_is_straight_c1_and_knows_its_derivatives(
        p in 1usize..5, q in 1usize..5, numbers in prop::collection::vec(-1.0..1.0f64, 60), rational: bool,
        s in 0.05..0.95f64, x in 0.01..2.0f64, y in 0.01..2.0f64,
    ) {
        let surface = surface([p, q], &numbers, rational);
        let inner = s / 3.0;
        for (u, v) in [(-x, s / 2.0), (1.0 + x, s / 2.0), (inner, -y), (inner, 1.0 + y), (-x, 1.0 + y), (1.0 + x, -y)] {
            assert_consistent(|u, v| surface.extended_jet(u, v), u, v);
            // Straight along the way out: two steps are twice one step.
            let (a, b) = (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0));
            let edge = surface.point(a, b);
            if (u, v) == (a, v) || (u, v) == (u, b) {
                let twice = surface.extended_jet(2.0 * u - a, 2.0 * v - b).point;
                let once = surface.extended_jet(u, v).point;
                prop_assert!((twice - edge - (once - edge) * 2.0).norm() < 1e-10);
            }
            // Value and first derivatives agree on both sides of the edge.
            let tiny = 1e-9;
            let out = surface.extended_jet(a + (u - a).signum() * tiny * f64::from(u != a), b + (v - b).signum() * tiny * f64::from(v != b));
            let inside = surface.jet(a, b);
            prop_assert!((out.point - inside.point).norm() < 1e-6 * (1.0 + inside.su.norm() + inside.sv.norm()));
            prop_assert!((out.su - inside.su).norm() < 1e-6 * (1.0 + inside.suv.norm() + inside.suu.norm()));
            prop_assert!((out.sv - inside.sv).norm() < 1e-6 * (1.0 + inside.suv.norm() + inside.svv.norm()));
        }
    }

    #[test]
    fn a_common_factor_of_all_weights_changes_nothing(
        numbers in prop::collection::vec(-1.0..1.0f64, 60), u in 0.0..1.0f64, v in 0.0..1.0f64,
    ) {
        let plain = surface([3, 2], &numbers, false);
        let (rows, columns) = (6, 4);
        let control = plain.control().chunks(columns).map(<[Point]>::to_vec).collect();
        let knots = [plain.knots_u().values().to_vec(), plain.knots_v().values().to_vec()];
        let weighted = SplineSurface::new([3, 2], knots, control, Some(vec![vec![3.7; columns]; rows])).unwrap();
        let (a, b) = (plain.jet(u, v), weighted.jet(u, v));
        prop_assert!((a.point - b.point).norm() < 1e-12 && (a.svv - b.svv).norm() < 1e-9 && (a.suv - b.suv).norm() < 1e-9);
    }
}

#[test]
fn what_does_not_fit_is_refused_by_kind() {
    let row = |n: usize| (0..n).map(|j| Point::new(j as f64, 0.0, 0.0)).collect::<Vec<_>>();
    let knots = vec![0.0, 0.0, 1.0, 1.0];
    let build = |control, knots_v: &[f64], weights| {
        SplineSurface::new([1, 1], [knots.clone(), knots_v.to_vec()], control, weights).unwrap_err()
    };
    assert_eq!(build(vec![row(2), row(3)], &knots, None), SurfaceError::Ragged { row: 1, found: 3, expected: 2 });
    assert!(matches!(
        build(vec![row(2), row(2)], &[0.0, 1.0, 1.0], None),
        SurfaceError::KnotsV(KnotError::Count { .. })
    ));
    assert!(matches!(build(vec![], &knots, None), SurfaceError::KnotsU(KnotError::TooFew { .. })));
    let mut bad = vec![row(2), row(2)];
    bad[1][0].z = f64::INFINITY;
    assert_eq!(build(bad, &knots, None), SurfaceError::NotFinite { row: 1, column: 0 });
    let weights = Some(vec![vec![1.0, 1.0], vec![1.0, 0.0]]);
    assert!(matches!(build(vec![row(2), row(2)], &knots, weights), SurfaceError::Weight { row: 1, column: 1, .. }));
    let short = Some(vec![vec![1.0, 1.0]]);
    assert_eq!(build(vec![row(2), row(2)], &knots, short), SurfaceError::WeightCount { row: 1 });
}
