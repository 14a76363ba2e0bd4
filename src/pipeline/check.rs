//! A program on its machine without a part: what the machine makes of it, judged; and how many rules it keeps.

use super::InputFile;
use super::scene::scene_of_machine;
use crate::diagnostic::{Diagnostic, Result};
use crate::machine::{Machine, Setup};
use crate::nc::{self, Program, Rules};
use crate::simulate::{OwnTool, ToolMotion, simulate};
use crate::verify::{MachineVerification, bodies_met, verify_motion};

/// A program and the machine that it is for.
#[derive(Clone, Copy, Debug)]
pub struct CheckRequest<'a> {
    /// The program.
    pub program: InputFile<'a>,
    /// The machine.
    pub machine: &'a Machine,
    /// Code of the work offset that the part stands at; the machine file's first where it is `None`.
    pub work_offset: Option<&'a str>,
    /// Tip to gauge line of the tool, mm.
    pub gauge_length: f64,
    /// How the program should call the tool, where that is known.
    pub tool: Option<OwnTool>,
    /// Give a verdict although some of the text is not known.
    pub despite_unknown_text: bool,
}

/// A program followed on its machine, and judged.
#[derive(Clone, Debug)]
pub struct Checked {
    /// What the program makes the tool do.
    pub motion: ToolMotion,
    /// Figures, findings and verdict.
    pub record: MachineVerification,
}

/// Judges a program by what its machine makes of it. A program that leaves it uncertain what the control does fails, see
/// [`doubts`] for how to refuse it. Bodies of the machine are followed where the tool's length is given. Refuses a machine without that work offset, and lengths that are none.
pub fn check(request: &CheckRequest<'_>) -> Result<Checked> {
    let (program, motion) = follow(request)?;
    let record = verify_motion(&program, &motion, request.despite_unknown_text);
    let record = record.with_bodies(&bodies_met(&motion, &scene_of_machine(motion.setup())?));
    Ok(Checked { motion, record })
}

fn follow(request: &CheckRequest<'_>) -> Result<(Program, ToolMotion)> {
    let machine = request.machine;
    let setup = match request.work_offset {
        Some(name) => Setup::new(machine, name, request.gauge_length)?,
        None => {
            let first = machine.control.work_offsets.first().map_or([0.0; 3], |offset| offset.linear);
            Setup::at(machine, first, request.gauge_length)?
        }
    };
    let program = nc::read(request.program.bytes, &Rules::of(machine));
    let motion = simulate(&program, &setup, request.tool);
    Ok((program, motion))
}

/// Complaints about a program that are shown at once.
const SHOWN: usize = 50;

/// Everything for which a program gets no verdict, and how to get one all the same; nothing where what the control does
/// is certain.
pub fn doubts(motion: &ToolMotion, program: InputFile<'_>) -> Vec<Diagnostic> {
    let findings = motion.findings();
    if !findings.any_doubt() {
        return Vec::new();
    }
    let doubtful = || findings.list().iter().filter(|finding| finding.leaves_doubt());
    let mut doubts: Vec<_> =
        doubtful().take(SHOWN).map(|finding| *finding.diagnostic(program.name, program.bytes)).collect();
    let more = doubtful().count().saturating_sub(SHOWN) + findings.omitted();
    let more = if more > 0 { format!("; {more} more complaints are not shown") } else { String::new() };
    let message = format!("no verdict: what the control does with this program is not certain{more}");
    let help = "correct the program, or give --despite-unknown to judge the rest of it";
    doubts.push(*Diagnostic::error(message).in_file(program.name).help(help));
    doubts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verify::Verdict;

    fn checked(text: &str) -> Checked {
        let machine = Machine::named("xyzac-trt").unwrap();
        check(&CheckRequest {
            program: InputFile { name: "p.ngc", bytes: text.as_bytes() },
            machine: &machine,
            work_offset: None,
            gauge_length: 100.0,
            tool: None,
            despite_unknown_text: false,
        })
        .unwrap()
    }

    const GOOD: &str = "G21 G90 G61 G54\nT1 M6\nS8000 M3\nG43 H1\nM428\nG0 X0 Y0 Z50 A0 C0\nG1 Z0 F600\nX10 A1\nX20 A2\nG0 Z50\nM429\nM30\n";

    fn errors(checked: &Checked) -> Vec<(Option<usize>, &'static str)> {
        checked.record.findings.iter().filter(|f| f.is_error()).map(|f| (f.line, f.code)).collect()
    }

    #[test]
    fn a_good_program_passes_without_a_word() {
        let good = checked(GOOD);
        assert_eq!(good.record.verdict, Verdict::Pass);
        assert!(good.record.findings.is_empty(), "{:?}", good.record.findings);
        let json: serde_json::Value = serde_json::to_value(&good.record).unwrap();
        assert_eq!((json["deviation"].is_null(), json["program"]["blocks"].as_u64()), (true, Some(4)));
    }

    #[test]
    fn what_the_machine_cannot_do_fails_with_its_line() {
        assert_eq!(errors(&checked(&GOOD.replace("X20 A2", "X20000 A2"))), [(Some(9), "travel-limit")]);
        assert_eq!(errors(&checked(&GOOD.replace("S8000 M3\n", ""))), [(Some(6), "spindle-off")]);
        let doubt = checked(&GOOD.replace("X20 A2", "X20 A2 G777"));
        assert_eq!((doubt.record.verdict, errors(&doubt)), (Verdict::Fail, vec![(Some(9), "unknown-code")]));
        let file = InputFile { name: "p.ngc", bytes: b"" };
        assert!(doubts(&doubt.motion, file).len() == 2 && doubts(&checked(GOOD).motion, file).is_empty());
    }

    #[test]
    fn nothing_is_no_pass() {
        for text in ["", "\0\u{1}\u{2}\n", "%\n%\n", "M30\n", "G0 X0 Y0 Z0 A0 C0\nM30\n", "(nothing)\n"] {
            assert_eq!(checked(text).record.verdict, Verdict::Fail, "{text:?}");
        }
    }

    #[test]
    fn turning_back_by_a_turn_is_unwinding_and_a_turned_cut_is_none() {
        let body = |words: &str| GOOD.replace("X10 A1\nX20 A2\n", words);
        let back = body("C170\nC175\nC179\nC-179\nC-175\n").replace("F600", "F60");
        assert_eq!(errors(&checked(&back)), [(Some(11), "unwinding")]);
        let over = body("C1\nC362\nC3\nC4\n").replace("F600", "F60");
        assert_eq!(errors(&checked(&over)), [(Some(9), "unwinding")]);
        let turned = body("C360\nZ1\nC0\n").replace("F600", "F60");
        assert_eq!(errors(&checked(&turned)), []);
    }
}
