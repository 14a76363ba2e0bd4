//! Strategies that choose the tool path: single sweep and multi-strip. Uses `diagnostic`, `geometry`, `part`, `tool`,
//! `motion`, `envelope`, `optimize` and `collide`.

mod assess;
mod attainable;
mod bands;
mod chart;
pub mod choice;
mod counts;
mod explain;
mod field;
mod fit;
mod fitted;
mod forecast;
mod join;
mod laid;
mod layout;
mod lift;
mod limits;
mod link;
pub mod meridian;
mod observe;
mod planner;
mod polish;
mod rails;
mod rajain;
mod reach;
mod refine;
mod seam;
mod search;
mod start;
mod strip;
#[cfg(test)]
mod tests;
mod touch;
mod trace;

pub use assess::{Bare, Deviation};
pub use attainable::{Attainable, AttainableMap, FlankLaw};
pub use explain::{LimitedBy, PlanVerdict, StripReport};
pub use laid::Gap;
pub use observe::{Observer, Progress, Stage, Unobserved};
pub use rajain::{DirectionField, Free, RajainFigures, RajainSettings, Weights};
pub use reach::{AxisBound, AxisReach};
pub use seam::Seam;

use crate::diagnostic::Result;
use crate::geometry::Vector;
use crate::motion::{FeedReference, Pass, RuledMotion, ToolPath, ToolSummary};
use crate::part::Part;
use crate::tool::Tool;
use explain::Planned;
use fitted::FittedStrip;
use link::passes;
use meridian::FoundTool;
use planner::{Found, Planner, flank};
use rajain::RajainStrip;

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
    /// All strips at once over a grid of points, as Rajain 2023 prints it.
    Rajain2023,
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
    /// How firmly strips follow the wanted direction, against 1 for standing square to the best axis.
    pub direction_weight: f64,
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
    /// How much a kink between neighbouring strips counts, against 1 for as much as the error that it comes with where the
    /// part is curved along the flank. 0 fits every strip on its own.
    pub smoothness: f64,
    /// Height above the tip at which the flank starts to be used, mm; just above the corner when left out.
    pub engage_from: Option<f64>,
    /// Length of lead-in and lead-out, mm; the tool's largest radius when left out.
    pub lead: Option<f64>,
    /// Stand-off of links, mm; 2 mm when left out.
    pub stand_off: Option<f64>,
    /// Tool axis directions to keep to; all when left out.
    pub reach: Option<AxisBound>,
    /// Settings of [`Method::Rajain2023`].
    pub rajain: RajainSettings,
}

impl Strategy {
    /// Defaults for a kind.
    pub fn new(kind: StrategyKind) -> Self {
        Self {
            kind,
            method: Method::Regulus,
            direction: None,
            direction_weight: 20.0,
            strips: None,
            tip: None,
            spindle: None,
            climb: true,
            fairness: 1.0,
            smoothness: 1.0,
            engage_from: None,
            lead: None,
            stand_off: None,
            reach: None,
            rajain: RajainSettings::default(),
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

/// A planned tool path.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The path.
    pub path: ToolPath,
    /// One entry a strip, in order.
    pub strips: Vec<StripReport>,
    /// Bands of the surface along which no strip could be laid, in order.
    pub gaps: Vec<Gap>,
    /// Whether the strips as planned keep the tolerance; what counts in the end is what the program's text leaves.
    pub verdict: PlanVerdict,
    /// What the flank can reach at best, fully engaged, whichever way its axis points; none for a tool that was found.
    pub attainable: Option<AttainableMap>,
    /// Distance between the planned-on spline and the part's surface, mm; 0 for spline parts.
    pub surface_fit_error: f64,
    /// True when the observer ended it early: this is then the best found so far.
    pub interrupted: bool,
    /// The tool, where it was not given at all but found.
    pub found: Option<Box<FoundTool>>,
    /// The tool that [`Method::Rajain2023`] made of the given one, where the job leaves some of it free; the path is for
    /// this one.
    pub tool: Option<Tool>,
    /// Figures of [`Method::Rajain2023`].
    pub rajain: Option<RajainFigures>,
}

impl Plan {
    /// The tool that the path is for, where it is not the given one.
    pub fn found_tool(&self) -> Option<&Tool> {
        self.tool.as_ref().or_else(|| self.found.as_ref().map(|found| &found.tool))
    }
}

impl PlanRequest<'_> {
    /// The tool path of these passes by `tool`, which may have been found on the way.
    fn path_of(&self, tool: &Tool, passes: Vec<Pass>) -> ToolPath {
        ToolPath {
            name: self.name.to_owned(),
            tool: ToolSummary::of(tool),
            cut_feed: self.cut_feed,
            feed_reference: self.feed_reference,
            spindle_rpm: self.spindle_rpm,
            linearization: self.linearization,
            overcut_tolerance: self.overcut_tolerance,
            undercut_tolerance: self.undercut_tolerance,
            passes,
        }
    }
}

/// Plans the tool path of a part.
pub fn plan(request: &PlanRequest<'_>) -> Result<Plan> {
    let form = request.part.surface.spline()?;
    let mut gaps = Vec::new();
    let (strips, passes, tool, figures) = match request.strategy.method {
        Method::Rajain2023 => {
            let found = rajain::plan(request, &form.spline)?;
            let normals: Vec<_> = found.strips.iter().map(|strip| strip.normals).collect();
            let steps = found.figures.steps;
            let strips = found.strips.into_iter().map(|RajainStrip { motion, deviation, .. }| Planned {
                motion,
                deviation,
                steps,
            });
            let strips: Vec<Planned> = strips.collect();
            let motions: Vec<RuledMotion> = strips.iter().map(|s| s.motion.clone()).collect();
            let passes = passes(request, found.tool.as_ref().unwrap_or(request.tool), &motions, &normals)?;
            (strips, passes, found.tool, Some(found.figures))
        }
        Method::Regulus | Method::Rulings => {
            let Found { planner, strips, gaps: left } = Planner::plan(request, &form.spline)?;
            let motions: Vec<RuledMotion> = strips.iter().map(|s| s.motion.clone()).collect();
            let passes = planner.passes(&motions)?;
            let strips = strips.into_iter().map(|FittedStrip { motion, deviation, steps, .. }| Planned {
                motion,
                deviation,
                steps,
            });
            gaps = left;
            (strips.collect(), passes, None, None)
        }
    };
    if let Some(bound) = &request.strategy.reach {
        bound.check(strips.iter().map(|strip| &strip.motion))?;
    }
    let path = request.path_of(tool.as_ref().unwrap_or(request.tool), passes);
    let bare_share = figures.map_or(0.0, |figures: RajainFigures| figures.bare_share);
    let used = tool.as_ref().unwrap_or(request.tool);
    let strips = explain::reports(request, used, &form.spline, &strips, bare_share > 0.0);
    let verdict = explain::verdict(request, &strips, bare_share, &gaps);
    let interrupted = request.observer.stopped();
    let surface_fit_error = form.fit_error;
    let attainable = Some(AttainableMap::new(&form.spline, flank(used, request.strategy)?.law()));
    Ok(Plan {
        path,
        strips,
        gaps,
        verdict,
        attainable,
        surface_fit_error,
        interrupted,
        found: None,
        tool,
        rajain: figures,
    })
}

/// What a tool's flank can reach at best on a part, before anything is planned.
pub fn attainable(part: &Part, tool: &Tool, strategy: &Strategy) -> Result<AttainableMap> {
    let form = part.surface.spline()?;
    Ok(AttainableMap::new(&form.spline, flank(tool, strategy)?.law()))
}
