//! `regulus run`: the main job from the job file to the report.

use super::files::Outputs;
use super::inputs::job_inputs;
use super::tools::tool_files;
use super::{Outcome, Refusal, Terminal, summary, watch};
use crate::motion::cl;
use crate::pipeline::{self, InputFile, to_json};
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub(super) struct Arguments {
    /// The job file
    job: PathBuf,
    /// Write path.cl, the program, plan.json, post.json, verify.json, report.html and a found tool's files here
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
}

pub(super) fn run(arguments: &Arguments, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    let mut inputs = job_inputs(&arguments.job, None, terminal)?;
    let plan = watch::plan(&inputs, terminal)?;
    let mut outputs = Outputs::default();
    if let Some(tool) = plan.found_tool() {
        // What was found of the tool is what cuts, and what is judged.
        tool_files(&mut outputs, &inputs, tool, &arguments.out.join("tool"));
        inputs = inputs.with_tool(tool.clone());
    }
    terminal.progress("posting");
    let posted = pipeline::post_job(&inputs, &plan.path)?;
    let program = format!("program.{}", posted.extension);
    terminal.progress("verifying");
    let file = InputFile { name: &program, bytes: posted.text.as_bytes() };
    let judged = pipeline::judge(&inputs, file, Some(&plan.path), &pipeline::Judging::default())?;
    terminal.progress("reporting");
    let page = pipeline::page(&inputs, Some(&plan), &judged, &posted.text)?;
    let record = &judged.verified.record;
    outputs.add(arguments.out.join("path.cl"), cl::write(&plan.path)?);
    outputs.add(arguments.out.join(&program), posted.text.as_str());
    outputs.add(arguments.out.join("plan.json"), to_json(&pipeline::explain(&inputs, &plan))?);
    outputs.add(arguments.out.join("post.json"), to_json(&pipeline::PostRecord::of(&posted))?);
    outputs.add(arguments.out.join("verify.json"), to_json(record)?);
    outputs.add(arguments.out.join("report.html"), page);
    outputs.write()?;
    let parts = [summary::of_plan(&plan), summary::of_program(&posted), summary::of_verdict(record)];
    terminal.print(&parts.concat());
    Ok(Outcome::of(record.verdict))
}
