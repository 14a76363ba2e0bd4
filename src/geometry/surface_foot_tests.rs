use super::*;
use crate::geometry::RigidMotion;
use proptest::prelude::*;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

/// A wavy bicubic patch, x in 0..30, y in 0..20, with `bumps` as heights of the control points.
fn wavy(bumps: &[f64]) -> SplineSurface {
    let (rows, columns) = (7, 6);
    let control = (0..rows)
        .map(|i| {
            (0..columns)
                .map(|j| Point::new(i as f64 * 5.0, j as f64 * 4.0, bumps[(i * columns + j) % bumps.len()]))
                .collect()
        })
        .collect();
    let uniform = |n: usize| {
        let mut knots = vec![0.0; 4];
        knots.extend((1..n - 3).map(|k| k as f64 / (n - 3) as f64));
        knots.extend([1.0; 4]);
        knots
    };
    SplineSurface::new([3, 3], [uniform(rows), uniform(columns)], control, None).unwrap()
}

/// A quarter of a cylinder about z, radius `r`, z in 0..`height`, exact as a rational quadratic; u is the angle.
fn quarter_cylinder(r: f64, height: f64) -> SplineSurface {
    let arc = [(r, 0.0), (r, r), (0.0, r)];
    let control = arc.iter().map(|(x, y)| vec![Point::new(*x, *y, 0.0), Point::new(*x, *y, height)]).collect();
    let weights = [1.0, FRAC_1_SQRT_2, 1.0].iter().map(|w| vec![*w; 2]).collect();
    let knots = [vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]];
    SplineSurface::new([2, 1], knots, control, Some(weights)).unwrap()
}

/// A patch of a sphere about the origin, longitude 0..90, latitude -45..45 degrees, exact as a rational biquadratic.
fn sphere_patch(r: f64) -> SplineSurface {
    let c = FRAC_1_SQRT_2;
    // Latitude arc in (rho, z): ends at ±45 degrees, middle where their tangents meet.
    let meridian = [(c, -c, 1.0), (1.0 / c, 0.0, c), (c, c, 1.0)];
    let circle = [(1.0, 0.0, 1.0), (1.0, 1.0, c), (0.0, 1.0, 1.0)];
    let control = circle
        .iter()
        .map(|(x, y, _)| meridian.iter().map(|(rho, z, _)| Point::new(x * rho * r, y * rho * r, z * r)).collect())
        .collect();
    let weights = circle.iter().map(|(_, _, a)| meridian.iter().map(|(_, _, b)| a * b).collect()).collect();
    let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    SplineSurface::new([2, 2], [knots.clone(), knots], control, Some(weights)).unwrap()
}

fn plane() -> SplineSurface {
    let control = vec![
        vec![Point::new(0.0, 0.0, 0.0), Point::new(0.0, 10.0, 0.0)],
        vec![Point::new(20.0, 0.0, 0.0), Point::new(20.0, 10.0, 0.0)],
    ];
    SplineSurface::new([1, 1], [vec![0.0, 0.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]], control, None).unwrap()
}

fn densely(surface: &SplineSurface, p: &Point, steps: usize) -> f64 {
    let mut least = f64::INFINITY;
    for i in 0..=steps {
        for j in 0..=steps {
            let q = surface.point(i as f64 / steps as f64, j as f64 / steps as f64);
            least = least.min((q - p).norm());
        }
    }
    least
}

