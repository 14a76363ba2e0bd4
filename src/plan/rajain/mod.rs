//! The method of Rajain, Bizzarri, Lavicka, Kosinka and Barton, "Towards G1-continuous multi-strip path-planning for
//! 5-axis flank CNC machining of free-form surfaces using conical cutting tools", CAD 163 (2023), 103555, as printed.
//!
//! Guiding curves (section 5) give base points; a grid of points m describes all strips; the weighted sum of rigidity,
//! accuracy, kink, proximity and fairness (equations 12 to 18) is minimized over it. Two things differ, both for the
//! better: the sum is minimized by Levenberg-Marquardt with the analytic Jacobian, and what is emitted is rigid by
//! construction. Figures are given as the paper has them and as the true envelope shows them.

mod emit;
mod field;
#[cfg(test)]
mod fixtures;
mod grid;
mod guide;
mod measure;
mod problem;
mod sheet;
mod spheres;
#[cfg(test)]
mod tests;

pub use field::DirectionField;

use super::{Deviation, PlanRequest, Progress, Stage, StrategyKind, TipSide};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::Vector;
use crate::motion::{Pose, RuledMotion};
use crate::optimize::{Settings, minimize_bordered};
use crate::part::{DesignSurface, OrientedSpline};
use crate::tool::Tool;
use field::{Source, Wish};
use grid::{Grid, Laying};
use guide::Guide;
use measure::{Rest, Subject};
use problem::{Axis, Problem};
use rayon::prelude::*;
use sheet::{Place, Sheet};
use spheres::{Cone, Flank};

/// Weights of equation 18.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// w1, of the rigidity of the axis (R12).
    pub rigidity: f64,
    /// w2, of the approximation (R13).
    pub accuracy: f64,
    /// w3, of the kink between strips (R16).
    pub g1: f64,
    /// w4, of the proximity to the start (R17).
    pub proximity: f64,
    /// w5, of the fairness of the motion (R14).
    pub fairness: f64,
}

impl Default for Weights {
    /// w1 and w4 of Remark 4, w2 and w3 of Fig. 16, bottom row: accuracy first. The paper prints no w5; here it is low
    /// enough not to show in the accuracy.
    fn default() -> Self {
        Self { rigidity: 1.0, accuracy: 1.0, g1: 0.001, proximity: 1e-4, fairness: 1e-6 }
    }
}

/// Which sizes of the tool the method may change.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Free {
    /// Distance L of the end spheres' centres.
    pub length: bool,
    /// Radius of the end sphere toward the tip.
    pub r1: bool,
    /// Radius of the end sphere toward the spindle.
    pub r2: bool,
}

impl Free {
    fn any(self) -> bool {
        self.length || self.r1 || self.r2
    }
}

/// What a user may set of this method.
#[derive(Clone, Debug, PartialEq)]
pub struct RajainSettings {
    /// Weights.
    pub weights: Weights,
    /// What is free of the tool.
    pub free: Free,
    /// Engaged shares of the flank's axis, from tip to spindle; the paper's Fig. 18 uses one half.
    pub engagement: (f64, f64),
    /// Distance h of neighbouring positions, mm; a hundredth of the surface's size when left out, as in the paper.
    pub step: Option<f64>,
    /// K, samples on every position of the axis.
    pub heights: usize,
    /// Directions at points of the part, in place of the one vector.
    pub field: Option<DirectionField>,
}

impl Default for RajainSettings {
    fn default() -> Self {
        Self {
            weights: Weights::default(),
            free: Free::default(),
            engagement: (0.0, 1.0),
            step: None,
            heights: 40,
            field: None,
        }
    }
}

/// What the method came to, in the paper's own measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RajainFigures {
    /// M, strips.
    pub strips: usize,
    /// Positions of the tool in all strips, N x M where they are alike.
    pub positions: usize,
    /// K, samples a position.
    pub heights: usize,
    /// L of the engaged part, as used or found, mm.
    pub length: f64,
    /// Radius of the engaged part's sphere toward the tip, mm.
    pub r1: f64,
    /// Radius of the engaged part's sphere toward the spindle, mm.
    pub r2: f64,
    /// Least and greatest length of the axis at the start, mm (Fig. 11).
    pub start_lengths: (f64, f64),
    /// The same as the optimizer left it, before the tool is made rigid, mm.
    pub lengths: (f64, f64),
    /// Equation 19 at all samples over the surface: greatest |y - foot| - r below zero and above, mm, not negative.
    pub distance_errors: (f64, f64),
    /// Greatest and mean difference of the angles of equation 15, degrees.
    pub kinks: (f64, f64),
    /// Positions that fail the distance check of Fig. 4.
    pub colliding: usize,
    /// Share of the surface outside the optimized strips.
    pub bare_share: f64,
    /// Steps of the optimizer.
    pub steps: usize,
}

