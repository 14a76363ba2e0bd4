//! Guaranteed bounds: never below the truth, near it where sampling sees it, and above what sampling cannot see.

use super::fixtures::*;
use super::region::plane;
use crate::part::DesignSurface;
use crate::tool::Tool;
use crate::verify::ToleranceRecord;
use crate::verify::body::Body;
use crate::verify::bound::{Bounds, Region};
use crate::verify::deviation::{Fineness, measure};
use crate::verify::sweep::Timeline;

/// Bounds, and the sampled overcut and undercut; `change` is how much refinement between samples may overlook.
fn bounds(tool: &Tool, motion: &Blocks, surface: &DesignSurface, change: f64) -> (Bounds, f64, f64) {
    bounds_within(ToleranceRecord { overcut: 1.0, undercut: 1.0 }, tool, motion, surface, change)
}

fn bounds_within(
    tolerance: ToleranceRecord,
    tool: &Tool,
    motion: &Blocks,
    surface: &DesignSurface,
    change: f64,
) -> (Bounds, f64, f64) {
    let timeline = Timeline::new(motion, tool.flute_length());
    let body = Body::of(tool.flutes().iter());
    let sweep = timeline.sweep(&body, WINDOW, 1e-6);
    let part = measure(surface, &sweep, WINDOW, &Fineness { spacing: 1.0, change, border: 0.01 });
    let runs = runs(motion);
    let found = Region { surface, sweep: &sweep, part: &part, runs: &runs }.bounds(1e-3, tolerance);
    let depth = |m: Option<crate::verify::MeasuredSample>| m.and_then(|m| m.deviation()).unwrap_or(0.0);
    (found, -depth(part.worst_overcut), depth(part.worst_undercut))
}

/// Parallel passes along X, tip at z = 0, axis up.
fn raster(pitch: f64, count: i32) -> Blocks {
    let passes = (-count..=count).flat_map(|k| {
        let (y, side) = (f64::from(k) * pitch, if k % 2 == 0 { -8.0 } else { 8.0 });
        [pose([side, y, 0.0], [0.0, 0.0, 1.0]), pose([-side, y, 0.0], [0.0, 0.0, 1.0])]
    });
    Blocks::through(&passes.collect::<Vec<_>>())
}

#[test]
fn bounds_of_scallops_are_near_their_height() {
    let pitch = 1.3;
    let (found, _, undercut) = bounds(&ball(8.0), &raster(pitch, 4), &plane([-5.0, 5.0], [-4.0, 4.0]), 1e-4);
    let scallop = 4.0 - f64::sqrt(16.0 - pitch * pitch / 4.0);
    let bound = found.undercut.unwrap();
    assert!(bound >= scallop && bound <= undercut + 1e-3, "{bound} {scallop}");
    assert!(found.overcut.is_some_and(|b| b <= 1e-3), "{found:?}");
}

/// What is within its tolerance by less than the resolution is proved to be.
#[test]
fn bounds_stay_within_a_tolerance_that_is_kept() {
    let scallop = 4.0 - f64::sqrt(16.0 - 1.3 * 1.3 / 4.0);
    let tolerance = ToleranceRecord { overcut: 3e-4, undercut: scallop + 4e-4 };
    let plane = plane([-5.0, 5.0], [-4.0, 4.0]);
    let (found, ..) = bounds_within(tolerance, &ball(8.0), &raster(1.3, 4), &plane, 1e-4);
    assert!(found.undercut.is_some_and(|b| (scallop..=tolerance.undercut).contains(&b)), "{found:?} {scallop}");
    assert!(found.overcut.is_some_and(|b| b <= tolerance.overcut), "{found:?}");
}

#[test]
fn a_defect_that_sampling_misses_is_within_the_bound() {
    let mut motion = raster(0.25, 20);
    let at = |z: f64| pose([0.37, 0.41, z], [0.0, 0.0, 1.0]);
    let plunge = Blocks::through(&[at(5.0), at(-0.05), at(5.0)]);
    motion.blocks.extend(plunge.blocks);
    motion.rapid.extend(plunge.rapid);
    // Refinement that overlooks everything leaves the samples alone, none of which lies in the dent of 0.5 mm.
    let (found, overcut, _) = bounds(&ball(1.2), &motion, &plane([-5.0, 5.0], [-4.0, 4.0]), f64::INFINITY);
    assert!(overcut < 0.01, "{overcut}");
    let bound = found.overcut.unwrap();
    assert!((0.05..0.2).contains(&bound), "{bound}");
}

/// A groove 0.001 mm wide, narrower than any sampling: only the proof sees it.
#[test]
fn a_scratch_of_a_micrometre_is_within_the_bound() {
    // Beside the rows' own end a sharp cone runs 0.05 mm deep: its groove is 2 x 0.05 tan(0.573 degrees) = 0.001 mm wide.
    let along = |z: f64| [pose([-8.0, 0.4142, z], [0.0, 0.0, 1.0]), pose([8.0, 0.4142, z], [0.0, 0.0, 1.0])];
    let needle = crate::tool::CutterShape::Cone {
        tip_diameter: 0.0,
        half_angle: crate::geometry::Degrees(0.573),
        corner_radius: 0.0,
        flute_length: 30.0,
    };
    let fixture = crate::tool::Fixture { gauge_length: 80.0, ..crate::tool::Fixture::default() };
    let tool = Tool::new(1, &needle, &fixture).unwrap();
    let motion = Blocks::through(&along(-0.05));
    let (found, overcut, _) = bounds(&tool, &motion, &plane([-5.0, 5.0], [-4.0, 4.0]), f64::INFINITY);
    assert!(overcut < 1e-9, "{overcut}");
    let bound = found.overcut.unwrap();
    assert!((0.05..0.12).contains(&bound), "{bound}");
}

#[test]
fn what_no_pass_reaches_has_no_bound() {
    let (found, ..) = bounds(&ball(8.0), &raster(1.0, 2), &plane([-5.0, 5.0], [-4.0, 24.0]), 1e-4);
    assert_eq!(found.undercut, None);
}

/// Two strips meet where the rims of a flank mill's two ends pass, on a ridge a little above the part.
#[test]
fn rims_within_the_region_leave_the_bounds_near() {
    let shape = crate::tool::CutterShape::Cylinder { diameter: 10.0, corner_radius: 0.0, flute_length: 12.0 };
    let fixture = crate::tool::Fixture { gauge_length: 80.0, ..crate::tool::Fixture::default() };
    let tool = Tool::new(1, &shape, &fixture).unwrap();
    // The axis turns about the part's normal on the way: every place near a rim is passed by it.
    let way = |x: f64, y: f64, dive: f64| {
        let turn = 0.02 * x / 8.0;
        pose([x, y + 0.1 * turn, 5.0 + dive], [turn.sin(), turn.cos(), 0.0])
    };
    let strip = |y: f64, dive: f64| (0..=8).map(move |k| way(2.0 * f64::from(k) - 8.0, y, dive)).collect::<Vec<_>>();
    let back: Vec<_> = strip(-11.3, 0.002).into_iter().rev().collect();
    let motion = Blocks::through(&[strip(0.0, -0.001), back].concat());
    let (found, overcut, undercut) = bounds(&tool, &motion, &plane([-5.0, 5.0], [-6.0, 6.0]), 1e-4);
    let near = |bound: Option<f64>, sampled: f64| bound.is_some_and(|b| b >= sampled && b <= sampled + 1e-3);
    assert!(near(found.overcut, overcut) && near(found.undercut, undercut), "{found:?} {overcut} {undercut}");
}
