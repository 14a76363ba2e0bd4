//! The motion of a program for one machine as a program for another: followed, recovered as a tool path, posted, read
//! back and compared with the first. Uses everything but `plan` and `part`.

use super::diff::{Difference, difference};
use super::followed::{Followed, Source};
use super::recover::{beyond_reach, passes};
use super::{InputFile, PostRequest, Posted, post};
use crate::diagnostic::Diagnostic;
use crate::machine::{Machine, Setup};
use crate::motion::{FeedReference, ToolPath, ToolSummary};
use crate::nc::code::{Coolant, SpindleTurn};
use crate::nc::program::Change;
use crate::simulate::{Path, SegmentKind};

/// Share of the tolerance that the recovered path may use, and that the blocks of the new program may.
const SHARES: (f64, f64) = (0.05, 0.9);

/// What is to be carried, and how.
#[derive(Clone, Copy, Debug)]
pub struct RetargetRequest<'a> {
    /// The program on its machine; its gauge length counts where one is given.
    pub source: Source<'a>,
    /// Whether the tool's length is known.
    pub knows_length: bool,
    /// How far tip and flank may leave the first program's motion at a feed, mm.
    pub tolerance: f64,
    /// Height above the tip up to which the flank is kept, mm.
    pub height: f64,
    /// Tool number, for programs that call none.
    pub tool: Option<u32>,
    /// Spindle speed, 1/min, for programs that name none.
    pub spindle: Option<f64>,
}

/// Where it goes.
#[derive(Clone, Copy, Debug)]
pub struct RetargetGoal<'a> {
    /// The other machine.
    pub machine: &'a Machine,
    /// Code of its work offset that the part stands at.
    pub work_offset: &'a str,
    /// Number of the new program, for controls that count programs.
    pub number: u32,
    /// Hash of everything that the new program is made from, see [`super::hash`].
    pub input_hash: &'a str,
}

/// A recovered tool path with what could not be carried.
#[derive(Clone, Debug)]
pub struct Recovered {
    /// The path.
    pub path: ToolPath,
    /// Warnings about the program, and what of it is left behind, by line.
    pub warnings: Vec<Diagnostic>,
    /// The coolant that cutting begins with.
    pub coolant: Coolant,
    followed: Followed,
}

/// A program on another machine.
#[derive(Clone, Debug)]
pub struct Retargeted {
    /// The program.
    pub posted: Posted,
    /// Its motion against the first program's.
    pub difference: Difference,
    /// What is to be known about it.
    pub warnings: Vec<Diagnostic>,
}

/// The tool path of a program.
///
/// # Errors
/// A program whose motion is not certain, or which asks for what a path with one tool does not carry; each with its
/// line.
pub fn recover(request: &RetargetRequest<'_>) -> Result<Recovered, Vec<Diagnostic>> {
    let followed = request.source.follow()?;
    let mut refusals = Vec::new();
    if !request.knows_length && !tip_alone(&followed) {
        let message = "parts of the program run without TCP: where the tip is depends on the tool's length";
        refusals.push(*Diagnostic::error(message).in_file(request.source.program.name).help("give --gauge-length MM"));
    }
    let mut carried = Carried::default();
    carried.follow(&followed, request.source.program, &mut refusals);
    let spindle = carried.spindle.or(request.spindle);
    let Some(spindle_rpm) = spindle.filter(|_| refusals.is_empty()) else {
        if spindle.is_none() {
            let finding = Diagnostic::error("the program never says how fast the spindle turns");
            refusals.push(*finding.in_file(request.source.program.name).help("give --spindle RPM"));
        }
        return Err(refusals);
    };
    let allowed = request.tolerance * SHARES.1;
    let path = ToolPath {
        name: file_stem(request.source.program.name).to_owned(),
        tool: ToolSummary {
            number: carried.tool.or(request.tool).unwrap_or(1),
            description: format!("as in {}", file_name(request.source.program.name)),
            gauge_length: request.source.gauge_length,
            flute_length: request.height,
        },
        // The passes have times of their own.
        cut_feed: fastest(&followed),
        feed_reference: FeedReference::Tip,
        spindle_rpm,
        linearization: allowed,
        overcut_tolerance: request.tolerance,
        undercut_tolerance: request.tolerance,
        passes: passes(&followed.motion, request.height, request.tolerance * SHARES.0),
    };
    let mut warnings = followed.warnings.clone();
    warnings.extend(carried.left_behind);
    Ok(Recovered { path, warnings, coolant: carried.coolant, followed })
}

