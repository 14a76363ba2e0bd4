//! Results in a few lines for people.

use crate::feed::{AxisLimit, Limiter};
use crate::job::fact_lines;
use crate::machine::Choice;
use crate::pipeline::Posted;
use crate::plan::meridian::{FoundTool, Seed};
use crate::plan::{Plan, RajainFigures, StripReport};
use crate::verify::{
    FindingRecord, MachineVerification, ParameterRecord, ProgramRecord, StockRecord, UncertaintyRecord, Verdict,
    Verification,
};
use std::fmt::Write;

/// Findings that are shown one by one.
const FINDINGS: usize = 20;
/// Reasons that are shown one by one.
const REASONS: usize = 10;
/// Reasons for slowness that are shown.
const LOSSES: usize = 5;

/// The strips as planned.
pub(super) fn of_plan(plan: &Plan) -> String {
    let mut text = format!("plan        {} strips, {} passes\n", plan.strips.len(), plan.path.passes.len());
    for (i, strip) in plan.strips.iter().enumerate() {
        text.push_str(&of_strip(i, strip));
    }
    if plan.tool.is_some() {
        let _ = writeln!(text, "  found tool: {}, see its files", plan.path.tool.description);
    }
    if let Some(figures) = &plan.rajain {
        text.push_str(&of_rajain(figures));
    }
    if plan.interrupted {
        text.push_str("  interrupted: this is the best found so far\n");
    }
    if let Some(found) = &plan.found {
        text += &of_tool(found);
    }
    if let Some(attainable) = &plan.attainable {
        let (worst, mean) = (attainable.worst(), attainable.mean());
        let _ = writeln!(
            text,
            "  attainable by the flank's curvature: two-sided {worst:.5} mm at the worst place, {mean:.5} mm in the mean"
        );
    }
    if plan.surface_fit_error > 0.0 {
        let _ = writeln!(text, "  planned on a spline that lies within {:.5} mm of the part", plan.surface_fit_error);
    }
    for reason in &plan.verdict.reasons {
        let _ = writeln!(text, "  misses the tolerance: {reason}");
    }
    for help in &plan.verdict.help {
        let _ = writeln!(text, "  would help: {help}");
    }
    text
}

fn of_strip(index: usize, strip: &StripReport) -> String {
    let deviation = &strip.deviation;
    let mut text = format!(
        "  strip {:<3} {:.1} mm long, {:.2} mm wide, planned overcut {:.5} mm, undercut {:.5} mm",
        index + 1,
        strip.length,
        strip.engagement,
        deviation.overcut,
        deviation.undercut
    );
    if deviation.outside > 0.0 {
        let _ = write!(text, ", {:.5} mm beside it", deviation.outside);
    }
    if let Some(seam) = &strip.seam {
        let _ = write!(text, ", kink to the next {:.3} deg, mean {:.3}", seam.kink_max_deg, seam.kink_mean_deg);
    }
    let _ = writeln!(text, ", {} steps; limited by {}", strip.steps, strip.limited_by.words());
    text
}

/// What the method of Rajain 2023 came to, in the paper's measures.
fn of_rajain(figures: &RajainFigures) -> String {
    let ((below, above), (kink, mean)) = (figures.distance_errors, figures.kinks);
    let mut text = format!(
        "  positions {}, samples {}; L {:.5}, r1 {:.5}, r2 {:.5} mm; distance error (R19) {below:.5} below, {above:.5} mm above; angles (R15) differ by {kink:.3} deg, mean {mean:.3}\n",
        figures.positions, figures.heights, figures.length, figures.r1, figures.r2
    );
    let _ = writeln!(
        text,
        "  axis {:.5} to {:.5} mm long at the start, {:.5} to {:.5} mm when optimized, then made rigid; {} positions fail the shank check",
        figures.start_lengths.0, figures.start_lengths.1, figures.lengths.0, figures.lengths.1, figures.colliding
    );
    text
}

