//! Gives blocks their meaning: modal state, moves, changes, and everything remarkable on the way. Knows no machine
//! beyond its axis letters and its control's rules; positions are followed later. Uses `diagnostic`.

use super::block::{Block, Blocks, Word};
use super::block_codes::{BlockCodes, Letters};
use super::code::{FeedUnit, GCode, Motion, PathControl, Plane, SpindleTurn, WorkOffsetCode};
use super::dialect::Rules;
use super::finding::{Finding, FindingCode};
use super::lexer::lex;
use super::program::{Change, ChangeAt, LengthOffset, Program};
use super::radians::RadiansWatch;
use crate::diagnostic::Severity;

/// Reads a whole program. Never fails: what cannot be understood is a finding, and reading goes on behind it.
pub fn read(text: &[u8], rules: &Rules) -> Program {
    let mut blocks = lex(text, &rules.lexical);
    let reading = std::mem::take(&mut blocks.findings);
    let mut interpreter = Interpreter::new(rules, &blocks);
    interpreter.run();
    let mut program = interpreter.program;
    program.findings.merge(reading);
    program
}

mod motion;

/// The motion code in force.
#[derive(Clone, Copy, PartialEq)]
enum MotionState {
    Unset,
    /// A code whose moves are not followed (a canned cycle).
    NotFollowed,
    Known(Motion),
}

struct Interpreter<'a> {
    rules: &'a Rules,
    blocks: &'a Blocks,
    program: Program,
    motion: MotionState,
    plane: Plane,
    inch: bool,
    incremental: bool,
    arc_absolute: bool,
    feed_unit: FeedUnit,
    feed: Option<f64>,
    spindle: SpindleTurn,
    rpm: f64,
    /// Chosen by T, in the spindle after M6.
    tool: Option<u32>,
    /// What has been said and need not be repeated before the state changes.
    said_spindle: bool,
    said_blending: bool,
    said_deletable: bool,
    said_no_motion: bool,
    radians: RadiansWatch,
}

impl<'a> Interpreter<'a> {
    fn new(rules: &'a Rules, blocks: &'a Blocks) -> Self {
        let mut program = Program { blocks: blocks.blocks.len(), lines: blocks.lines, ..Program::default() };
        program.moves.reserve(blocks.blocks.len());
        if rules.blends_at_start {
            program.changes.push(ChangeAt { line: 1, change: Change::PathControl(PathControl::Free) });
        }
        Self {
            rules,
            blocks,
            program,
            motion: MotionState::Unset,
            plane: Plane::Xy,
            inch: false,
            incremental: false,
            arc_absolute: false,
            feed_unit: FeedUnit::PerMinute,
            feed: None,
            spindle: SpindleTurn::Off,
            rpm: 0.0,
            tool: None,
            said_spindle: false,
            said_blending: !rules.blends_at_start,
            said_deletable: false,
            said_no_motion: false,
            radians: RadiansWatch::default(),
        }
    }

    fn run(&mut self) {
        let blocks = self.blocks;
        let mut ended = blocks.closed;
        for (index, block) in blocks.blocks.iter().enumerate() {
            if self.block(block) {
                ended = true;
                self.unreached(index + 1);
                break;
            }
        }
        let last = self.program.lines;
        if blocks.blocks.is_empty() {
            self.add(Finding::new(FindingCode::UnreadableText, 1, "the program holds no block", "write one"));
        } else if !ended {
            let message = "the program does not say where it ends";
            let finding = Finding::new(FindingCode::MissingEnd, last, message, "end it with M2 or M30");
            let severity = if self.rules.end_needed { Severity::Error } else { Severity::Warning };
            self.add(finding.weighing(severity));
        }
        if let Some(finding) = self.radians.finding() {
            self.add(finding);
        }
    }

    /// Blocks behind the end of the program.
    fn unreached(&mut self, index: usize) {
        self.program.blocks = index;
        let Some(block) = self.blocks.blocks.get(index) else { return };
        let message = "the control never reaches this: the program has ended";
        let help = "remove it, or move the end behind it";
        self.note(block, FindingCode::UnreachedText, message, help);
    }