/// Writes a recovered path for another machine, reads it back and compares it with the first program.
///
/// # Errors
/// What the other machine or its control cannot do, with the lines of the first program that ask for it.
pub fn retarget(
    request: &RetargetRequest<'_>,
    recovered: &Recovered,
    goal: &RetargetGoal<'_>,
) -> Result<Retargeted, Vec<Diagnostic>> {
    let RetargetGoal { machine, work_offset, number, input_hash } = *goal;
    let name = request.source.program.name;
    let refuse = |e: Box<Diagnostic>| vec![*if e.place.is_some() { e } else { e.in_file(name) }];
    if !request.knows_length && !machine.control.tcp {
        let message = format!("the program for {} runs without TCP: it depends on the tool's length", machine.name);
        return Err(vec![*Diagnostic::error(message).in_file(name).help("give --gauge-length MM")]);
    }
    let path = &recovered.path;
    let setup = Setup::new(machine, work_offset, path.tool.gauge_length).map_err(refuse)?;
    let beyond = beyond_reach(&path.passes, &setup, name);
    if !beyond.is_empty() {
        return Err(beyond);
    }
    let cooled = cooled(machine, recovered.coolant);
    let posted = post(&PostRequest { path, machine: &cooled, work_offset, number, input_hash }).map_err(refuse)?;
    let own = format!("the program for {}", machine.name);
    let back = Source {
        program: InputFile { name: &own, bytes: posted.text.as_bytes() },
        machine,
        work_offset: Some(work_offset),
        gauge_length: path.tool.gauge_length,
        despite_unknown_text: false,
    };
    let written = back.follow()?;
    let motions = [&recovered.followed.motion, &written.motion];
    let difference = difference(motions, [name, &own], request.height)?;
    let mut warnings: Vec<_> = recovered.warnings.iter().cloned().chain(written.warnings).collect();
    let coolant = Change::Coolant(recovered.coolant);
    if recovered.coolant != Coolant::Off && !written.program.changes.iter().any(|at| at.change == coolant) {
        let message = format!("the templates of {} leave the coolant out", machine.name);
        warnings.push(*Diagnostic::warning(message).in_file(name).help("write start_lines and end_lines in them"));
    }
    Ok(Retargeted { posted, difference, warnings })
}

/// The machine with its programs turning the coolant on before everything and off at the end.
pub(super) fn cooled(machine: &Machine, coolant: Coolant) -> Machine {
    let mut machine = machine.clone();
    let code = match coolant {
        Coolant::Off => return machine,
        Coolant::Mist => "M7",
        Coolant::Flood => "M8",
    };
    machine.control.options.start_lines.push(code.to_owned());
    machine.control.options.end_lines.push("M9".to_owned());
    machine
}

/// Whether every move at a feed is one of the tip, so that the tool's length does not matter.
fn tip_alone(followed: &Followed) -> bool {
    let by_joints = |path: &Path| matches!(path, Path::Joints | Path::JointArc(_));
    let mut segments = followed.motion.segments().iter();
    !segments.any(|segment| segment.kind == SegmentKind::Feed && by_joints(&segment.path))
}

/// Highest speed of the tip at a feed, mm/min; at least 1.
fn fastest(followed: &Followed) -> f64 {
    let segments = followed.motion.segments().iter().filter(|s| s.kind == SegmentKind::Feed && s.programmed > 0.0);
    segments.map(|segment| 60.0 * followed.motion.tip_length(segment) / segment.programmed).fold(1.0, f64::max)
}

/// What a program asks for besides motion.
#[derive(Default)]
struct Carried {
    tool: Option<u32>,
    spindle: Option<f64>,
    coolant: Coolant,
    left_behind: Vec<Diagnostic>,
}

