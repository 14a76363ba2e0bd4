//! Clearances of moving tools against closed forms and against many samples.

use super::*;
use crate::geometry::{Direction, Point, TriangleMesh, Vector};
use crate::motion::Pose;
use crate::tool::meridian::at;
use crate::tool::{CutterShape, Fixture, Section, Tool};
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};

const RESOLUTION: f64 = 1e-3;

/// Cylinder D10 with 20 mm of flutes, shank D8 up to 50, holder D40 up to 80.
fn tool() -> ToolSolid {
    let shape = CutterShape::Cylinder { diameter: 10.0, corner_radius: 0.0, flute_length: 20.0 };
    let fixture =
        Fixture { shank_diameter: Some(8.0), gauge_length: 80.0, holder: vec![at(50.0, 20.0), at(80.0, 20.0)] };
    ToolSolid::of(&Tool::new(1, &shape, &fixture).unwrap())
}

fn pose(tip: [f64; 3], axis: [f64; 3]) -> Pose {
    Pose { tip: Point::from(tip), axis: Direction::new_normalize(Vector::from(axis)) }
}

fn still(pose: Pose) -> Move<Leg> {
    Move { sweep: Leg { from: pose, to: pose }, cutting: true }
}

/// A square of side 400 about the origin in the plane z = 0.
fn floor(role: Role) -> Obstacle {
    let corner = |x, y| Point::new(x, y, 0.0);
    let corners = [corner(-200.0, -200.0), corner(200.0, -200.0), corner(200.0, 200.0), corner(-200.0, 200.0)];
    Obstacle::new("floor", role, &corners, &[[0, 1, 2], [0, 2, 3]]).unwrap()
}

/// A needle: a triangle without width.
fn needle(foot: [f64; 3], height: f64) -> Obstacle {
    let foot = Point::from(foot);
    let top = foot + Vector::z() * height;
    Obstacle::new("needle", Role::Avoid, &[foot, top, top], &[[0, 1, 2]]).unwrap()
}

/// A sphere whose vertices lie on it, one of them at +x.
fn sphere(centre: Point, radius: f64) -> Obstacle {
    let (rings, sectors) = (24_u32, 48_u32);
    let vertex = |ring: u32, sector: u32| {
        let (polar, around) = (PI * f64::from(ring) / f64::from(rings), TAU * f64::from(sector) / f64::from(sectors));
        centre + Vector::new(polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos()) * radius
    };
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for ring in 0..=rings {
        for sector in 0..=sectors {
            vertices.push(vertex(ring, sector));
            if ring < rings && sector < sectors {
                let a = ring * (sectors + 1) + sector;
                triangles.extend([[a, a + sectors + 1, a + 1], [a + 1, a + sectors + 1, a + sectors + 2]]);
            }
        }
    }
    Obstacle::new("sphere", Role::Avoid, &vertices, &triangles).unwrap()
}

fn below(obstacles: &[Obstacle], moves: &[Move<Leg>], margin: f64) -> Vec<Approach> {
    let tool = tool();
    Clearance { tool: &tool, obstacles, resolution: RESOLUTION }.below(moves, margin)
}

/// Clearance attained never undercuts the truth, and exceeds it by no more than the resolution and 1 % of a depth.
fn assert_near(found: f64, truth: f64) {
    assert!((-1e-9..=RESOLUTION + 0.01 * (-truth).max(0.0)).contains(&(found - truth)), "{found} for {truth}");
}

#[test]
fn a_tilted_tool_over_a_plane_is_as_far_as_its_lowest_rim() {
    for tilt in [0.3_f64, 0.8, 1.3] {
        let found =
            below(&[floor(Role::Avoid)], &[still(pose([3.0, -8.0, 30.0], [tilt.sin(), 0.0, tilt.cos()]))], 100.0);
        for (section, height, radius) in
            [(Section::Flute, 0.0, 5.0), (Section::Shank, 20.0, 4.0), (Section::Holder, 50.0, 20.0)]
        {
            let approach = found.iter().find(|f| f.section == section).unwrap();
            assert_near(approach.clearance, 30.0 + height * tilt.cos() - radius * tilt.sin());
        }
    }
}

#[test]
fn a_sphere_beside_the_shank_is_as_far_as_its_nearest_point() {
    let ball = sphere(Point::new(-20.0, 0.0, 35.0), 12.0);
    let found = below(&[ball], &[still(pose([0.0; 3], [0.0, 0.0, 1.0]))], 5.0);
    let shank = found.iter().find(|f| f.section == Section::Shank).unwrap();
    assert_near(shank.clearance, 20.0 - 12.0 - 4.0);
    assert!((shank.point - Point::new(-8.0, 0.0, 35.0)).norm() < 0.1);
}