fn point_within(low: [f64; 3], high: [f64; 3]) -> impl Strategy<Value = Point> {
    (low[0]..high[0], low[1]..high[1], low[2]..high[2]).prop_map(|(x, y, z)| Point::new(x, y, z))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn closest_is_not_beaten_by_dense_sampling(
        bumps in prop::collection::vec(-4.0..4.0f64, 42),
        p in point_within([-15.0, -15.0, -30.0], [45.0, 35.0, 30.0]),
    ) {
        let surface = wavy(&bumps);
        let foot = surface.closest(&p);
        let sampled = densely(&surface, &p, 48);
        prop_assert!(foot.distance <= sampled + 1e-12, "{} {}", foot.distance, sampled);
        // A sampled point lies within half a grid diagonal of the foot.
        prop_assert!(sampled <= foot.distance + 0.8);
        let again = surface.point(foot.u, foot.v);
        prop_assert!((again - foot.point).norm() < 1e-12 && ((again - p).norm() - foot.distance).abs() < 1e-12);
    }

    #[test]
    fn a_foot_inside_is_perpendicular_and_one_past_an_edge_lies_on_it(
        bumps in prop::collection::vec(-4.0..4.0f64, 42),
        p in point_within([-10.0, -10.0, -8.0], [40.0, 30.0, 8.0]),
    ) {
        let surface = wavy(&bumps);
        let foot = surface.closest(&p);
        let jet = surface.jet(foot.u, foot.v);
        let offset = p - foot.point;
        let (out_u, out_v) = (offset.dot(&jet.su) / jet.su.norm(), offset.dot(&jet.sv) / jet.sv.norm());
        let small = 1e-8;
        match foot.past_edge {
            None => prop_assert!(out_u.abs() < 1e-7 && out_v.abs() < 1e-7, "{out_u} {out_v}"),
            Some(Boundary::Edge(Edge::LowU)) => prop_assert!(foot.u == 0.0 && out_u < small && out_v.abs() < 1e-7),
            Some(Boundary::Edge(Edge::HighU)) => prop_assert!(foot.u == 1.0 && out_u > -small && out_v.abs() < 1e-7),
            Some(Boundary::Edge(Edge::LowV)) => prop_assert!(foot.v == 0.0 && out_v < small && out_u.abs() < 1e-7),
            Some(Boundary::Edge(Edge::HighV)) => prop_assert!(foot.v == 1.0 && out_v > -small && out_u.abs() < 1e-7),
            Some(Boundary::Corner(..)) => {
                prop_assert!((foot.u == 0.0 || foot.u == 1.0) && (foot.v == 0.0 || foot.v == 1.0));
            }
        }
    }

    #[test]
    fn a_point_on_a_short_normal_comes_back(
        bumps in prop::collection::vec(-1.0..1.0f64, 42), u in 0.0..1.0f64, v in 0.0..1.0f64, d in -0.5..0.5f64,
    ) {
        let surface = wavy(&bumps);
        let jet = surface.jet(u, v);
        let p = jet.point + jet.normal().unwrap().into_inner() * d;
        for foot in [surface.closest(&p), surface.closest_from(&p, (u + 0.03, v - 0.02))] {
            prop_assert!((foot.point - jet.point).norm() < 1e-9 && (foot.distance - d.abs()).abs() < 1e-11);
            prop_assert_eq!(foot.past_edge, None);
        }
    }

    #[test]
    fn feet_move_with_the_surface(
        bumps in prop::collection::vec(-4.0..4.0f64, 42),
        p in point_within([-10.0, -10.0, -8.0], [40.0, 30.0, 8.0]),
        turn in prop::array::uniform3(-3.0..3.0f64), shift in prop::array::uniform3(-50.0..50.0f64),
    ) {
        let motion = RigidMotion::new(shift.into(), turn.into());
        let surface = wavy(&bumps);
        let (here, there) = (surface.closest(&p), surface.transformed(&motion).closest(&(motion * p)));
        prop_assert!((here.distance - there.distance).abs() < 1e-11 * (1.0 + here.distance));
    }

    #[test]
    fn warm_start_finds_the_extension_and_tells_the_edge(y in 1.0..9.0f64, x in 0.5..5.0f64, z in -3.0..3.0f64) {
        let surface = plane();
        let foot = surface.closest_from(&Point::new(-x, y, z), (0.4, 0.4));
        prop_assert!((foot.point - Point::new(-x, y, 0.0)).norm() < 1e-12 && (foot.distance - z.abs()).abs() < 1e-12);
        prop_assert_eq!(foot.past_edge, Some(Boundary::Edge(Edge::LowU)));
        let clamped = surface.closest(&Point::new(-x, y, z));
        prop_assert!((clamped.distance - x.hypot(z)).abs() < 1e-12);
        prop_assert_eq!(clamped.past_edge, Some(Boundary::Edge(Edge::LowU)));
        let corner = surface.closest_from(&Point::new(20.0 + x, -y, z), (0.5, 0.5));
        prop_assert_eq!(corner.past_edge, Some(Boundary::Corner(Edge::HighU, Edge::LowV)));
    }

    #[test]
    fn a_foot_from_a_known_place_is_the_closest_point_but_for_rounding_and_so_is_its_jet(
        p in point_within([-2.0, -2.0, -1.0], [32.0, 22.0, 4.0]), off in -1.0..1.0f64, power in -8..0_i32,
    ) {
        let surface = wavy(&[0.0, 0.6, -0.4, 0.9, 0.2]);
        let exact = surface.closest(&p);
        let off = off * 10f64.powi(power);
        let near = (exact.u + off, exact.v - 2.0 * off);
        let place = surface.place_closest_from(&p, &surface.place(near.0, near.1));
        let foot = surface.closest_from(&p, near);
        prop_assert!((place.u - foot.u).abs() < 1e-10 && (place.v - foot.v).abs() < 1e-10, "{place:?} {foot:?}");
        let jet = surface.extended_jet(place.u, place.v);
        prop_assert!((place.jet.point - jet.point).norm() < 1e-12, "{place:?} {jet:?}");
        for (found, want) in [(place.jet.su, jet.su), (place.jet.sv, jet.sv)] {
            prop_assert!((found - want).norm() < 1e-8 * want.norm(), "{place:?} {jet:?}");
        }
    }

    #[test]
    fn cylinder_and_sphere_have_their_closed_forms(
        angle in 0.01..1.56f64, z in 0.5..29.5f64, latitude in -0.78..0.78f64, d in -9.0..40.0f64,
    ) {
        let radial = Vector::new(angle.cos(), angle.sin(), 0.0);
        let foot = quarter_cylinder(10.0, 30.0).closest(&(Point::new(0.0, 0.0, z) + radial * (10.0 + d)));
        prop_assert!((foot.point - (Point::new(0.0, 0.0, z) + radial * 10.0)).norm() < 1e-9);
        prop_assert!((foot.distance - d.abs()).abs() < 1e-11 && foot.past_edge.is_none());
        let out = radial * latitude.cos() + Vector::z() * latitude.sin();
        let sphere = sphere_patch(10.0).closest(&Point::from(out * (10.0 + d)));
        prop_assert!((sphere.point - Point::from(out * 10.0)).norm() < 1e-9);
        prop_assert!((sphere.distance - d.abs()).abs() < 1e-11 && sphere.past_edge.is_none());
    }
}

#[test]
fn beyond_the_centre_of_curvature_the_rim_is_closest() {
    // On the axis of symmetry the distance to the middle of the patch is a local maximum.
    let surface = quarter_cylinder(10.0, 30.0);
    let middle = FRAC_PI_2 / 2.0;
    let p = Point::new(-20.0 * middle.cos(), -20.0 * middle.sin(), 15.0);
    let want = (p - Point::new(10.0, 0.0, 15.0)).norm();
    assert!((surface.closest(&p).distance - want).abs() < 1e-12);
}

#[test]
fn the_centre_of_a_sphere_is_one_radius_from_it() {
    assert!((sphere_patch(10.0).closest(&Point::origin()).distance - 10.0).abs() < 1e-12);
}

#[test]
fn a_warm_start_at_a_maximum_of_the_distance_recovers() {
    let surface = quarter_cylinder(10.0, 30.0);
    let middle = FRAC_PI_2 / 2.0;
    let p = Point::new(-20.0 * middle.cos(), -20.0 * middle.sin(), 15.0);
    let foot = surface.closest_from(&p, (0.5, 0.5));
    assert!(foot.distance <= surface.closest(&p).distance + 1e-12);
}
