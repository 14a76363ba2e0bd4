//! Cuts a Siemens program into words: `X10`, `X=10`, `C=DC(30)`, `A3=0.5`, `CR=5`, `TRAORI`, `CYCLE832(0.01)`,
//! `FGREF[A]=57.3`.

use super::{HARMLESS_ALONE, KEYWORDS};
use crate::nc::block::{Blocks, WordMode, address};
use crate::nc::dialect::keyword_index;
use crate::nc::finding::FindingCode;
use crate::nc::number::{Decimal, decimal};
use crate::nc::scan::{Scanner, behind, behind_blanks, is_blank, name_length};

/// Names whose values change no motion that is followed here.
const IGNORED_VALUES: [&[u8]; 6] = [b"ADIS", b"ADISPOS", b"CTOL", b"OTOL", b"OVR", b"ACC"];

/// Cuts `text` into blocks.
pub(in crate::nc) fn lex(text: &[u8], max_block_length: usize) -> Blocks {
    let mut scanner = Scanner::new(text);
    while let Some(line) = scanner.next_line() {
        let rest = scanner.begin_block(line);
        // Archives begin with %_N_NAME_MPF.
        if rest.first() != Some(&b'%') {
            words(&mut scanner, rest);
        }
        scanner.check_length(line, Some(max_block_length));
        scanner.end_block();
    }
    scanner.finish()
}

fn words<'a>(scanner: &mut Scanner<'a>, mut rest: &'a [u8]) {
    while let Some(byte) = rest.first() {
        rest = match byte {
            byte if byte.is_ascii_alphabetic() || *byte == b'_' => {
                word(scanner, rest).unwrap_or_else(|| named(scanner, rest))
            }
            byte if is_blank(*byte) => behind_blanks(rest),
            b';' => &[],
            _ => scanner.unreadable(rest),
        };
    }
}

/// A letter with its number behind it; `None` where the letter is part of a name.
fn word<'a>(scanner: &mut Scanner<'a>, rest: &'a [u8]) -> Option<&'a [u8]> {
    let (letter, number) = rest.split_first()?;
    if !matches!(number.first()?, b'0'..=b'9' | b'+' | b'-' | b'.') {
        return None;
    }
    let (after, number) = decimal(number, false, false).ok()?;
    if behind_blanks(after).first() == Some(&b'=') || after.first() == Some(&b'(') {
        return None;
    }
    scanner.word(letter.to_ascii_uppercase(), number, WordMode::Plain, rest, after);
    Some(after)
}

/// A name with what belongs to it.
fn named<'a>(scanner: &mut Scanner<'a>, rest: &'a [u8]) -> &'a [u8] {
    let length = name_length(rest);
    let (name, after) = rest.split_at(length);
    let next = behind_blanks(after);
    match next.first() {
        Some(b'=') => assignment(scanner, rest, name, behind_blanks(behind(next, 1))),
        Some(b'[') => indexed(scanner, rest, name, next),
        Some(b'(') => call(scanner, rest, name, next),
        _ => keyword(scanner, rest, name, after, next),
    }
}

/// `NAME=number`, `NAME=DC(number)`.
fn assignment<'a>(scanner: &mut Scanner<'a>, rest: &'a [u8], name: &[u8], value: &'a [u8]) -> &'a [u8] {
    if value.first() == Some(&b'"') {
        // A name of a tool or a program: no number.
        let length = value.iter().skip(1).position(|byte| *byte == b'"').map_or(value.len(), |end| end + 2);
        return behind(value, length);
    }
    let Some((after, number, mode)) = valued(value) else { return scanner.unreadable(rest) };
    let upper = |index: usize| name.get(index).map_or(0, u8::to_ascii_uppercase);
    let letter = match (name.len(), upper(0), upper(1)) {
        (1, letter, _) => letter,
        (2, letter @ b'A'..=b'C', b'3') => address::VECTOR[usize::from(letter - b'A')],
        (2, b'C', b'R') => b'R',
        // The master spindle by its number.
        (2, letter @ (b'S' | b'M'), b'1') => letter,
        (4, ..) if name.eq_ignore_ascii_case(b"TURN") => {
            let turns = Decimal { value: number.value + 1.0, ..number };
            scanner.word(b'P', turns, mode, rest, after);
            return after;
        }
        _ if IGNORED_VALUES.iter().any(|known| known.eq_ignore_ascii_case(name)) => return after,
        _ => {
            let shown = String::from_utf8_lossy(name).into_owned();
            let message = format!("{shown}= is not followed here: what it does to the motion is not known");
            scanner.complain_about(rest, after, FindingCode::UnsupportedCode, message, "post the program without it");
            return after;
        }
    };
    scanner.word(letter, number, mode, rest, after);
    after
}