/// A found tool: what it leaves, and what its maker needs to know.
fn of_tool(found: &FoundTool) -> String {
    let from = match found.seed {
        Seed::Line => "a line that can move along the part",
        Seed::Surface => "rulings across the part",
    };
    let mut text = format!("tool        found from {from}, see its files\n");
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
        let [(low, high), (start, end)] = sweep.band;
        if found.sweeps.len() > 1 {
            let _ = writeln!(text, "  band: {low:.3} to {high:.3} across, {start:.3} to {end:.3} along the cut");
        }
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
    let Choice { seconds, least, rewinds } = posted.choice;
    let _ = writeln!(
        text,
        "  rotary choice: {seconds:.2} s of ways at the axes' top speeds, no choice can need less than {least:.2} s (proved)"
    );
    if rewinds > 0 {
        let _ = writeln!(text, "  rewinds {rewinds}: there the tool leaves the part while rotary axes turn back");
    }
    let _ = writeln!(text, "feed        {:.1} s", posted.duration);
    for loss in posted.losses.iter().take(LOSSES) {
        let _ = writeln!(text, "  {} costs {:.2} s in {} moves", limiter(loss.limiter), loss.seconds, loss.blocks);
    }
    if let Some(first) = posted.slowed.first() {
        let count = posted.slowed.len();
        let _ = writeln!(text, "  feed words lower the speed of {count} moves, the first on line {first}");
    }
    text
}

/// What holds the feed back, in words.
fn limiter(limiter: Limiter) -> String {
    match limiter {
        Limiter::Feed => "the feed itself".to_owned(),
        Limiter::Flank => "the fastest point of the flutes".to_owned(),
        Limiter::Axis(letter, AxisLimit::Speed) => format!("the speed of {letter}"),
        Limiter::Axis(letter, AxisLimit::Acceleration) => format!("the acceleration of {letter}"),
        Limiter::Axis(letter, AxisLimit::Jerk) => format!("the jerk of {letter}"),
        Limiter::Word => "the feed word".to_owned(),
        Limiter::Rapid => "rapid traverse".to_owned(),
    }
}

/// Figures and verdict.
pub(super) fn of_verdict(record: &Verification) -> String {
    let (deviation, strips, program) = (&record.deviation, &record.strips, &record.program);
    let mut text = format!(
        "overcut     {:.5} mm, allowed {}\nundercut    {:.5} mm, allowed {}\n",
        deviation.overcut_max_mm, deviation.tolerance.overcut, deviation.undercut_max_mm, deviation.tolerance.undercut
    );
    let bounds = [deviation.overcut_bound_mm, deviation.undercut_bound_mm];
    if bounds.iter().any(Option::is_some) {
        let shown = |bound: f64| format!("{bound:.5} mm");
        let [over, under] = bounds.map(|bound| bound.map_or("not shown".to_owned(), shown));
        let _ = writeln!(text, "proved      overcut at most {over}, undercut at most {under}");
    }
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
    text.push_str(&of_size(program));
    if program.blending_mm > 0.0 {
        let (corners, degrees, band) = (program.blending_mm, program.blending_rotary_deg, deviation.blending_band_mm);
        let turned = if degrees > 0.0 {
            format!(", a rotary axis by up to {degrees:.4} deg: {band:.4} mm at the tool")
        } else {
            String::new()
        };
        let _ = writeln!(text, "corners     the program lets the control round them by {corners} mm{turned}");
    }
    if let Some(trip) = &record.round_trip {
        let _ = writeln!(
            text,
            "round trip  tip within {:.5} mm, axis within {:.5} deg of the tool path",
            trip.tip_max_mm, trip.axis_max_deg
        );
    }
    if let Some(stock) = &record.stock {
        text.push_str(&of_stock(stock));
    }
    text.push_str(&of_limits(record.limits.len(), record.collisions.len(), record.near_misses.len()));
    if let Some(uncertainty) = &record.uncertainty {
        text.push_str(&of_uncertainty(uncertainty));
    }
    text + &of_findings(&record.findings) + &of_reasons(record.verdict, &record.reasons)
}

