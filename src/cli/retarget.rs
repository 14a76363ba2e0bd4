//! `regulus retarget`: the same motion on another machine.

use super::diff::{complain_briefly, describe, length};
use super::files::{Outputs, read_bytes};
use super::inputs::machine_file;
use super::{Outcome, Refusal, Terminal, summary};
use crate::diagnostic::Diagnostic;
use crate::motion::{apt, cl};
use crate::pipeline::{
    InputFile, PostRecord, Recovered, RetargetGoal, RetargetRequest, Source, hash, is_apt, recover, retarget, to_json,
};
use clap::Args;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub(super) struct Arguments {
    /// The NC program
    program: PathBuf,
    /// The machine that it is for
    #[arg(long, value_name = "M.toml")]
    from: String,
    /// The machine that it is to run on; not needed where --out is a tool path
    #[arg(long, value_name = "N.toml")]
    to: Option<String>,
    /// Write the new program here, or the tool path: .cl, or APT as .apt, .cls, .clsf, .as
    #[arg(long, value_name = "B.nc")]
    out: PathBuf,
    /// Write the new program's figures here, too
    #[arg(long, value_name = "J.json", requires = "to")]
    json: Option<PathBuf>,
    /// Work offset that the part stands at on the first machine; its machine file's first when left out
    #[arg(long, value_name = "CODE")]
    work_offset: Option<String>,
    /// Work offset that the part stands at on the other machine; its machine file's first when left out
    #[arg(long, value_name = "CODE")]
    work_offset_to: Option<String>,
    /// How far tip and flank may leave the motion of the first program, mm
    #[arg(long, value_name = "MM", default_value_t = 0.0005, value_parser = length)]
    tolerance: f64,
    /// Height above the tip up to which the flank is kept, mm
    #[arg(long, value_name = "MM", default_value_t = 40.0, value_parser = length)]
    flank: f64,
    /// Tip to gauge line of the tool, mm; needed where either program runs without TCP
    #[arg(long, value_name = "MM", value_parser = length)]
    gauge_length: Option<f64>,
    /// Tool number, where the program calls no tool
    #[arg(long, value_name = "N")]
    tool: Option<u32>,
    /// Spindle speed, 1/min, where the program names none
    #[arg(long, value_name = "RPM", value_parser = length)]
    spindle: Option<f64>,
    /// Number of the new program, for controls that count programs
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=9999))]
    number: u32,
    /// Carry the program although some of its text is not known
    #[arg(long)]
    despite_unknown: bool,
}

pub(super) fn run(arguments: &Arguments, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    let bytes = read_bytes(&arguments.program)?;
    let from = machine_file(&arguments.from, Path::new(""))?;
    let name = arguments.program.display().to_string();
    if arguments.tolerance <= 0.0 {
        return Err(Diagnostic::error("--tolerance is 0").help("allow what the new control's digits need").into());
    }
    let request = RetargetRequest {
        source: Source {
            program: InputFile { name: &name, bytes: &bytes },
            machine: &from.machine,
            work_offset: arguments.work_offset.as_deref(),
            gauge_length: arguments.gauge_length.unwrap_or(0.0),
            despite_unknown_text: arguments.despite_unknown,
        },
        knows_length: arguments.gauge_length.is_some(),
        tolerance: arguments.tolerance,
        height: arguments.flank,
        tool: arguments.tool,
        spindle: arguments.spindle,
    };
    terminal.progress("following the program");
    let recovered = recover(&request)?;
    let Some(to) = &arguments.to else { return write_path(arguments, &recovered, terminal) };
    let to = machine_file(to, Path::new(""))?;
    let first = to.machine.control.work_offsets.first().map(|offset| offset.name.as_str());
    let work_offset = arguments
        .work_offset_to
        .as_deref()
        .or(first)
        .ok_or_else(|| Diagnostic::error("the machine file has no work offset").help("add one to it"))?;
    terminal.progress("writing and comparing");
    let goal = RetargetGoal {
        machine: &to.machine,
        work_offset,
        number: arguments.number,
        input_hash: &hash(
            &std::iter::once(bytes.as_slice()).chain(from.sources()).chain(to.sources()).collect::<Vec<_>>(),
        ),
    };
    let retargeted = retarget(&request, &recovered, &goal)?;
    let mut outputs = Outputs::default();
    outputs.add(arguments.out.clone(), retargeted.posted.text.as_str());
    if let Some(json) = &arguments.json {
        outputs.add(json.clone(), to_json(&PostRecord::of(&retargeted.posted))?);
    }
    outputs.write()?;
    complain_briefly(&retargeted.warnings, terminal);
    let difference = &retargeted.difference;
    terminal.print(&(summary::of_program(&retargeted.posted) + &describe(difference)));
    let apart = difference.feed.tip_mm.value.max(difference.feed.flank_mm.value);
    Ok(if apart > arguments.tolerance { Outcome::Failed } else { Outcome::Good })
}

/// Writes the recovered tool path itself.
fn write_path(arguments: &Arguments, recovered: &Recovered, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    let name = arguments.out.display().to_string();
    let text = if is_apt(&name) {
        apt::write(&recovered.path)?
    } else if name.to_lowercase().ends_with(".cl") {
        cl::write(&recovered.path)?
    } else {
        let finding = Diagnostic::error(format!("{name} is to be a program, but no machine is given for it"));
        return Err(finding.help("give --to N.toml, or name a tool path: .cl, .apt, .cls, .clsf, .as").into());
    };
    let mut outputs = Outputs::default();
    outputs.add(arguments.out.clone(), text);
    outputs.write()?;
    complain_briefly(&recovered.warnings, terminal);
    terminal.print(&format!("path        {} passes\n", recovered.path.passes.len()));
    Ok(Outcome::Good)
}
