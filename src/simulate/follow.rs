//! Follows a program move by move as its control would. Uses `diagnostic`, `geometry`, `machine` and the reading half of
//! `nc`.

use super::arc::Arc;
use super::duration::feed_duration;
use super::rapid::{rapid_duration, stopped_duration};
use super::rollover::turn_to;
use super::rounding::{Corner, Rounding};
use super::segment::{Path, Segment, SegmentKind};
use super::tool_motion::ToolMotion;
use crate::diagnostic::Severity;
use crate::geometry::Direction;
use crate::geometry::{Point, Vector};
use crate::machine::{AxisPosition, AxisZero, Dialect, Setup, TcpInterpolation};
use crate::motion::Pose;
use crate::nc::code::PathControl;
use crate::nc::program::{AXIS_LETTERS, AxisSet, Change, ChangeAt, Feed, Frame, LengthOffset, Move, Way};
use crate::nc::{FeedRules, Finding, FindingCode, Findings, Program, Travelled};
use std::f64::consts::TAU;

/// The numbers by which a program should call the tool that it is followed with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OwnTool {
    /// Of the tool.
    pub number: u32,
    /// Of its length offset in the control's table.
    pub length_offset: u32,
}

impl From<u32> for OwnTool {
    /// A tool whose length offset has its own number.
    fn from(number: u32) -> Self {
        Self { number, length_offset: number }
    }
}

/// Moves the machine as the program says. `tool` says how the tool that the setup holds should be called, where there is
/// one to compare with. Never fails: what makes the motion uncertain is a finding.
pub fn simulate(program: &Program, setup: &Setup, tool: Option<OwnTool>) -> ToolMotion {
    let mut follower = Follower::new(program, setup, tool);
    for step in &program.moves {
        follower.changes_up_to(step.changes as usize);
        follower.step(step);
    }
    follower.changes_up_to(program.changes.len());
    let mut findings = program.findings.clone();
    findings.merge(follower.findings);
    ToolMotion::new(setup.clone(), follower.segments, findings).rounded(follower.rounding)
}

/// Turns of a rotary axis in one block, and distance from any zero, mm, beyond which a move is not followed.
const MOST_TURNS: f64 = 100.0;
const FARTHEST: f64 = 1e6;

/// Where a move leads.
struct Target {
    /// X, Y, Z in program coordinates.
    words: Point,
    axes: AxisPosition,
}

struct Follower<'a> {
    program: &'a Program,
    setup: &'a Setup,
    tool: Option<OwnTool>,
    /// Index in [`AXIS_LETTERS`] of each rotary axis.
    rotary_letters: [usize; 2],
    /// Changes carried out so far.
    changes: usize,
    axes: AxisPosition,
    /// The tip in the part frame, kept exact while TCP is on.
    tip: Point,
    tcp: bool,
    /// Work offset in force less the setup's, mm.
    offset: Vector,
    length_on: bool,
    rules: FeedRules,
    /// How the tool turns with TCP on, where the program has said it.
    interpolation: Option<TcpInterpolation>,
    /// What is to be done at the ends of blocks, and where corners may be rounded.
    path_control: Option<PathControl>,
    rounding: Rounding,
    /// How far the program lets rotary axes leave their way there, radians.
    rounding_rotary: Option<f64>,
    rpm: f64,
    time: f64,
    /// Axes that the program names anywhere, and those it has positioned so far.
    needed: AxisSet,
    positioned: AxisSet,
    said_unknown_start: bool,
    /// That the tool length is missing: in a rapid, and at a feed.
    said_without_length: [bool; 2],
    segments: Vec<Segment>,
    findings: Findings,
}