/// What the machine's tolerances change on the part.
fn of_uncertainty(record: &UncertaintyRecord) -> String {
    let (worst, rss) = (record.worst_case_mm, record.rss_mm);
    let mut text =
        format!("machine     {worst:.5} mm at most on the part by its tolerances, {rss:.5} mm as independent errors\n");
    for parameter in &record.parameters {
        let ParameterRecord { name, tolerance, unit, change_max_mm, point_mm: [x, y, z], line } = parameter;
        let _ = writeln!(
            text,
            "  {name}, {tolerance} {unit}: {change_max_mm:.5} mm at ({x:.3}, {y:.3}, {z:.3}), cut by line {line}"
        );
    }
    text
}

/// Figures and verdict of a program on its machine, without a part.
pub(super) fn of_machine_verdict(record: &MachineVerification) -> String {
    let mut text = of_size(&record.program);
    text.push_str(&of_limits(record.limits.len(), record.collisions.len(), record.near_misses.len()));
    text + &of_findings(&record.findings) + &of_reasons(record.verdict, &record.reasons)
}

fn of_limits(limits: usize, collisions: usize, near: usize) -> String {
    let near = if near > 0 { format!(", {near} near misses") } else { String::new() };
    format!("limits      {limits} passed, {collisions} collisions{near}\n")
}

fn of_size(program: &ProgramRecord) -> String {
    format!(
        "blocks      {}, {:.1} s, {:.1} mm at a feed, at most {:.1} blocks/s\n",
        program.blocks, program.duration_s, program.cut_length_mm, program.max_block_rate_hz
    )
}

/// The way through the stock.
pub(super) fn of_stock(stock: &StockRecord) -> String {
    let on = |line: Option<usize>| line.map_or(String::new(), |line| format!(" on line {line}"));
    format!(
        "stock       {:.1} mm³ of {:.1} left, {:.1} taken, {:.1} by rapids, {:.1} by shank and holder; cells of {:.4} mm\n\
         removal     at most {:.3} cm³/min{}, engagement at most {:.0} deg{}, {:.1} % of the time at feed in air\n",
        stock.volume_after_mm3,
        stock.volume_before_mm3,
        stock.removed_mm3,
        stock.removed_by_rapids_mm3,
        stock.removed_by_body_mm3,
        stock.cell_mm,
        stock.removal_max_cm3_min,
        on(stock.removal_max_line),
        stock.engagement_max_deg,
        on(stock.engagement_max_line),
        100.0 * stock.air_share
    )
}

/// What was found, a line each; nothing where nothing was.
pub(super) fn of_findings(findings: &[FindingRecord]) -> String {
    if findings.is_empty() {
        return String::new();
    }
    let errors = findings.iter().filter(|finding| finding.is_error()).count();
    let mut text = format!("findings    {errors} errors, {} warnings\n", findings.len() - errors);
    for finding in findings.iter().take(FINDINGS) {
        let line = finding.line.map_or(String::new(), |line| format!(" line {line}:"));
        let _ = writeln!(text, "  {} {}{line} {}", finding.severity, finding.id, finding.message);
    }
    if findings.len() > FINDINGS {
        let _ = writeln!(text, "  and {} more in the JSON", findings.len() - FINDINGS);
    }
    text
}

fn of_reasons(verdict: Verdict, reasons: &[String]) -> String {
    let mut text = format!("verdict     {}\n", if verdict == Verdict::Pass { "pass" } else { "fail" });
    for reason in reasons.iter().take(REASONS) {
        let _ = writeln!(text, "  {reason}");
    }
    if reasons.len() > REASONS {
        let _ = writeln!(text, "  and {} more in the JSON", reasons.len() - REASONS);
    }
    text
}