impl Carried {
    fn follow(&mut self, followed: &Followed, file: InputFile<'_>, refusals: &mut Vec<Diagnostic>) {
        let lines = followed.motion.segments().iter().map(|segment| segment.line);
        let (first, last) = lines.fold((usize::MAX, 0), |(low, high), line| (low.min(line), high.max(line)));
        let located = |finding: Box<Diagnostic>, line: u32| {
            let mut finding = *finding.in_file(file.name);
            if let Some(place) = &mut finding.place {
                place.line = Some(line as usize);
            }
            finding
        };
        for at in &followed.program.changes {
            let between = (first..=last).contains(&(at.line as usize));
            match at.change {
                Change::Tool(number) if self.tool.is_none_or(|before| before == number) => self.tool = Some(number),
                Change::Tool(number) => {
                    let message = format!("tool {number} is called where tool {:?} was", self.tool.unwrap_or(0));
                    let finding = Diagnostic::error(message).help("split the program: one tool a file");
                    refusals.push(located(finding, at.line));
                }
                Change::Spindle { turn: SpindleTurn::Counterclockwise, .. } => {
                    let finding = Diagnostic::error("the spindle turns counterclockwise (M4)");
                    refusals.push(located(finding.help("only clockwise cutting (M3) is carried"), at.line));
                }
                Change::Spindle { turn, rpm } if rpm > 0.0 => {
                    let turning = turn != SpindleTurn::Off;
                    match self.spindle.filter(|before| turning && *before != rpm) {
                        Some(before) => {
                            let message = format!("the spindle speed changes from {before} to {rpm} 1/min");
                            let finding = Diagnostic::error(message).help("split the program: one speed a file");
                            refusals.push(located(finding, at.line));
                        }
                        None => self.spindle = Some(rpm),
                    }
                }
                Change::Dwell(seconds) if between && seconds > 0.0 => {
                    let finding = Diagnostic::warning(format!("a dwell of {seconds} s is not carried"));
                    self.left_behind
                        .push(located(finding.help("write it into the new program if it is needed"), at.line));
                }
                Change::Coolant(coolant) if self.coolant == Coolant::Off => self.coolant = coolant,
                Change::Coolant(coolant) if between && coolant != self.coolant => {
                    let finding =
                        Diagnostic::warning("the coolant changes here; the new program leaves it as it began");
                    self.left_behind.push(located(finding.help("change it in the new program if it matters"), at.line));
                }
                Change::Stop if between => {
                    let finding = Diagnostic::warning("a stop for the operator is not carried");
                    self.left_behind
                        .push(located(finding.help("write it into the new program if it is needed"), at.line));
                }
                _ => {}
            }
        }
    }
}

fn file_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

