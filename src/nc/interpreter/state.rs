//! What a block changes before it moves, in the order in which controls do it.

use super::{Interpreter, MotionState};
use crate::diagnostic::Severity;
use crate::machine::OrientationWords;
use crate::nc::block::{Block, address};
use crate::nc::block_codes::{BlockCodes, Letters};
use crate::nc::code::{FeedGroup, GCode, PathControl, WorkOffsetCode};
use crate::nc::finding::{Finding, FindingCode};
use crate::nc::program::{Change, LengthOffset};

impl Interpreter<'_> {
    /// Whether I, J, K of the block are components of the tool axis.
    pub(super) fn takes_vectors(&self, codes: &BlockCodes) -> bool {
        match codes.length {
            Some(GCode::LengthOn { tcp: Some(words) }) => words == OrientationWords::Vectors,
            Some(_) => false,
            None => self.vectors,
        }
    }

    /// Everything that a block changes.
    pub(super) fn change_state(&mut self, block: &Block, letters: &Letters, codes: &BlockCodes) {
        if let Some(unit) = codes.feed_unit {
            if unit != self.feed_unit {
                self.feed = None;
            }
            self.feed_unit = unit;
        }
        self.change_units(block, codes);
        self.change_feed(block, letters, codes);
        if let Some(tool) = letters.get(b'T') {
            self.tool = self.whole(block, b'T', tool);
        }
        if codes.tool_change {
            let tool = self.tool.unwrap_or(0);
            self.change(block, Change::Tool(tool));
            if codes.tool_call {
                let length = if tool == 0 { LengthOffset::Off } else { LengthOffset::OwnTool };
                self.change(block, Change::Length(length));
            }
        }
        self.change_spindle(block, letters, codes);
        self.change_tcp(block, letters, codes);
        if codes.dwell {
            let seconds = letters.get(b'P').map(|p| p * self.rules.dwell_unit).or(letters.get(b'X'));
            let seconds = seconds.or_else(|| letters.get(b'F').filter(|_| self.rules.dwell_in_f));
            self.change(block, Change::Dwell(seconds.unwrap_or(0.0).max(0.0)));
        }
        self.plane = codes.plane.unwrap_or(self.plane);
        self.change_offsets(block, letters, codes);
        self.change_path_control(block, letters, codes);
        self.incremental = codes.incremental.unwrap_or(self.incremental);
        self.arc_absolute = codes.arc_absolute.unwrap_or(self.arc_absolute);
        self.shortest_way = codes.shortest_way.unwrap_or(self.shortest_way);
        if codes.motion_off {
            self.motion = MotionState::Unset;
            self.said_no_motion = false;
        }
    }

    fn change_units(&mut self, block: &Block, codes: &BlockCodes) {
        let Some(inch) = codes.inch else { return };
        if inch != self.inch && !self.program.moves.is_empty() {
            let message = "the unit of length changes after the first move";
            self.note(block, FindingCode::UnitsChange, message, "write one unit in the header, and keep to it");
        }
        self.inch = inch;
        self.change(block, Change::Units { inch });
    }

    fn change_feed(&mut self, block: &Block, letters: &Letters, codes: &BlockCodes) {
        if let Some(feed) = letters.get(b'F').filter(|_| !(codes.dwell && self.rules.dwell_in_f)) {
            if feed < 0.0 {
                self.find_letter(block, b'F', FindingCode::BadNumber, "a negative feed", "write a positive one");
            }
            self.feed = Some(feed).filter(|value| *value > 0.0);
        }
        let radius = letters.get(address::FEED_RADIUS).filter(|radius| *radius > 0.0);
        if radius.is_none() && codes.feed_group.is_none() {
            return;
        }
        self.feed_radius = radius.map_or(self.feed_radius, |radius| radius * self.scale());
        self.feed_group = codes.feed_group.unwrap_or(self.feed_group);
        let radius = match self.feed_group {
            FeedGroup::Usual => self.rules.usual_feed_radius,
            FeedGroup::Linear => 0.0,
            FeedGroup::All => self.feed_radius,
        };
        self.change(block, Change::FeedRadius(radius));
    }

    fn change_spindle(&mut self, block: &Block, letters: &Letters, codes: &BlockCodes) {
        if let Some(coolant) = codes.coolant {
            self.change(block, Change::Coolant(coolant));
        }
        let speed = letters.get(b'S');
        if speed.is_none() && codes.spindle.is_none() {
            return;
        }
        if speed.is_some_and(|speed| speed < 0.0) {
            let help = "write a positive one, and M4 to turn the other way";
            self.find_letter(block, b'S', FindingCode::BadNumber, "a negative spindle speed", help);
        }
        self.rpm = speed.unwrap_or(self.rpm);
        self.spindle = codes.spindle.unwrap_or(self.spindle);
        self.said_spindle = false;
        self.change(block, Change::Spindle { turn: self.spindle, rpm: self.rpm });
    }

    fn change_tcp(&mut self, block: &Block, letters: &Letters, codes: &BlockCodes) {
        if let Some(on) = codes.tcp {
            self.change(block, Change::Tcp(on));
            if self.rules.tcp_says_interpolation && codes.interpolation.is_none() {
                self.change(block, Change::Interpolation(None));
            }
        }
        if let Some(how) = codes.interpolation {
            self.change(block, Change::Interpolation(Some(how)));
        }
        let Some(switch) = self.rules.tcp_output.filter(|_| codes.analog_output) else { return };
        let (output, value) = (letters.get(b'E').unwrap_or(0.0), letters.get(b'Q').unwrap_or(0.0));
        if output == switch.output && value == switch.on {
            self.change(block, Change::Tcp(true));
        } else if output == switch.output && value == switch.off {
            self.change(block, Change::Tcp(false));
        }
    }

    fn change_offsets(&mut self, block: &Block, letters: &Letters, codes: &BlockCodes) {
        match codes.length {
            Some(GCode::LengthOn { tcp }) => {
                self.length_on(block, letters);
                self.vectors = tcp == Some(OrientationWords::Vectors);
                if self.vectors && letters.vector().is_some() {
                    let message = "a tool vector in the block that turns TCP on: controls of turning tables refuse it";
                    let help = "bring the rotary axes there first, and write I, J, K from the next block on";
                    let finding = Finding::new(FindingCode::WrongTcpState, block.line as usize, message, help);
                    self.add(finding.weighing(Severity::Warning));
                }
                if tcp.is_some() {
                    self.change(block, Change::Tcp(true));
                }
            }
            Some(GCode::LengthOff { tcp }) => {
                self.vectors = false;
                if tcp {
                    self.change(block, Change::Tcp(false));
                }
                self.change(block, Change::Length(LengthOffset::Off));
            }
            _ => {}
        }
        if let Some(edge) = letters.get(b'D').filter(|_| self.rules.length_by_d) {
            let length = if edge == 0.0 { LengthOffset::Off } else { LengthOffset::OwnTool };
            self.change(block, Change::Length(length));
        }
        if let Some(tenths) = codes.work_offset {
            let chosen = codes.offset_letter.and_then(|letter| Some((letter, letters.get(letter)? as u16)));
            self.change(block, Change::WorkOffset(WorkOffsetCode { tenths, chosen }));
        }
    }

    fn length_on(&mut self, block: &Block, letters: &Letters) {
        let number = letters.get(b'H').and_then(|value| self.whole(block, b'H', value));
        let offset = match number {
            Some(0) => LengthOffset::Off,
            Some(number) => LengthOffset::Number(number),
            None => LengthOffset::OwnTool,
        };
        if number.is_none() && !self.rules.own_length {
            let message = "a tool length offset without its number";
            let help = "write H and the tool's number";
            self.note(block, FindingCode::MissingOffsetNumber, message, help);
        }
        self.change(block, Change::Length(offset));
    }

    fn change_path_control(&mut self, block: &Block, letters: &Letters, codes: &BlockCodes) {
        if codes.exact_path {
            self.said_blending = true;
            self.change(block, Change::PathControl(PathControl::Exact));
        }
        let rotary = letters.get(b'Q').filter(|_| codes.blend && self.rules.rotary_tolerance);
        if codes.blend && self.rules.rotary_tolerance {
            self.change(block, Change::RoundingRotary(rotary.map(f64::abs)));
        }
        // A tolerance of rotary axes alone goes with that of the block before.
        if codes.blend && (rotary.is_none() || letters.get(b'P').is_some()) {
            // To LinuxCNC a tolerance of zero is none; one below zero is to nobody.
            let some = |p: &f64| *p > 0.0 || *p == 0.0 && !self.rules.blends_at_start;
            let tolerance = letters.get(b'P').map(|p| p * self.scale()).filter(some);
            self.said_blending = tolerance.is_some();
            if let Some(tolerance) = tolerance {
                let message =
                    format!("the control rounds corners by up to {tolerance} mm, more where rotary axes turn");
                let help = "write G61 or G61.1, or allow for the band that `verify` adds to its figures";
                self.note(block, FindingCode::Blending, &message, help);
            }
            self.change(block, Change::PathControl(tolerance.map_or(PathControl::Free, PathControl::Tolerance)));
        }
    }

    /// mm of a unit of length.
    pub(super) fn scale(&self) -> f64 {
        if self.inch { 25.4 } else { 1.0 }
    }
}