/// A number, or one in the brackets of the way that it is meant.
fn valued(value: &[u8]) -> Option<(&[u8], Decimal, WordMode)> {
    let length = name_length(value);
    let mode = match value.get(..length)? {
        b"DC" | b"dc" => WordMode::Shortest,
        b"ACP" | b"acp" => WordMode::Positive,
        b"ACN" | b"acn" => WordMode::Negative,
        b"AC" | b"ac" => WordMode::Absolute,
        b"IC" | b"ic" => WordMode::Incremental,
        _ => {
            let (after, number) = decimal(value, false, false).ok()?;
            // Anything behind it makes it an expression.
            let ends = after.first().is_none_or(|byte| is_blank(*byte) || *byte == b';' || byte.is_ascii_alphabetic());
            return ends.then_some((after, number, WordMode::Plain));
        }
    };
    let open = behind_blanks(behind(value, length)).strip_prefix(b"(")?;
    let (after, number) = decimal(behind_blanks(open), false, false).ok()?;
    Some((behind_blanks(after).strip_prefix(b")")?, number, mode))
}

/// `FGREF[A]=radius`.
fn indexed<'a>(scanner: &mut Scanner<'a>, rest: &'a [u8], name: &[u8], open: &'a [u8]) -> &'a [u8] {
    let value = || {
        let close = open.iter().position(|byte| *byte == b']')?;
        let value = behind_blanks(behind(open, close + 1)).strip_prefix(b"=")?;
        decimal(behind_blanks(value), false, false).ok()
    };
    match value() {
        Some((after, radius)) if name.eq_ignore_ascii_case(b"FGREF") => {
            scanner.word(address::FEED_RADIUS, radius, WordMode::Plain, rest, after);
            after
        }
        _ => scanner.unreadable(rest),
    }
}

/// `NAME(...)`.
fn call<'a>(scanner: &mut Scanner<'a>, rest: &'a [u8], name: &[u8], open: &'a [u8]) -> &'a [u8] {
    let Some(length) = closing(open) else {
        scanner.bad_comment(rest, &[], "brackets that are not closed on their line");
        return &[];
    };
    let (arguments, after) = open.split_at(length);
    let arguments = arguments.get(1..arguments.len() - 1).unwrap_or_default();
    if name.eq_ignore_ascii_case(b"FGROUP") {
        let rotary = arguments.iter().any(|byte| matches!(byte.to_ascii_uppercase(), b'A'..=b'C'));
        let index = if arguments.trim_ascii().is_empty() { 2 } else { usize::from(!rotary) };
        scanner.keyword(index, rest, after);
        return after;
    }
    if name.eq_ignore_ascii_case(b"CYCLE832") {
        // Its first argument is the tolerance, its third that of the tool's orientation; none ends it.
        let number = |argument: &'a [u8]| decimal(behind_blanks(argument), false, false).ok().map(|(_, number)| number);
        let mut numbers = arguments.split(|byte| *byte == b',').map(number);
        if let (Some(index), Some(Some(tolerance))) = (keyword_index(KEYWORDS, name), numbers.next()) {
            scanner.keyword(index, rest, after);
            scanner.word(b'P', tolerance, WordMode::Plain, rest, after);
            if let Some(Some(orientation)) = numbers.nth(1) {
                scanner.word(b'Q', orientation, WordMode::Plain, rest, after);
            }
        }
        return after;
    }
    if arguments.trim_ascii().is_empty() && is_harmless_alone(name) {
        return after;
    }
    match keyword_index(KEYWORDS, name) {
        Some(index) => scanner.keyword(index, rest, after),
        None => unknown(scanner, rest, after, name),
    }
    after
}

/// Length of brackets with their content, text in quotes skipped.
fn closing(open: &[u8]) -> Option<usize> {
    let (mut depth, mut quoted) = (0_usize, false);
    for (index, byte) in open.iter().enumerate() {
        match byte {
            b'"' => quoted = !quoted,
            b'(' if !quoted => depth += 1,
            b')' if !quoted => {
                depth -= 1;
                if depth == 0 {
                    return Some(index + 1);
                }
            }
            _ => {}
        }
    }
    None
}

/// A word of the language by itself.
fn keyword<'a>(scanner: &mut Scanner<'a>, rest: &'a [u8], name: &[u8], after: &'a [u8], next: &'a [u8]) -> &'a [u8] {
    if is_harmless_alone(name) {
        if next.first().is_some_and(|byte| *byte != b';') {
            unknown(scanner, rest, &[], name);
            return &[];
        }
        return after;
    }
    if let Some(index) = keyword_index(KEYWORDS, name) {
        scanner.keyword(index, rest, after);
        return after;
    }
    // Whatever follows belongs to it.
    unknown(scanner, rest, &[], name);
    &[]
}

fn is_harmless_alone(name: &[u8]) -> bool {
    HARMLESS_ALONE.iter().any(|known| known.as_bytes().eq_ignore_ascii_case(name))
}

fn unknown(scanner: &mut Scanner<'_>, from: &[u8], to: &[u8], name: &[u8]) {
    let shown = String::from_utf8_lossy(name.get(..name.len().min(40)).unwrap_or_default()).into_owned();
    let message = format!("{shown} is not followed here: what it does to the motion is not known");
    scanner.complain_about(from, to, FindingCode::UnsupportedCode, message, "post the program without it");
}
