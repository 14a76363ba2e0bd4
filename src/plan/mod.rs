//! Strategies that choose the tool path: single sweep and multi-strip. Uses `diagnostic`, `geometry`, `part`, `tool`,
//! `motion`, `envelope`, `optimize` and `collide`.

mod assess;
mod chart;
mod fit;
mod layout;
mod link;
pub mod meridian;
mod observe;
mod planner;
mod start;
mod strip;
#[cfg(test)]
mod tests;

pub use assess::Deviation;
pub use observe::{Observer, Progress, Stage, Unobserved};

use crate::diagnostic::Result;
use crate::geometry::Vector;
use crate::motion::{FeedReference, RuledMotion, ToolPath, ToolSummary};
use crate::part::Part;
use crate::tool::Tool;
use meridian::FoundTool;
use planner::Planner;

/// How many strips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StrategyKind {
    /// One sweep over the whole surface.
    SingleSweep,
    /// As many strips as asked for, or as the tolerance needs.
    MultiStrip,
}

/// How the motion is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Envelope fitted to the part.
    #[default]
    Regulus,
    /// Tool laid on rulings across the strip, touching at both ends, nothing optimized: what most systems do.
    Rulings,
}

/// Which end of the crossing parameter the tip is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TipSide {
    /// The parameter's low end.
    Low,
    /// The parameter's high end.
    High,
}

/// What the user wants of the plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Strategy {
    /// Number of strips in kind.
    pub kind: StrategyKind,
    /// How the motion is found.
    pub method: Method,
    /// Wanted cutting direction, part frame; the planner chooses when left out.
    pub direction: Option<Vector>,
    /// Number of strips; as few as the tolerance allows when left out.
    pub strips: Option<usize>,
    /// End of the surface that the tip is at; from `spindle` when left out.
    pub tip: Option<TipSide>,
    /// Roughly where the spindle is, seen from the part; upward or outward from the part's Z axis when left out.
    pub spindle: Option<Vector>,
    /// Climb milling with a clockwise spindle; otherwise conventional.
    pub climb: bool,
    /// Multiplies the weight of the motion's fairness.
    pub fairness: f64,
    /// Height above the tip at which the flank starts to be used, mm; just above the corner when left out.
    pub engage_from: Option<f64>,
    /// Length of lead-in and lead-out, mm; the tool's largest radius when left out.
    pub lead: Option<f64>,
    /// Stand-off of links, mm; 2 mm when left out.
    pub stand_off: Option<f64>,
}

impl Strategy {
    /// Defaults for a kind.
    pub fn new(kind: StrategyKind) -> Self {
        Self {
            kind,
            method: Method::Regulus,
            direction: None,
            strips: None,
            tip: None,
            spindle: None,
            climb: true,
            fairness: 1.0,
            engage_from: None,
            lead: None,
            stand_off: None,
        }
    }
}

/// Everything a plan starts from.
#[derive(Clone, Copy, Debug)]
pub struct PlanRequest<'a> {
    /// Name of the job.
    pub name: &'a str,
    /// The part.
    pub part: &'a Part,
    /// The tool.
    pub tool: &'a Tool,
    /// What is wanted.
    pub strategy: &'a Strategy,
    /// Largest depth below the surface, mm.
    pub overcut_tolerance: f64,
    /// Largest height above the surface, mm.
    pub undercut_tolerance: f64,
    /// Speed of the reference point, mm/min.
    pub cut_feed: f64,
    /// Which point that is.
    pub feed_reference: FeedReference,
    /// Spindle speed, 1/min.
    pub spindle_rpm: f64,
    /// How far the flank may leave the path between blocks, mm.
    pub linearization: f64,
    /// Follows the plan and may end it early.
    pub observer: &'a dyn Observer,
}

/// What one strip came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StripReport {
    /// Deviation of its envelope, as planned.
    pub deviation: Deviation,
    /// Length of the way of the flank's middle, mm.
    pub length: f64,
    /// Widest engagement of the flank, mm.
    pub engagement: f64,
    /// Steps of the optimizer.
    pub steps: usize,
}

/// A planned tool path.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The path.
    pub path: ToolPath,
    /// One entry a strip, in order.
    pub strips: Vec<StripReport>,
    /// Distance between the planned-on spline and the part's surface, mm; 0 for spline parts.
    pub surface_fit_error: f64,
    /// True when the observer ended it early: this is then the best found so far.
    pub interrupted: bool,
    /// The tool, where it was not given but found.
    pub found: Option<Box<FoundTool>>,
}

/// Plans the tool path of a part.
pub fn plan(request: &PlanRequest<'_>) -> Result<Plan> {
    let form = request.part.surface.spline()?;
    let planner = Planner::new(request, &form.spline)?;
    let strips = planner.strips()?;
    let motions: Vec<RuledMotion> = strips.iter().map(|s| s.motion.clone()).collect();
    let passes = planner.passes(&motions)?;
    let tool = request.tool;
    let path = ToolPath {
        name: request.name.to_owned(),
        tool: ToolSummary::of(tool),
        cut_feed: request.cut_feed,
        feed_reference: request.feed_reference,
        spindle_rpm: request.spindle_rpm,
        linearization: request.linearization,
        overcut_tolerance: request.overcut_tolerance,
        undercut_tolerance: request.undercut_tolerance,
        passes,
    };
    let strips = strips.iter().map(|s| report(&s.motion, s.deviation, s.steps)).collect();
    Ok(Plan { path, strips, surface_fit_error: form.fit_error, interrupted: request.observer.stopped(), found: None })
}

fn report(motion: &RuledMotion, deviation: Deviation, steps: usize) -> StripReport {
    let (start, end) = motion.domain();
    let at = |i: usize| start + (end - start) * i as f64 / 200.0;
    let middle = |t: f64| nalgebra::center(&motion.lower.point(t), &motion.upper.point(t));
    let length = (0..200).map(|i| (middle(at(i + 1)) - middle(at(i))).norm()).sum();
    let engagement =
        (0..=200).map(|i| (motion.upper.point(at(i)) - motion.lower.point(at(i))).norm()).fold(0.0, f64::max);
    StripReport { deviation, length, engagement, steps }
}
