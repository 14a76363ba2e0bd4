//! What every lexer needs: lines, words and complaints with their places, in linear time whatever the bytes are. Uses
//! `diagnostic`.

use super::block::{Block, Blocks, Word, WordMode};
use super::finding::{Finding, FindingCode};
use super::number::Decimal;
use std::ops::Range;

/// Longest program that is read, bytes: what it becomes must fit the memory of any computer.
pub const MAX_PROGRAM_BYTES: usize = 128 << 20;
/// Most blocks of a program that are read.
const MAX_BLOCKS: usize = 8_000_000;
/// Complaints kept for one block; then the rest of it is skipped.
const COMPLAINTS_PER_BLOCK: usize = 8;

/// A blank inside a line.
pub(super) fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\r' | 0x0b | 0x0c)
}

/// What is behind the blanks at the start of a line's rest.
pub(super) fn behind_blanks(rest: &[u8]) -> &[u8] {
    let length = rest.iter().take_while(|byte| is_blank(**byte)).count();
    rest.get(length..).unwrap_or_default()
}

/// What is behind the first `count` bytes.
pub(super) fn behind(rest: &[u8], count: usize) -> &[u8] {
    rest.get(count..).unwrap_or_default()
}

/// Length of the letters, digits and underscores at the start.
pub(super) fn name_length(rest: &[u8]) -> usize {
    rest.iter().take_while(|byte| byte.is_ascii_alphanumeric() || **byte == b'_').count()
}

/// Length of the text up to a line feed, or to its end.
fn line_length(text: &[u8]) -> usize {
    const PIECE: usize = 16;
    // Whole pieces at once: the compiler compares their bytes together.
    let holds = |piece: &[u8; PIECE]| piece.iter().fold(false, |found, byte| found | (*byte == b'\n'));
    let (pieces, _) = text.as_chunks::<PIECE>();
    let before = PIECE * pieces.iter().take_while(|piece| !holds(piece)).count();
    let rest = behind(text, before);
    before + rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len())
}

/// Collects the words of one line after another.
pub(super) struct Scanner<'a> {
    text: &'a [u8],
    rest: &'a [u8],
    out: Blocks,
    /// The present line, from 1, with its first byte and the byte after its last.
    line: usize,
    start: usize,
    end: usize,
    /// Index of the first word of the present block, and the line on which it began.
    first: usize,
    first_line: usize,
    deletable: bool,
    /// Complaints in the present block.
    complaints: usize,
}