impl<'a> Follower<'a> {
    fn new(program: &'a Program, setup: &'a Setup, tool: Option<OwnTool>) -> Self {
        let machine = setup.machine();
        let index = |letter: char| AXIS_LETTERS.iter().position(|known| *known == letter).unwrap_or(0);
        let axes = AxisPosition::default();
        Self {
            program,
            setup,
            tool,
            rotary_letters: machine.rotary.each_ref().map(|axis| index(axis.letter)),
            changes: 0,
            axes,
            tip: setup.forward(&axes).tip,
            tcp: machine.control.options.tcp_at_start,
            offset: Vector::zeros(),
            length_on: false,
            rules: FeedRules::new(machine.control.dialect, &machine.control.options),
            interpolation: None,
            path_control: None,
            rounding: Rounding::default(),
            rounding_rotary: None,
            rpm: 0.0,
            time: 0.0,
            needed: AxisSet(program.moves.iter().fold(0, |bits, step| bits | step.given.0) & !AxisSet::VECTOR.0),
            positioned: AxisSet::default(),
            said_unknown_start: false,
            said_without_length: [false; 2],
            segments: Vec::with_capacity(program.moves.len()),
            findings: Findings::default(),
        }
    }

    fn changes_up_to(&mut self, count: usize) {
        for change in self.program.changes.get(self.changes..count).unwrap_or_default() {
            self.change(change);
        }
        self.changes = self.changes.max(count);
    }

    fn change(&mut self, at: &ChangeAt) {
        let line = at.line as usize;
        match at.change {
            Change::Tcp(on) => {
                if on != self.tcp {
                    self.tip = self.setup.forward(&self.axes).tip;
                }
                self.tcp = on;
                self.said_without_length = [false; 2];
            }
            Change::Interpolation(how) => self.interpolation = how,
            Change::FeedRadius(radius) => self.rules = self.rules.at_radius(radius),
            Change::Length(length) => self.change_length(line, length),
            Change::WorkOffset(code) => {
                let name = code.to_string();
                let offsets = &self.setup.machine().control.work_offsets;
                match offsets.iter().find(|offset| offset.name == name) {
                    Some(found) => self.offset = Vector::from(found.linear) - Vector::from(self.setup.work_offset()),
                    None => self.find(
                        FindingCode::UnknownWorkOffset,
                        line,
                        format!("the machine file gives no work offset {name}"),
                        "add it to [control.work_offsets], or use one that is there",
                    ),
                }
            }
            Change::Tool(number) => {
                if self.tcp && self.setup.machine().control.dialect == Dialect::HeidenhainTnc {
                    let help = "switch TCP off first: M129 or FUNCTION RESET TCPM";
                    self.find(FindingCode::WrongTcpState, line, "a tool call with TCP on", help);
                }
                if let Some(own) = self.tool.map(|tool| tool.number).filter(|own| *own != number) {
                    let message = format!("tool {number} is put into the spindle; the job's is tool {own}");
                    let help = "call the job's tool, or give the job this number; the job's tool is used here";
                    self.find(FindingCode::OtherTool, line, message, help);
                }
            }
            Change::Spindle { rpm, .. } => self.rpm = rpm,
            Change::Dwell(seconds) => self.time += seconds,
            Change::PathControl(control) => self.path_control = Some(control),
            Change::RoundingRotary(degrees) => self.rounding_rotary = degrees.map(f64::to_radians),
            Change::Stop | Change::Coolant(_) | Change::Units { .. } => {}
        }
    }

    fn change_length(&mut self, line: usize, length: LengthOffset) {
        let on = length != LengthOffset::Off;
        // Tip words stay and the machine follows: by the length times how far the tool axis has turned.
        let turned = self.setup.axis(self.axes.rotary).into_inner() - self.setup.axis([0.0; 2]).into_inner();
        let jump = self.setup.tool_length() * turned.norm();
        if self.tcp && on != self.length_on && self.length_in_kinematics() && jump > 1e-6 {
            let message =
                format!("the tool length changes while tilted with TCP on: the machine jumps by {jump:.3} mm");
            let help = "switch the tool length where the rotary axes stand at zero, or with TCP off";
            self.find(FindingCode::Jump, line, message, help);
        }
        let own = self.tool.map(|tool| tool.length_offset);
        if let (LengthOffset::Number(number), Some(own)) = (length, own)
            && number != own
        {
            let message = format!("length offset {number} is called; that of the job's tool is {own}");
            let help = "call the job's, or give --length-offset with this number where the table holds the tool's length there";
            self.find(FindingCode::OtherLength, line, message, help);
        }
        self.length_on = on;
        self.said_without_length = [false; 2];
    }