fn file_stem(path: &str) -> &str {
    let name = file_name(path);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks of a swept flank with the tip, tilt and table turning together, a rapid, and a plunge.
    fn program() -> String {
        let mut text =
            "G21 G90 G61\nT3 M6\nS8000 M3 M8\nG43 H3\nM428\nG0 X0 Y0 Z60 A0 C0\nG0 X10 Y5 Z40 A-50 C-20\nG93\n"
                .to_owned();
        for k in 1..=40 {
            let t = f64::from(k) / 40.0;
            text += &format!(
                "G1 X{:.3} Y{:.3} Z{:.3} A{:.3} C{:.3} F{}\n",
                10.0 - 30.0 * t,
                5.0 - 20.0 * t * t,
                40.0 - 25.0 * t,
                -50.0 - 12.0 * (3.0 * t).sin(),
                -20.0 + 40.0 * t,
                if k % 7 == 0 { 60 } else { 120 }
            );
        }
        text + "G0 Z60\nG0 X15\nG1 Z20 F12\nG0 Z60\nM5\nM30\n"
    }

    fn request<'a>(text: &'a str, name: &'a str, machine: &'a Machine) -> RetargetRequest<'a> {
        let source = Source {
            program: InputFile { name, bytes: text.as_bytes() },
            machine,
            work_offset: None,
            gauge_length: 120.0,
            despite_unknown_text: false,
        };
        RetargetRequest { source, knows_length: true, tolerance: 0.0005, height: 40.0, tool: None, spindle: None }
    }

    fn moved(text: &str, from: &Machine, to: &Machine) -> Result<Retargeted, Vec<Diagnostic>> {
        let request = request(text, "dir/a.ngc", from);
        let work_offset = &to.control.work_offsets[0].name;
        let goal = RetargetGoal { machine: to, work_offset, number: 1, input_hash: "0" };
        retarget(&request, &recover(&request)?, &goal)
    }

    #[test]
    fn there_and_back_over_every_kind_of_machine() {
        let first = Machine::named("xyzac-trt").unwrap();
        let text = program();
        for name in ["xyzbc-trt", "head-b-table-c", "bridgemill", "trunnion-ac-30i"] {
            let other = Machine::named(name).unwrap();
            let there = moved(&text, &first, &other).unwrap();
            let back = moved(&there.posted.text, &other, &first).unwrap();
            let home = super::super::diff(
                &request(&text, "a.ngc", &first).source,
                &request(&back.posted.text, "b.ngc", &first).source,
                40.0,
            );
            for found in [there.difference, back.difference, home.unwrap().difference] {
                let feed = found.feed;
                assert!(feed.tip_mm.value <= 0.001 && feed.flank_mm.value <= 0.001, "{name}: {found:?}");
                // The axes of these machines are fast enough for all of it.
                assert!(feed.time_s.value < 0.01 * found.size[0].feed_s, "{name}: {found:?}");
            }
            let lines: Vec<&str> = there.posted.text.lines().collect();
            assert!(lines.contains(&"T3 M6") && lines.contains(&"M8") && lines.contains(&"M9"), "{name}: {lines:?}");
        }
    }

    /// What a line asks for that is not carried is refused or said with the line.
    #[test]
    fn what_cannot_be_carried_is_said_with_its_line() {
        let machine = Machine::named("xyzac-trt").unwrap();
        let place = |finding: &Diagnostic| finding.place.as_ref().and_then(|place| place.line);
        for (from, to, said, line) in [
            ("G0 Z60\nG0 X15", "G0 Z60\nT4 M6\nG0 X15", "tool 4 is called", Some(50)),
            ("G0 Z60\nG0 X15", "G0 Z60\nS900\nG0 X15", "changes from 8000 to 900", Some(50)),
            ("S8000 M3", "S8000 M4", "counterclockwise", Some(3)),
            ("M5", "G777 X1", "G777", Some(53)),
        ] {
            let text = program();
            assert!(text.contains(from), "{from}");
            let findings = recover(&request(&text.replacen(from, to, 1), "a.ngc", &machine)).unwrap_err();
            let found = findings.iter().find(|finding| finding.message.contains(said));
            assert_eq!(found.map(place), Some(line), "{to}: {findings:?}");
        }
        let dwell = program().replacen("G0 Z60\nG0 X15", "G0 Z60\nG4 P2\nG0 X15", 1);
        let recovered = recover(&request(&dwell, "a.ngc", &machine)).unwrap();
        assert!(recovered.warnings.iter().any(|w| w.message.contains("dwell of 2 s") && place(w) == Some(50)));
        assert_eq!(recovered.path.name, "a");
    }

    #[test]
    fn lines_that_lead_out_of_reach_are_named() {
        let first = Machine::named("xyzac-trt").unwrap();
        let mut narrow = Machine::named("xyzbc-trt").unwrap();
        for axis in &mut narrow.rotary {
            axis.travel = crate::machine::Travel::Limited { min: -0.9, max: 0.9 };
        }
        let findings = moved(&program(), &first, &narrow).unwrap_err();
        let place = findings[0].place.as_ref().unwrap();
        assert!(findings[0].message.contains("beyond its limits") && place.line.is_some(), "{findings:?}");
        assert!(findings.len() <= 51 && findings.iter().all(|finding| finding.help.is_some()));
    }

    #[test]
    fn without_tcp_the_length_of_the_tool_must_be_known() {
        let machine = Machine::named("xyzac-trt").unwrap();
        let text = "G21 G90 G61\nT1 M6\nS1000 M3\nG43 H1\nM429\nG0 X0 Y0 Z50 A10 C0\nG0 Z20\nG1 X10 F600\nM30\n";
        let unknown = RetargetRequest { knows_length: false, ..request(text, "a.ngc", &machine) };
        assert!(recover(&unknown).unwrap_err()[0].help.as_ref().unwrap().contains("--gauge-length"));
        assert!(recover(&request(text, "a.ngc", &machine)).is_ok());
    }
}
