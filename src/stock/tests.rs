//! The stock against closed forms, and its two ways to find an extent against each other and against many poses.

use super::extent::Extent;
use super::solid::{Side, Solid};
use super::straight::Shifted;
use super::turning::Turning;
use super::*;
use crate::geometry::{Degrees, Direction, Point, TriangleMesh, Vector};
use crate::motion::Pose;
use crate::tool::{CutterShape, Fixture, Section};
use proptest::prelude::*;
use std::f64::consts::PI;

fn tool(shape: CutterShape) -> Tool {
    Tool::new(1, &shape, &Fixture { gauge_length: 80.0, ..Fixture::default() }).unwrap()
}

fn cylinder(diameter: f64, corner_radius: f64) -> Tool {
    tool(CutterShape::Cylinder { diameter, corner_radius, flute_length: 40.0 })
}

fn pose(tip: [f64; 3], axis: [f64; 3]) -> Pose {
    Pose { tip: Point::from(tip), axis: Direction::new_normalize(Vector::from(axis)) }
}

fn block(min: [f64; 3], max: [f64; 3]) -> Blank {
    Blank::Box { min: Point::from(min), max: Point::from(max) }
}

fn solids() -> Vec<Solid> {
    let shapes = [
        CutterShape::Cylinder { diameter: 10.0, corner_radius: 2.0, flute_length: 20.0 },
        CutterShape::Cylinder { diameter: 8.0, corner_radius: 4.0, flute_length: 20.0 },
        CutterShape::Cone { tip_diameter: 4.0, half_angle: Degrees(12.0), corner_radius: 0.5, flute_length: 15.0 },
        CutterShape::Barrel {
            diameter: 10.0,
            barrel_radius: 85.0,
            half_angle: Degrees(5.0),
            corner_radius: 1.0,
            flute_length: 20.0,
        },
    ];
    shapes.into_iter().flat_map(|shape| Solid::of_tool(&tool(shape))).filter(|s| s.section == Section::Flute).collect()
}

/// What poses of a stretch cover of a line, from points of the line: never more than there is.
fn by_points(solid: &Solid, turning: &Turning<'_>, foot: &Vector, along: usize) -> Option<(f64, f64)> {
    let mut covered: Option<(f64, f64)> = None;
    for i in 0..=60 {
        let (tip, axis) = turning.pose(f64::from(i) / 60.0);
        for k in -300..=300 {
            let s = f64::from(k) * 0.1;
            let mut x = foot - tip;
            x[along] += s;
            let height = axis.dot(&x);
            if solid.holds(height, (x - axis * height).norm(), 0.0) {
                let (low, high) = covered.get_or_insert((s, s));
                (*low, *high) = (low.min(s), high.max(s));
            }
        }
    }
    covered
}

fn straight(solid: &Solid, from: &Pose, shift: Vector, foot: &Vector, along: usize) -> Option<Option<Extent>> {
    let shifted = Shifted::new(solid, from.axis.into_inner(), shift, along)?;
    let mut o = foot - from.tip.coords;
    o[along] = 0.0;
    let zero = from.tip[along];
    let moved = |mut extent: Extent| {
        extent.iter_mut().for_each(|end| end.s += zero);
        extent
    };
    Some(shifted.extent(&o).map(moved))
}

