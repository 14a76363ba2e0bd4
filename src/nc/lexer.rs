//! Cuts a program of words, each a letter with a number, into blocks. Uses nothing of the crate.

use super::block::{Blocks, WordMode};
use super::number::decimal;
use super::scan::{Scanner, behind, behind_blanks, is_blank};

/// How a dialect's text is cut into words.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lexical {
    /// Digits of one number may stand apart.
    pub(super) blanks_in_numbers: bool,
    /// `;` begins a comment.
    pub(super) semicolon_comments: bool,
    /// Longest block the control takes, where that is known.
    pub(super) max_block_length: Option<usize>,
}

/// Cuts `text` into blocks.
pub(super) fn lex(text: &[u8], lexical: &Lexical) -> Blocks {
    let mut scanner = Scanner::new(text);
    let mut opened = false;
    while let Some(line) = scanner.next_line() {
        let rest = scanner.begin_block(line);
        let percent = words(&mut scanner, rest, lexical);
        scanner.check_length(line, lexical.max_block_length);
        scanner.end_block();
        if percent && (opened || !scanner.is_empty()) {
            scanner.close("%");
        }
        opened |= percent;
    }
    scanner.finish()
}

/// Reads the words of a line; whether it holds a %.
fn words<'a>(scanner: &mut Scanner<'a>, mut rest: &'a [u8], lexical: &Lexical) -> bool {
    let mut percent = false;
    while let Some(byte) = rest.first() {
        rest = match byte {
            _ if byte.is_ascii_alphabetic() => word(scanner, rest, lexical.blanks_in_numbers),
            byte if is_blank(*byte) => behind_blanks(rest),
            b'(' => bracketed(scanner, rest),
            b';' if lexical.semicolon_comments => &[],
            b'%' if !percent && scanner.block_is_empty() => {
                percent = true;
                behind(rest, 1)
            }
            _ => scanner.unreadable(rest),
        };
    }
    percent
}

/// A letter and its number, blanks between them allowed.
fn word<'a>(scanner: &mut Scanner<'a>, rest: &'a [u8], blanks: bool) -> &'a [u8] {
    let letter = rest.first().map_or(0, u8::to_ascii_uppercase);
    match decimal(behind_blanks(behind(rest, 1)), blanks, false) {
        Ok((after, number)) => {
            scanner.word(letter, number, WordMode::Plain, rest, after);
            after
        }
        Err(_) => scanner.unreadable(rest),
    }
}

/// `( ... )` within one line.
fn bracketed<'a>(scanner: &mut Scanner<'a>, rest: &'a [u8]) -> &'a [u8] {
    let Some(length) = rest.iter().position(|byte| *byte == b')') else {
        scanner.bad_comment(rest, behind(rest, rest.len()), "a comment that is not closed on its line");
        return &[];
    };
    let after = behind(rest, length + 1);
    if rest.get(1..length).is_some_and(|text| text.contains(&b'(')) {
        scanner.bad_comment(rest, after, "a comment inside a comment");
    }
    after
}
