//! The tool as an unknown: a single sweep, or several, by a general surface of revolution whose meridian is found
//! together with the motion (Bo 2016). Uses what its parent uses.
//!
//! The tool is a family of spheres along its axis, their radius a spline; the motion is rigid by construction. Fits are
//! converged, and the terms that only guide them are taken back to nothing, so that an exact envelope is found as one.

mod fit;
mod judge;
mod line;
mod outliers;
mod patches;
mod problem;
mod radius;
mod search;
#[cfg(test)]
mod tests;

pub use problem::MeridianWeights;
pub use radius::{FREE_COEFFICIENTS, MeridianFamily, RadiusFunction, RadiusJet};

use super::chart::Chart;
use super::chart::Lines;
use super::explain::{self, Planned};
use super::layout::{orient, runs_along_u};
use super::link::chart_passes;
use super::{Deviation, Observer, Plan, PlanRequest, Strategy, StrategyKind};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::extend::extended;
use crate::motion::RuledMotion;
use crate::part::{OrientedSpline, Part};
use crate::tool::profile::{CurvePoint, smooth_profile};
use crate::tool::{CutterShape, Fixture, Tool};
use problem::Band;
use search::{Fitted, NotFound, Search, both_ways};

/// What a search starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seed {
    /// A straight line that can move along the part.
    Line,
    /// Rulings straight across the surface's parameters.
    Surface,
}

/// What the unknown tool may be.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolWish {
    /// Number in the control's tool table.
    pub number: u32,
    /// Which meridians are allowed.
    pub family: MeridianFamily,
    /// Coefficients of a free meridian; 10 and then more while they pay, when left out.
    pub coefficients: Option<usize>,
    /// Least and largest sphere radius, mm.
    pub radius: (f64, f64),
    /// Radii of the end spheres of a cone, mm, where they are given and only its length is not.
    pub ends: Option<(f64, f64)>,
    /// What to start from; both when left out.
    pub seed: Option<Seed>,
    /// Least and largest length between the outermost sphere centres, mm.
    pub length: (f64, f64),
    /// Weights of the terms at the start; what only guides the search is then taken back.
    pub weights: MeridianWeights,
    /// What is above the flutes.
    pub fixture: Fixture,
}

/// Everything a search starts from.
#[derive(Clone, Copy, Debug)]
pub struct ToolRequest<'a> {
    /// The part.
    pub part: &'a Part,
    /// What the tool may be.
    pub wish: &'a ToolWish,
    /// What is wanted of the sweeps.
    pub strategy: &'a Strategy,
    /// Error of either sign that is good enough, mm.
    pub tolerance: f64,
    /// Follows the search and may end it.
    pub observer: &'a dyn Observer,
}

/// What one sweep came to.
#[derive(Clone, Debug)]
pub struct FoundSweep {
    /// What it is to cover: shares of the surface across the cut and along it.
    pub band: [(f64, f64); 2],
    /// The tool's motion; its lower rail carries the centre of the lowest sphere.
    pub motion: RuledMotion,
    /// Largest errors of its envelope, mm.
    pub deviation: Deviation,
    /// Where the largest error is: share of the surface across the cut and along it.
    pub worst_at: (f64, f64),
    /// Root mean square error of its envelope, mm.
    pub rms: f64,
    /// Share of its band that the envelope covers.
    pub covered: f64,
    /// Share of its band that the envelope covers within the tolerance.
    pub within: f64,
    /// The largest rectangle of the surface's parameters within tolerance: across the cut, along it, each 0..1.
    pub patch: Option<[(f64, f64); 2]>,
}

