//! A program followed on its machine for what its motion is, whoever wrote it: read, simulated, and refused where the
//! motion is not certain.

use super::InputFile;
use crate::diagnostic::{Diagnostic, Result, Severity};
use crate::machine::{Machine, Setup};
use crate::nc::{self, Finding, Program, Rules};
use crate::simulate::{ToolMotion, simulate};

/// Complaints that are reported at once.
const REPORTED: usize = 50;

/// A program on its machine.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// The program.
    pub program: InputFile<'a>,
    /// The machine that it is for.
    pub machine: &'a Machine,
    /// Code of the work offset that the part stands at; the machine file's first where it is `None`.
    pub work_offset: Option<&'a str>,
    /// Tip to gauge line of the tool, mm.
    pub gauge_length: f64,
    /// Follow it although some of its text is not known.
    pub despite_unknown_text: bool,
}

/// What a program says and does.
#[derive(Clone, Debug)]
pub(super) struct Followed {
    pub(super) program: Program,
    pub(super) motion: ToolMotion,
    /// What is remarkable, but leaves the motion certain.
    pub(super) warnings: Vec<Diagnostic>,
}

impl Source<'_> {
    /// Follows the program.
    pub(super) fn follow(&self) -> Result<Followed, Vec<Diagnostic>> {
        let refuse = |e: Box<Diagnostic>| vec![*e];
        let setup = self.setup().map_err(refuse)?;
        let file = self.program;
        let program = nc::read(file.bytes, &Rules::of(self.machine));
        let motion = simulate(&program, &setup, None);
        let findings = motion.findings();
        let certain = |finding: &&Finding| self.despite_unknown_text || !finding.leaves_doubt();
        let (harmless, doubtful): (Vec<&Finding>, Vec<&Finding>) = findings.list().iter().partition(certain);
        let located = |finding: &&Finding| *finding.diagnostic(file.name, file.bytes);
        if !doubtful.is_empty() {
            let mut doubts: Vec<_> = doubtful.iter().take(REPORTED).map(located).collect();
            let left = doubtful.len() + findings.omitted() - doubts.len();
            let more = if left > 0 { format!("; {left} more are not shown") } else { String::new() };
            let message = format!("what the control does with this program is not certain{more}");
            let help = "correct the program, or give --despite-unknown to take the rest of it as it is understood";
            doubts.push(*Diagnostic::error(message).in_file(file.name).help(help));
            return Err(doubts);
        }
        let warnings = harmless.iter().map(located).map(|mut warning| {
            warning.severity = Severity::Warning;
            warning
        });
        let warnings = warnings.collect();
        if motion.segments().is_empty() {
            return Err(refuse(
                Diagnostic::error("the program moves nothing")
                    .in_file(file.name)
                    .help("give a program that positions each axis and then moves"),
            ));
        }
        Ok(Followed { program, motion, warnings })
    }

    fn setup(&self) -> Result<Setup> {
        match self.work_offset {
            Some(name) => Setup::new(self.machine, name, self.gauge_length),
            None => {
                let first = self.machine.control.work_offsets.first().map_or([0.0; 3], |offset| offset.linear);
                Setup::at(self.machine, first, self.gauge_length)
            }
        }
    }
}
