//! A plan in figures, as JSON for other programs and as rows for the report: what each strip came to and what limits it.

use super::Inputs;
use crate::plan::{LimitedBy, Method, Plan, RajainFigures, StripReport};
use crate::tool::Tool;
use crate::verify::ToleranceRecord;
use serde::Serialize;

/// Format and version of the JSON.
const FORMAT: (&str, u32) = ("regulus-plan", 1);

/// A plan in figures. Lengths mm, angles degrees.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanRecord {
    format: &'static str,
    version: u32,
    /// Name of the job.
    pub name: String,
    /// How the motion was found, in the job's word.
    pub method: &'static str,
    /// True when all strips as planned keep the tolerance and cover the surface.
    pub within_tolerance: bool,
    /// Why not.
    pub reasons: Vec<String>,
    /// What would help.
    pub help: Vec<String>,
    /// True when planning was ended early.
    pub interrupted: bool,
    /// What was allowed.
    pub tolerance: ToleranceRecord,
    /// Distance between the spline planned on and the part, mm.
    pub surface_fit_error_mm: f64,
    /// The tool.
    pub tool: String,
    /// End spheres of the tool that was found, where some of it was free.
    pub found_tool: Option<SphereRecord>,
    /// In order.
    pub strips: Vec<StripRecord>,
    /// Figures of the method "rajain-2023".
    pub rajain_2023: Option<RajainRecord>,
}

/// A conical or cylindrical flank by its end spheres, as `spheres` of a job's `[tool]` takes it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SphereRecord {
    /// Radius toward the tip.
    pub r1: f64,
    /// Radius toward the spindle.
    pub r2: f64,
    /// Distance of the centres.
    pub length: f64,
}

/// One strip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StripRecord {
    /// Number, from 0.
    pub strip: usize,
    /// Largest depth of the envelope below the surface.
    pub overcut_mm: f64,
    /// Largest height of the envelope above the surface.
    pub undercut_mm: f64,
    /// Deepest gouge by the flutes beside the strip, the shank or the holder.
    pub outside_mm: f64,
    /// How far the flank stops short of the strip's border at most; 0 where it covers all of its band.
    pub bare_mm: f64,
    /// How it meets the next strip; none for the last, and where they do not meet.
    pub seam: Option<SeamRecord>,
    /// Way of the flank's middle.
    pub length_mm: f64,
    /// Widest engagement of the flank.
    pub engagement_mm: f64,
    /// Steps of the optimizer.
    pub steps: usize,
    /// Least error, of either sign, that the curvature along the flank leaves a straight tool.
    pub curvature_error_mm: f64,
    /// What keeps it from being better.
    pub limited_by: LimitedBy,
}

/// How two strips meet, by their true envelopes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SeamRecord {
    /// Largest angle.
    pub kink_max_deg: f64,
    /// Mean angle.
    pub kink_mean_deg: f64,
    /// Largest step.
    pub step_max_mm: f64,
}

/// Figures of the method "rajain-2023" in the paper's own measures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RajainRecord {
    /// M.
    pub strips: usize,
    /// Positions of the tool in all strips.
    pub positions: usize,
    /// K.
    pub samples: usize,
    /// L of the engaged part.
    pub length_mm: f64,
    /// Radius of the engaged part toward the tip.
    pub r1_mm: f64,
    /// Radius of the engaged part toward the spindle.
    pub r2_mm: f64,
    /// Least and greatest length of the axis at the start (Fig. 11).
    pub start_lengths_mm: [f64; 2],
    /// The same as the optimizer left it, before the tool is made rigid.
    pub lengths_mm: [f64; 2],
    /// Greatest distance error of equation 19 below the surface.
    pub distance_error_overcut_mm: f64,
    /// Greatest distance error of equation 19 above the surface.
    pub distance_error_undercut_mm: f64,
    /// Greatest difference of the angles of equation 15.
    pub kink_max_deg: f64,
    /// Mean difference of the angles of equation 15.
    pub kink_mean_deg: f64,
    /// Positions that fail the distance check of Fig. 4.
    pub colliding_positions: usize,
    /// Share of the surface outside all strips.
    pub bare_share: f64,
}

/// A plan in figures.
pub fn explain(inputs: &Inputs, plan: &Plan) -> PlanRecord {
    let job = &inputs.job;
    PlanRecord {
        format: FORMAT.0,
        version: FORMAT.1,
        name: job.name.clone(),
        method: match job.strategy.method {
            Method::Regulus => "regulus",
            Method::Rulings => "rulings",
            Method::Rajain2023 => "rajain-2023",
        },
        within_tolerance: plan.verdict.within_tolerance,
        reasons: plan.verdict.reasons.clone(),
        help: plan.verdict.help.clone(),
        interrupted: plan.interrupted,
        tolerance: ToleranceRecord { overcut: job.part.overcut_tolerance, undercut: job.part.undercut_tolerance },
        surface_fit_error_mm: plan.surface_fit_error,
        tool: format!("T{} {}", plan.path.tool.number, plan.path.tool.description),
        found_tool: plan.tool.as_ref().and_then(spheres),
        strips: plan.strips.iter().enumerate().map(|(i, strip)| strip_record(i, strip)).collect(),
        rajain_2023: plan.rajain.as_ref().map(rajain_record),
    }
}

/// End spheres of a straight flank.
fn spheres(tool: &Tool) -> Option<SphereRecord> {
    let flank = tool.flutes().last()?;
    let (low, high) = (flank.contact(0.0), flank.contact(1.0));
    Some(SphereRecord {
        r1: low.sphere_radius(),
        r2: high.sphere_radius(),
        length: high.sphere_height() - low.sphere_height(),
    })
}

fn strip_record(strip: usize, report: &StripReport) -> StripRecord {
    let deviation = &report.deviation;
    StripRecord {
        strip,
        overcut_mm: deviation.overcut,
        undercut_mm: deviation.undercut,
        outside_mm: deviation.outside,
        bare_mm: deviation.bare.map_or(0.0, |bare| bare.width),
        seam: report.seam.map(|seam| SeamRecord {
            kink_max_deg: seam.kink_max_deg,
            kink_mean_deg: seam.kink_mean_deg,
            step_max_mm: seam.step_max,
        }),
        length_mm: report.length,
        engagement_mm: report.engagement,
        steps: report.steps,
        curvature_error_mm: report.curvature_error,
        limited_by: report.limited_by,
    }
}

fn rajain_record(figures: &RajainFigures) -> RajainRecord {
    let pair = |(low, high): (f64, f64)| [low, high];
    RajainRecord {
        strips: figures.strips,
        positions: figures.positions,
        samples: figures.heights,
        length_mm: figures.length,
        r1_mm: figures.r1,
        r2_mm: figures.r2,
        start_lengths_mm: pair(figures.start_lengths),
        lengths_mm: pair(figures.lengths),
        distance_error_overcut_mm: figures.distance_errors.0,
        distance_error_undercut_mm: figures.distance_errors.1,
        kink_max_deg: figures.kinks.0,
        kink_mean_deg: figures.kinks.1,
        colliding_positions: figures.colliding,
        bare_share: figures.bare_share,
    }
}
