//! `regulus inspect`: what a program, a tool path or a part file holds.

use super::files::{Outputs, read_bytes, read_text};
use super::inputs::machine_file;
use super::{Outcome, Refusal, Terminal};
use crate::machine::Dialect;
use crate::pipeline::{
    Control, InputFile, Pace, PartSummary, PathSummary, ProgramSummary, inspect_part, inspect_path, inspect_program,
    is_apt, to_json,
};
use clap::Args;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Extensions of part files; everything else is taken for an NC program.
const PART_EXTENSIONS: [&str; 4] = ["json", "csv", "stl", "obj"];
/// Findings that are shown one by one.
const SHOWN: usize = 50;
/// Passages and slow blocks that are shown one by one.
const SLOWEST: usize = 5;

#[derive(Args)]
pub(super) struct Arguments {
    /// An NC program, a tool path (.cl, .apt, .cls, .clsf, .as), or a part file (.json, .csv, .stl, .obj)
    file: PathBuf,
    /// Follow the program on this machine: name of one that comes along, or path of a machine file
    #[arg(long, value_name = "M.toml")]
    machine: Option<String>,
    /// Dialect to read the program in when no machine is given
    #[arg(long, value_name = "NAME", conflicts_with = "machine", value_parser = dialect)]
    dialect: Option<Dialect>,
    /// Tip to gauge line of the tool to follow it with, mm
    #[arg(long, value_name = "MM", default_value_t = 0.0, requires = "machine")]
    gauge_length: f64,
    /// Write the summary here as JSON
    #[arg(long, value_name = "I.json")]
    json: Option<PathBuf>,
}

fn dialect(name: &str) -> Result<Dialect, String> {
    let known = Dialect::ALL.iter().find(|(_, known)| *known == name).map(|(dialect, _)| *dialect);
    known.ok_or_else(|| format!("known are {}", Dialect::ALL.map(|(_, known)| known).join(", ")))
}

pub(super) fn run(arguments: &Arguments, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    let bytes = read_bytes(&arguments.file)?;
    let name = arguments.file.display().to_string();
    let file = InputFile { name: &name, bytes: &bytes };
    let extension = arguments.file.extension().map(|e| e.to_string_lossy().to_lowercase());
    let is_path = is_apt(&name) || extension.as_deref() == Some("cl");
    let is_part = extension.is_some_and(|e| PART_EXTENSIONS.contains(&e.as_str()));
    let (text, json) = if is_part {
        let summary = inspect_part(file)?;
        (describe_part(&summary), to_json(&summary)?)
    } else if is_path {
        let (summary, messages) = inspect_path(&read_text(&arguments.file)?, &name)?;
        for message in messages.iter().take(SHOWN) {
            terminal.complain(message);
        }
        (describe_path(&summary), to_json(&summary)?)
    } else {
        let machine = arguments.machine.as_deref().map(|given| machine_file(given, Path::new(""))).transpose()?;
        let machine = machine.as_ref().map(|found| &found.machine);
        let control = match machine {
            Some(machine) => Control::Machine { machine, gauge_length: arguments.gauge_length },
            None => Control::Dialect(arguments.dialect.unwrap_or(Dialect::LinuxCnc)),
        };
        let (summary, messages) = inspect_program(file, &control)?;
        for message in messages.iter().take(SHOWN) {
            terminal.complain(message);
        }
        (describe_program(&summary), to_json(&summary)?)
    };
    if let Some(path) = &arguments.json {
        let mut outputs = Outputs::default();
        outputs.add(path.clone(), json);
        outputs.write()?;
    }
    terminal.print(&text);
    Ok(Outcome::Good)
}

fn describe_part(summary: &PartSummary) -> String {
    let mut text = format!("{}: {}\n", summary.file, summary.form);
    let size: Vec<_> = summary.high.iter().zip(summary.low).map(|(high, low)| format!("{:.3}", high - low)).collect();
    let _ = writeln!(text, "size        {} mm, from {:.3?} to {:.3?}", size.join(" x "), summary.low, summary.high);
    let _ = writeln!(text, "area        {:.3} mm^2", summary.area_mm2);
    if let (Some([p, q]), Some([m, n])) = (summary.degree, summary.control) {
        let rational = if summary.rational == Some(true) { ", rational" } else { "" };
        let _ = writeln!(text, "spline      degree {p} x {q}, {m} x {n} control points{rational}");
    }
    if let (Some(vertices), Some(triangles)) = (summary.vertices, summary.triangles) {
        let _ = writeln!(text, "mesh        {vertices} vertices, {triangles} triangles");
    }
    text
}