fn unit() -> impl Strategy<Value = Vector> {
    prop::array::uniform3(-1.0..1.0f64).prop_map(Vector::from)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Both ways agree where a solid is shifted only, and neither misses what points of the line show.
    #[test]
    fn extents_hold_all_that_poses_cover(
        index in 0..9usize, tip in unit(), axis in unit(), shift in unit(), turn in unit(), foot in unit(),
        along in 0..3usize, turns in prop::bool::ANY, long in 0.1..30.0f64, lean in 0.0..4.0f64,
    ) {
        // Lines nearly along the axis, too.
        let axis = axis + Vector::ith(along, lean.floor() * 2.0);
        let solids = solids();
        let solid = &solids[index % solids.len()];
        prop_assume!(axis.norm() > 0.3);
        let shift = shift * long;
        let from = pose((tip * 4.0).into(), axis.into());
        let turned = if turns { from.axis.into_inner() + turn * 0.01 } else { from.axis.into_inner() };
        let to = Pose { tip: from.tip + shift, axis: Direction::new_normalize(turned) };
        let turning = Turning::new(solid, from, to, along);
        let mut foot = (foot * 8.0) + shift * 0.5 + from.tip.coords + from.axis.into_inner() * 0.5 * (solid.low + solid.high);
        foot[along] = 0.0;
        let found = turning.extent(&foot);
        if let Some((low, high)) = by_points(solid, &turning, &foot, along) {
            prop_assert!(found.is_some(), "missed {low} {high}");
            let [a, b] = found.unwrap();
            prop_assert!(a.s <= low + 2e-6 && b.s >= high - 2e-6, "{a:?} {b:?} {low} {high}");
        }
        if let (false, Some(exact)) = (turns, straight(solid, &from, shift, &foot, along)) {
            match (exact, found) {
                (Some([a, b]), Some([c, d])) => {
                    prop_assert!((a.s - c.s).abs() < 5e-6 && (b.s - d.s).abs() < 5e-6, "{a:?} {c:?} {b:?} {d:?}");
                }
                (None, None) => {}
                // A touch along a hair's breadth may be seen by one alone.
                (one, other) => {
                    let [a, b] = one.or(other).unwrap();
                    prop_assert!(b.s - a.s < 0.05, "{one:?} {other:?}");
                }
            }
        }
    }

    /// The ends lie on the solid's surface at their own moment.
    #[test]
    fn ends_lie_on_the_surface(index in 0..9usize, axis in unit(), shift in unit(), foot in unit(), along in 0..3usize) {
        let solids = solids();
        let solid = &solids[index % solids.len()];
        prop_assume!(axis.norm() > 0.3);
        let from = pose([0.0; 3], axis.into());
        let to = Pose { tip: from.tip + shift, axis: Direction::new_normalize(from.axis.into_inner() + shift * 0.01) };
        let turning = Turning::new(solid, from, to, along);
        let mut foot = foot * 5.0;
        foot[along] = 0.0;
        for end in turning.extent(&foot).into_iter().flatten() {
            let (tip, axis) = turning.pose(end.t);
            let mut x = foot - tip;
            x[along] += end.s;
            let height = axis.dot(&x);
            let rho = (x - axis * height).norm();
            prop_assert!(solid.holds(height, rho, 1e-6), "{end:?}");
            let side = match solid.side {
                Side::Quadric { alpha, beta, gamma } => {
                    let profile = (alpha * height * height + 2.0 * beta * height + gamma - height * height).max(0.0);
                    (rho - profile.sqrt()).abs()
                }
                Side::Torus { height: c, radius, arc } => ((rho - radius).max(0.0).hypot(height - c) - arc).abs(),
            };
            let off = side.min((height - solid.low).abs()).min((height - solid.high).abs());
            prop_assert!(off < 2e-5, "{end:?} {off}");
        }
    }
}

fn milled(blank: &Blank, cell: f64, tool: &Tool, poses: &[Pose]) -> (Stock, Cut) {
    let mut stock = Stock::new(blank, cell).unwrap();
    let cut = stock.cut(&Moves::through(poses, 10.0), tool);
    (stock, cut)
}