    /// Whether the control takes G43's length into its kinematics; else it knows the length otherwise.
    fn length_in_kinematics(&self) -> bool {
        self.setup.machine().spindle.axis_zero == AxisZero::GaugePoint
    }

    /// What the control adds to linear words to get axis positions with TCP off, and machine coordinates with TCP on.
    fn zero(&self) -> Vector {
        let added = self.length_on && (self.tcp || self.setup.machine().control.options.length_offset_without_tcp);
        let length = if added { self.setup.tool_length() } else { 0.0 };
        Vector::from(self.setup.work_offset()) + self.offset + Vector::new(0.0, 0.0, length)
    }

    /// X, Y, Z in program coordinates.
    fn here(&self) -> Point {
        if self.tcp { self.tip - self.offset } else { Point::from(self.axes.linear) - self.zero() }
    }

    fn step(&mut self, step: &Move) {
        self.check_tcp(step);
        let here = self.here();
        let target = self.target(step, here);
        if self.is_absurd(step, &target) {
            return;
        }
        let positioned = self.positioned;
        let known = self.needed.0 & !positioned.0 == 0;
        self.positioned = AxisSet(self.positioned.0 | self.named(step).0);
        let (path, travelled) = self.path(step, here, &target);
        let segment = Segment {
            line: step.line as usize,
            kind: if step.way == Way::Rapid { SegmentKind::Rapid } else { SegmentKind::Feed },
            start: self.time,
            duration: 0.0,
            programmed: 0.0,
            from: self.axes,
            to: target.axes,
            path,
        };
        self.axes = target.axes;
        if self.tcp {
            self.tip = target.words + self.offset;
        }
        if travelled.is_none() {
            return;
        }
        if known {
            self.add(step, segment, travelled);
        } else if segment.kind == SegmentKind::Feed
            && !self.only_turns_first(step, positioned)
            && !self.said_unknown_start
        {
            self.said_unknown_start = true;
            let missing = AxisSet(self.needed.0 & !self.positioned.0).indices().filter_map(|k| AXIS_LETTERS.get(k));
            let message = format!("a feed move before the program has positioned {}", missing.collect::<String>());
            let help = "position each axis with G0 first: nobody knows where the machine stands";
            self.find(FindingCode::UnknownStart, segment.line, message, help);
        }
    }

    /// Whether a move only brings rotary axes to where the program wants them first: slowly, where a rapid would not do.
    fn only_turns_first(&self, step: &Move, positioned: AxisSet) -> bool {
        step.given.0 & (0b111 | AxisSet::VECTOR.0 | positioned.0) == 0
    }

    /// Whether a move leads where no machine goes; then that is said. Following it would take for ever.
    fn is_absurd(&mut self, step: &Move, target: &Target) -> bool {
        let turns = target.axes.rotary.iter().zip(self.axes.rotary).map(|(to, from)| (to - from).abs() / TAU);
        let turns = turns.fold(0.0, f64::max);
        let away = target.words.coords.amax().max(target.axes.linear.iter().fold(0.0, |most, x| x.abs().max(most)));
        let message = if turns > MOST_TURNS {
            format!("a rotary axis turns {turns:.0} times in one block")
        } else if away > FARTHEST {
            format!("the block leads {:.0} m away", away / 1000.0)
        } else {
            return false;
        };
        let help = "write the decimal point where it belongs; the block is not followed";
        self.find(FindingCode::AbsurdMove, step.line as usize, message, help);
        true
    }

