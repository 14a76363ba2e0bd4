//! `regulus post`: the NC program of a tool path.

use super::diff::{complain_briefly, length};
use super::files::{Outputs, read_text};
use super::inputs::machine_file;
use super::{Outcome, Refusal, Terminal, summary};
use crate::diagnostic::Diagnostic;
use crate::motion::apt::Assumptions;
use crate::pipeline::{PostRecord, PostRequest, Reading, hash, post, read_path, to_json};
use clap::Args;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub(super) struct Arguments {
    /// The tool path: as `regulus plan` writes it, or APT of another CAM system (.apt, .cls, .clsf, .as)
    path: PathBuf,
    /// Name of a machine that comes along, or path of a machine file
    #[arg(long, value_name = "M.toml")]
    machine: String,
    /// Write the program here
    #[arg(long, value_name = "P.nc")]
    out: PathBuf,
    /// Write the program's figures here, too
    #[arg(long, value_name = "J.json")]
    json: Option<PathBuf>,
    /// Work offset that the program calls; the machine file's first when left out
    #[arg(long, value_name = "CODE")]
    work_offset: Option<String>,
    /// Number of the program, for controls that count programs
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=9999))]
    number: u32,
    #[command(flatten)]
    foreign: Foreign,
}

/// What an APT file does not say.
#[derive(Args)]
struct Foreign {
    /// APT: which of the file's operations, from 1, where it holds several
    #[arg(long, value_name = "N")]
    operation: Option<usize>,
    /// APT: tool number, where the file calls no tool
    #[arg(long, value_name = "N")]
    tool: Option<u32>,
    /// APT: tip to gauge line of the tool, mm
    #[arg(long, value_name = "MM", value_parser = length)]
    gauge_length: Option<f64>,
    /// APT: height above the tip up to which the flank follows the path, mm
    #[arg(long, value_name = "MM", value_parser = length)]
    flank: Option<f64>,
    /// APT: spindle speed, 1/min
    #[arg(long, value_name = "RPM", value_parser = length)]
    spindle: Option<f64>,
    /// APT: feed of moves before the file gives one, mm/min
    #[arg(long, value_name = "MM_PER_MIN", value_parser = length)]
    feed: Option<f64>,
    /// APT: how far the flank may leave the path between blocks, and chords their circles, mm
    #[arg(long, value_name = "MM", default_value_t = 0.001, value_parser = length)]
    linearization: f64,
    /// APT: post the path although some words of the file are not understood
    #[arg(long)]
    despite_unknown: bool,
}

pub(super) fn run(arguments: &Arguments, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    let text = read_text(&arguments.path)?;
    let name = arguments.path.display().to_string();
    let foreign = &arguments.foreign;
    if foreign.linearization <= 0.0 {
        return Err(Diagnostic::error("--linearization is 0").help("allow what the control's digits need").into());
    }
    let given = Assumptions {
        name: &arguments.path.file_stem().map(|stem| stem.to_string_lossy()).unwrap_or_default(),
        tool: foreign.tool,
        gauge_length: foreign.gauge_length,
        flute_length: foreign.flank,
        spindle: foreign.spindle,
        feed: foreign.feed,
        linearization: foreign.linearization,
    };
    let reading = Reading {
        given,
        operation: foreign.operation,
        chord: foreign.linearization,
        despite_unknown_text: foreign.despite_unknown,
    };
    let (path, warnings) = read_path(&text, &name, &reading)?;
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
        input_hash: &hash(&std::iter::once(text.as_bytes()).chain(found.sources()).collect::<Vec<_>>()),
    })?;
    let mut outputs = Outputs::default();
    outputs.add(arguments.out.clone(), posted.text.as_str());
    if let Some(json) = &arguments.json {
        outputs.add(json.clone(), to_json(&PostRecord::of(&posted))?);
    }
    outputs.write()?;
    complain_briefly(&warnings, terminal);
    terminal.print(&summary::of_program(&posted));
    Ok(Outcome::Good)
}