/// A tool that was found, with its sweeps.
#[derive(Clone, Debug)]
pub struct FoundTool {
    /// The tool, its flank made of arcs within [`PROFILE_TOLERANCE`] of the found meridian.
    pub tool: Tool,
    /// The meridian as it was found.
    pub radius: RadiusFunction,
    /// Its sweeps, in order.
    pub sweeps: Vec<FoundSweep>,
    /// Share of the surface, by parameters, that no sweep is to cover: none of the tool's was found there.
    pub left: f64,
    /// What the search that led to it started from.
    pub seed: Seed,
    /// Steps of the optimizer.
    pub steps: usize,
    /// Distance between the planned-on spline and the part's surface, mm; 0 for spline parts.
    pub surface_fit_error: f64,
    layout: super::chart::Layout,
}

/// How far the arcs of a tool's flank may leave the found meridian, mm.
pub const PROFILE_TOLERANCE: f64 = 1e-5;
/// Most sweeps tried when their number is free.
const MOST_SWEEPS: usize = 12;

/// Finds a tool and its sweeps for a part.
pub fn find_tool(request: &ToolRequest<'_>) -> Result<FoundTool> {
    let form = request.part.surface.spline()?;
    let strategy = request.strategy;
    let only = strategy.direction.map(|direction| runs_along_u(&form.spline, &direction));
    let layouts = both_ways(|along_u| orient(strategy, &form.spline, Lines::parameter(along_u)), only);
    let (continued, whole) = continued(&form.spline);
    let charts: Vec<Chart<'_>> = layouts.iter().map(|layout| Chart::new(&continued, layout.clone())).collect();
    let search = Search { wish: request.wish, whole, limit: request.tolerance, observer: request.observer };
    let (index, fitted) = best_sweeps(&search, strategy, &charts).map_err(|why| refusal(&why, request.wish))?;
    found(request, (layouts[index].clone(), whole), fitted, form.fit_error)
}

