//! `regulus plan`: the tool path of a job.

use super::files::Outputs;
use super::inputs::job_inputs;
use super::tools::tool_files;
use super::{Outcome, Refusal, Terminal, summary, watch};
use crate::motion;
use crate::pipeline::{explain, to_json};
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub(super) struct Arguments {
    /// The job file
    job: PathBuf,
    /// Write the tool path here, and a found tool's files beside it
    #[arg(long, value_name = "PATH.cl")]
    out: PathBuf,
    /// Write what each strip came to, and what limits it, here
    #[arg(long, value_name = "PLAN.json")]
    json: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    let inputs = job_inputs(&arguments.job, None, terminal)?;
    let plan = watch::plan(&inputs, terminal)?;
    let mut outputs = Outputs::default();
    outputs.add(arguments.out.clone(), motion::cl::write(&plan.path)?);
    if let Some(tool) = plan.found_tool() {
        tool_files(&mut outputs, &inputs, tool, &arguments.out.with_extension("tool"));
    }
    if let Some(json) = &arguments.json {
        outputs.add(json.clone(), to_json(&explain(&inputs, &plan))?);
    }
    outputs.write()?;
    terminal.print(&summary::of_plan(&plan));
    Ok(if plan.verdict.within_tolerance { Outcome::Good } else { Outcome::Failed })
}
