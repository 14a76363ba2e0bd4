//! Leads, links and retracts around the sweeps of a found tool.

use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::Vector;
use crate::motion::{Pass, RuledMotion};
use crate::plan::PlanRequest;
use crate::plan::chart::Chart;
use crate::plan::link;

/// Joins the sweeps' motions into passes.
pub(super) fn passes(request: &PlanRequest<'_>, chart: &Chart<'_>, motions: &[RuledMotion]) -> Result<Vec<Pass>> {
    let normals = motions.iter().map(|motion| end_normals(chart, motion)).collect::<Result<Vec<_>>>()?;
    link::passes(request, request.tool, motions, &normals)
}

fn end_normals(chart: &Chart<'_>, motion: &RuledMotion) -> Result<(Vector, Vector)> {
    let (start, end) = motion.domain();
    let at = |t: f64, h: f64| {
        let middle = nalgebra::center(&motion.lower.point(t), &motion.upper.point(t));
        chart.foot(&middle, (0.5, h)).map(|foot| foot.frame.normal).ok_or_else(|| {
            Diagnostic::error("the surface's extension has no normal where the tool leads in or out")
                .help("give a shorter [strategy] lead")
        })
    };
    Ok((at(start, 0.0)?, at(end, 1.0)?))
}
