//! `regulus verify`: what any program leaves of a job's part; without a job, what its machine makes of it.

use super::files::{Outputs, read_program, read_text};
use super::inputs::{job_inputs, machine_file};
use super::{Outcome, Refusal, Terminal, summary};
use crate::diagnostic::Diagnostic;
use crate::job::read_tool;
use crate::nc::{FindingCode, GROUPS};
use crate::pipeline::{CheckRequest, InputFile, Judging, check, doubts, judge, page, to_json};
use crate::report::{junit, sarif};
use crate::simulate::OwnTool;
use crate::verify::{FindingRecord, Verdict};
use clap::Args;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What `--explain` takes for the whole catalogue.
const EVERYTHING: &str = "all";

#[derive(Args)]
pub(super) struct Arguments {
    /// The NC program, whoever wrote it
    #[arg(required_unless_present = "explain")]
    program: Option<PathBuf>,
    /// Name of a machine that comes along, or path of a machine file
    #[arg(long, value_name = "M.toml", required_unless_present = "explain")]
    machine: Option<String>,
    /// The job: part, tool, tolerance and work offset; left out, the program is judged by its machine alone
    #[arg(long, value_name = "JOB.toml")]
    job: Option<PathBuf>,
    /// The tool, from a file as `run` writes it, in place of the job's; needed where the planner found the job's tool
    #[arg(long, value_name = "T.toml", requires = "job")]
    tool: Option<PathBuf>,
    /// Number of the tool's length offset in the control's table, where that is not the tool's own
    #[arg(long, value_name = "N", requires = "job")]
    length_offset: Option<u32>,
    /// Without a job: tip to gauge line of the tool, mm; bodies of the machine are followed where it is given
    #[arg(long, value_name = "MM", default_value_t = 0.0, conflicts_with = "job")]
    gauge_length: f64,
    /// Without a job: work offset that the part stands at; the machine file's first when left out
    #[arg(long, value_name = "G54", conflicts_with = "job")]
    work_offset: Option<String>,
    /// Write the figures here
    #[arg(long, value_name = "V.json")]
    json: Option<PathBuf>,
    /// Write the findings here as SARIF 2.1.0, for annotations; also where there is no verdict
    #[arg(long, value_name = "S.sarif")]
    sarif: Option<PathBuf>,
    /// Write the findings here as JUnit's XML, a test case a rule; also where there is no verdict
    #[arg(long, value_name = "J.xml")]
    junit: Option<PathBuf>,
    /// Judge the program although some of its text is not known
    #[arg(long)]
    despite_unknown: bool,
    /// Prove upper bounds of overcut and undercut between the samples, too; takes several times as long
    #[arg(long, requires = "job")]
    bounds: bool,
    /// Say what the machine's own tolerances, `[tolerances]` of the machine file, change on the part
    #[arg(long, requires = "job")]
    uncertainty: bool,
    /// Write the report here, as `run` does
    #[arg(long, value_name = "R.html", requires = "job")]
    report: Option<PathBuf>,
    /// Distance of neighbouring samples of the part, mm; about 20,000 over its area when left out. Between them it is
    /// refined where it matters
    #[arg(long, value_name = "MM", requires = "job", value_parser = spacing)]
    spacing: Option<f64>,
    /// Say what a rule is about, by its code or name; with none, list all rules
    #[arg(long, value_name = "CODE", num_args = 0..=1, default_missing_value = EVERYTHING, exclusive = true)]
    explain: Option<String>,
}

/// A distance between samples.
fn spacing(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "write a number of millimetres".to_owned())?;
    let range = 1e-3..=1e3;
    if range.contains(&value) { Ok(value) } else { Err("write a distance from 0.001 to 1000 mm".to_owned()) }
}

/// What a judgement leaves for people and files.
struct Judgement {
    verdict: Verdict,
    text: String,
    json: String,
    /// The report, where one is wanted.
    page: Option<String>,
    findings: Vec<FindingRecord>,
}

pub(super) fn run(arguments: &Arguments, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    if let Some(code) = &arguments.explain {
        terminal.print(&explain(code)?);
        return Ok(Outcome::Good);
    }
    let (Some(path), Some(machine)) = (&arguments.program, &arguments.machine) else {
        return Err(Diagnostic::error("nothing to verify").help("name a program and its machine").into());
    };
    let bytes = read_program(path)?;
    let name = path.display().to_string();
    let program = InputFile { name: &name, bytes: &bytes };
    let judged = match &arguments.job {
        Some(job) => with_job(arguments, program, machine, job, terminal),
        None => alone(arguments, program, machine),
    }?;
    let (findings, judged) = match judged {
        Ok(judgement) => (judgement.findings.clone(), Ok(judgement)),
        Err((findings, refusal)) => (findings, Err(refusal)),
    };
    let mut outputs = Outputs::default();
    if let Some(path) = &arguments.sarif {
        outputs.add(path.clone(), sarif(&findings, &name, &bytes));
    }
    if let Some(path) = &arguments.junit {
        outputs.add(path.clone(), junit(&findings, &name));
    }
    if let (Some(path), Ok(judgement)) = (&arguments.json, &judged) {
        outputs.add(path.clone(), judgement.json.as_str());
    }
    if let (Some(path), Ok(Judgement { page: Some(page), .. })) = (&arguments.report, &judged) {
        outputs.add(path.clone(), page.as_str());
    }
    outputs.write()?;
    let judgement = judged.map_err(Refusal)?;
    terminal.print(&judgement.text);
    Ok(Outcome::of(judgement.verdict))
}

