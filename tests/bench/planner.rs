//! The planner's table: what the planned sweeps leave of each benchmark surface, judged without the planner's own eyes,
//! and what planning cost. `cargo bench --bench planner`; words after `--` choose cases whose names hold one of them;
//! `-- scaling` measures how the cost grows instead.

#[path = "planner/cases.rs"]
mod cases;
#[path = "planner/measure.rs"]
mod measure;
#[path = "planner/papers.rs"]
mod papers;
#[path = "planner/scaling.rs"]
mod scaling;

use cases::{Case, all, part};
use measure::{Figures, measure};
use regulus::diagnostic::Diagnostic;
use regulus::motion::FeedReference;
use regulus::plan::{PlanRequest, Unobserved, plan};
use std::io::{Write, stdout};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    if wanted == ["scaling"] {
        return scaling::run();
    }
    let mut out = stdout();
    writeln!(out, "Errors in mm (overcut, undercut of the swept flanks on the whole surface), kink in degrees.")?;
    writeln!(
        out,
        "| {:<38} | {:>9} | {:>9} | {:>6} | {:>8} | {:>6} | {:>7} | {:>7} |",
        "case", "overcut", "undercut", "kink", "area %", "strips", "wall s", "cpu s"
    )?;
    writeln!(out, "|{:-<40}|{:->11}|{:->11}|{:->8}|{:->10}|{:->8}|{:->9}|{:->9}|", "", "", "", "", "", "", "", "")?;
    let is_wanted = |name: &str| wanted.is_empty() || wanted.iter().any(|word| name.contains(word.as_str()));
    for case in all().iter().filter(|case| is_wanted(case.name)) {
        writeln!(out, "| {:<38} | {}", case.name, row(run(case)))?;
        out.flush()?;
    }
    for case in papers::all().iter().filter(|case| is_wanted(case.name)) {
        writeln!(out, "| {:<38} | {}", case.name, row(papers::run(case)))?;
        out.flush()?;
    }
    Ok(())
}

/// The figures of a line, or why there are none.
fn row(result: Result<(Figures, [f64; 2]), Box<Diagnostic>>) -> String {
    match result {
        Ok((figures, [wall, cpu])) => format!(
            "{:>9.7} | {:>9.7} | {:>6.2} | {:>8.3} | {:>6} | {wall:>7.2} | {cpu:>7.2} |",
            figures.overcut,
            figures.undercut,
            figures.kink_deg,
            100.0 * figures.covered,
            figures.strips
        ),
        Err(error) => format!("{error} |"),
    }
}

/// Plans a case; what it came to, and wall and processor seconds of planning.
fn run(case: &Case) -> Result<(Figures, [f64; 2]), Box<Diagnostic>> {
    let part = part(case.surface)?;
    let tool = case.tool().map_err(|e| Diagnostic::error(e.to_string()))?;
    let strategy = case.strategy();
    let request = PlanRequest {
        name: case.name,
        part: &part,
        tool: &tool,
        strategy: &strategy,
        overcut_tolerance: case.tolerance[0],
        undercut_tolerance: case.tolerance[1],
        cut_feed: 600.0,
        feed_reference: FeedReference::Mid,
        spindle_rpm: 8000.0,
        linearization: 0.0,
        observer: &Unobserved,
    };
    let (wall, cpu) = (Instant::now(), processor_seconds());
    let planned = plan(&request)?;
    let spent = [wall.elapsed().as_secs_f64(), processor_seconds() - cpu];
    Ok((measure(&part, &tool, &planned.path)?, spent))
}

/// Processor time of this process so far, s; not a number where the system does not tell.
pub(crate) fn processor_seconds() -> f64 {
    // utime and stime, in hundredths of a second, are the 12th and 13th fields after the name in parentheses.
    let status = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = status.rsplit(')').next().unwrap_or_default().split_whitespace().skip(11).take(2);
    let ticks: Vec<f64> = fields.filter_map(|field| field.parse().ok()).collect();
    if ticks.len() == 2 { (ticks[0] + ticks[1]) / 100.0 } else { f64::NAN }
}
