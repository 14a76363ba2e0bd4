//! The whole region: extremes between samples, shares, seams, contacts, threads.

use super::fixtures::*;
use crate::geometry::{Point, RigidMotion, SplineSurface, TriangleMesh, Vector};
use crate::motion::Pose;
use crate::part::{DesignSurface, OrientedSpline, Part};
use crate::tool::{CutterShape, Fixture, Section, Tool};
use crate::verify::body::Body;
use crate::verify::contacts::{Contact, Contacts, Obstacle, ToolBody};
use crate::verify::crossings::{Allowed, crossings};
use crate::verify::deviation::{Fineness, PartDeviation, measure};
use crate::verify::strips::{Seams, seams};
use crate::verify::sweep::Timeline;
use std::collections::BTreeSet;

/// The plane z = 0 over a rectangle, normal up.
pub(super) fn plane(x: [f64; 2], y: [f64; 2]) -> DesignSurface {
    let control = x.map(|x| y.map(|y| Point::new(x, y, 0.0)).to_vec()).to_vec();
    let knots = || vec![0.0, 0.0, 1.0, 1.0];
    let surface = SplineSurface::new([1, 1], [knots(), knots()], control, None).unwrap();
    DesignSurface::Spline(OrientedSpline::new(surface, false).unwrap())
}

fn fineness(spacing: f64) -> Fineness {
    Fineness { spacing, change: 1e-4, border: 0.01 }
}

fn deviation(tool: &Tool, motion: &Blocks, surface: &DesignSurface, spacing: f64) -> PartDeviation {
    let timeline = Timeline::new(motion, tool.flute_length());
    let body = Body::of(tool.flutes().iter());
    measure(surface, &timeline.sweep(&body, WINDOW, 1e-6), WINDOW, &fineness(spacing))
}

fn extremes(part: &PartDeviation) -> (f64, f64) {
    let depth = |m: &Option<crate::verify::MeasuredSample>| m.map_or(0.0, |m| m.deviation().unwrap_or(f64::NAN));
    (-depth(&part.worst_overcut), depth(&part.worst_undercut))
}

/// Parallel passes along X at the given Y, tip at z = 0, axis up.
fn raster(ys: &[f64]) -> Blocks {
    let tips = ys.iter().enumerate().flat_map(|(k, y)| {
        let side = if k % 2 == 0 { -30.0 } else { 30.0 };
        [pose([side, *y, 0.0], [0.0, 0.0, 1.0]), pose([-side, *y, 0.0], [0.0, 0.0, 1.0])]
    });
    Blocks::through(&tips.collect::<Vec<_>>())
}

#[test]
fn scallop_tops_are_found_between_samples() {
    let pitch = 1.3;
    let ys: Vec<f64> = (-8..=8).map(|k| f64::from(k) * pitch).collect();
    let part = deviation(&ball(8.0), &raster(&ys), &plane([-20.0, 20.0], [-9.0, 9.0]), 1.0);
    let scallop = 4.0 - f64::sqrt(16.0 - pitch * pitch / 4.0);
    let (over, under) = extremes(&part);
    assert!(over < 1e-9, "{over}");
    assert!((under - scallop).abs() < 2e-5, "{under} {scallop}");
    assert!(part.measured > part.samples.len());
}

#[test]
fn plunge_between_samples_is_found_to_its_full_depth() {
    let ys: Vec<f64> = (-40..=40).map(|k| f64::from(k) * 0.25).collect();
    let mut motion = raster(&ys);
    // A plunge of 0.05, 1.2 mm wide, at no sample of the 1 mm grid.
    let at = |z: f64| pose([3.37, 2.41, z], [0.0, 0.0, 1.0]);
    let plunge = Blocks::through(&[at(5.0), at(-0.05), at(5.0)]);
    motion.blocks.extend(plunge.blocks);
    motion.rapid.extend(plunge.rapid);
    let part = deviation(&ball(8.0), &motion, &plane([-10.0, 10.0], [-8.0, 8.0]), 1.0);
    let (over, _) = extremes(&part);
    assert!((over - 0.05).abs() < 2e-5, "{over}");
    let worst = part.worst_overcut.unwrap();
    assert!((worst.sample.point - Point::new(3.37, 2.41, 0.0)).norm() < 0.03, "{worst:?}");
    assert!(worst.touch.unwrap().when.block >= motion.blocks.len() - 2);
}

