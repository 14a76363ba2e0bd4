//! What there is to know about a file without a job: an NC program's blocks, axes, time, extents and findings; a part
//! file's size and form.

use super::InputFile;
use super::pace::{Pace, pace};
use crate::diagnostic::{Diagnostic, Result, Severity};
use crate::machine::{Dialect, DialectOptions, Machine, Setup};
use crate::nc::program::{AXIS_LETTERS, Change, Frame, Way};
use crate::nc::{self, Findings, Program, Rules};
use crate::part::{DesignSurface, ReadOptions};
use crate::simulate::{LimitViolation, ToolMotion, simulate};
use crate::verify::{AxisRecord, ProgramRecord, by_letter};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Format and version of the JSON that both summaries become.
pub(super) const FORMAT: (&str, u32) = ("regulus-inspect", 1);

/// An NC program in figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProgramSummary {
    format: &'static str,
    version: u32,
    kind: &'static str,
    /// Name of the file.
    pub file: String,
    /// The dialect that it was read as.
    pub dialect: &'static str,
    /// The machine that it was followed on.
    pub machine: Option<String>,
    /// Lines up to the end of the program.
    pub lines: usize,
    /// Lines with at least one word.
    pub blocks: usize,
    /// Number of rapid moves, straight feed moves and arcs.
    pub moves: MoveCounts,
    /// Tools that are put into the spindle, ascending.
    pub tools: Vec<u32>,
    /// Whether TCP is turned on anywhere.
    pub tcp: bool,
    /// Lowest and highest word of each axis in work coordinates, mm and degrees.
    pub extents: BTreeMap<char, Extent>,
    /// What the machine does, where one was given.
    pub motion: Option<MotionSummary>,
    /// Everything remarkable, in the order of the text.
    pub findings: Vec<FindingSummary>,
    /// Findings that were only counted.
    pub findings_omitted: usize,
}

/// How many moves of each way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MoveCounts {
    /// G0.
    pub rapid: usize,
    /// G1.
    pub line: usize,
    /// G2 and G3.
    pub arc: usize,
}

/// Lowest and highest value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Extent {
    /// Lowest.
    pub min: f64,
    /// Highest.
    pub max: f64,
}

/// A program on a machine.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MotionSummary {
    /// Its size.
    pub program: ProgramRecord,
    /// What each axis does, under its letter, in the machine's order.
    #[serde(serialize_with = "by_letter")]
    pub axes: Vec<(char, AxisRecord)>,
    /// Every limit that is passed.
    pub limits: Vec<LimitViolation>,
    /// Where the time goes.
    pub pace: Pace,
}

/// A finding in a program.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FindingSummary {
    /// Line, from 1.
    pub line: usize,
    /// `warning`, or `error` where no verdict can rest on the program.
    pub severity: &'static str,
    /// Stable name of the rule.
    pub code: &'static str,
    /// What is wrong.
    pub message: String,
    /// What to write instead.
    pub help: String,
}

/// A part file in figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartSummary {
    format: &'static str,
    version: u32,
    kind: &'static str,
    /// Name of the file.
    pub file: String,
    /// `spline` or `mesh`.
    pub form: &'static str,
    /// Lowest corner of the box that holds it, mm.
    pub low: [f64; 3],
    /// Highest corner, mm.
    pub high: [f64; 3],
    /// Area, mm^2.
    pub area_mm2: f64,
    /// Degree along u and v of a spline.
    pub degree: Option<[usize; 2]>,
    /// Control points along u and v of a spline.
    pub control: Option<[usize; 2]>,
    /// Whether a spline has weights.
    pub rational: Option<bool>,
    /// Vertices of a mesh.
    pub vertices: Option<usize>,
    /// Triangles of a mesh.
    pub triangles: Option<usize>,
}

/// Whose rules a program is read by.
#[derive(Clone, Copy, Debug)]
pub enum Control<'a> {
    /// Those of a dialect; the program is not followed.
    Dialect(Dialect),
    /// Those of a machine's control; the program is followed on it.
    Machine {
        /// The machine.
        machine: &'a Machine,
        /// Tip to gauge line of the tool, mm.
        gauge_length: f64,
    },
}

