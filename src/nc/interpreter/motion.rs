//! The move that a block commands, with its feed, its arc and its axes.

use super::{Interpreter, MotionState};
use crate::nc::block::Block;
use crate::nc::block_codes::{BlockCodes, Letters};
use crate::nc::code::{FeedUnit, Motion, SpindleTurn};
use crate::nc::finding::FindingCode;
use crate::nc::program::{AXIS_LETTERS, ArcCentre, ArcWords, AxisSet, Feed, Frame, Move, Way};

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
        let arc_words = letters.present() & (Letters::bit(b'I') | Letters::bit(b'J') | Letters::bit(b'K')) != 0;
        if let Some(number) = codes.reference {
            self.reference(block, letters, given, number);
            return;
        }
        if codes.not_followed || codes.dwell || (given == AxisSet::default() && !arc_words) {
            return;
        }
        let MotionState::Known(motion) = self.motion else {
            if self.motion == MotionState::Unset && !std::mem::replace(&mut self.said_no_motion, true) {
                let help = "write G0 or G1 before the first axis word";
                self.note(block, FindingCode::NoMotionCode, "axis words with no motion code in force", help);
            }
            return;
        };
        let way = match motion {
            Motion::Rapid => Way::Rapid,
            Motion::Line => Way::Line(self.feed_in_force(block, letters)),
            Motion::Arc { clockwise } => {
                let Some(arc) = self.arc(block, letters, clockwise) else { return };
                let index = self.program.arcs.len() as u32;
                let feed = self.feed_in_force(block, letters);
                self.program.arcs.push(arc);
                Way::Arc(feed, index)
            }
        };
        let frame = if codes.machine_frame { Frame::Machine } else { Frame::Work };
        if codes.machine_frame && (self.incremental || matches!(way, Way::Arc(..))) {
            let message = "machine coordinates need G90 and G0 or G1";
            self.note(block, FindingCode::GroupConflict, message, "write G90 G53 G0");
        }
        let incremental = self.incremental && !codes.machine_frame;
        self.push_move(block, letters, given, way, frame, incremental);
    }

    fn push_move(
        &mut self,
        block: &Block,
        letters: &Letters,
        given: AxisSet,
        way: Way,
        frame: Frame,
        incremental: bool,
    ) {
        let scale = if self.inch { 25.4 } else { 1.0 };
        let target = letters.axes(scale, given);
        let changes = self.program.changes.len() as u32;
        self.program.moves.push(Move { target, way, line: block.line, changes, given, frame, incremental });
    }

    /// G28, G30: first through the given point, then to the reference position, both as rapids.
    fn reference(&mut self, block: &Block, letters: &Letters, given: AxisSet, number: u8) {
        if given != AxisSet::default() {
            self.push_move(block, letters, given, Way::Rapid, Frame::Work, self.incremental);
        }
        let all = if given == AxisSet::default() { self.rules.axes } else { given };
        self.push_move(block, &Letters::default(), all, Way::Rapid, Frame::Reference(number), false);
    }

    /// The axes a block names; those the machine lacks are findings and left out.
    fn given(&mut self, block: &Block, letters: &Letters) -> AxisSet {
        let given = letters.axis_set();
        let lacking = AxisSet(given.0 & !self.rules.axes.0);
        for index in lacking.indices() {
            let letter = AXIS_LETTERS[index];
            let message = format!("the machine has no axis {letter}");
            let help = "post for this machine, or check that the machine file is the right one";
            self.find_letter(block, letter as u8, FindingCode::MissingAxis, &message, help);
        }
        AxisSet(given.0 & self.rules.axes.0)
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
            Some(feed) if !inverse || letters.get(b'F').is_some() => Feed::of(feed, self.feed_unit, self.inch),
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

    fn arc(&mut self, block: &Block, letters: &Letters, clockwise: bool) -> Option<ArcWords> {
        let scale = if self.inch { 25.4 } else { 1.0 };
        let offsets = [b'I', b'J', b'K'].map(|letter| letters.get(letter));
        let centre = match (letters.get(b'R'), offsets) {
            (Some(radius), [None, None, None]) if radius != 0.0 => ArcCentre::Radius(radius * scale),
            (None, offsets) if offsets != [None; 3] => {
                ArcCentre::Point { words: offsets.map(|v| v.unwrap_or(0.0) * scale), absolute: self.arc_absolute }
            }
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