/// A strip of this method.
#[derive(Clone, Debug)]
pub(super) struct RajainStrip {
    pub(super) motion: RuledMotion,
    pub(super) deviation: Deviation,
    /// Outward normals at start and end.
    pub(super) normals: (Vector, Vector),
}

/// A plan of this method.
#[derive(Clone, Debug)]
pub(super) struct RajainPlan {
    pub(super) strips: Vec<RajainStrip>,
    /// The tool found, where some of it is free.
    pub(super) tool: Option<Tool>,
    pub(super) figures: RajainFigures,
}

/// Plans strips on a surface. Where their number is free and rigid strips draw together so far that the surface is no
/// longer covered, one more is laid.
pub(super) fn plan(request: &PlanRequest<'_>, spline: &OrientedSpline) -> Result<RajainPlan> {
    let strategy = request.strategy;
    let sheet = Sheet::new(spline);
    let flank = Flank::of(request.tool, strategy.engage_from, strategy.rajain.engagement)?;
    let cone = flank.engaged();
    let asked = if strategy.kind == StrategyKind::SingleSweep { Some(1) } else { strategy.strips };
    let mut count = asked;
    for attempt in 1.. {
        let (guide, grid) = lay(request, sheet, &cone, count)?;
        let fitted = fit(request, &guide, &grid, &cone)?;
        let enough = asked.is_some() || fitted.bare_share == 0.0 || request.observer.stopped();
        if enough || attempt == ATTEMPTS {
            return fitted.emit(request, sheet, &flank);
        }
        count = Some(grid.strips.len() + 1);
    }
    Err(Diagnostic::error("no number of strips was tried"))
}

/// Most numbers of strips tried.
const ATTEMPTS: usize = 3;

/// An optimized grid.
struct Fitted {
    axes: Vec<Axis>,
    strip_of: Vec<usize>,
    cone: Cone,
    bare_share: f64,
    figures: RajainFigures,
}

/// Minimizes equation 18 over a grid.
fn fit(request: &PlanRequest<'_>, guide: &Guide<'_>, grid: &Grid, cone: &Cone) -> Result<Fitted> {
    let settings = &request.strategy.rajain;
    let weighing = (settings.weights, settings.free);
    let (mut problem, mut x) = Problem::new(guide.sheet(), grid, *cone, settings.heights, weighing);
    let degenerate = || {
        Diagnostic::error("the tool cannot be laid on the guiding curves: the surface is too curved for it there")
            .help("use a shorter engagement, a slimmer tool, or another direction")
    };
    let start = problem.axes(&x).ok_or_else(degenerate)?;
    let observer = request.observer;
    let strips = grid.strips.len();
    let watch = |problem: &Problem<'_>, step: usize| {
        let (low, high) = problem.spread;
        let (overcut, undercut) = ((-low).max(0.0), high.max(0.0));
        observer.note(&Progress { strips, stage: Stage::Step(step), overcut, undercut });
        !observer.stopped()
    };
    let mut steps = 0;
    for (rigidity, stopping) in stages(&settings.weights, cone) {
        if steps > 0 && observer.stopped() {
            break;
        }
        problem.weigh_rigidity(rigidity);
        let watch = |problem: &Problem<'_>, step: usize| watch(problem, steps + step);
        steps += minimize_bordered(&mut problem, &mut x, &stopping, watch).ok_or_else(degenerate)?.steps;
    }
    let axes = problem.axes(&x).ok_or_else(degenerate)?;
    let found = problem.cone(&x);
    let (count, positions, heights) = problem.size();
    let bare_share = bare_share(guide, &axes, &problem.strip_of);
    let figures = RajainFigures {
        strips: count,
        positions,
        heights,
        length: found.length,
        r1: found.r1,
        r2: found.r2,
        start_lengths: lengths(&start),
        lengths: lengths(&axes),
        distance_errors: problem.distance_errors(&x).ok_or_else(degenerate)?,
        kinks: problem.kinks(&x).ok_or_else(degenerate)?,
        colliding: 0,
        bare_share,
        steps,
    };
    Ok(Fitted { axes, strip_of: problem.strip_of, cone: found, bare_share, figures })
}

impl Fitted {
    /// Rigid motions of the tool that was given or found, measured.
    fn emit(self, request: &PlanRequest<'_>, sheet: Sheet<'_>, flank: &Flank) -> Result<RajainPlan> {
        let settings = &request.strategy.rajain;
        let tool = if settings.free.any() { Some(flank.tool_with(&self.cone, request.tool)?) } else { None };
        let flank = match &tool {
            Some(tool) => Flank::of(tool, None, settings.engagement)?,
            None => *flank,
        };
        let used = tool.as_ref().unwrap_or(request.tool);
        let emission = Emission { request, sheet, tool: used, flank: &flank, cone: self.cone };
        let (strips, colliding) = emission.strips(&self.axes, &self.strip_of, self.figures.strips)?;
        Ok(RajainPlan { strips, tool, figures: RajainFigures { colliding, ..self.figures } })
    }
}