#[test]
fn the_lowest_point_of_a_swing_is_found_between_its_ends() {
    // Hanging from z = 85 and swinging by 60 degrees to both sides, the holder's far rim runs on a circle.
    let side = |sign: f64| pose([0.0, 0.0, 85.0], [sign * (PI / 3.0).sin(), 0.0, -0.5]);
    let swing = Move { sweep: Leg { from: side(-1.0), to: side(1.0) }, cutting: false };
    let found = below(&[floor(Role::Avoid)], &[swing], 10.0);
    let [holder] = found.as_slice() else { panic!("{found:?}") };
    assert_eq!(holder.section, Section::Holder);
    assert_near(holder.clearance, 85.0 - 80.0_f64.hypot(20.0));
    let angle = (holder.share - 0.5).abs() * PI * 2.0 / 3.0;
    assert!((angle.tan() - 20.0 / 80.0).abs() < 0.02);
}

#[test]
fn a_needle_between_the_ends_of_a_long_rapid_is_hit_at_its_place() {
    let rapid = |z: f64| Move {
        sweep: Leg { from: pose([-300.0, 3.0, z], [0.0, 0.0, 1.0]), to: pose([500.0, 3.0, z], [0.0, 0.0, 1.0]) },
        cutting: false,
    };
    let needles = [needle([73.123, 0.0, 0.0], 30.0)];
    let found = below(&needles, &[rapid(40.0), rapid(-5.0), rapid(-45.0)], 0.0);
    let hits: Vec<_> = found.iter().map(|f| (f.index, f.section)).collect();
    assert_eq!(hits, [(1, Section::Flute), (1, Section::Shank), (2, Section::Shank), (2, Section::Holder)]);
    let depths = [-2.0, -1.0, -1.0, -17.0];
    for (approach, depth) in found.iter().zip(depths).filter(|(f, _)| f.section != Section::Holder) {
        assert_near(approach.clearance, depth);
        assert!((approach.share * 800.0 - 300.0 - 73.123).abs() < 0.1);
    }
}

#[test]
fn a_tool_gliding_along_a_wall_needs_few_looks() {
    // The clearance is the same all the way: bounds that ignored the direction of motion would halve it to dust.
    let rapid = Move {
        sweep: Leg { from: pose([-150.0, 0.0, 0.5], [0.0, 0.0, 1.0]), to: pose([150.0, 0.0, 0.5], [0.0, 0.0, 1.0]) },
        cutting: false,
    };
    struct Counting(Leg, std::sync::atomic::AtomicUsize);
    impl Sweep for Counting {
        fn pose(&self, share: f64) -> Pose {
            self.1.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            self.0.pose(share)
        }
        fn chord_bound(&self, from: f64, to: f64, height: f64) -> f64 {
            self.0.chord_bound(from, to, height)
        }
    }
    let moves = [Move { sweep: Counting(rapid.sweep, 0.into()), cutting: false }];
    let (tool, floor) = (tool(), [floor(Role::Avoid)]);
    let found = Clearance { tool: &tool, obstacles: &floor, resolution: RESOLUTION }.below(&moves, 1.0);
    assert_eq!(found.len(), 1);
    assert_near(found[0].clearance, 0.5);
    assert!(moves[0].sweep.1.load(std::sync::atomic::Ordering::Relaxed) < 30);
}

/// A closed box as an obstacle, with or without an inside.
fn block(half: f64, inside: bool) -> Obstacle {
    let corner = |k: u8| Point::from([0, 1, 2].map(|i| if k >> i & 1 == 0 { -half } else { half }));
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<[u32; 3]> = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    let corners: Vec<Point> = (0..8).map(corner).collect();
    let skin = Obstacle::new("block", Role::Avoid, &corners, &triangles).unwrap();
    let mesh = TriangleMesh::new(corners, triangles).unwrap();
    if inside { skin.with_inside(&mesh) } else { skin }
}

#[test]
fn a_tool_wholly_inside_a_closed_obstacle_is_deep_in_it() {
    let rapid = Move {
        sweep: Leg { from: pose([0.0, 0.0, -40.0], [0.0, 0.0, 1.0]), to: pose([9.0, 0.0, -40.0], [0.0, 0.0, 1.0]) },
        cutting: false,
    };
    let found = below(&[block(200.0, true)], &[rapid], -0.01);
    let sections: Vec<_> = found.iter().map(|f| f.section).collect();
    assert_eq!(sections, [Section::Flute, Section::Shank, Section::Holder]);
    assert!((found[0].clearance + 160.0).abs() < 1e-9 && found[0].share == 0.0, "{found:?}");
    assert!(below(&[block(200.0, false)], &[rapid], -0.01).is_empty());
    // Outside it the inside changes nothing, and where the skin is crossed its depth counts as before.
    let beside = still(pose([215.0, 0.0, 0.0], [0.0, 0.0, 1.0]));
    let touching = still(pose([203.0, 0.0, 0.0], [0.0, 0.0, 1.0]));
    for moves in [[beside], [touching]] {
        assert_eq!(below(&[block(200.0, true)], &moves, 0.0), below(&[block(200.0, false)], &moves, 0.0));
    }
}