#[test]
fn what_no_pass_reaches_is_uncut() {
    let motion = raster(&[-6.0, -2.0, 2.0, 6.0]);
    let part = deviation(&cylinder(10.0), &motion, &plane([-10.0, 10.0], [-8.0, 24.0]), 0.5);
    // Cut up to y = 11, so 13 of 32 mm are not.
    assert!((part.area_share(|s| s.touch.is_none()) - 13.0 / 32.0).abs() < 0.02);
    assert!(part.worst_undercut.unwrap().touch.is_none());
    assert!(part.worst_overcut.is_none());
}

#[test]
fn edge_samples_are_drawn_inside() {
    // Flutes that end exactly at the region's edges.
    let tool = tool(&CutterShape::Cylinder { diameter: 10.0, corner_radius: 0.0, flute_length: 16.0 });
    let along = |x: f64| pose([x, -8.0, 5.0], [0.0, 1.0, 0.0]);
    let motion = Blocks::through(&[along(-10.0), along(10.0)]);
    let part = deviation(&tool, &motion, &plane([-10.0, 10.0], [-8.0, 8.0]), 0.5);
    assert_eq!(part.area_share(|s| s.touch.is_some()), 1.0);
    assert!(extremes(&part).1 < 1e-9, "{:?}", part.worst_undercut);
}

/// Two strips by the flank of a cylinder, meeting over y = 0 in a ridge of `kink` degrees.
fn two_strips(kink: f64) -> Blocks {
    let half = (kink / 2.0).to_radians();
    let mut blocks = Vec::new();
    let mut rapid = Vec::new();
    for side in [-1.0, 1.0f64] {
        let axis = Vector::new(0.0, half.cos(), -side * half.sin());
        let up = Vector::new(0.0, side * half.sin(), half.cos());
        // The flank's lowest line passes through the X axis.
        let start = up * 5.0 + axis * (if side < 0.0 { -10.0 } else { -1.0 });
        let at = |x: f64| pose([x, start.y, start.z], axis.into());
        let above = |x: f64| Pose { tip: at(x).tip + Vector::z() * 20.0, ..at(x) };
        for (from, to, fast) in
            [(above(-20.0), at(-20.0), true), (at(-20.0), at(20.0), false), (at(20.0), above(20.0), true)]
        {
            blocks.push(Block::Straight(from, to));
            rapid.push(fast);
        }
    }
    Blocks { blocks, rapid }
}

fn measured_seams(tool: &Tool, motion: &Blocks, surface: &DesignSurface) -> Seams {
    let timeline = Timeline::new(motion, tool.flute_length());
    let body = Body::of(tool.flutes().iter());
    let sweep = timeline.sweep(&body, WINDOW, 1e-6);
    let part = measure(surface, &sweep, WINDOW, &fineness(0.7));
    seams(surface, &sweep, &part, &runs(motion))
}

#[test]
fn kink_between_strips_is_the_angle_of_their_planes() {
    let tool = tool(&CutterShape::Cylinder { diameter: 10.0, corner_radius: 0.0, flute_length: 11.0 });
    let found = measured_seams(&tool, &two_strips(3.0), &plane([-10.0, 10.0], [-8.0, 8.0]));
    assert_eq!(found.strips, 2);
    assert!((found.kink_max_deg - 3.0).abs() < 1e-6, "{found:?}");
    assert!((found.kink_mean_deg - 3.0).abs() < 1e-6, "{found:?}");
    assert!(found.gap_max < 1e-4, "{found:?}");
}

#[test]
fn rigid_motions_change_nothing() {
    let placed = RigidMotion::new(Vector::new(120.0, -80.0, 33.0), Vector::new(0.4, -0.9, 1.3));
    let ys: Vec<f64> = (-8..=8).map(|k| f64::from(k) * 1.1).collect();
    let motion = raster(&ys);
    let moved = Blocks {
        blocks: motion
            .blocks
            .iter()
            .map(|b| match b {
                Block::Straight(a, b) => Block::Straight(a.transformed(&placed), b.transformed(&placed)),
                Block::Turn(..) | Block::Hypar(_) => *b,
            })
            .collect(),
        rapid: motion.rapid.clone(),
    };
    let surface = plane([-9.0, 9.0], [-7.0, 7.0]);
    let here = deviation(&bull(8.0, 3.0), &motion, &surface, 1.03);
    let there = deviation(&bull(8.0, 3.0), &moved, &surface.transformed(&placed), 1.03);
    assert_eq!(here.samples.len(), there.samples.len());
    for (a, b) in here.samples.iter().zip(&there.samples) {
        assert!((a.deviation().unwrap() - b.deviation().unwrap()).abs() < 1e-9, "{a:?} {b:?}");
    }
}