    /// Adds a segment with its duration.
    fn add(&mut self, step: &Move, mut segment: Segment, travelled: Travelled) {
        let feed = match step.way {
            Way::Rapid => None,
            Way::Line(feed) | Way::Arc(feed, _) => Some(feed),
        };
        let seconds = feed.and_then(|feed| feed_duration(&self.rules, feed, travelled, self.tcp, self.rpm));
        if let Some(Feed::InverseTime(word)) = feed
            && let Some(seconds) = self.rules.inverse_time_floor(word, travelled)
        {
            let message = format!("F{word} makes less than the slowest feed of the control: it takes {seconds:.4} s");
            let help = "make the block longer, or merge it with its neighbour";
            self.find(FindingCode::FeedTrap, segment.line, message, help);
        }
        segment.programmed = seconds.unwrap_or_else(|| rapid_duration(self.setup, &segment));
        let options = &self.setup.machine().control.options;
        segment.duration = match seconds {
            Some(seconds) if self.stops() && options.exact_stop && seconds > 0.0 => {
                stopped_duration(self.setup, &segment, seconds, options.cycle)
            }
            _ => segment.programmed,
        };
        if let (Some(_), Some(PathControl::Tolerance(tolerance))) = (feed, self.path_control) {
            self.rounding.tolerance = self.rounding.tolerance.max(tolerance);
            if tolerance > 0.0 && self.segments.last().is_some_and(|last| last.kind == SegmentKind::Feed) {
                let corner = Corner { segment: self.segments.len(), rotary: self.rounding_rotary };
                self.rounding.corners.push(corner);
            }
        }
        self.time += segment.duration;
        self.segments.push(segment);
    }

    /// Whether blocks are to end exactly where they say.
    fn stops(&self) -> bool {
        self.path_control == Some(PathControl::Exact)
    }

    /// The axes that a move positions.
    fn named(&self, step: &Move) -> AxisSet {
        if !step.given.has_vector() {
            return step.given;
        }
        AxisSet(self.rotary_letters.iter().fold(step.given.0, |bits, letter| bits | 1 << letter))
    }

    /// What the control refuses or misunderstands with TCP on, or off.
    fn check_tcp(&mut self, step: &Move) {
        if !self.tcp {
            if step.given.has_vector() {
                let message = "the tool axis by its components with TCP off";
                let help = "switch TCP on first, or write rotary angles";
                self.find(FindingCode::WrongTcpState, step.line as usize, message, help);
            }
            return;
        }
        let line = step.line as usize;
        let feeds = step.way != Way::Rapid;
        let [said_in_rapid, said_at_feed] = &mut self.said_without_length;
        let said = if feeds { said_at_feed } else { said_in_rapid };
        let was_said = std::mem::replace(said, true);
        if !was_said && !self.length_on && self.length_in_kinematics() {
            let severity = if feeds { Severity::Error } else { Severity::Warning };
            let message = "TCP is on with no tool length offset in force; the job's tool length is supposed here";
            let help = "write G43 H before TCP is switched on";
            self.findings.push(Finding::new(FindingCode::TcpWithoutLength, line, message, help).weighing(severity));
        }
        let refused = match step.frame {
            Frame::Work => false,
            Frame::Machine => !matches!(
                self.setup.machine().control.dialect,
                Dialect::LinuxCnc | Dialect::GrblHal | Dialect::Iso | Dialect::Siemens840d
            ),
            Frame::Reference(_) => true,
        };
        if refused {
            let message = "machine coordinates with TCP on";
            let help = "switch TCP off first";
            self.find(FindingCode::WrongTcpState, line, message, help);
        }
    }

    fn target(&mut self, step: &Move, here: Point) -> Target {
        let zero = self.zero();
        let linear = |index: usize| {
            let word = step.target[index];
            match step.frame {
                _ if !step.given.has(index) => here[index],
                Frame::Work if step.incremental.has(index) => here[index] + word,
                Frame::Work => word,
                Frame::Machine => word - zero[index],
                Frame::Reference(number) => self.reference(number, index) - zero[index],
            }
        };
        let words = Point::new(linear(0), linear(1), linear(2));
        let tip = words + self.offset;
        let rotary = if step.given.has_vector() { self.vector_target(step, tip) } else { self.rotary_target(step) };
        let axes = if self.tcp {
            self.setup.with_rotary(&tip, rotary)
        } else {
            AxisPosition { linear: (words + zero).into(), rotary }
        };
        Target { words, axes }
    }