#[test]
fn a_slot_has_its_volume() {
    let blank = block([0.0, 0.0, 0.0], [40.0, 20.0, 10.0]);
    let up = [0.0, 0.0, 1.0];
    let (stock, cut) =
        milled(&blank, 0.1, &cylinder(8.0, 0.0), &[pose([10.0, 10.0, 7.0], up), pose([30.0, 10.0, 7.0], up)]);
    let exact = 3.0 * (20.0 * 8.0 + PI * 16.0);
    assert!((cut.removals[0].volume - exact).abs() < 2e-3 * exact, "{} {exact}", cut.removals[0].volume);
    assert!((stock.volume() - (8000.0 - cut.removals[0].volume)).abs() < 1e-6);
    assert!((cut.removals[0].depth - 3.0).abs() < 1e-9, "{}", cut.removals[0].depth);
    // Half of the flutes are in material, 3 mm of their 40.
    let widest = cut.engagements.iter().map(|e| e.angle.to_degrees()).fold(0.0, f64::max);
    assert!((widest - 180.0).abs() < 4.0, "{widest}");
}

#[test]
fn a_plane_is_left_as_one() {
    let blank = block([0.0, 0.0, 0.0], [20.0, 20.0, 10.0]);
    let up = [0.0, 0.0, 1.0];
    let poses: Vec<Pose> = (0..=10)
        .flat_map(|i| [[-8.0, 2.0 * f64::from(i), 8.0], [28.0, 2.0 * f64::from(i), 8.0]])
        .map(|p| pose(p, up))
        .collect();
    let (stock, _) = milled(&blank, 0.25, &cylinder(6.0, 0.0), &poses);
    let top: Vec<f64> = stock.ends().filter(|(_, n)| n.z > 0.9).map(|(p, _)| p.z).collect();
    assert!(top.len() > 6000 && top.iter().all(|z| (z - 8.0).abs() < 1e-9));
}

#[test]
fn a_ball_leaves_scallops_of_their_height() {
    let blank = block([0.0, 0.0, 0.0], [10.0, 12.0, 10.0]);
    let up = [0.0, 0.0, 1.0];
    let row = |i: i32| if i % 2 == 0 { [-8.0, 18.0] } else { [18.0, -8.0] }.map(|x| pose([x, f64::from(i), 8.0], up));
    let poses: Vec<Pose> = (0..=12).flat_map(row).collect();
    let (stock, _) = milled(&blank, 0.1, &cylinder(8.0, 4.0), &poses);
    // Rows 1 mm apart: 4 - sqrt(16 - 1/4).
    let scallop = 4.0 - (16.0_f64 - 0.25).sqrt();
    for (p, n) in stock.ends().filter(|(p, n)| n.z > 0.9 && p.y > 1.0 && p.y < 11.0) {
        let off = (p.y - p.y.round()).abs();
        assert!((p.z - (8.0 + 4.0 - (16.0 - off * off).sqrt())).abs() < 1e-9, "{p} {n}");
        assert!(p.z < 8.0 + scallop);
    }
}

/// A tool that stands still while the part turns under it: the table's turn cuts a groove of revolution.
#[test]
fn a_turning_table_cuts_a_groove_of_revolution() {
    let blank = Blank::Cylinder { base: Point::origin(), axis: Vector::x_axis(), radius: 20.0, height: 10.0 };
    let tool = cylinder(4.0, 2.0);
    let steps = 720;
    let around = |i: i32| {
        let turn = nalgebra::Rotation3::from_axis_angle(&Vector::x_axis(), 2.0 * PI * f64::from(i) / f64::from(steps));
        Pose { tip: turn * Point::new(5.0, 0.0, 19.0), axis: turn * Vector::z_axis() }
    };
    let poses: Vec<Pose> = (0..=steps).map(around).collect();
    let (stock, _) = milled(&blank, 0.2, &tool, &poses);
    let mut seen = 0;
    for (p, _) in stock.ends() {
        let (x, r) = (p.x - 5.0, p.y.hypot(p.z));
        if x.abs() < 1.5 && r < 20.2 {
            let bottom = 21.0 - (4.0 - x * x).sqrt();
            // Chords of half a degree lie within the circle by 21 (1 - cos 0.25 degrees) = 0.0002.
            assert!(r > bottom - 3e-4 && r < bottom + 1e-6, "{p} {r} {bottom}");
            seen += 1;
        }
    }
    assert!(seen > 5000, "{seen}");
}