#[test]
fn flutes_may_touch_only_what_is_cut_and_only_while_cutting() {
    let leg = Leg { from: pose([0.0, 0.0, -2.0], [0.0, 0.0, 1.0]), to: pose([9.0, 0.0, -2.0], [0.0, 0.0, 1.0]) };
    let hits = |role, cutting| !below(&[floor(role)], &[Move { sweep: leg, cutting }], 0.0).is_empty();
    assert!(!hits(Role::Cut, true));
    assert!(hits(Role::Cut, false) && hits(Role::Avoid, true) && hits(Role::Avoid, false));
    // The shank may never.
    let deep = still(pose([0.0, 0.0, -22.0], [0.0, 0.0, 1.0]));
    assert_eq!(below(&[floor(Role::Cut)], &[deep], 0.0).len(), 1);
}

#[test]
fn the_smallest_clearance_of_all_moves_is_named() {
    let (tool, bodies) = (tool(), [floor(Role::Avoid), needle([40.0, 0.0, 0.0], 50.0)]);
    let clearance = Clearance { tool: &tool, obstacles: &bodies, resolution: RESOLUTION };
    let leg = |y: f64| Move {
        sweep: Leg { from: pose([0.0, y, 60.0], [0.0, 0.0, 1.0]), to: pose([90.0, y, 60.0], [0.0, 0.0, 1.0]) },
        cutting: false,
    };
    let nearest = clearance.smallest(&[leg(30.0), leg(4.0), leg(-11.0)], 1000.0).unwrap();
    assert_eq!((nearest.index, nearest.obstacle, nearest.section), (1, 1, Section::Flute));
    assert_near(nearest.clearance, 10.0);
    assert_eq!(clearance.smallest(&[leg(30.0)], 5.0), None);
    assert_eq!(clearance.smallest::<Leg>(&[], 5.0), None);
}

#[test]
fn bad_meshes_are_refused_by_name() {
    let point = Point::origin();
    let no_vertex = Obstacle::new("x", Role::Avoid, &[point], &[[0, 0, 7]]).err();
    assert_eq!(no_vertex, Some(ObstacleError::NoVertex { triangle: 0, vertex: 7, vertices: 1 }));
    let infinite = Obstacle::new("x", Role::Avoid, &[point, Point::new(0.0, f64::NAN, 0.0)], &[]).err();
    assert_eq!(infinite, Some(ObstacleError::NotFinite(1)));
    assert!(
        below(&[Obstacle::new("x", Role::Avoid, &[], &[]).unwrap()], &[still(pose([0.0; 3], [0.0, 0.0, 1.0]))], 1e9)
            .is_empty()
    );
}

fn any_pose() -> impl Strategy<Value = Pose> {
    prop::array::uniform6(-1.0..1.0f64)
        .prop_map(|[a, b, c, d, e, f]| pose([50.0 * a, 50.0 * b, 60.0 * c], [d, e, 1.1 + f]))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// What is found is attained; what is sampled, in time and on the triangles, is never nearer.
    #[test]
    fn no_sample_undercuts_what_is_found(from in any_pose(), to in any_pose(),
        corners in prop::array::uniform4(prop::array::uniform3(-60.0..60.0f64))) {
        let points = corners.map(Point::from);
        let triangles = [[0, 1, 2], [1, 2, 3]];
        let bodies = [Obstacle::new("pair", Role::Avoid, &points, &triangles).unwrap()];
        let (tool, leg) = (tool(), Leg { from, to });
        let clearance = Clearance { tool: &tool, obstacles: &bodies, resolution: 0.01 };
        let found = clearance.below(&[Move { sweep: leg, cutting: true }], 1e3);
        prop_assert_eq!(found.len(), 3);
        for approach in &found {
            let distance = |pose: &Pose, point: &Point| {
                let pieces = tool.pieces.iter().filter(|(section, _)| *section == approach.section);
                pieces.map(|(_, piece)| piece.signed(pose, point).distance).fold(f64::INFINITY, f64::min)
            };
            let attained = distance(&leg.pose(approach.share), &approach.point);
            prop_assert!((attained - approach.clearance).abs() < 1e-9);
            for step in 0..=60 {
                let instant = leg.pose(f64::from(step) / 60.0);
                for corners in triangles {
                    let [a, b, c] = corners.map(|i| points[i as usize]);
                    for (i, j) in (0..=12).flat_map(|i| (0..=12 - i).map(move |j| (i, j))) {
                        let point = a + (b - a) * (f64::from(i) / 12.0) + (c - a) * (f64::from(j) / 12.0);
                        prop_assert!(distance(&instant, &point) >= approach.clearance - 0.01 - 0.01 * (-approach.clearance).max(0.0) - 1e-9);
                    }
                }
            }
        }
    }
}
