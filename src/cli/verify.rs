//! `regulus verify`: what any program leaves of a job's part.

use super::files::{Outputs, read_bytes, read_text};
use super::inputs::job_inputs;
use super::{Outcome, Refusal, Terminal, summary};
use crate::job::read_tool;
use crate::pipeline::{InputFile, Judging, judge, to_json};
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub(super) struct Arguments {
    /// The NC program, whoever wrote it
    program: PathBuf,
    /// Name of a machine that comes along, or path of a machine file
    #[arg(long, value_name = "M.toml")]
    machine: String,
    /// The job: part, tool, tolerance and work offset
    #[arg(long, value_name = "JOB.toml")]
    job: PathBuf,
    /// The tool, from a file as `run` writes it, in place of the job's; needed where the planner found the job's tool
    #[arg(long, value_name = "T.toml")]
    tool: Option<PathBuf>,
    /// Write the figures here
    #[arg(long, value_name = "V.json")]
    json: Option<PathBuf>,
    /// Judge the program although some of its text is not known
    #[arg(long)]
    despite_unknown: bool,
    /// Prove upper bounds of overcut and undercut between the samples, too; takes several times as long
    #[arg(long)]
    bounds: bool,
}

pub(super) fn run(arguments: &Arguments, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    let bytes = read_bytes(&arguments.program)?;
    let mut inputs = job_inputs(&arguments.job, Some(&arguments.machine), terminal)?;
    if let Some(path) = &arguments.tool {
        inputs = inputs.with_tool(read_tool(&read_text(path)?, &path.display().to_string())?);
    }
    terminal.progress("verifying");
    let name = arguments.program.display().to_string();
    let how = Judging { despite_unknown_text: arguments.despite_unknown, bounds: arguments.bounds };
    let judged = judge(&inputs, InputFile { name: &name, bytes: &bytes }, None, &how)?;
    let record = &judged.verified.record;
    if let Some(path) = &arguments.json {
        let mut outputs = Outputs::default();
        outputs.add(path.clone(), to_json(record)?);
        outputs.write()?;
    }
    terminal.print(&summary::of_verdict(record));
    Ok(Outcome::of(record.verdict))
}