/// Reads a program, and follows it where there is a machine. Returns the findings as messages too; in a mere inspection
/// all of them are warnings.
pub fn inspect_program(file: InputFile<'_>, control: &Control<'_>) -> Result<(ProgramSummary, Vec<Diagnostic>)> {
    let (rules, dialect) = match control {
        Control::Machine { machine, .. } => (Rules::of(machine), machine.control.dialect),
        Control::Dialect(dialect) => (Rules::new(*dialect, &DialectOptions::of(*dialect), &[]), *dialect),
    };
    let program = nc::read(file.bytes, &rules);
    let (machine, motion) = match control {
        Control::Machine { machine, gauge_length } => (Some(machine), Some(follow(&program, machine, *gauge_length)?)),
        Control::Dialect(_) => (None, None),
    };
    let findings = motion.as_ref().map_or(&program.findings, ToolMotion::findings);
    let summary = ProgramSummary {
        format: FORMAT.0,
        version: FORMAT.1,
        kind: "program",
        file: file.name.to_owned(),
        dialect: dialect.name(),
        machine: machine.map(|machine| machine.name.clone()),
        lines: program.lines,
        blocks: program.blocks,
        moves: count(&program),
        tools: tools(&program),
        tcp: program.changes.iter().any(|c| c.change == Change::Tcp(true)),
        extents: extents(&program),
        motion: motion.as_ref().map(summarize),
        findings: list(findings),
        findings_omitted: findings.omitted(),
    };
    let messages = findings.list().iter().map(|finding| {
        let mut message = *finding.diagnostic(file.name, file.bytes);
        message.severity = Severity::Warning;
        message
    });
    let messages = messages.collect();
    Ok((summary, messages))
}

fn follow(program: &Program, machine: &Machine, tool_length: f64) -> Result<ToolMotion> {
    let offset = machine.control.work_offsets.first().map_or([0.0; 3], |offset| offset.linear);
    Ok(simulate(program, &Setup::at(machine, offset, tool_length)?, None))
}

fn count(program: &Program) -> MoveCounts {
    let mut counts = MoveCounts::default();
    for step in &program.moves {
        match step.way {
            Way::Rapid => counts.rapid += 1,
            Way::Line(_) => counts.line += 1,
            Way::Arc(..) => counts.arc += 1,
        }
    }
    counts
}

fn tools(program: &Program) -> Vec<u32> {
    let tools = program.changes.iter().filter_map(|c| match c.change {
        Change::Tool(number) => Some(number),
        _ => None,
    });
    tools.collect::<BTreeSet<_>>().into_iter().collect()
}

fn extents(program: &Program) -> BTreeMap<char, Extent> {
    let mut extents: BTreeMap<char, Extent> = BTreeMap::new();
    for step in program.moves.iter().filter(|step| step.frame == Frame::Work) {
        for (index, (letter, value)) in AXIS_LETTERS.iter().zip(step.target).enumerate() {
            if step.given.has(index) && !step.incremental.has(index) {
                let extent = extents.entry(*letter).or_insert(Extent { min: value, max: value });
                *extent = Extent { min: extent.min.min(value), max: extent.max.max(value) };
            }
        }
    }
    extents
}

fn summarize(motion: &ToolMotion) -> MotionSummary {
    let report = motion.axis_report();
    let (program, pace) = (ProgramRecord::of(motion), pace(motion));
    MotionSummary { program, axes: AxisRecord::all(&report), limits: report.limits, pace }
}

fn list(findings: &Findings) -> Vec<FindingSummary> {
    let one = |finding: &nc::Finding| FindingSummary {
        line: finding.line,
        severity: match finding.severity {
            Severity::Warning => "warning",
            Severity::Error => "error",
        },
        code: finding.code.name(),
        message: finding.message.clone(),
        help: finding.help.clone(),
    };
    findings.list().iter().map(one).collect()
}

