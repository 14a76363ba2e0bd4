//! Gives blocks their meaning: modal state, moves, changes, and everything remarkable on the way. Knows no machine
//! beyond its axis letters and its control's rules; positions are followed later. Uses `diagnostic` and of `machine` the
//! control's options.

use super::block::{Block, Blocks, Word, address};
use super::block_codes::{BlockCodes, Letters};
use super::code::{FeedGroup, FeedUnit, GCode, MCode, Motion, Plane, SpindleTurn};
use super::dialect::Rules;
use super::finding::{Finding, FindingCode};
use super::program::{Change, ChangeAt, Program};
use super::radians::RadiansWatch;
use crate::diagnostic::Severity;
use crate::machine::PointRule;

mod motion;
mod state;

/// Reads a whole program. Never fails: what cannot be understood is a finding, and reading goes on behind it.
pub fn read(text: &[u8], rules: &Rules) -> Program {
    let mut blocks = rules.cut(text);
    let reading = std::mem::take(&mut blocks.findings);
    let mut interpreter = Interpreter::new(rules, &blocks, text);
    interpreter.run();
    let mut program = interpreter.program;
    program.findings.merge(reading);
    program
}

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
    text: &'a [u8],
    program: Program,
    motion: MotionState,
    plane: Plane,
    inch: bool,
    incremental: bool,
    arc_absolute: bool,
    /// Centre of arcs that give none, mm.
    circle_centre: Option<[f64; 3]>,
    /// I, J, K are components of the tool axis.
    vectors: bool,
    /// Rotary axes take the shorter way.
    shortest_way: bool,
    feed_unit: FeedUnit,
    feed: Option<f64>,
    feed_group: FeedGroup,
    /// mm.
    feed_radius: f64,
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
    fn new(rules: &'a Rules, blocks: &'a Blocks, text: &'a [u8]) -> Self {
        use super::code::PathControl;
        let mut program = Program { blocks: blocks.blocks.len(), lines: blocks.lines, ..Program::default() };
        program.moves.reserve(blocks.blocks.len());
        if rules.blends_at_start {
            program.changes.push(ChangeAt { line: 1, change: Change::PathControl(PathControl::Free) });
        }
        Self {
            rules,
            blocks,
            text,
            program,
            motion: MotionState::Unset,
            plane: Plane::Xy,
            inch: false,
            incremental: false,
            arc_absolute: false,
            circle_centre: None,
            vectors: false,
            shortest_way: false,
            feed_unit: FeedUnit::PerMinute,
            feed: None,
            feed_group: FeedGroup::Usual,
            feed_radius: rules.group_radius,
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
        let mut letters = Letters::default();
        let mut codes = BlockCodes::default();
        for word in self.blocks.words(block) {
            match word.letter {
                b'G' => self.add_g(block, word, self.rules.g_code(word.value), &mut codes),
                b'M' => self.add_m(block, word, &mut codes),
                address::KEYWORD => self.add_g(block, word, self.rules.keyword(word.value), &mut codes),
                _ => self.add_letter(block, word, &mut letters),
            }
        }
        if block.deletable && !self.said_deletable {
            self.said_deletable = true;
            let message = "blocks with / are taken as executed";
            let help = "switch block delete off at the control, or remove them";
            self.note(block, FindingCode::BlockDelete, message, help);
        }
        if self.takes_vectors(&codes) {
            letters.take_vector();
        }
        self.unused_letters(block, &letters, &codes);
        self.change_state(block, &letters, &codes);
        self.command(block, &letters, &codes);
        if codes.stop {
            self.change(block, Change::Stop);
        }
        codes.end
    }

    fn add_letter(&mut self, block: &Block, word: &Word, letters: &mut Letters) {
        let mut value = word.value;
        let dimension = matches!(word.letter, b'X'..=b'Z' | b'A'..=b'C' | b'I'..=b'K' | b'R');
        if !word.point && dimension && value != 0.0 {
            match self.rules.point {
                PointRule::Unit => {}
                PointRule::Increment => value *= self.rules.least_increment,
                PointRule::Required => {
                    let message = format!("{} has no decimal point: the control may count increments", self.name(word));
                    let help = "write the point; here it is read as mm or degrees";
                    self.find(block, word, FindingCode::MissingPoint, message, help);
                }
            }
        }
        if letters.add(word, value) {
            let message = format!("the letter {} twice in one block", self.address(word));
            self.find(block, word, FindingCode::RepeatedWord, message, "write it once");
        }
    }

    fn add_g(&mut self, block: &Block, word: &Word, meaning: GCode, codes: &mut BlockCodes) {
        if !codes.add_g(meaning, word.value) {
            self.group_conflict(block, word);
        }
        self.not_followed(block, word, meaning == GCode::Unknown, meaning == GCode::Unsupported);
    }

    fn add_m(&mut self, block: &Block, word: &Word, codes: &mut BlockCodes) {
        let meaning = self.rules.m_code(word.value);
        if !codes.add_m(meaning) {
            self.group_conflict(block, word);
        }
        if codes.m_codes.checked_sub(1) == Some(self.rules.m_codes_per_block) {
            let message = format!("more than {} M codes in one block", self.rules.m_codes_per_block);
            self.find(block, word, FindingCode::GroupConflict, message, "write them in blocks of their own");
        }
        self.not_followed(block, word, meaning == MCode::Unknown, meaning == MCode::Unsupported);
    }

    fn group_conflict(&mut self, block: &Block, word: &Word) {
        let message = format!("{} and another code of its modal group in one block", self.name(word));
        self.find(block, word, FindingCode::GroupConflict, message, "write one of them, or two blocks");
    }

    fn not_followed(&mut self, block: &Block, word: &Word, unknown: bool, unsupported: bool) {
        if unknown {
            let message = format!("{} is no code of this control as far as is known here", self.name(word));
            let help = "remove it, or check that the machine's dialect and its options are right";
            self.find(block, word, FindingCode::UnknownCode, message, help);
        } else if unsupported {
            let message = format!("{} is not followed here: what it does to the motion is not known", self.name(word));
            let help = "post the program without it";
            self.find(block, word, FindingCode::UnsupportedCode, message, help);
        }
    }

    /// Letters that no code of the block takes.
    fn unused_letters(&mut self, block: &Block, letters: &Letters, codes: &BlockCodes) {
        let taken = codes.parameters(self.motion == MotionState::NotFollowed, self.is_arc(codes));
        let unused = letters.present() & !(taken | self.rules.free_letters);
        if unused == 0 {
            return;
        }
        for word in self.blocks.words(block).iter().filter(|word| Letters::bit(word.letter) & unused != 0) {
            let message = format!("{} means nothing in this block", self.name(word));
            let help = "remove it, or add the code that it belongs to";
            self.find(block, word, FindingCode::UnusedWord, message, help);
        }
    }

    fn is_arc(&self, codes: &BlockCodes) -> bool {
        let motion = codes.motion.map_or(self.motion, MotionState::Known);
        matches!(motion, MotionState::Known(Motion::Arc { .. }))
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

    /// A word for a message.
    fn name(&self, word: &Word) -> String {
        match word.letter {
            letter if letter.is_ascii_uppercase() => format!("{}{}", char::from(letter), word.value),
            _ => String::from_utf8_lossy(self.text.get(word.span()).unwrap_or_default()).into_owned(),
        }
    }

    /// A word's address for a message.
    fn address(&self, word: &Word) -> String {
        match word.letter {
            letter if letter.is_ascii_uppercase() => char::from(letter).to_string(),
            _ => self.name(word),
        }
    }
}