#[test]
fn threads_change_nothing() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let ys: Vec<f64> = (-8..=8).map(|k| f64::from(k) * 1.1).collect();
        let surface = plane([-9.0, 9.0], [-7.0, 7.0]);
        let part = pool.install(|| deviation(&cone(6.0, 10.0), &raster(&ys), &surface, 0.6));
        let touches: Vec<_> = part.samples.iter().map(|s| s.touch).collect();
        (touches, part.measured, extremes(&part))
    };
    assert_eq!(run(1), run(2));
}

fn contacts(tool: &Tool, motion: &Blocks, surface: &DesignSurface, check: Option<&DesignSurface>) -> Vec<Contact> {
    let timeline = Timeline::new(motion, tool.flute_length());
    let runs = runs(motion);
    let flutes = Body::of(tool.flutes().iter());
    let sweep = timeline.sweep(&flutes, WINDOW, 1e-6);
    let part = measure(surface, &sweep, WINDOW, &fineness(0.7));
    let mut found = Contacts::default();
    found.rapids_in_part(&sweep, &part, &runs, (0.02, WINDOW.outward, 1e-3));
    for (body, section) in [(ToolBody::Shank, Section::Shank), (ToolBody::Holder, Section::Holder)] {
        let solid = Body::of(tool.body().filter(|(s, _)| *s == section).map(|(_, e)| e));
        found.body_on_part(body, &timeline.sweep(&solid, WINDOW, 1e-6), &part, &runs, WINDOW.outward, 1e-3);
    }
    let part = Part {
        name: "region".into(),
        surface: surface.clone(),
        body: None,
        check: check.into_iter().cloned().collect(),
    };
    for contact in crossings(motion, tool, &part, ALLOWED).0 {
        found.add(&runs, contact);
    }
    found.into_sorted().into_iter().map(|(contact, _)| contact).collect()
}

const ALLOWED: Allowed = Allowed { contact: 1e-3, overcut: 5e-3, spacing: 0.7 };

#[test]
fn rapid_through_the_part_is_found_and_rapid_along_the_cut_is_not() {
    let up = [0.0, 0.0, 1.0];
    let at = |x: f64, z: f64| pose([x, 0.0, z], up);
    let cut = Block::Straight(at(-20.0, 0.0), at(20.0, 0.0));
    let back = |z: f64| Block::Straight(at(20.0, z), at(-20.0, z));
    let surface = plane([-10.0, 10.0], [-3.0, 3.0]);
    let run =
        |blocks: Vec<Block>, rapid: Vec<bool>| contacts(&cylinder(10.0), &Blocks { blocks, rapid }, &surface, None);
    assert_eq!(run(vec![cut, back(0.0)], vec![false, true]), vec![]);
    assert_eq!(run(vec![back(0.5), cut], vec![true, false]), vec![]);
    let before = run(vec![back(0.0), cut], vec![true, false]);
    assert_eq!(before.len(), 1);
    assert_eq!((before[0].body, before[0].when.block), (ToolBody::FlutesInRapid, 0));
    let deeper = run(vec![cut, back(-0.2)], vec![false, true]);
    assert!((deeper[0].depth - 0.2).abs() < 1e-9 && deeper[0].when.block == 1, "{deeper:?}");
    // An innocent deeper rapid does not hide an earlier one through the stock.
    let hidden = run(vec![back(0.01), cut, back(0.0)], vec![true, false, true]);
    assert_eq!(hidden.iter().map(|c| c.when.block).collect::<Vec<_>>(), vec![0]);
}

#[test]
fn thick_shank_and_holder_hit_the_wall() {
    let shape = CutterShape::Cylinder { diameter: 10.0, corner_radius: 0.0, flute_length: 20.0 };
    let holder = vec![crate::tool::meridian::at(40.0, 6.0), crate::tool::meridian::at(60.0, 20.0)];
    let fixture = |shank: f64| Fixture { shank_diameter: Some(shank), gauge_length: 80.0, holder: holder.clone() };
    let along = |x: f64| pose([x, 0.0, 5.0], [0.0, 1.0, 0.0]);
    let motion = Blocks::through(&[along(-20.0), along(20.0)]);
    let run = |shank: f64, y: [f64; 2]| {
        contacts(&Tool::new(1, &shape, &fixture(shank)).unwrap(), &motion, &plane([-10.0, 10.0], y), None)
    };
    assert_eq!(run(9.9, [1.0, 19.0]), vec![]);
    let shank = run(10.4, [1.0, 30.0]);
    assert_eq!(shank.len(), 1);
    assert_eq!(shank[0].body, ToolBody::Shank);
    // Above the flutes nothing is cut: all of the window plus 0.2 below the surface.
    assert!((shank[0].depth - 1.2).abs() < 1e-9, "{shank:?}");
    let bodies: BTreeSet<ToolBody> = run(10.0, [1.0, 45.0]).iter().map(|c| c.body).collect();
    assert_eq!(bodies, BTreeSet::from([ToolBody::Shank, ToolBody::Holder]));
}

