//! Distances of moving bodies against closed forms and against many samples.

use super::*;
use proptest::prelude::*;
use std::f64::consts::PI;

const RESOLUTION: f64 = 1e-4;

/// Even way and even turn about an axis through the body's own zero.
struct Screw {
    from: Vector,
    way: Vector,
    turn: Vector,
    reach: f64,
}

impl RigidSweep for Screw {
    fn motion(&self, share: f64) -> RigidMotion {
        RigidMotion::new(self.from + self.way * share, self.turn * share)
    }

    fn acceleration(&self) -> f64 {
        self.turn.norm_squared() * self.reach
    }
}

fn screw(from: [f64; 3], way: [f64; 3], turn: [f64; 3]) -> Screw {
    Screw { from: from.into(), way: way.into(), turn: turn.into(), reach: 60.0 }
}

fn table() -> Rigid {
    Rigid::cuboid(Point::new(-100.0, -100.0, -20.0), Point::new(100.0, 100.0, 0.0))
}

fn rod(radius: f64, length: f64) -> Rigid {
    Rigid::cylinder(Point::origin(), Vector::z(), radius, length).unwrap()
}

fn found(sweep: &Screw, bodies: (&Rigid, &Rigid), margin: f64) -> Option<Nearing> {
    nearing(sweep, bodies, (margin, RESOLUTION), &mut Vector::z())
}

fn assert_near(found: f64, truth: f64) {
    assert!((-1e-6..=RESOLUTION + 1e-3 * (-truth).max(0.0)).contains(&(found - truth)), "{found} for {truth}");
}

#[test]
fn a_rapid_over_a_block_comes_as_near_as_it_is_high() {
    let block = Rigid::cuboid(Point::new(10.0, -5.0, 0.0), Point::new(11.0, 5.0, 30.0));
    for (height, truth) in [(30.5, 0.5), (30.0, 0.0), (28.0, -2.0)] {
        let rapid = screw([-300.0, 2.0, height], [600.0, 0.0, 0.0], [0.0; 3]);
        let near = found(&rapid, (&rod(4.0, 40.0), &block), 1.0).unwrap();
        assert_near(near.distance, truth);
        assert!((near.share * 600.0 - 310.5).abs() < 5.0, "{near:?}");
    }
    assert_eq!(found(&screw([-300.0, 2.0, 31.5], [600.0, 0.0, 0.0], [0.0; 3]), (&rod(4.0, 40.0), &block), 1.0), None);
}

#[test]
fn the_lowest_point_of_a_swing_lies_between_its_ends() {
    // A box hangs from an axis 55 mm over the table and swings by 120 degrees: its far edge runs on a circle.
    let arm = Rigid::cuboid(Point::new(-50.0, -5.0, -10.0), Point::new(0.0, 5.0, 10.0));
    let swing = Screw { from: Vector::new(0.0, 0.0, 55.0), way: Vector::zeros(), turn: Vector::y() * -PI, reach: 52.0 };
    let near = found(&swing, (&arm, &table()), 10.0).unwrap();
    assert_near(near.distance, 55.0 - 50.0_f64.hypot(10.0));
}

#[test]
fn what_glides_along_a_wall_is_as_far_all_the_way() {
    let wall = Rigid::cuboid(Point::new(-500.0, 4.5, -50.0), Point::new(500.0, 9.0, 50.0));
    let glide = screw([-300.0, 0.0, 0.0], [600.0, 0.0, 0.0], [0.0; 3]);
    assert_near(found(&glide, (&rod(4.0, 40.0), &wall), 1.0).unwrap().distance, 0.5);
}

