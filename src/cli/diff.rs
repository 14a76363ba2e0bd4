//! `regulus diff`: the largest distance between two programs.

use super::files::{Outputs, read_bytes};
use super::inputs::machine_file;
use super::{Outcome, Refusal, Terminal};
use crate::diagnostic::Diagnostic;
use crate::pipeline::{Difference, Differences, InputFile, Source, diff, to_json};
use clap::Args;
use std::fmt::Write;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub(super) struct Arguments {
    /// The first NC program
    first: PathBuf,
    /// The second NC program
    second: PathBuf,
    /// Machine of the first program, and of the second unless it has one of its own
    #[arg(long, value_name = "M.toml")]
    machine: String,
    /// Machine of the second program
    #[arg(long, value_name = "N.toml")]
    machine_b: Option<String>,
    /// Height above the tip of the axis point that is compared besides the tip, mm
    #[arg(long, value_name = "MM", default_value_t = 40.0, value_parser = length)]
    flank: f64,
    /// Tip to gauge line of the tool, mm
    #[arg(long, value_name = "MM", default_value_t = 0.0, value_parser = length)]
    gauge_length: f64,
    /// Tip to gauge line of the tool of the second program, mm, where it is another
    #[arg(long, value_name = "MM", value_parser = length)]
    gauge_length_b: Option<f64>,
    /// Work offset that the part stands at; the machine file's first when left out
    #[arg(long, value_name = "CODE")]
    work_offset: Option<String>,
    /// Work offset on the second machine
    #[arg(long, value_name = "CODE")]
    work_offset_b: Option<String>,
    /// End with status 1 where tip or flank of feed moves are further apart, mm
    #[arg(long, value_name = "MM", value_parser = length)]
    tolerance: Option<f64>,
    /// End with status 1 where the times of feed moves differ by more, s
    #[arg(long, value_name = "S", value_parser = length)]
    time_tolerance: Option<f64>,
    /// Write the figures here
    #[arg(long, value_name = "F.json")]
    json: Option<PathBuf>,
    /// Compare the programs although some of their text is not known
    #[arg(long)]
    despite_unknown: bool,
}

/// A number that is finite and not negative.
pub(super) fn length(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("{text} is no number"))?;
    if value.is_finite() && value >= 0.0 { Ok(value) } else { Err("write a finite number, zero or more".to_owned()) }
}

pub(super) fn run(arguments: &Arguments, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    let machine = machine_file(&arguments.machine, Path::new(""))?.machine;
    let other = arguments.machine_b.as_deref().map(|given| machine_file(given, Path::new(""))).transpose()?;
    let other = other.map(|found| found.machine);
    let files = [&arguments.first, &arguments.second];
    let names = files.map(|path| path.display().to_string());
    let [first, second] = files.map(|path| read_bytes(path));
    let (first, second) = (first?, second?);
    let source = |index: usize, bytes, machine| Source {
        program: InputFile { name: &names[index], bytes },
        machine,
        work_offset: arguments.work_offset.as_deref(),
        gauge_length: arguments.gauge_length,
        despite_unknown_text: arguments.despite_unknown,
    };
    terminal.progress("comparing");
    let second = Source {
        gauge_length: arguments.gauge_length_b.unwrap_or(arguments.gauge_length),
        // The offset's code is of its own machine.
        work_offset: match (&arguments.work_offset_b, &other) {
            (None, None) => arguments.work_offset.as_deref(),
            (given, _) => given.as_deref(),
        },
        ..source(1, &second, other.as_ref().unwrap_or(&machine))
    };
    let compared = diff(&source(0, &first, &machine), &second, arguments.flank)?;
    if let Some(path) = &arguments.json {
        let mut outputs = Outputs::default();
        outputs.add(path.clone(), to_json(&compared.difference)?);
        outputs.write()?;
    }
    complain_briefly(&compared.warnings, terminal);
    terminal.print(&describe(&compared.difference));
    Ok(if beyond(arguments, &compared.difference) { Outcome::Failed } else { Outcome::Good })
}

/// Shows the first warnings and counts the others.
pub(super) fn complain_briefly(warnings: &[Diagnostic], terminal: &mut Terminal) {
    const SHOWN: usize = 10;
    for warning in warnings.iter().take(SHOWN) {
        terminal.complain(warning);
    }
    if let Some(left) = warnings.len().checked_sub(SHOWN).filter(|left| *left > 0) {
        terminal.complain(&Diagnostic::warning(format!("{left} more warnings are not shown")));
    }
}

fn beyond(arguments: &Arguments, difference: &Difference) -> bool {
    let feed = &difference.feed;
    let distance = feed.tip_mm.value.max(feed.flank_mm.value);
    arguments.tolerance.is_some_and(|allowed| distance > allowed)
        || arguments.time_tolerance.is_some_and(|allowed| feed.time_s.value > allowed)
}

/// The figures in a few lines.
pub(super) fn describe(difference: &Difference) -> String {
    let mut text = String::new();
    describe_moves(&mut text, "feed", &difference.feed, difference.flank_height_mm);
    if let Some(rapid) = &difference.rapid {
        describe_moves(&mut text, "rapid", rapid, difference.flank_height_mm);
    }
    for (file, size) in difference.files.iter().zip(&difference.size) {
        let _ = writeln!(
            text,
            "{file}: {} passages, {:.1} mm at a feed in {:.2} s, {:.2} s in all",
            size.passages, size.feed_length_mm, size.feed_s, size.duration_s
        );
    }
    if !difference.matched_by_passage {
        text.push_str("the programs have other passages: all motion is matched as one\n");
    }
    text
}

fn describe_moves(text: &mut String, kind: &str, found: &Differences, height: f64) {
    for (name, largest, unit) in [
        ("tip".to_owned(), &found.tip_mm, "mm"),
        (format!("flank at {height}"), &found.flank_mm, "mm"),
        ("time".to_owned(), &found.time_s, "s"),
    ] {
        let [a, b] = largest.lines;
        let _ = writeln!(text, "{kind:<6} {name:<14} {:.6} {unit}, lines {a} and {b}", largest.value);
    }
}