/// Weights of rigidity, one after the other, with when to stop: the last is the user's. Where it outweighs accuracy the
/// sum has a narrow bent valley along which descent creeps; from a start where a length and a distance amiss cost alike
/// (|span|^2 - L^2 changes by 2 L a millimetre) the valley is entered near its bottom.
fn stages(weights: &Weights, cone: &Cone) -> Vec<(f64, Settings)> {
    let stopping = Settings { max_steps: MOST_STEPS, cost_share: 1e-6, ..Settings::default() };
    let even = weights.accuracy / (3.0 * (2.0 * cone.length).powi(2));
    let first = Settings { max_steps: FIRST_STEPS, cost_share: 1e-3, ..Settings::default() };
    let mut stages = Vec::new();
    if even < weights.rigidity && even > 0.0 {
        stages.extend([(even, first), ((even * weights.rigidity).sqrt(), first)]);
    }
    stages.push((weights.rigidity, stopping));
    stages
}

/// Most steps of the optimizer with the user's weights.
const MOST_STEPS: usize = 200;
/// Most steps with less rigidity.
const FIRST_STEPS: usize = 60;

/// Guiding curves and grid (section 5).
fn lay<'a>(
    request: &PlanRequest<'_>,
    sheet: Sheet<'a>,
    cone: &Cone,
    strips: Option<usize>,
) -> Result<(Guide<'a>, Grid)> {
    let strategy = request.strategy;
    let settings = &strategy.rajain;
    let source = match (&settings.field, strategy.direction) {
        (Some(field), _) => Source::Field(field),
        (None, Some(direction)) => Source::Vector(direction),
        (None, None) => {
            return Err(Diagnostic::error("method \"rajain-2023\" needs the machining direction")
                .help("give [strategy] direction = [x, y, z], or [strategy.rajain] field = \"directions.csv\""));
        }
    };
    let size = request.part.surface.bounds().diagonal();
    let step = settings.step.unwrap_or(size / 100.0);
    let wish = Wish { source, toward: spindle_side(request, &sheet)? };
    let distance = cone.distance();
    let reach = distance + 6.0 * step;
    let guide = Guide::new(sheet, &wish, reach)?;
    check_hollows(&guide, cone)?;
    let laying = Laying { distance, strips, step, forward: strategy.climb };
    let grid = Grid::new(&guide, &laying, cone)?;
    Ok((guide, grid))
}

/// The tool must fit into the hollows of the part along the cut.
fn check_hollows(guide: &Guide<'_>, cone: &Cone) -> Result<()> {
    let radius = cone.r1.min(cone.r2);
    let Some((hollow, at)) = guide.sharpest_hollow().filter(|(hollow, _)| hollow * radius >= 1.0) else {
        return Ok(());
    };
    Err(Diagnostic::error(format!(
        "the tool is too big for the part: near ({:.3}, {:.3}, {:.3}) the surface is hollow with radius {:.3} mm along the cut, the slimmest part of the flank has {radius:.3} mm",
        at.x, at.y, at.z, 1.0 / hollow
    ))
    .help("use a tool with a smaller diameter, or another cutting direction"))
}

/// Roughly where the spindle is, seen from the part: as wished, from the end that the tip is at, or upward and outward.
fn spindle_side(request: &PlanRequest<'_>, sheet: &Sheet<'_>) -> Result<Vector> {
    let strategy = request.strategy;
    let middle = sheet.frame((0.5, 0.5)).ok_or_else(|| {
        Diagnostic::error("the surface has no normal in its middle").help("repair the surface: it has a fold or a pole")
    })?;
    if let Some(side) = strategy.tip {
        let along = strategy.direction.and_then(|direction| middle.along(&direction));
        let [u, v] = [0, 1].map(|k| middle.tangents.column(k).into_owned());
        // The parameter that crosses the cut is the one less along it.
        let crossing = match along {
            Some(along) if u.normalize().dot(&along).abs() > v.normalize().dot(&along).abs() => v,
            Some(_) => u,
            None => v,
        };
        return Ok(if side == TipSide::Low { crossing } else { -crossing });
    }
    if let Some(side) = strategy.spindle {
        return Ok(side);
    }
    let outward = Vector::new(middle.point.x, middle.point.y, 0.0);
    let up = Vector::z() - middle.normal * middle.normal.z;
    Ok(if up.norm() > 0.35 || outward.norm() < 1e-6 { Vector::z() } else { outward })
}

