//! What a program leaves to chance: states of the control that it relies on and never sets. Uses `machine`, `nc` and
//! `simulate`.

use crate::machine::{Dialect, Setup};
use crate::nc::program::{Change, ChangeAt, LengthOffset, Move, Way};
use crate::nc::{Finding, FindingCode, Program};

/// Walks through a program and says each thing once.
pub(super) fn modal(program: &Program, setup: &Setup) -> Vec<Finding> {
    let mut state = State::new(setup);
    let mut changes = program.changes.iter();
    let mut done = 0;
    for step in &program.moves {
        let due = (step.changes as usize).saturating_sub(done);
        changes.by_ref().take(due).for_each(|at| state.change(at));
        done += due;
        state.step(step);
    }
    state.findings
}

struct State<'a> {
    setup: &'a Setup,
    tcp: bool,
    length: bool,
    offset: bool,
    tool: bool,
    /// The last move was at a feed, and TCP has not been switched since.
    cutting: bool,
    /// Where TCP was switched since a feed move.
    switched: Option<usize>,
    findings: Vec<Finding>,
}

impl<'a> State<'a> {
    fn new(setup: &'a Setup) -> Self {
        let tcp = setup.machine().control.options.tcp_at_start;
        Self {
            setup,
            tcp,
            length: false,
            offset: false,
            tool: false,
            cutting: false,
            switched: None,
            findings: Vec::new(),
        }
    }

    fn change(&mut self, at: &ChangeAt) {
        match at.change {
            Change::Tcp(on) => {
                if on != self.tcp && self.cutting {
                    self.switched = Some(at.line as usize);
                }
                self.tcp = on;
            }
            Change::Length(length) => self.length = length != LengthOffset::Off,
            Change::WorkOffset(code) => {
                self.offset = true;
                self.other_offset(&code.to_string(), at.line as usize);
            }
            Change::Tool(_) => self.tool = true,
            _ => {}
        }
    }

    fn other_offset(&mut self, name: &str, line: usize) {
        let own = self.setup.work_offset();
        let offsets = &self.setup.machine().control.work_offsets;
        if let Some(other) = offsets.iter().find(|offset| offset.name == name && offset.linear != own) {
            let [x, y, z] = other.linear;
            let message = format!("work offset {name}, at ({x}, {y}, {z}), is not the job's");
            self.say(FindingCode::OtherWorkOffset, line, message);
        }
    }

    fn step(&mut self, step: &Move) {
        let line = step.line as usize;
        if step.way == Way::Rapid {
            (self.cutting, self.switched) = (false, None);
            return;
        }
        if let Some(at) = self.switched.take() {
            let state = if self.tcp { "on" } else { "off" };
            self.say(FindingCode::TcpSwitchedInCut, at, format!("TCP is switched {state} between two feed moves"));
        }
        self.cutting = true;
        // Klartext programs run at the preset that the operator has chosen.
        let preset = self.setup.machine().control.dialect == Dialect::HeidenhainTnc;
        if !self.offset && !preset {
            self.say(FindingCode::NoWorkOffset, line, "a feed move, and no work offset has been called");
        }
        if !self.tool {
            self.say(FindingCode::NoTool, line, "a feed move, and no tool has been called");
        }
        let control = &self.setup.machine().control;
        if !self.tcp && !self.length && control.options.length_offset_without_tcp {
            self.say(FindingCode::LengthOff, line, "a feed move with TCP off and no tool length offset in force");
        }
        let turns = step.given.indices().any(|index| index > 2);
        if !self.tcp && control.tcp && turns {
            self.say(FindingCode::CutWithoutTcp, line, "rotary axes turn at a feed with TCP off");
        }
    }

    /// Says a thing, unless it has been said; other offsets are said each time.
    fn say(&mut self, code: FindingCode, line: usize, message: impl Into<String>) {
        let repeats = matches!(code, FindingCode::OtherWorkOffset | FindingCode::TcpSwitchedInCut);
        if repeats || !self.findings.iter().any(|finding| finding.code == code) {
            self.findings.push(Finding::new(code, line, message, code.rule().remedy));
        }
    }
}