fn describe_program(summary: &ProgramSummary) -> String {
    let moves = summary.moves;
    let mut text = format!("{}: {} program\n", summary.file, summary.dialect);
    let _ = writeln!(text, "lines       {}, blocks {}", summary.lines, summary.blocks);
    let _ = writeln!(text, "moves       {} rapid, {} straight, {} arcs", moves.rapid, moves.line, moves.arc);
    if !summary.tools.is_empty() {
        let tools: Vec<_> = summary.tools.iter().map(|t| format!("T{t}")).collect();
        let _ = writeln!(text, "tools       {}", tools.join(", "));
    }
    let _ = writeln!(text, "TCP         {}", if summary.tcp { "turned on" } else { "not turned on" });
    for (letter, extent) in &summary.extents {
        let _ = writeln!(text, "words {letter}     {:.4} to {:.4}", extent.min, extent.max);
    }
    if let (Some(machine), Some(motion)) = (&summary.machine, &summary.motion) {
        let _ = writeln!(
            text,
            "on {machine}: {:.1} s, {:.1} mm at a feed",
            motion.program.duration_s, motion.program.cut_length_mm
        );
        for (letter, axis) in &motion.axes {
            let unit = if "ABC".contains(*letter) { "deg" } else { "mm" };
            let _ = writeln!(
                text,
                "axis {letter}      {:.4} to {:.4} {unit}, way {:.1} {unit}, up to {:.2} {unit}/s and {:.1} {unit}/s^2",
                axis.min, axis.max, axis.travel, axis.max_rate, axis.max_accel
            );
        }
        let _ = writeln!(text, "limits      {} passed", motion.limits.len());
        describe_pace(&mut text, &motion.pace);
    }
    let findings = summary.findings.len() + summary.findings_omitted;
    let shown = if findings > SHOWN { format!(", of which the first {SHOWN} are shown") } else { String::new() };
    let _ = writeln!(text, "findings    {findings}{shown}");
    text
}

fn describe_pace(text: &mut String, pace: &Pace) {
    let _ = writeln!(text, "passages    {} at a feed, {:.1} s of rapids", pace.passages.len(), pace.rapid_s);
    let mut longest: Vec<_> = pace.passages.iter().collect();
    longest.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    for passage in longest.iter().take(SLOWEST) {
        let (load, [first, last]) = (&passage.busiest, passage.lines);
        let _ = writeln!(
            text,
            "  lines {first} to {last}: {:.2} s, {:.1} mm, mean {:.0}, usually {:.0} mm/min, {}",
            passage.seconds,
            passage.length_mm,
            passage.mean_feed,
            passage.usual_feed,
            load.words()
        );
    }
    for (cause, seconds) in &pace.lost_s {
        let cause = match cause.as_str() {
            "programmed" => "as programmed".to_owned(),
            "block-rate" => "by the control's block rate".to_owned(),
            letter => format!("by axis {letter}"),
        };
        let _ = writeln!(text, "slower      {seconds:.2} s against the usual feed of each passage, {cause}");
    }
    for slow in pace.slowest.iter().take(SLOWEST) {
        let [first, last] = slow.lines;
        let _ = writeln!(
            text,
            "  lines {first} to {last}: down to {:.0} of {:.0} mm/min, {:.3} s more, {}",
            slow.feed,
            slow.usual_feed,
            slow.lost_s,
            slow.busiest.words()
        );
    }
}

fn describe_path(summary: &PathSummary) -> String {
    let mut text =
        format!("{}: {} tool path {}\nlines       {}\n", summary.file, summary.form, summary.name, summary.lines);
    for (index, operation) in summary.operations.iter().enumerate() {
        let duration = operation.feed_s.map_or(String::new(), |seconds| format!(" in {seconds:.1} s"));
        let tool = operation.tool.map_or("no tool".to_owned(), |tool| format!("tool {tool}"));
        let _ = writeln!(
            text,
            "operation {} {tool}: {} places, {:.1} mm at a feed{duration}, {:.1} mm rapid, tilt up to {:.3} deg",
            index + 1,
            operation.places,
            operation.feed_length_mm,
            operation.rapid_length_mm,
            operation.tilt_max_deg
        );
        let _ = writeln!(text, "  tip from {:.3?} to {:.3?}", operation.low, operation.high);
    }
    let shown =
        if summary.findings.len() > SHOWN { format!(", of which the first {SHOWN} are shown") } else { String::new() };
    let _ = writeln!(text, "findings    {}{shown}", summary.findings.len());
    text
}
