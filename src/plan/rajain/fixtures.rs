//! Surfaces for the tests of this method, by formula.

use crate::geometry::{Point, SplineSurface, Vector, interpolate_grid};
use crate::part::{DesignSurface, OrientedSpline, Part};
use crate::plan::{Method, Plan, PlanRequest, Strategy, StrategyKind, Unobserved};
use crate::tool::{CutterShape, Fixture, Tool};

/// A surface through points of `height` over a rectangle of `length` by `width` mm about the origin; its normal points
/// up.
pub(super) fn graph(length: f64, width: f64, height: impl Fn(f64, f64) -> f64) -> OrientedSpline {
    let count = 25;
    let at = |i: usize, size: f64| (i as f64 / (count - 1) as f64 - 0.5) * size;
    let rows: Vec<Vec<Point>> = (0..count)
        .map(|i| {
            let x = at(i, length);
            (0..count).map(|j| (x, at(j, width))).map(|(x, y)| Point::new(x, y, height(x, y))).collect()
        })
        .collect();
    let surface: SplineSurface = interpolate_grid(&rows).unwrap();
    OrientedSpline::new(surface, false).unwrap()
}

/// A gear-flank-like saddle, 24 by 8 mm: bent up along x, down along y.
pub(super) fn saddle() -> OrientedSpline {
    graph(24.0, 8.0, |x, y| x * x / 160.0 - y * y / 60.0 + 0.02 * x * y)
}

/// A shallow dome: bent down both ways, where no straight tool joins smoothly.
pub(super) fn dome() -> OrientedSpline {
    graph(24.0, 8.0, |x, y| -x * x / 240.0 - y * y / 120.0)
}

pub(super) fn part(spline: OrientedSpline) -> Part {
    Part { name: "fixture".into(), surface: DesignSurface::Spline(spline), body: None, check: Vec::new() }
}

/// The cone of the paper's gear examples: spheres of 0.3 and 1 mm, 1.717 mm apart (Rajain 2023, Table 1).
pub(super) fn cone() -> Tool {
    let shape = CutterShape::EndSpheres { r1: 0.3, r2: 1.0, length: 1.717 };
    tool(&shape)
}

pub(super) fn tool(shape: &CutterShape) -> Tool {
    Tool::new(1, shape, &Fixture { gauge_length: 30.0, ..Fixture::default() }).unwrap()
}

/// The strategy of this method with the cut along x.
pub(super) fn strategy() -> Strategy {
    Strategy {
        method: Method::Rajain2023,
        direction: Some(Vector::x()),
        spindle: Some(Vector::y()),
        ..Strategy::new(StrategyKind::MultiStrip)
    }
}

pub(super) fn request<'a>(part: &'a Part, tool: &'a Tool, strategy: &'a Strategy) -> PlanRequest<'a> {
    PlanRequest {
        name: "fixture",
        part,
        tool,
        strategy,
        overcut_tolerance: 0.005,
        undercut_tolerance: 0.005,
        cut_feed: 600.0,
        feed_reference: crate::motion::FeedReference::Mid,
        spindle_rpm: 8000.0,
        linearization: 0.0005,
        observer: &Unobserved,
    }
}

pub(super) fn planned(part: &Part, tool: &Tool, strategy: &Strategy) -> Plan {
    crate::plan::plan(&request(part, tool, strategy)).unwrap()
}