    /// Carries out one block; true when the program ends with it.
    fn block(&mut self, block: &Block) -> bool {
        let words = self.blocks.words(block);
        let mut letters = Letters::default();
        let mut codes = BlockCodes::default();
        for word in words {
            match word.letter {
                b'G' => self.add_g(block, word, &mut codes),
                b'M' => self.add_m(block, word, &mut codes),
                _ => {
                    if letters.add(word.letter, word.value) {
                        let message = format!("the letter {} twice in one block", char::from(word.letter));
                        self.find(block, word, FindingCode::RepeatedWord, message, "write it once");
                    }
                }
            }
        }
        if block.deletable && !self.said_deletable {
            self.said_deletable = true;
            let message = "blocks with / are taken as executed";
            let help = "switch block delete off at the control, or remove them";
            self.note(block, FindingCode::BlockDelete, message, help);
        }
        self.unused_letters(block, &letters, &codes);
        self.change_state(block, &letters, &codes);
        self.command(block, &letters, &codes);
        if codes.stop {
            self.change(block, Change::Stop);
        }
        codes.end
    }

    fn add_g(&mut self, block: &Block, word: &Word, codes: &mut BlockCodes) {
        let meaning = self.rules.g_code(word.value);
        if !codes.add_g(meaning, word.value) {
            self.group_conflict(block, word);
        }
        self.not_followed(block, word, meaning == GCode::Unknown, meaning == GCode::Unsupported);
    }

    fn add_m(&mut self, block: &Block, word: &Word, codes: &mut BlockCodes) {
        use super::code::MCode;
        let meaning = self.rules.m_code(word.value);
        if !codes.add_m(meaning) {
            self.group_conflict(block, word);
        }
        if codes.m_codes == self.rules.m_codes_per_block + 1 {
            let message = format!("more than {} M codes in one block", self.rules.m_codes_per_block);
            self.find(block, word, FindingCode::GroupConflict, message, "write them in blocks of their own");
        }
        self.not_followed(block, word, meaning == MCode::Unknown, meaning == MCode::Unsupported);
    }

    fn group_conflict(&mut self, block: &Block, word: &Word) {
        let message = format!("{} and another code of its modal group in one block", name(word));
        self.find(block, word, FindingCode::GroupConflict, message, "write one of them, or two blocks");
    }

    fn not_followed(&mut self, block: &Block, word: &Word, unknown: bool, unsupported: bool) {
        if unknown {
            let message = format!("{} is no code of this control as far as is known here", name(word));
            let help = "remove it, or check that the machine's dialect and its options are right";
            self.find(block, word, FindingCode::UnknownCode, message, help);
        } else if unsupported {
            let message = format!("{} is not followed here: what it does to the motion is not known", name(word));
            let help = "post the program without it";
            self.find(block, word, FindingCode::UnsupportedCode, message, help);
        }
    }

    /// Letters that no code of the block takes.
    fn unused_letters(&mut self, block: &Block, letters: &Letters, codes: &BlockCodes) {
        let unused = letters.present() & !codes.parameters(self.motion == MotionState::NotFollowed, self.is_arc(codes));
        if unused == 0 && !self.rules.point_needed {
            return;
        }
        for word in self.blocks.words(block) {
            if Letters::bit(word.letter) & unused != 0 {
                let message = format!("{} means nothing in this block", name(word));
                self.find(
                    block,
                    word,
                    FindingCode::UnusedWord,
                    message,
                    "remove it, or add the code that it belongs to",
                );
            }
            let dimension = matches!(word.letter, b'X'..=b'Z' | b'A'..=b'C' | b'I'..=b'K' | b'R');
            if self.rules.point_needed && dimension && !word.point && word.value != 0.0 {
                let message = format!("{} has no decimal point: the control may count increments", name(word));
                self.find(
                    block,
                    word,
                    FindingCode::MissingPoint,
                    message,
                    "write the point; here it is read as mm or degrees",
                );
            }
        }
    }

    fn is_arc(&self, codes: &BlockCodes) -> bool {
        let motion = codes.motion.map_or(self.motion, MotionState::Known);
        matches!(motion, MotionState::Known(Motion::Arc { .. }))
    }

