//! `regulus post`: the NC program of a tool path.

use super::files::{Outputs, read_text};
use super::inputs::machine_file;
use super::{Outcome, Refusal, Terminal, summary};
use crate::diagnostic::Diagnostic;
use crate::motion::cl;
use crate::pipeline::{PostRequest, hash, post};
use clap::Args;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub(super) struct Arguments {
    /// The tool path, as `regulus plan` writes it
    path: PathBuf,
    /// Name of a machine that comes along, or path of a machine file
    #[arg(long, value_name = "M.toml")]
    machine: String,
    /// Write the program here
    #[arg(long, value_name = "P.nc")]
    out: PathBuf,
    /// Work offset that the program calls; the machine file's first when left out
    #[arg(long, value_name = "CODE")]
    work_offset: Option<String>,
    /// Number of the program, for controls that count programs
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=9999))]
    number: u32,
}

pub(super) fn run(arguments: &Arguments, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    let text = read_text(&arguments.path)?;
    let path = cl::read(&text, &arguments.path.display().to_string())?;
    let found = machine_file(&arguments.machine, Path::new(""))?;
    let first = found.machine.control.work_offsets.first().map(|offset| offset.name.as_str());
    let work_offset = arguments
        .work_offset
        .as_deref()
        .or(first)
        .ok_or_else(|| Diagnostic::error("the machine file has no work offset").help("add one to it"))?;
    terminal.progress("posting");
    let posted = post(&PostRequest {
        path: &path,
        machine: &found.machine,
        work_offset,
        number: arguments.number,
        input_hash: &hash(&[text.as_bytes(), found.text.as_bytes()]),
    })?;
    let mut outputs = Outputs::default();
    outputs.add(arguments.out.clone(), posted.text.as_str());
    outputs.write()?;
    terminal.print(&summary::of_program(&posted));
    Ok(Outcome::Good)
}