#[test]
fn check_surface_is_kept_clear() {
    let wall = TriangleMesh::new(
        vec![
            Point::new(12.0, -20.0, -5.0),
            Point::new(12.0, 20.0, -5.0),
            Point::new(12.0, 20.0, 15.0),
            Point::new(12.0, -20.0, 15.0),
        ],
        vec![[0, 2, 1], [0, 3, 2]],
    )
    .unwrap();
    let wall = DesignSurface::Mesh(wall);
    let normal = wall.foot(&Point::new(0.0, 0.0, 1.0)).normal.0;
    assert!(normal.x < -0.9, "the wall faces the tool: {normal:?}");
    let at = |x: f64| -> Pose { pose([x, 0.0, 0.0], [0.0, 0.0, 1.0]) };
    let run = |end: f64| {
        let motion = Blocks::through(&[at(-5.0), at(end)]);
        contacts(&cylinder(10.0), &motion, &plane([-3.0, 3.0], [-3.0, 3.0]), Some(&wall))
    };
    assert_eq!(run(7.0), vec![]);
    let hit = run(7.25);
    assert_eq!((hit.len(), hit[0].obstacle), (1, Obstacle::Check(0)));
    // As deep as it is, to the hundredth part.
    assert!((0.25 * 0.99 - 2.5e-4..=0.25).contains(&hit[0].depth), "{hit:?}");
    assert_eq!(run(7.0009), vec![]);
    assert_eq!(run(7.0019).len(), 1);
}

/// A nail of 0.02 mm x 2 mm, no wider than a hair: no sample of it or of the motion need lie where they meet.
fn nail(x: f64, y: f64) -> DesignSurface {
    let corners = vec![Point::new(x, y, -1.0), Point::new(x + 0.02, y, -1.0), Point::new(x, y, 1.0)];
    DesignSurface::Mesh(TriangleMesh::new(corners, vec![[0, 1, 2]]).unwrap())
}

#[test]
fn a_nail_touched_in_passing_is_found() {
    // The tool turns about the part's Z axis and comes nearest to the nail half way, by 0.01 mm.
    let start = pose([30.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let motion = Blocks::feed(vec![Block::Turn(start, 1.0)]);
    let at = |radius: f64| nail(radius * 0.5_f64.cos(), radius * 0.5_f64.sin());
    let run = |radius: f64| contacts(&cylinder(10.0), &motion, &plane([-3.0, 3.0], [-3.0, 3.0]), Some(&at(radius)));
    assert_eq!(run(35.0), vec![]);
    let hit = run(34.98);
    assert_eq!((hit.len(), hit[0].body), (1, ToolBody::Flutes));
    assert!((hit[0].when.share - 0.5).abs() < 0.05 && (hit[0].depth - 0.02).abs() < 0.002, "{hit:?}");
}

#[test]
fn the_body_is_entered_nowhere_but_cut_within_tolerance() {
    // A block under the plane that is milled, with a step beside it.
    let quad = |a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]| [a, b, c, d].map(Point::from).to_vec();
    let floor = quad([-10.0, -10.0, 0.0], [10.0, -10.0, 0.0], [10.0, 10.0, 0.0], [-10.0, 10.0, 0.0]);
    let step = quad([-10.0, 10.0, 0.0], [10.0, 10.0, 0.0], [10.0, 10.0, 4.0], [-10.0, 10.0, 4.0]);
    let body = TriangleMesh::new([floor, step].concat(), vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]).unwrap();
    let part = Part {
        name: "stepped".into(),
        surface: plane([-10.0, 10.0], [-10.0, 10.0]),
        body: Some(DesignSurface::Mesh(body)),
        check: vec![],
    };
    let run = |y: f64, z: f64| {
        let at = |x: f64| pose([x, y, z], [0.0, 0.0, 1.0]);
        crossings(&Blocks::through(&[at(-20.0), at(20.0)]), &cylinder(10.0), &part, ALLOWED).0
    };
    assert_eq!(run(5.0, 0.0), vec![]);
    assert_eq!(run(5.0, -0.005), vec![]);
    let deep = run(5.0, -0.01);
    assert_eq!(deep.iter().map(|c| (c.body, c.obstacle)).collect::<Vec<_>>(), [(ToolBody::Flutes, Obstacle::Body)]);
    let side = run(5.02, 0.0);
    assert!((side[0].depth - 0.02).abs() < 1e-3, "{side:?}");
}