    /// What a block changes before it moves, in the order in which controls do it.
    fn change_state(&mut self, block: &Block, letters: &Letters, codes: &BlockCodes) {
        if let Some(unit) = codes.feed_unit {
            if unit != self.feed_unit {
                self.feed = None;
            }
            self.feed_unit = unit;
        }
        if let Some(inch) = codes.inch {
            self.inch = inch;
        }
        if let Some(feed) = letters.get(b'F') {
            if feed < 0.0 {
                self.find_letter(block, b'F', FindingCode::BadNumber, "a negative feed", "write a positive one");
            }
            self.feed = Some(feed).filter(|value| *value > 0.0);
        }
        if let Some(tool) = letters.get(b'T') {
            self.tool = self.whole(block, b'T', tool);
        }
        if codes.tool_change {
            self.change(block, Change::Tool(self.tool.unwrap_or(0)));
        }
        self.change_spindle(block, letters, codes);
        if let Some(on) = codes.tcp {
            self.change(block, Change::Tcp(on));
        }
        self.analog_output(block, letters, codes);
        if codes.dwell {
            let seconds = letters.get(b'P').map(|p| p * self.rules.dwell_unit).or(letters.get(b'X')).unwrap_or(0.0);
            self.change(block, Change::Dwell(seconds.max(0.0)));
        }
        self.plane = codes.plane.unwrap_or(self.plane);
        self.change_offsets(block, letters, codes);
        self.incremental = codes.incremental.unwrap_or(self.incremental);
        self.arc_absolute = codes.arc_absolute.unwrap_or(self.arc_absolute);
    }

    fn change_spindle(&mut self, block: &Block, letters: &Letters, codes: &BlockCodes) {
        let speed = letters.get(b'S');
        if speed.is_none() && codes.spindle.is_none() {
            return;
        }
        self.rpm = speed.unwrap_or(self.rpm);
        self.spindle = codes.spindle.unwrap_or(self.spindle);
        self.said_spindle = false;
        self.change(block, Change::Spindle { turn: self.spindle, rpm: self.rpm });
    }

    fn analog_output(&mut self, block: &Block, letters: &Letters, codes: &BlockCodes) {
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
                if tcp {
                    self.change(block, Change::Tcp(true));
                }
            }
            Some(GCode::LengthOff { tcp }) => {
                if tcp {
                    self.change(block, Change::Tcp(false));
                }
                self.change(block, Change::Length(LengthOffset::Off));
            }
            _ => {}
        }
        if let Some(tenths) = codes.work_offset {
            let number = if codes.extended_offset { letters.get(b'P').unwrap_or(0.0) as u16 } else { 0 };
            self.change(block, Change::WorkOffset(WorkOffsetCode { tenths, number }));
        }
        if codes.exact_path {
            self.said_blending = true;
            self.change(block, Change::PathControl(PathControl::Exact));
        }
        if codes.blend {
            let scale = if self.inch { 25.4 } else { 1.0 };
            let tolerance = letters.get(b'P').map(|p| p * scale);
            self.said_blending = tolerance.is_some();
            if let Some(tolerance) = tolerance {
                let message =
                    format!("the control rounds corners by up to {tolerance} mm, more where rotary axes turn");
                let help = "write G61 or G61.1: corners are followed exactly here";
                self.note(block, FindingCode::Blending, &message, help);
            }
            self.change(block, Change::PathControl(tolerance.map_or(PathControl::Free, PathControl::Tolerance)));
        }
    }

    /// A number that must be whole and not negative.
    fn whole(&mut self, block: &Block, letter: u8, value: f64) -> Option<u32> {
        if value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value) {
            return Some(value as u32);
        }
        let message = format!("{}{value} is no whole number", char::from(letter));
        self.find_letter(block, letter, FindingCode::BadNumber, &message, "write a whole number");
        None
    }

    fn change(&mut self, block: &Block, change: Change) {
        self.program.changes.push(ChangeAt { line: block.line, change });
    }

    fn find(&mut self, block: &Block, word: &Word, code: FindingCode, message: String, help: &str) {
        self.add(Finding::new(code, block.line as usize, message, help).at(word.span()));
    }

    fn find_letter(&mut self, block: &Block, letter: u8, code: FindingCode, message: &str, help: &str) {
        if let Some(word) = self.blocks.words(block).iter().find(|word| word.letter == letter) {
            self.find(block, word, code, message.to_owned(), help);
        }
    }

    /// A finding about a whole block.
    fn note(&mut self, block: &Block, code: FindingCode, message: &str, help: &str) {
        let finding = Finding::new(code, block.line as usize, message, help);
        let words = self.blocks.words(block);
        self.add(match words.first().zip(words.last()) {
            Some((first, last)) => finding.at(first.span().start..last.span().end),
            None => finding,
        });
    }

    fn add(&mut self, finding: Finding) {
        self.program.findings.push(finding);
    }
}

/// A word for a message.
fn name(word: &Word) -> String {
    format!("{}{}", char::from(word.letter), word.value)
}
