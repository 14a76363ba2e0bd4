//! `regulus stock`: what a program takes from a job's stock, and what is left of it.

use super::files::{Outputs, read_program, read_text};
use super::inputs::job_inputs;
use super::{Outcome, Refusal, Terminal, summary};
use crate::job::read_tool;
use crate::pipeline::{InputFile, Judging, mill_program, stock_report, to_json};
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub(super) struct Arguments {
    /// The NC program, whoever wrote it
    program: PathBuf,
    /// Name of a machine that comes along, or path of a machine file
    #[arg(long, value_name = "M.toml")]
    machine: String,
    /// The job with its `[stock]` table: box, cylinder, or file of a closed mesh
    #[arg(long, value_name = "JOB.toml")]
    job: PathBuf,
    /// The tool, from a file as `run` writes it, in place of the job's
    #[arg(long, value_name = "T.toml")]
    tool: Option<PathBuf>,
    /// Write what is left here, a closed mesh; the `[stock]` of the next job can name it
    #[arg(long, value_name = "OUT.stl")]
    stl: Option<PathBuf>,
    /// Write figures, findings, and every move's removal and engagement here
    #[arg(long, value_name = "S.json")]
    json: Option<PathBuf>,
    /// Follow the program although some of its text is not known
    #[arg(long)]
    despite_unknown: bool,
}

pub(super) fn run(arguments: &Arguments, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    let bytes = read_program(&arguments.program)?;
    let mut inputs = job_inputs(&arguments.job, Some(&arguments.machine), terminal)?;
    if let Some(path) = &arguments.tool {
        inputs = inputs.with_tool(read_tool(&read_text(path)?, &path.display().to_string())?);
    }
    terminal.progress("cutting");
    let name = arguments.program.display().to_string();
    let how = Judging { despite_unknown_text: arguments.despite_unknown, ..Judging::default() };
    let milled = mill_program(&inputs, InputFile { name: &name, bytes: &bytes }, &how)?;
    let mut outputs = Outputs::default();
    if let Some(path) = &arguments.stl {
        outputs.add(path.clone(), milled.stock.stl());
    }
    if let Some(path) = &arguments.json {
        outputs.add(path.clone(), to_json(&stock_report(&milled))?);
    }
    outputs.write()?;
    terminal.print(&(summary::of_stock(&milled.record) + &summary::of_findings(&milled.findings)));
    let fails = milled.findings.iter().any(crate::verify::FindingRecord::is_error);
    Ok(if fails { Outcome::Failed } else { Outcome::Good })
}