/// The fewest sweeps within the limit, or else those that come nearest to it, with the index of their chart. Where their
/// number is free, bands beside each other are compared with patches.
fn best_sweeps(
    search: &Search<'_>,
    strategy: &Strategy,
    charts: &[Chart<'_>],
) -> std::result::Result<(usize, Fitted), NotFound> {
    let (fewest, mut most) = match (strategy.kind, strategy.strips) {
        (StrategyKind::SingleSweep, _) => (1, 1),
        (StrategyKind::MultiStrip, Some(count)) => (count, count),
        (StrategyKind::MultiStrip, None) => (1, MOST_SWEEPS),
    };
    let mut best: Option<(usize, Fitted)> = None;
    let mut refused = NotFound::NoFit;
    let mut count = fewest;
    while count <= most {
        match search.run(charts, &search.whole.divided(count)) {
            Ok((chart, fitted)) => {
                let enough = fitted.worst() <= search.limit;
                let patches = count == 1 && most > 1 && !enough;
                let patched = if patches { search.patches(&charts[chart], &fitted) } else { None };
                for tried in [Some(fitted), patched].into_iter().flatten() {
                    if tried.worst() <= search.limit {
                        most = most.min(tried.bands.len() - 1);
                    }
                    if best.as_ref().is_none_or(|(_, known)| search.prefers(&tried, known)) {
                        best = Some((chart, tried));
                    }
                }
                if enough || search.observer.stopped() {
                    break;
                }
            }
            Err(reason) => refused = reason,
        }
        count += 1;
    }
    best.ok_or(refused)
}

/// The surface with its end polynomials going on all around, as far as it stays regular, and the part of it that is
/// the surface itself: sweeps cross its borders without a bend.
fn continued(spline: &OrientedSpline) -> (OrientedSpline, Band) {
    for share in [0.06, 0.03, 0.015] {
        let longer = extended(spline.surface(), share);
        if let Some(longer) = longer.and_then(|longer| OrientedSpline::new(longer, spline.flip()).ok()) {
            return (longer, Band::inside(share / (1.0 + 2.0 * share)));
        }
    }
    (spline.clone(), Band::inside(0.0))
}

fn refusal(reason: &NotFound, wish: &ToolWish) -> Box<Diagnostic> {
    match reason {
        NotFound::TooShort(needed) => Diagnostic::error(format!(
            "no flank of at most {} mm covers the part: at least {needed:.3} mm are needed",
            wish.length.1
        ))
        .help("allow a longer [tool] length, or more sweeps: [strategy] kind = \"multi-strip\""),
        NotFound::NoFit => {
            Diagnostic::error("no tool was found that is a proper surface of revolution and covers the part")
                .help("allow a wider [tool] radius, another family, or give [strategy] direction")
        }
    }
}

fn found(
    request: &ToolRequest<'_>,
    (layout, whole): (super::chart::Layout, Band),
    fitted: Fitted,
    surface_fit_error: f64,
) -> Result<FoundTool> {
    let tool = tool_of(request.wish, &fitted.radius)?;
    let left = 1.0 - fitted.bands.iter().map(Band::area).sum::<f64>() / whole.area();
    let seed = fitted.seed;
    let shares = move |band: &Band| {
        let (low, high) = (whole.share((band.low, band.start)), whole.share((band.high, band.end)));
        [(low.0, high.0), (low.1, high.1)]
    };
    let sweeps =
        fitted.motions.into_iter().zip(&fitted.bands).zip(&fitted.judged).map(|((motion, band), judged)| FoundSweep {
            band: shares(band),
            motion,
            deviation: Deviation {
                overcut: judged.overcut,
                undercut: judged.undercut,
                outside: judged.outside,
                samples: judged.samples,
                bare: None,
            },
            worst_at: whole.share(judged.worst_at),
            rms: judged.rms,
            covered: judged.covered(),
            within: judged.share_within(request.tolerance),
            patch: judged.largest_patch(band, request.tolerance).as_ref().map(shares),
        });
    let sweeps = sweeps.collect();
    let left = if left > 1e-9 { left } else { 0.0 };
    Ok(FoundTool { tool, radius: fitted.radius, sweeps, left, seed, steps: fitted.steps, surface_fit_error, layout })
}

/// The found sphere family as a tool: arcs along its meridian, flat bottom, shank and holder as wished.
fn tool_of(wish: &ToolWish, radius: &RadiusFunction) -> Result<Tool> {
    let curve = |share: f64| {
        let s = share * radius.length();
        let contact = radius.jet(s).contact(s);
        CurvePoint { point: contact.point, tangent: (contact.normal_radial, -contact.normal_axial) }
    };
    let points = smooth_profile(curve, PROFILE_TOLERANCE).ok_or_else(|| {
        Diagnostic::error("the found meridian runs back toward the tip").help("allow a narrower [tool] radius")
    })?;
    let tool = Tool::new(wish.number, &CutterShape::Meridian { points }, &wish.fixture);
    tool.map_err(|e| Diagnostic::error(format!("the found tool: {e}")).help("change this key of [tool]"))
}

/// The tool path of a found tool; `request.tool` is that tool.
pub fn plan_found(request: &PlanRequest<'_>, found: &FoundTool) -> Result<Plan> {
    let form = request.part.surface.spline()?;
    let chart = Chart::new(&form.spline, found.layout.clone());
    let motions: Vec<RuledMotion> = found.sweeps.iter().map(|sweep| sweep.motion.clone()).collect();
    if let Some(bound) = &request.strategy.reach {
        bound.check(motions.iter())?;
    }
    let passes = chart_passes(request, &chart, &motions)?;
    let path = request.path_of(request.tool, passes);
    let planned = found.sweeps.iter().map(|sweep| Planned {
        motion: sweep.motion.clone(),
        deviation: sweep.deviation,
        steps: found.steps,
    });
    let planned: Vec<Planned> = planned.collect();
    let strips = explain::reports(request, request.tool, &form.spline, &planned, found.left > 0.0);
    let verdict = explain::verdict(request, &strips, found.left, &[]);
    Ok(Plan {
        gaps: Vec::new(),
        path,
        strips,
        verdict,
        attainable: None,
        surface_fit_error: found.surface_fit_error,
        interrupted: request.observer.stopped(),
        found: None,
        tool: None,
        rajain: None,
    })
}
