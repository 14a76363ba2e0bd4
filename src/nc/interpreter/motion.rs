//! The move that a block commands, with its feed, its arc and its axes.

use super::{Interpreter, MotionState};
use crate::machine::InverseTimeUnit;
use crate::nc::block::Block;
use crate::nc::block_codes::{BlockCodes, Letters};
use crate::nc::code::{FeedUnit, Motion, SpindleTurn, letters as letter_bits};
use crate::nc::finding::FindingCode;
use crate::nc::program::{AXIS_LETTERS, ArcCentre, ArcWords, AxisSet, Feed, Frame, Move, Turns, Way};

impl Interpreter<'_> {
    /// The move that a block commands.
    pub(super) fn command(&mut self, block: &Block, letters: &Letters, codes: &BlockCodes) {
        if let Some(motion) = codes.motion {
            self.motion = MotionState::Known(motion);
        }
        if codes.canned_cycle {
            self.motion = MotionState::NotFollowed;
        }
        let given = self.given(block, letters);
        self.watch_radians(block, given);
        if let Some(number) = codes.reference {
            self.reference(block, letters, given, number);
            return;
        }
        if codes.circle_centre {
            let [x, y, z, ..] = letters.axes(self.scale(), given);
            self.circle_centre = Some([x, y, z]);
            return;
        }
        let arc_words = letters.present() & letter_bits("IJK") != 0;
        if codes.not_followed || codes.dwell || (given.is_empty() && !arc_words) {
            return;
        }
        let MotionState::Known(motion) = self.motion else {
            if self.motion == MotionState::Unset && !std::mem::replace(&mut self.said_no_motion, true) {
                let help = "write G0 or G1 before the first axis word";
                self.note(block, FindingCode::NoMotionCode, "axis words with no motion code in force", help);
            }
            return;
        };
        let Some(way) = self.way(block, letters, codes, motion) else { return };
        let frame = if codes.machine_frame { Frame::Machine } else { Frame::Work };
        if codes.machine_frame && (self.incremental || matches!(way, Way::Arc(..))) {
            let message = "machine coordinates need G90 and G0 or G1";
            self.note(block, FindingCode::GroupConflict, message, "write G90 G53 G0");
        }
        self.push_move(block, letters, given, way, frame);
    }

    fn way(&mut self, block: &Block, letters: &Letters, codes: &BlockCodes, motion: Motion) -> Option<Way> {
        Some(match motion {
            _ if codes.rapid_once => Way::Rapid,
            Motion::Rapid => Way::Rapid,
            Motion::Line => Way::Line(self.feed_in_force(block, letters)),
            Motion::Arc { clockwise } => {
                let arc = self.arc(block, letters, clockwise)?;
                let index = self.program.arcs.len() as u32;
                let feed = self.feed_in_force(block, letters);
                self.program.arcs.push(arc);
                Way::Arc(feed, index)
            }
        })
    }

    fn push_move(&mut self, block: &Block, letters: &Letters, given: AxisSet, way: Way, frame: Frame) {
        let mut target = letters.axes(self.scale(), given);
        if given.has_vector()
            && let ([_, _, _, orientation @ ..], Some(vector)) = (&mut target, letters.vector())
        {
            *orientation = vector;
        }
        let incremental = match frame {
            Frame::Work => letters.incremental(self.incremental),
            _ => AxisSet::default(),
        };
        let turns = if self.shortest_way { Turns::SHORTEST } else { letters.turns() };
        let changes = self.program.changes.len() as u32;
        self.program.moves.push(Move { target, way, line: block.line, changes, given, frame, incremental, turns });
    }

    /// G28, G30: first through the given point, then to the reference position, both as rapids.
    fn reference(&mut self, block: &Block, letters: &Letters, given: AxisSet, number: u8) {
        if !given.is_empty() {
            self.push_move(block, letters, given, Way::Rapid, Frame::Work);
        }
        let all = if given.is_empty() { self.rules.axes } else { given };
        self.push_move(block, &Letters::default(), all, Way::Rapid, Frame::Reference(number));
    }

    /// The axes a block names; those the machine lacks are findings and left out.
    fn given(&mut self, block: &Block, letters: &Letters) -> AxisSet {
        let given = letters.axis_set();
        let lacking = AxisSet(given.0 & !self.rules.axes.0);
        for index in lacking.indices() {
            let letter = AXIS_LETTERS[index];
            let known: String = self.rules.axes.indices().filter_map(|k| AXIS_LETTERS.get(k)).collect();
            let message = format!("the machine has no axis {letter}; it has {known}");
            let help = "post for this machine, or check that the machine file is the right one";
            self.find_letter(block, letter as u8, FindingCode::MissingAxis, &message, help);
        }
        let given = AxisSet(given.0 & self.rules.axes.0);
        let Some(vector) = letters.vector() else { return given };
        if vector == [0.0; 3] {
            let message = "a tool axis of no length";
            self.note(block, FindingCode::BadNumber, message, "write at least one component that is not zero");
            return given;
        }
        if given.0 & 0b11_1000 != 0 {
            let message = "rotary axes and the components of the tool axis in one block";
            self.note(block, FindingCode::GroupConflict, message, "write one of them");
            return given;
        }
        AxisSet(given.0 | AxisSet::VECTOR.0)
    }

    fn watch_radians(&mut self, block: &Block, given: AxisSet) {
        if given.0 & 0b11_1000 != 0 && self.radians.possible() {
            for word in self.blocks.words(block).iter().filter(|word| matches!(word.letter, b'A'..=b'C')) {
                self.radians.see(block, word);
            }
        }
    }

    /// The feed of a feed move, with what is to be said about it.
    fn feed_in_force(&mut self, block: &Block, letters: &Letters) -> Feed {
        if (self.spindle == SpindleTurn::Off || self.rpm <= 0.0) && !self.said_spindle {
            self.said_spindle = true;
            let message = "a feed move while the spindle stands still";
            self.note(block, FindingCode::SpindleOff, message, "start the spindle first: S and M3 or M4");
        }
        if !self.said_blending {
            self.said_blending = true;
            let message = "the control rounds corners here without any tolerance";
            let help = "write G61, G61.1 or G64 with P before the first feed move";
            self.note(block, FindingCode::Blending, message, help);
        }
        let inverse = self.feed_unit == FeedUnit::InverseTime;
        match self.feed {
            Some(feed) if !inverse || letters.get(b'F').is_some() => self.feed_of(feed),
            _ => {
                let (message, help) = if inverse {
                    ("inverse-time feed (G93) without F in the block", "write F in each block under G93")
                } else {
                    ("a feed move with no feed in force", "write F; it is forgotten when G93, G94, G95 change")
                };
                self.note(block, FindingCode::MissingFeed, message, help);
                Feed::Missing
            }
        }
    }

    /// The feed that an F word means.
    fn feed_of(&self, value: f64) -> Feed {
        match (self.feed_unit, self.rules.inverse_time_unit) {
            (FeedUnit::InverseTime, InverseTimeUnit::PerMinute) => Feed::InverseTime(value),
            (FeedUnit::InverseTime, InverseTimeUnit::PerSecond) => Feed::InverseTime(value * 60.0),
            (FeedUnit::InverseTime, InverseTimeUnit::Seconds) => Feed::Duration(value),
            (FeedUnit::PerMinute, _) => Feed::PerMinute { linear: value * self.scale(), rotary: value },
            (FeedUnit::PerRevolution, _) => Feed::PerRevolution(value * self.scale()),
        }
    }

    fn arc(&mut self, block: &Block, letters: &Letters, clockwise: bool) -> Option<ArcWords> {
        let scale = self.scale();
        let offsets = [b'I', b'J', b'K'].map(|letter| letters.get(letter));
        let centre = match (letters.get(b'R'), offsets) {
            (Some(radius), [None, None, None]) if radius != 0.0 => ArcCentre::Radius(radius * scale),
            (None, [None, None, None]) if self.circle_centre.is_some() => {
                ArcCentre::Point { words: self.circle_centre.unwrap_or_default(), absolute: true }
            }
            (None, offsets) if offsets != [None; 3] => ArcCentre::Point {
                words: offsets.map(|v| v.unwrap_or(0.0) * scale),
                absolute: letters.centre_is_absolute(self.arc_absolute),
            },
            _ => {
                let message = "an arc needs its centre (I, J, K) or its radius (R), one of them";
                self.note(block, FindingCode::BadArc, message, "write one of them");
                return None;
            }
        };
        let turns = letters.get(b'P').filter(|_| self.rules.arc_turns).map_or(1.0, |p| p.clamp(1.0, 1e6)) as u32;
        Some(ArcWords { plane: self.plane, clockwise, centre, turns })
    }
}
