//! Results in a few lines for people.

use crate::job::fact_lines;
use crate::pipeline::Posted;
use crate::plan::Plan;
use crate::plan::meridian::FoundTool;
use crate::verify::{Verdict, Verification};
use std::fmt::Write;

/// Reasons that are shown one by one.
const REASONS: usize = 10;

/// The strips as planned.
pub(super) fn of_plan(plan: &Plan) -> String {
    let mut text = format!("plan        {} strips, {} passes\n", plan.strips.len(), plan.path.passes.len());
    for (i, strip) in plan.strips.iter().enumerate() {
        let deviation = &strip.deviation;
        let _ = writeln!(
            text,
            "  strip {i:<3} {:.1} mm long, {:.2} mm wide, planned overcut {:.5} mm, undercut {:.5} mm, {} steps",
            strip.length, strip.engagement, deviation.overcut, deviation.undercut, strip.steps
        );
    }
    if plan.interrupted {
        text.push_str("  interrupted: this is the best found so far\n");
    }
    if let Some(found) = &plan.found {
        text += &of_tool(found);
    }
    if plan.surface_fit_error > 0.0 {
        let _ = writeln!(text, "  planned on a spline that lies within {:.5} mm of the part", plan.surface_fit_error);
    }
    text
}

/// A found tool: what it leaves, and what its maker needs to know.
fn of_tool(found: &FoundTool) -> String {
    let mut text = String::from("tool        found, see its files\n");
    for line in fact_lines(&found.tool) {
        let _ = writeln!(text, "  {line}");
    }
    for (i, sweep) in found.sweeps.iter().enumerate() {
        let _ = writeln!(
            text,
            "  sweep {i:<3} covers {:.2} % of its band, {:.2} % within tolerance, root mean square error {:.6} mm",
            sweep.covered * 100.0,
            sweep.within * 100.0,
            sweep.rms
        );
        if let Some([(low, high), (start, end)]) = sweep.patch.filter(|_| sweep.within < 1.0) {
            let _ = writeln!(
                text,
                "  largest rectangle within tolerance: {low:.3} to {high:.3} across, {start:.3} to {end:.3} along the cut"
            );
        }
    }
    text
}

/// The program as written.
pub(super) fn of_program(posted: &Posted) -> String {
    let mut text = format!(
        "program     {} moves, flank within {:.5} mm of the tool path between blocks\n",
        posted.moves, posted.linearization
    );
    if let Some(first) = posted.slowed.first() {
        let _ = writeln!(
            text,
            "  feed words lower the speed of {} moves, the first on line {first}: {:.2} s in all",
            posted.slowed.len(),
            posted.lost
        );
    }
    text
}

/// Figures and verdict.
pub(super) fn of_verdict(record: &Verification) -> String {
    let (deviation, strips, program) = (&record.deviation, &record.strips, &record.program);
    let mut text = format!(
        "overcut     {:.5} mm, allowed {}\nundercut    {:.5} mm, allowed {}\n",
        deviation.overcut_max_mm, deviation.tolerance.overcut, deviation.undercut_max_mm, deviation.tolerance.undercut
    );
    let _ = writeln!(
        text,
        "area        {:.2} % within tolerance, {:.2} % reached by no pass, {} samples",
        deviation.within_tolerance_share * 100.0,
        deviation.uncut_share * 100.0,
        deviation.samples
    );
    let _ = writeln!(
        text,
        "strips      {}, kink at most {:.3} deg, mean {:.3} deg, step at most {:.5} mm",
        strips.count, strips.kink_max_deg, strips.kink_mean_deg, strips.gap_max_mm
    );
    let _ = writeln!(
        text,
        "blocks      {}, {:.1} s, {:.1} mm at a feed, at most {:.1} blocks/s",
        program.blocks, program.duration_s, program.cut_length_mm, program.max_block_rate_hz
    );
    if let Some(trip) = &record.round_trip {
        let _ = writeln!(
            text,
            "round trip  tip within {:.5} mm, axis within {:.5} deg of the tool path",
            trip.tip_max_mm, trip.axis_max_deg
        );
    }
    let _ = writeln!(text, "limits      {} passed, {} collisions", record.limits.len(), record.collisions.len());
    let verdict = if record.verdict == Verdict::Pass { "pass" } else { "fail" };
    let _ = writeln!(text, "verdict     {verdict}");
    for reason in record.reasons.iter().take(REASONS) {
        let _ = writeln!(text, "  {reason}");
    }
    if record.reasons.len() > REASONS {
        let _ = writeln!(text, "  and {} more in the JSON", record.reasons.len() - REASONS);
    }
    text
}
