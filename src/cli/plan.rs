//! `regulus plan`: the tool path of a job.

use super::files::Outputs;
use super::inputs::job_inputs;
use super::tools::tool_files;
use super::{Outcome, Refusal, Terminal, summary, watch};
use crate::motion;
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub(super) struct Arguments {
    /// The job file
    job: PathBuf,
    /// Write the tool path here, and a found tool's files beside it
    #[arg(long, value_name = "PATH.cl")]
    out: PathBuf,
}

pub(super) fn run(arguments: &Arguments, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    let inputs = job_inputs(&arguments.job, None, terminal)?;
    let plan = watch::plan(&inputs, terminal)?;
    let mut outputs = Outputs::default();
    outputs.add(arguments.out.clone(), motion::cl::write(&plan.path)?);
    if let Some(found) = &plan.found {
        tool_files(&mut outputs, &inputs, found, &arguments.out.with_extension("tool"));
    }
    outputs.write()?;
    terminal.print(&summary::of_plan(&plan));
    Ok(Outcome::Good)
}
