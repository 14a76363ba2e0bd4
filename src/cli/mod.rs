//! The command line: arguments, files, progress and printing around the pure pipeline. The only module that touches
//! files and terminals. Uses everything.

mod files;
mod inputs;
mod inspect;
mod machine;
mod terminal;

use crate::diagnostic::Diagnostic;
use clap::{Parser, Subcommand};
use std::process::ExitCode;
use terminal::Terminal;

/// Plans 5-axis flank milling, writes the NC program for a real machine, and proves from its text what the swept tool
/// leaves.
///
/// Exit status: 0 done and within tolerance and limits; 1 done, but the verdict is "fail"; 2 bad input or arguments.
#[derive(Parser)]
#[command(name = "regulus", version, max_term_width = 100)]
struct Arguments {
    /// Number of threads; all cores when left out. The results are the same bytes for any number
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Say what an NC program or a part file holds
    Inspect(inspect::Arguments),
    /// The machines that come along, and checks of your own
    Machine {
        #[command(subcommand)]
        action: machine::Action,
    },
}

/// How a command that ran to its end ended.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Outcome {
    /// Done, within tolerance and limits where there are any.
    Good,
    /// Done, but the verdict is "fail".
    Failed,
}

/// Why a command did not run to its end.
struct Refusal(Vec<Diagnostic>);

impl From<Box<Diagnostic>> for Refusal {
    fn from(finding: Box<Diagnostic>) -> Self {
        Self(vec![*finding])
    }
}

impl From<Vec<Diagnostic>> for Refusal {
    fn from(findings: Vec<Diagnostic>) -> Self {
        Self(findings)
    }
}

/// Runs the program with the arguments of this process; what it returns is the exit status.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let mut terminal = Terminal::new();
    match run(&arguments, &mut terminal) {
        Ok(Outcome::Good) => ExitCode::SUCCESS,
        Ok(Outcome::Failed) => ExitCode::from(1),
        Err(Refusal(findings)) => {
            for finding in &findings {
                terminal.complain(finding);
            }
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    if let Some(threads) = arguments.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
        pool.map_err(|e| Diagnostic::error(format!("{threads} threads cannot be started: {e}")))?;
    }
    match &arguments.command {
        Command::Inspect(arguments) => inspect::run(arguments, terminal),
        Command::Machine { action } => machine::run(action, terminal),
    }
}
