//! The command line: arguments, files, progress and printing around the pure pipeline. The only module that touches
//! files and terminals. Uses everything.

mod diff;
mod files;
mod inputs;
mod inspect;
mod machine;
mod plan;
mod post;
mod retarget;
mod run;
mod stock;
mod summary;
mod terminal;
mod tools;
mod verify;
mod watch;

use crate::diagnostic::Diagnostic;
use crate::verify::Verdict;
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
    /// The main job: plan, post, verify, report
    Run(run::Arguments),
    /// Plan the tool path of a job
    Plan(plan::Arguments),
    /// Write the NC program of a tool path
    Post(post::Arguments),
    /// Judge a program by what the swept tool leaves of a job's part
    Verify(verify::Arguments),
    /// Take a program through a job's stock: removal, engagement, rapids in material, what is left
    Stock(stock::Arguments),
    /// Rank the cutters of a catalogue for a job's part
    Tools(tools::Arguments),
    /// Say what an NC program or a part file holds
    Inspect(inspect::Arguments),
    /// Write a program's motion for another machine
    Retarget(retarget::Arguments),
    /// Say how far two programs are apart, in the part frame
    Diff(diff::Arguments),
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

impl Outcome {
    fn of(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Pass => Self::Good,
            Verdict::Fail => Self::Failed,
        }
    }
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
    match dispatch(&arguments, &mut terminal) {
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

fn dispatch(arguments: &Arguments, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    if let Some(threads) = arguments.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
        pool.map_err(|e| Diagnostic::error(format!("{threads} threads cannot be started: {e}")))?;
    }
    match &arguments.command {
        Command::Run(arguments) => run::run(arguments, terminal),
        Command::Plan(arguments) => plan::run(arguments, terminal),
        Command::Post(arguments) => post::run(arguments, terminal),
        Command::Verify(arguments) => verify::run(arguments, terminal),
        Command::Stock(arguments) => stock::run(arguments, terminal),
        Command::Tools(arguments) => tools::run(arguments, terminal),
        Command::Inspect(arguments) => inspect::run(arguments, terminal),
        Command::Retarget(arguments) => retarget::run(arguments, terminal),
        Command::Diff(arguments) => diff::run(arguments, terminal),
        Command::Machine { action } => machine::run(action, terminal),
    }
}