#[test]
fn a_tilted_gouge_is_read_as_deep_as_it_is() {
    let blank = block([0.0, 0.0, 0.0], [60.0, 20.0, 40.0]);
    let tilt = 20.0_f64.to_radians();
    let axis = [tilt.sin(), 0.0, tilt.cos()];
    let mut poses: Vec<Pose> = Vec::new();
    for i in 0..=5 {
        let y = 4.0 * f64::from(i);
        poses.extend([
            pose([0.0, y, 39.0], axis),
            pose([30.0, y, if i == 3 { 38.95 } else { 39.0 }], axis),
            pose([60.0, y, 39.0], axis),
        ]);
    }
    let (stock, _) = milled(&blank, 0.1, &cylinder(20.0, 0.0), &poses);
    // The lowest point of the tilted disc is 10 sin(tilt) below its centre.
    let floor = 39.0 - 10.0 * tilt.sin();
    let deepest = stock.ends().filter(|(_, n)| n.z > 0.5).map(|(p, _)| floor - p.z).fold(0.0, f64::max);
    // Half a cell away the way is 0.05 / 30 * 0.05 higher, and the rim sin(tilt) * 0.05^2 / 20.
    let beside = 0.05 / 30.0 * 0.05 + tilt.sin() * 0.05 * 0.05 / 20.0;
    assert!(deepest < 0.05 + 1e-9 && deepest > 0.05 - beside - 1e-6, "{deepest}");
}

#[test]
fn a_shank_in_material_is_told_from_the_flutes() {
    let blank = block([0.0, 0.0, 0.0], [20.0, 20.0, 20.0]);
    let shape = CutterShape::Cylinder { diameter: 6.0, corner_radius: 0.0, flute_length: 5.0 };
    let fixture = Fixture { shank_diameter: Some(8.0), gauge_length: 60.0, holder: vec![] };
    let tool = Tool::new(1, &shape, &fixture).unwrap();
    let up = [0.0, 0.0, 1.0];
    let (_, cut) = milled(&blank, 0.2, &tool, &[pose([-10.0, 10.0, 14.4], up), pose([30.0, 10.0, 14.4], up)]);
    let removal = &cut.removals[0];
    assert!((removal.body_depth - 0.6).abs() < 1e-9 && !removal.holder, "{removal:?}");
    assert!((removal.body_volume - 0.6 * 8.0 * 20.0).abs() < 1.0, "{removal:?}");
    assert!((removal.volume - 5.0 * 6.0 * 20.0).abs() < 6.0, "{removal:?}");
}

fn octahedron(radius: f64) -> TriangleMesh {
    let p = |x: f64, y: f64, z: f64| Point::new(x * radius, y * radius, z * radius);
    let vertices = vec![
        p(1.0, 0.0, 0.0),
        p(-1.0, 0.0, 0.0),
        p(0.0, 1.0, 0.0),
        p(0.0, -1.0, 0.0),
        p(0.0, 0.0, 1.0),
        p(0.0, 0.0, -1.0),
    ];
    let triangles = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    TriangleMesh::new(vertices, triangles).unwrap()
}

/// Its edges and corners pass exactly through lines of the lattice.
#[test]
fn a_mesh_with_edges_on_the_lines_fills_every_line() {
    let stock = Stock::new(&Blank::Mesh(Box::new(octahedron(4.0))), 0.5).unwrap();
    let exact = 4.0 / 3.0 * 64.0;
    assert!((stock.volume() - exact).abs() < 0.02 * exact, "{} {exact}", stock.volume());
    for (p, _) in stock.ends() {
        assert!((p.x.abs() + p.y.abs() + p.z.abs() - 4.0).abs() < 1e-9, "{p}");
    }
    // A line through the middle of the sides, on edges from end to end.
    let odd = Stock::new(&Blank::Mesh(Box::new(octahedron(4.25))), 0.5).unwrap();
    assert!((odd.volume() - 4.0 / 3.0 * 4.25_f64.powi(3)).abs() < 0.02 * 102.0, "{}", odd.volume());
}