/// Least and greatest length of the axis.
fn lengths(axes: &[Axis]) -> (f64, f64) {
    let lengths = axes.iter().map(|axis| (axis.b - axis.a).norm());
    lengths.fold((f64::INFINITY, 0.0), |(low, high), l| (low.min(l), high.max(l)))
}

/// Share of the surface, by parameters, that the optimized strips leave on their outer sides: where G is lower than at the
/// nearest foot of the first rail, or higher than at the nearest of the last.
fn bare_share(guide: &Guide<'_>, axes: &[Axis], strip_of: &[usize]) -> f64 {
    let last = strip_of.last().copied().unwrap_or(0);
    let rail = |strip: usize, end: usize| -> Vec<(Place, f64)> {
        let own = axes.iter().zip(strip_of).filter(|(_, s)| **s == strip);
        own.map(|(axis, _)| (axis.places[end], guide.level(axis.places[end]))).collect()
    };
    let (first, last) = (rail(0, 0), rail(last, 1));
    let level_near = |rail: &[(Place, f64)], at: Place| {
        let off = |p: &Place| (p.0 - at.0).powi(2) + (p.1 - at.1).powi(2);
        rail.iter().min_by(|a, b| off(&a.0).total_cmp(&off(&b.0))).map(|(_, level)| *level)
    };
    let steps = 60;
    let at = |k: usize| (k as f64 + 0.5) / steps as f64;
    let bare = (0..steps * steps).map(|k| (at(k / steps), at(k % steps))).filter(|place| {
        let level = guide.level(*place);
        level_near(&first, *place).is_some_and(|low| level < low - 1e-6)
            || level_near(&last, *place).is_some_and(|high| level > high + 1e-6)
    });
    bare.count() as f64 / (steps * steps) as f64
}

/// From optimized positions to measured motions.
struct Emission<'a> {
    request: &'a PlanRequest<'a>,
    sheet: Sheet<'a>,
    tool: &'a Tool,
    flank: &'a Flank,
    cone: Cone,
}

impl Emission<'_> {
    /// Every strip, and the number of positions that fail the distance check.
    fn strips(&self, axes: &[Axis], strip_of: &[usize], count: usize) -> Result<(Vec<RajainStrip>, usize)> {
        let rest = Rest::of(self.tool, self.flank.engaged_contacts());
        let emitted: Vec<Result<(RajainStrip, usize)>> = (0..count)
            .into_par_iter()
            .map(|index| {
                let own: Vec<Axis> = axes.iter().zip(strip_of).filter(|(_, s)| **s == index).map(|(a, _)| *a).collect();
                self.strip(&own, &rest).map_err(|mut e| {
                    e.message = format!("strip {} of {count}: {}", index + 1, e.message);
                    e
                })
            })
            .collect();
        let emitted: Vec<(RajainStrip, usize)> = emitted.into_iter().collect::<Result<_>>()?;
        let colliding = emitted.iter().map(|(_, n)| n).sum();
        Ok((emitted.into_iter().map(|(strip, _)| strip).collect(), colliding))
    }

    fn strip(&self, axes: &[Axis], rest: &Rest) -> Result<(RajainStrip, usize)> {
        let height = self.flank.engaged_height();
        let Some((motion, ends)) = emit::motion(axes, self.cone.length, height).zip(axes.first().zip(axes.last()))
        else {
            return Err(Diagnostic::error("neighbouring positions of the tool coincide: the fit broke down")
                .help("give [strategy.weights] proximity or fairness more weight, or use another direction"));
        };
        let contacts = self.flank.engaged_contacts();
        let subject = Subject { sheet: self.sheet, tool: self.tool, engaged: contacts, rest };
        let deviation = measure::measure(&subject, &motion, ends.0.places[0], axes.len())?;
        let normals = measure::end_normals(&self.sheet, &motion, (ends.0.places[0], ends.1.places[0]))?;
        let poses: Vec<_> = axes.iter().filter_map(|axis| Some((pose(axis, height)?, axis.places[0]))).collect();
        let allowed = self.request.overcut_tolerance;
        let part = self.request.part;
        let around: Vec<&DesignSurface> = part.body.iter().chain(&part.check).collect();
        let colliding = measure::colliding(&subject, &poses, &around, allowed);
        Ok((RajainStrip { motion, deviation, normals }, colliding))
    }
}

fn pose(axis: &Axis, height: f64) -> Option<Pose> {
    let direction = crate::geometry::Direction::try_new(axis.b - axis.a, 1e-9)?;
    Some(Pose { tip: axis.a - direction.into_inner() * height, axis: direction })
}