#[test]
fn meshes_are_followed_like_the_solids_that_they_bound() {
    let corners: Vec<Point> = (0..8)
        .map(|k| Point::new(f64::from(k & 1) * 8.0, f64::from((k >> 1) & 1) * 6.0, f64::from(k >> 2) * 4.0))
        .collect();
    let faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let triangles: Vec<[Point; 3]> = faces
        .iter()
        .flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]])
        .map(|face| face.map(|corner: usize| corners[corner]))
        .collect();
    let mesh = Rigid::mesh(&triangles);
    let solid = Rigid::cuboid(corners[0], corners[7]);
    for (from, way, turn) in [
        ([-30.0, 3.0, 4.3], [60.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ([20.0, 8.0, 7.0], [-30.0, 3.0, -1.0], [0.0, 0.7, 0.4]),
        ([4.0, -12.0, 9.0], [1.0, 30.0, 2.0], [0.5, 0.0, 2.0]),
    ] {
        let sweep = screw(from, way, turn);
        let [a, b] = [&mesh, &solid].map(|body| found(&sweep, (body, &table()), 50.0).unwrap().distance);
        assert_eq!(a > 0.0, b > 0.0);
        assert!(b <= 0.0 || (a - b).abs() <= 2.0 * RESOLUTION, "{a} {b}");
        let ball = rod(2.0, 5.0);
        let [a, b] = [&mesh, &solid].map(|body| found(&sweep, (&ball, body), 50.0).unwrap().distance);
        assert!(b <= 0.0 || (a - b).abs() <= 2.0 * RESOLUTION, "{a} {b}");
    }
    assert_eq!(found(&screw([0.0; 3], [0.0; 3], [0.0; 3]), (&Rigid::mesh(&[]), &solid), 1e3), None);
}

/// A closed box as a mesh, turned inside out where `hollow`.
fn shell(low: [f64; 3], high: [f64; 3], hollow: bool, first: u32) -> (Vec<Point>, Vec<[u32; 3]>) {
    let corner = |k: u8| Point::from([0, 1, 2].map(|i| if k >> i & 1 == 0 { low[i] } else { high[i] }));
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
    let turned = |[a, b, c]: [u32; 3]| if hollow { [a, c, b] } else { [a, b, c] };
    ((0..8).map(corner).collect(), triangles.map(|t| turned(t).map(|k| k + first)).collect())
}

#[test]
fn a_body_wholly_inside_a_closed_mesh_is_seen_and_one_in_its_cavity_is_not() {
    let (mut points, mut triangles) = shell([-50.0; 3], [50.0; 3], false, 0);
    let block = Rigid::solid(TriangleMesh::new(points.clone(), triangles.clone()).unwrap());
    let inside = screw([-5.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 0.2, 0.0]);
    let probe = rod(2.0, 10.0);
    let near = found(&inside, (&probe, &block), 1.0).unwrap();
    // A point of the rod lies 40 to 50 mm below the skin.
    assert!((-50.0..-35.0).contains(&near.distance) && near.share == 0.0, "{near:?}");
    // The other way round, too: the block moves over the rod.
    let near = found(&screw([1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0; 3]), (&block, &probe), 1.0).unwrap();
    assert!(near.distance < -35.0, "{near:?}");
    // Near the skin from inside it is a collision and no near miss; beside the block it is nothing.
    let close = found(&screw([47.5, 0.0, 0.0], [0.0; 3], [0.0; 3]), (&probe, &block), 1.0).unwrap();
    assert!(close.distance < 0.0, "{close:?}");
    assert_eq!(found(&screw([60.0, 0.0, 0.0], [0.0; 3], [0.0; 3]), (&probe, &block), 1.0), None);
    // A cavity around the way is outside; an open mesh is its skin alone.
    let (hollow, inner) = shell([-40.0; 3], [40.0; 3], true, 8);
    points.extend(hollow);
    triangles.extend(inner);
    let cavity = Rigid::solid(TriangleMesh::new(points.clone(), triangles.clone()).unwrap());
    assert_eq!(found(&inside, (&probe, &cavity), 1.0), None);
    assert_eq!(cavity.anchors.len(), 2);
    triangles.truncate(11);
    let open = Rigid::solid(TriangleMesh::new(points, triangles).unwrap());
    assert_eq!(found(&inside, (&probe, &open), 1.0), None);
}

/// The nearest points of a box and a cylinder, by going to and fro between them: an independent measure.
fn apart(
    motion: &RigidMotion,
    (low, high): (Point, Point),
    (base, axis, radius, length): (Point, Vector, f64, f64),
) -> f64 {
    let on_box = |p: &Point| {
        let local = motion.inverse_transform_point(p);
        motion * Point::from(local.coords.sup(&low.coords).inf(&high.coords))
    };
    let on_cylinder = |p: &Point| {
        let height = (p - base).dot(&axis).clamp(0.0, length);
        let across = (p - base) - axis * (p - base).dot(&axis);
        base + axis * height + across.cap_magnitude(radius)
    };
    let mut on = motion * nalgebra::center(&low, &high);
    // Where both nearly touch along a line it takes thousands of steps.
    for _ in 0..100_000 {
        let next = on_box(&on_cylinder(&on));
        let moved = (next - on).norm();
        on = next;
        if moved < 1e-9 {
            break;
        }
    }
    (on - on_cylinder(&on)).norm()
}

#[test]
fn a_corner_over_the_rim_of_a_disc_is_met_where_it_leaves_it() {
    // Along the axis of the cylinder the direction that parts both has nothing across it but rounding.
    let turn = [0.0, 0.7129357221348932, -0.24924187317883192];
    let way = [53.60800481561113, 7.211414633578599, 16.707439498604366];
    let sweep = screw([-28.4568496964109, 20.449458045375245, 5.901862312573867], way, turn);
    let other = Rigid::cylinder(Point::new(1.0, 2.0, -8.0), Vector::new(0.0, 0.6, 0.8), 7.0, 20.0).unwrap();
    let body = Rigid::cuboid(Point::new(-8.0, -3.0, -5.0), Point::new(9.0, 4.0, 6.0));
    let near = found(&sweep, (&body, &other), 1e3).unwrap();
    assert!((near.distance - 0.52364).abs() < 2e-4, "{near:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// What is found is attained; what is sampled is never nearer.
    #[test]
    fn no_sample_undercuts_what_is_found(
        from in prop::array::uniform3(-40.0..40.0f64), way in prop::array::uniform3(-60.0..60.0f64),
        turn in prop::array::uniform3(-1.5..1.5f64)
    ) {
        let (low, high) = (Point::new(-8.0, -3.0, -5.0), Point::new(9.0, 4.0, 6.0));
        let (base, axis) = (Point::new(1.0, 2.0, -8.0), Vector::new(0.0, 0.6, 0.8));
        let other = Rigid::cylinder(base, axis, 7.0, 20.0).unwrap();
        let sweep = screw(from, way, turn);
        let near = found(&sweep, (&Rigid::cuboid(low, high), &other), 1e3).unwrap();
        let at = |share: f64| apart(&sweep.motion(share), (low, high), (base, axis, 7.0, 20.0));
        prop_assert!((at(near.share) - near.distance.max(0.0)).abs() < 2e-3, "{} {near:?}", at(near.share));
        for k in 0..=200 {
            let sample = at(f64::from(k) / 200.0);
            prop_assert!(sample >= near.distance - RESOLUTION - 1e-6, "{sample} {near:?}");
        }
    }
}