/// Sharp corners, a cavity's round corners, and what is left as a closed mesh that can be stock again.
#[test]
fn what_is_left_is_a_closed_mesh() {
    let blank = block([0.0, 0.0, 0.0], [24.0, 12.0, 8.0]);
    let axis = [0.2, 0.1, 1.0];
    let (middle, end) = (pose([12.0, 5.0, 3.1], axis), pose([30.0, 8.0, 6.0], [-0.1, 0.2, 1.0]));
    let turning = (0..=60).map(|k| middle.interpolate(&end, f64::from(k) / 60.0));
    let poses: Vec<Pose> = std::iter::once(pose([-6.0, 3.0, 5.0], axis)).chain(turning).collect();
    let (stock, _) = milled(&blank, 0.4, &cylinder(5.0, 1.0), &poses);
    let read = crate::part::read(&stock.stl(), "left.stl", &crate::part::ReadOptions::default()).unwrap();
    crate::part::require_closed(&read).unwrap();
    let crate::part::DesignSurface::Mesh(mesh) = read else { panic!("an STL file is a mesh") };
    let volume = stock.volume();
    assert!((mesh.signed_volume() - volume).abs() < 2e-3 * volume, "{} {volume}", mesh.signed_volume());
    // The box keeps its corners.
    let bounds = mesh.bounds();
    assert!((bounds.high - Point::new(24.0, 12.0, 8.0)).norm() < 2e-3 && bounds.low.coords.norm() < 2e-3, "{bounds:?}");
    let again = Stock::new(&Blank::Mesh(mesh.into()), 0.4).unwrap();
    assert!((again.volume() - volume).abs() < 2e-3 * volume, "{} {volume}", again.volume());
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let blank = block([0.0, 0.0, 0.0], [20.0, 20.0, 10.0]);
    let poses: Vec<Pose> = (0..40)
        .map(|i| {
            let t = f64::from(i) / 40.0;
            pose([20.0 * t, 10.0 + 6.0 * (9.0 * t).sin(), 6.0], [0.2 * (5.0 * t).sin(), 0.1, 1.0])
        })
        .collect();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| milled(&blank, 0.25, &cylinder(6.0, 1.0), &poses).1)
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert!(one.removals.iter().all(|r| r.volume >= 0.0) && one.removals[0].volume > 0.0);
}

#[test]
fn blanks_without_volume_or_too_fine_are_refused() {
    let flat = block([0.0, 0.0, 0.0], [1.0, 1.0, 0.0]);
    assert!(matches!(Stock::new(&flat, 0.1), Err(StockError::Empty(_))));
    let big = block([0.0; 3], [1000.0; 3]);
    assert!(matches!(Stock::new(&big, 0.01), Err(StockError::TooFine { .. })));
}

/// The three directions of lines see one body.
#[test]
fn all_directions_of_lines_agree() {
    let blank = block([0.0, 0.0, 0.0], [24.0, 12.0, 8.0]);
    let axis = [0.2, 0.1, 1.0];
    for corner in [0.0, 1.0, 2.5] {
        let (stock, _) =
            milled(&blank, 0.2, &cylinder(5.0, corner), &[pose([-6.0, 3.0, 5.0], axis), pose([12.0, 5.0, 3.1], axis)]);
        let volumes = stock.grids.each_ref().map(|grid| grid.length() * 0.04);
        let (least, most) = volumes.iter().fold((f64::INFINITY, 0.0_f64), |(l, m), v| (v.min(l), v.max(m)));
        assert!(most - least < 1.5, "{corner} {volumes:?}");
    }
}