impl<'a> Scanner<'a> {
    /// At the start of a text.
    pub(super) fn new(text: &'a [u8]) -> Self {
        const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
        // A word every seven bytes, a block every forty.
        let mut out = Blocks::default();
        if text.len() <= MAX_PROGRAM_BYTES {
            out.words.reserve(text.len() / 7);
            out.blocks.reserve(text.len() / 40);
        }
        let mut scanner = Self {
            text,
            rest: text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text),
            out,
            line: 0,
            start: 0,
            end: 0,
            first: 0,
            first_line: 1,
            deletable: false,
            complaints: 0,
        };
        if text.len() > MAX_PROGRAM_BYTES {
            scanner.line = 1;
            let message = format!("the program is longer than {} MiB", MAX_PROGRAM_BYTES >> 20);
            scanner.complain(0..0, FindingCode::UnreadableText, message, "split it");
            scanner.rest = &[];
        }
        scanner
    }

    /// The next line without its end; `None` behind the last.
    pub(super) fn next_line(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        self.line += 1;
        self.out.lines = self.line;
        self.start = self.text.len() - self.rest.len();
        let length = line_length(self.rest);
        let (line, rest) = self.rest.split_at(length);
        self.end = self.start + length;
        self.rest = behind(rest, 1);
        Some(line)
    }

    /// Begins a block on the present line; returns what is behind a block delete.
    pub(super) fn begin_block(&mut self, line: &'a [u8]) -> &'a [u8] {
        self.first = self.out.words.len();
        self.first_line = self.line;
        self.complaints = 0;
        let rest = behind_blanks(line);
        self.deletable = rest.first() == Some(&b'/');
        if self.deletable { behind(rest, 1) } else { rest }
    }

    /// Complains about too long a line.
    pub(super) fn check_length(&mut self, line: &'a [u8], limit: Option<usize>) {
        if let Some(limit) = limit.filter(|limit| line.len() > *limit) {
            let length = line.trim_ascii_end().len();
            if length > limit {
                let message = format!("{length} characters in a block; the control takes {limit}");
                let help = "split the block or its comment";
                self.complain(self.start..self.start, FindingCode::BlockTooLong, message, help);
            }
        }
    }

    /// Forgets the words of the present block.
    pub(super) fn drop_block(&mut self) {
        self.out.words.truncate(self.first);
    }

    /// Ends the present block.
    pub(super) fn end_block(&mut self) {
        let (first, last) = (self.first, self.out.words.len());
        self.first = last;
        if last > first {
            let line = u32::try_from(self.first_line).unwrap_or(u32::MAX);
            self.out.blocks.push(Block { line, first: first as u32, last: last as u32, deletable: self.deletable });
            if self.out.blocks.len() == MAX_BLOCKS && !self.rest.is_empty() {
                let message = format!("the program has more than {MAX_BLOCKS} blocks");
                self.complain(self.start..self.start, FindingCode::UnreadableText, message, "split it");
                self.rest = &[];
            }
        }
    }

    /// Whether the present block has no word yet.
    pub(super) fn block_is_empty(&self) -> bool {
        self.out.words.len() == self.first
    }

    /// Whether there is no block yet.
    pub(super) fn is_empty(&self) -> bool {
        self.out.blocks.is_empty()
    }

    /// Adds a word that reaches from the start of `from` to that of `to`.
    pub(super) fn word(&mut self, letter: u8, number: Decimal, mode: WordMode, from: &[u8], to: &[u8]) {
        let span = self.offset(from) as u32..self.offset(to) as u32;
        self.out.words.push(Word::new(letter, number, mode, span));
    }

    /// Adds a word of the language, by its index in the dialect's table.
    pub(super) fn keyword(&mut self, index: usize, from: &[u8], to: &[u8]) {
        let span = self.offset(from) as u32..self.offset(to) as u32;
        self.out.words.push(Word::keyword(index, span));
    }

    /// Complains about what stands at the start of `rest`, up to a blank or a comment, and returns what is behind it; the
    /// rest of the line when there is much to complain about.
    pub(super) fn unreadable(&mut self, rest: &'a [u8]) -> &'a [u8] {
        let more = |byte: &&u8| !is_blank(**byte) && **byte != b'(' && **byte != b';';
        let length = 1 + rest.iter().skip(1).take_while(more).count();
        let after = behind(rest, length);
        let shown = String::from_utf8_lossy(rest.get(..length.min(40)).unwrap_or_default()).into_owned();
        let (message, help) = match rest.first() {
            Some(b'#' | b'[' | b'=') => (
                format!("\"{shown}\" uses variables or expressions, which are not evaluated here"),
                "write plain numbers",
            ),
            Some(b'O' | b'o') => {
                (format!("\"{shown}\" is program flow, which is not followed here"), "write the moves out")
            }
            _ => (format!("\"{shown}\" is no word: a letter and a number such as X-12.5"), "correct or remove it"),
        };
        self.complain_about(rest, after, FindingCode::UnreadableText, message, help);
        if self.complaints < COMPLAINTS_PER_BLOCK { after } else { &[] }
    }

    /// Complains about a comment.
    pub(super) fn bad_comment(&mut self, from: &[u8], to: &[u8], what: &str) {
        let help = "close each comment with one ) before the next begins";
        let message = format!("{what}: the control refuses the block");
        self.complain_about(from, to, FindingCode::BadComment, message, help);
    }

    /// Complains about what reaches from the start of `from` to that of `to`.
    pub(super) fn complain_about(&mut self, from: &[u8], to: &[u8], code: FindingCode, message: String, help: &str) {
        self.complain(self.offset(from)..self.offset(to), code, message, help);
    }

    fn complain(&mut self, span: Range<usize>, code: FindingCode, message: String, help: &str) {
        self.complaints += 1;
        self.out.findings.push(Finding::new(code, self.line, message, help).at(span));
    }

    /// Ends the program here: `by` is what says so. What follows is a finding.
    pub(super) fn close(&mut self, by: &str) {
        self.out.closed = true;
        if self.rest.iter().any(|byte| !is_blank(*byte) && *byte != b'\n' && *byte != 0) {
            let message = format!("the control ignores what follows the closing {by}");
            let help = format!("remove it, or move the {by} behind it");
            self.out.findings.push(Finding::new(FindingCode::UnreachedText, self.line + 1, message, &help));
        }
        self.rest = &[];
    }

    /// What has been read.
    pub(super) fn finish(self) -> Blocks {
        self.out
    }

    /// Place of what is left of the present line.
    fn offset(&self, rest: &[u8]) -> usize {
        self.end - rest.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn lines_end_at_the_first_line_feed(text in "[a\n]{0,60}|a{0,60}\n") {
            let length = line_length(text.as_bytes());
            prop_assert_eq!(Some(&text[..length]), text.split('\n').next());
        }
    }
}