/// A judgement; or where there can be none, what was found, and why.
type Judged = Result<Judgement, (Vec<FindingRecord>, Vec<Diagnostic>)>;

fn with_job(
    arguments: &Arguments,
    program: InputFile<'_>,
    machine: &str,
    job: &Path,
    terminal: &mut Terminal,
) -> Result<Judged, Refusal> {
    let mut inputs = job_inputs(job, Some(machine), terminal)?;
    if let Some(path) = &arguments.tool {
        inputs = inputs.with_tool(read_tool(&read_text(path)?, &path.display().to_string())?);
    }
    terminal.progress("verifying");
    let how = Judging {
        despite_unknown_text: arguments.despite_unknown,
        bounds: arguments.bounds,
        length_offset: arguments.length_offset,
        spacing: arguments.spacing,
        uncertainty: arguments.uncertainty,
    };
    if arguments.uncertainty && inputs.machine.tolerances.is_none() {
        return Err(Diagnostic::error(format!("machine {} gives no tolerances", inputs.machine.name))
            .in_file(machine)
            .help("write [tolerances] into the machine file: pivot in mm, direction and angle in degrees")
            .into());
    }
    let tool = inputs.tool()?;
    let refusal = match judge(&inputs, program, None, &how) {
        Ok(judged) => {
            let record = &judged.verified.record;
            return Ok(Ok(Judgement {
                verdict: record.verdict,
                text: summary::of_verdict(record),
                json: to_json(record)?,
                page: match arguments.report {
                    Some(_) => Some(page(&inputs, None, &judged, &String::from_utf8_lossy(program.bytes))?),
                    None => None,
                },
                findings: record.findings.clone(),
            }));
        }
        Err(refusal) => refusal,
    };
    let checked = check(&CheckRequest {
        program,
        machine: &inputs.machine,
        work_offset: Some(&inputs.job.machine.work_offset),
        gauge_length: tool.gauge_length(),
        tool: Some(OwnTool { number: tool.number, length_offset: arguments.length_offset.unwrap_or(tool.number) }),
        despite_unknown_text: arguments.despite_unknown,
    })?;
    Ok(Err((checked.record.findings, refusal)))
}

fn alone(arguments: &Arguments, program: InputFile<'_>, machine: &str) -> Result<Judged, Refusal> {
    let machine = machine_file(machine, Path::new(""))?.machine;
    let checked = check(&CheckRequest {
        program,
        machine: &machine,
        work_offset: arguments.work_offset.as_deref(),
        gauge_length: arguments.gauge_length,
        tool: None,
        despite_unknown_text: arguments.despite_unknown,
    })?;
    let doubts = if arguments.despite_unknown { Vec::new() } else { doubts(&checked.motion, program) };
    if !doubts.is_empty() {
        return Ok(Err((checked.record.findings, doubts)));
    }
    let record = checked.record;
    Ok(Ok(Judgement {
        verdict: record.verdict,
        text: summary::of_machine_verdict(&record),
        json: to_json(&record)?,
        page: None,
        findings: record.findings,
    }))
}

/// A rule in words, or all of them.
fn explain(code: &str) -> Result<String, Refusal> {
    let mut text = String::new();
    if code == EVERYTHING {
        for (digit, group) in GROUPS {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "R{digit}xx {group}");
            let of_group = |code: &&FindingCode| code.id().chars().nth(1) == Some(digit);
            for rule in FindingCode::ALL.iter().filter(of_group).map(|code| code.rule()) {
                let _ =
                    writeln!(text, "  {} {:<22} {:<6} {}", rule.id, rule.name, rule.weight.name(), rule.explanation);
            }
        }
        text.push_str(
            "\ndoubt: no verdict, what the control does is not certain; fault: the program fails; notice: to know\n",
        );
        return Ok(text);
    }
    let Some(rule) = FindingCode::find(code).map(FindingCode::rule) else {
        return Err(Diagnostic::error(format!("no rule is called \"{code}\""))
            .help("give a code or a name of those that `regulus verify --explain` lists")
            .into());
    };
    let _ = writeln!(text, "{} {}, {}\n{}\n{}", rule.id, rule.name, rule.weight.name(), rule.explanation, rule.remedy);
    Ok(text)
}