/// Reads a part file as it is, without placement; numbers of files that name no unit are taken as millimetres.
pub fn inspect_part(file: InputFile<'_>) -> Result<PartSummary> {
    let surface = crate::part::read(file.bytes, file.name, &ReadOptions::default())?;
    let bounds = surface.bounds();
    let mut summary = PartSummary {
        format: FORMAT.0,
        version: FORMAT.1,
        kind: "part",
        file: file.name.to_owned(),
        form: "mesh",
        low: bounds.low.into(),
        high: bounds.high.into(),
        area_mm2: surface.area(),
        degree: None,
        control: None,
        rational: None,
        vertices: None,
        triangles: None,
    };
    match &surface {
        DesignSurface::Spline(spline) => {
            let (u, v) = (spline.surface().knots_u(), spline.surface().knots_v());
            summary.form = "spline";
            summary.degree = Some([u.degree(), v.degree()]);
            summary.control = Some([u.controls(), v.controls()]);
            summary.rational = Some(spline.surface().weights().is_some());
        }
        DesignSurface::Mesh(_) | DesignSurface::Curved(_) => {
            summary.vertices = surface.mesh().map(|mesh| mesh.vertices().len());
            summary.triangles = surface.mesh().map(|mesh| mesh.triangles().len());
        }
    }
    Ok(summary)
}

/// A summary as JSON text.
pub fn to_json(summary: &impl Serialize) -> Result<String> {
    let mut text = serde_json::to_string_pretty(summary)
        .map_err(|e| Diagnostic::error(format!("the summary cannot be written as JSON: {e}")))?;
    text.push('\n');
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PROGRAM: &str =
        "%\nG21 G90 G94\nT3 M6\nS8000 M3\nG0 X0 Y0 Z50 A0 C0\nG1 Z-10 F600\nX100 C90\nG2 X0 Y0 I-50 J0\nM5\nM30\n%\n";

    fn program(text: &str, machine: Option<&Machine>) -> (ProgramSummary, Vec<Diagnostic>) {
        let control = match machine {
            Some(machine) => Control::Machine { machine, gauge_length: 100.0 },
            None => Control::Dialect(Dialect::LinuxCnc),
        };
        inspect_program(InputFile { name: "p.ngc", bytes: text.as_bytes() }, &control).unwrap()
    }

    #[test]
    fn a_program_is_summed_up_without_a_machine() {
        let (summary, _) = program(PROGRAM, None);
        assert_eq!(summary.moves, MoveCounts { rapid: 1, line: 2, arc: 1 });
        assert_eq!(summary.tools, [3]);
        assert_eq!(summary.extents[&'X'], Extent { min: 0.0, max: 100.0 });
        assert_eq!(summary.extents[&'Z'], Extent { min: -10.0, max: 50.0 });
        assert!(!summary.extents.contains_key(&'B'));
        assert_eq!(summary.motion, None);
    }

    #[test]
    fn on_a_machine_time_and_axes_come_along() {
        let machine = Machine::named("xyzac-trt").unwrap();
        let text = PROGRAM.replace("T3 M6", "T3 M6 G43\nM429");
        let (summary, _) = program(&text, Some(&machine));
        let motion = summary.motion.unwrap();
        assert_eq!(motion.axes.iter().map(|(letter, _)| *letter).collect::<String>(), "XYZAC");
        assert!((motion.axes[4].1.max - 90.0).abs() < 1e-9);
        // 60 mm down and 100 mm across at 600 mm/min are 16 s; the arc and the rapid take more.
        assert!(motion.program.duration_s > 16.0, "{motion:?}");
    }

    #[test]
    fn unknown_codes_are_warnings_with_their_place() {
        let (summary, messages) = program("G21 G90\nG777 X1\nM30\n", None);
        let unknown = summary.findings.iter().find(|f| f.code == "unknown-code").unwrap();
        assert_eq!((unknown.line, unknown.severity), (2, "error"));
        let message = messages.iter().find(|m| m.message.contains("unknown-code")).unwrap();
        assert_eq!(message.severity, Severity::Warning);
        assert_eq!(message.source_line.as_deref(), Some("G777 X1"));
    }
}