    /// The rotary angles for a tool axis given by its components: of all those nearest to where the axes stand.
    fn vector_target(&mut self, step: &Move, tip: Point) -> [f64; 2] {
        let [_, _, _, x, y, z] = step.target;
        let near = Direction::try_new(Vector::new(x, y, z), 1e-9)
            .and_then(|axis| self.setup.inverse_near(&Pose { tip, axis }, self.axes.rotary));
        match near {
            Some(axes) => axes.rotary,
            None => {
                let message = format!("no rotary angles bring the tool axis to [{x}, {y}, {z}]");
                let help = "post for this machine, or check that the machine file is the right one";
                self.find(FindingCode::UnreachableAxis, step.line as usize, message, help);
                self.axes.rotary
            }
        }
    }

    /// Where a reference position has an axis of the machine, mm or degrees.
    fn reference(&self, number: u8, axis: usize) -> f64 {
        let positions = &self.setup.machine().control.reference_positions;
        let position = positions.get(usize::from(number).saturating_sub(1));
        position.and_then(|position| position.get(axis)).copied().unwrap_or(0.0)
    }

    fn rotary_target(&self, step: &Move) -> [f64; 2] {
        let [first, second] = &self.setup.machine().rotary;
        [(0, first), (1, second)].map(|(slot, axis)| {
            let start = self.axes.rotary[slot];
            let index = self.rotary_letters[slot];
            if !step.given.has(index) {
                return start;
            }
            let word = match step.frame {
                Frame::Reference(number) => self.reference(number, 3 + slot),
                _ => step.target.get(index).copied().unwrap_or(0.0),
            };
            if step.incremental.has(index) {
                return start + word.to_radians();
            }
            let options = &self.setup.machine().control.options;
            turn_to(word, start, step.turns.of(index), axis.travel, options)
        })
    }

    /// The way to the target, and how long it is.
    fn path(&mut self, step: &Move, here: Point, target: &Target) -> (Path, Travelled) {
        let turned = |slot: usize| (target.axes.rotary[slot] - self.axes.rotary[slot]).to_degrees();
        let rotary = turned(0).hypot(turned(1));
        if let Way::Arc(_, index) = step.way
            && let Some(words) = self.program.arcs.get(index as usize)
        {
            match Arc::from_words(words, here, target.words, Point::origin()) {
                Ok(arc) => {
                    let travelled = Travelled { linear: arc.length(), rotary };
                    let path = if self.tcp {
                        Path::TipArc(arc.moved(self.offset))
                    } else {
                        Path::JointArc(arc.moved(self.zero()))
                    };
                    return (path, travelled);
                }
                Err(reason) => {
                    let help = "correct its centre or radius";
                    self.find(FindingCode::BadArc, step.line as usize, reason, help);
                }
            }
        }
        let travelled = Travelled { linear: (target.words - here).norm(), rotary };
        let end = target.words + self.offset;
        let path = match self.turning(step) {
            None => Path::Joints,
            Some(TcpInterpolation::RotaryLinear) => Path::Tip { from: self.tip, to: end },
            Some(TcpInterpolation::GreatCircle) => {
                Path::Vector { from: self.setup.forward(&self.axes), to: self.setup.forward(&target.axes) }
            }
        };
        (path, travelled)
    }

    /// How the tool turns with TCP on; `None` with TCP off.
    fn turning(&self, step: &Move) -> Option<TcpInterpolation> {
        let options = &self.setup.machine().control.options;
        let usual = if step.given.has_vector() { options.vector_interpolation } else { options.tcp_interpolation };
        self.tcp.then(|| self.interpolation.unwrap_or(usual))
    }

    fn find(&mut self, code: FindingCode, line: usize, message: impl Into<String>, help: &str) {
        self.findings.push(Finding::new(code, line, message, help));
    }
}
