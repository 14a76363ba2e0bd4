//! Cuts a program's bytes into words and blocks, whatever the bytes are: in linear time, with every complaint located,
//! going on behind each. Uses `diagnostic`.

use super::block::{Block, Blocks, Word};
use super::finding::{Finding, FindingCode};
use super::number::{Decimal, decimal};
use nom::branch::alt;
use nom::bytes::complete::{tag, take, take_till, take_while};
use nom::character::complete::one_of;
use nom::combinator::{map, opt, recognize, value};
use nom::sequence::{delimited, pair, preceded};
use nom::{IResult, Parser};
use std::ops::Range;

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

/// Complaints kept for one block; then the rest of it is skipped.
const COMPLAINTS_PER_BLOCK: usize = 8;

/// What may stand in a line.
#[derive(Clone, Copy)]
enum Item {
    Word { letter: u8, number: Decimal },
    Comment { nested: bool },
    OpenComment,
    Percent,
}

fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\r' | 0x0b | 0x0c)
}

fn is_line_end(byte: u8) -> bool {
    byte == b'\n'
}

fn blanks(input: &[u8]) -> IResult<&[u8], &[u8]> {
    take_while(is_blank)(input)
}

/// A letter and its number, blanks between them allowed.
fn word(input: &[u8], inner_blanks: bool) -> IResult<&[u8], Item> {
    let letter = |bytes: &[u8]| bytes.first().map_or(0, u8::to_ascii_uppercase);
    let (rest, first) = take(1_usize)(input)?;
    let (rest, number) = preceded(blanks, |bytes| decimal(bytes, inner_blanks)).parse(rest)?;
    Ok((rest, Item::Word { letter: letter(first), number }))
}

/// `( ... )` within one line.
fn bracketed(input: &[u8]) -> IResult<&[u8], Item> {
    let text = take_till(|b| b == b')' || is_line_end(b));
    map(delimited(tag("("), text, tag(")")), |text: &[u8]| Item::Comment { nested: text.contains(&b'(') }).parse(input)
}

/// Whatever follows a bracket that no bracket closes.
fn unclosed(input: &[u8]) -> IResult<&[u8], Item> {
    value(Item::OpenComment, pair(tag("("), take_till(is_line_end))).parse(input)
}

/// `; ...` up to the end of the line.
fn to_line_end(input: &[u8]) -> IResult<&[u8], Item> {
    value(Item::Comment { nested: false }, pair(tag(";"), take_till(is_line_end))).parse(input)
}

fn item<'a>(input: &'a [u8], lexical: &Lexical) -> IResult<&'a [u8], Item> {
    match input.first() {
        Some(byte) if byte.is_ascii_alphabetic() => word(input, lexical.blanks_in_numbers),
        Some(b'(') => alt((bracketed, unclosed)).parse(input),
        Some(b';') if lexical.semicolon_comments => to_line_end(input),
        _ => value(Item::Percent, tag("%")).parse(input),
    }
}

/// The offending piece of text: at least one byte, up to a blank, a comment or the line's end.
fn unreadable(input: &[u8]) -> IResult<&[u8], &[u8]> {
    recognize(pair(take(1_usize), take_while(|b| !is_blank(b) && !is_line_end(b) && b != b'(' && b != b';')))
        .parse(input)
}

/// Cuts `text` into blocks.
pub(super) fn lex(text: &[u8], lexical: &Lexical) -> Blocks {
    let mut lexer = Lexer { text, lexical, out: Blocks::default(), complaints: 0 };
    if u32::try_from(text.len()).is_err() {
        lexer.complain(1, 0..0, FindingCode::UnreadableText, "the program is longer than 4 GiB".into(), "split it");
        return lexer.out;
    }
    lexer.run();
    lexer.out
}

struct Lexer<'a> {
    text: &'a [u8],
    lexical: &'a Lexical,
    out: Blocks,
    /// In the present block.
    complaints: usize,
}

impl<'a> Lexer<'a> {
    fn run(&mut self) {
        const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
        let mut rest = self.text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(self.text);
        let mut opened = false;
        let mut line = 0_usize;
        while !rest.is_empty() {
            line += 1;
            let percent;
            (rest, percent) = self.line(rest, line);
            self.out.lines = line;
            if percent && (opened || !self.out.blocks.is_empty()) {
                self.out.closed = true;
                self.after_the_end(rest, line + 1);
                return;
            }
            opened |= percent;
        }
    }

    /// Reads one line; returns what follows it and whether it holds a %.
    fn line(&mut self, input: &'a [u8], line: usize) -> (&'a [u8], bool) {
        let start = self.offset(input);
        let first = self.out.words.len() as u32;
        self.complaints = 0;
        let (mut rest, deleted) = self.block_delete(input);
        let mut percent = false;
        while let Some(byte) = rest.first() {
            if is_line_end(*byte) {
                break;
            }
            if is_blank(*byte) {
                rest = blanks(rest).map_or(rest, |(behind, _)| behind);
                continue;
            }
            rest = match item(rest, self.lexical) {
                Ok((behind, Item::Word { letter, number })) => {
                    let span = self.offset(rest) as u32..self.offset(behind) as u32;
                    self.out.words.push(Word::new(letter, number, span));
                    behind
                }
                Ok((behind, Item::Percent)) if !percent && self.out.words.len() as u32 == first => {
                    percent = true;
                    behind
                }
                Ok((behind, Item::Comment { nested: false })) => behind,
                Ok((behind, Item::Comment { nested: true })) => {
                    self.bad_comment(line, self.span(rest, behind), "a comment inside a comment");
                    behind
                }
                Ok((behind, Item::OpenComment)) => {
                    self.bad_comment(line, self.span(rest, behind), "a comment that is not closed on its line");
                    behind
                }
                Ok((_, Item::Percent)) | Err(_) => self.skip(rest, line),
            };
        }
        self.too_long(line, start..self.offset(rest));
        let last = self.out.words.len() as u32;
        if last > first {
            let line = u32::try_from(line).unwrap_or(u32::MAX);
            self.out.blocks.push(Block { line, first, last, deletable: deleted });
        }
        (rest.get(1..).unwrap_or_default(), percent)
    }

    fn block_delete(&self, input: &'a [u8]) -> (&'a [u8], bool) {
        let mut mark = preceded(blanks, opt(one_of::<_, _, nom::error::Error<&[u8]>>("/")));
        mark.parse(input).map_or((input, false), |(rest, found)| (rest, found.is_some()))
    }

    /// Complains about what stands at the start of `rest` and returns what is behind it.
    fn skip(&mut self, rest: &'a [u8], line: usize) -> &'a [u8] {
        let behind = unreadable(rest).map_or(&[][..], |(behind, _)| behind);
        let span = self.span(rest, behind);
        let shown = self.show(&span);
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
        self.complain(line, span, FindingCode::UnreadableText, message, help);
        if self.complaints < COMPLAINTS_PER_BLOCK { behind } else { take_line(behind) }
    }

    fn bad_comment(&mut self, line: usize, span: Range<usize>, what: &str) {
        let help = "close each comment with one ) before the next begins";
        self.complain(line, span, FindingCode::BadComment, format!("{what}: the control refuses the block"), help);
    }

    fn too_long(&mut self, line: usize, span: Range<usize>) {
        let length = self.text.get(span.clone()).unwrap_or_default().trim_ascii_end().len();
        let Some(limit) = self.lexical.max_block_length.filter(|limit| length > *limit) else { return };
        let message = format!("{length} characters in a block; the control takes {limit}");
        self.complain(
            line,
            span.start..span.start,
            FindingCode::BlockTooLong,
            message,
            "split the block or its comment",
        );
    }

    fn after_the_end(&mut self, rest: &[u8], line: usize) {
        if rest.iter().any(|byte| !is_blank(*byte) && !is_line_end(*byte) && *byte != 0) {
            let message = "the control ignores what follows the closing %";
            let help = "remove it, or move the % behind it";
            self.out.findings.push(Finding::new(FindingCode::UnreachedText, line, message, help));
        }
    }

    fn complain(&mut self, line: usize, span: Range<usize>, code: FindingCode, message: String, help: &str) {
        self.complaints += 1;
        self.out.findings.push(Finding::new(code, line, message, help).at(span));
    }

    fn offset(&self, rest: &[u8]) -> usize {
        self.text.len() - rest.len()
    }

    fn span(&self, from: &[u8], to: &[u8]) -> Range<usize> {
        self.offset(from)..self.offset(to)
    }

    /// Text for a message, short.
    fn show(&self, span: &Range<usize>) -> String {
        let bytes = self.text.get(span.start..span.end.min(span.start + 40)).unwrap_or_default();
        String::from_utf8_lossy(bytes).into_owned()
    }
}

/// What is left at the end of the line.
fn take_line(input: &[u8]) -> &[u8] {
    let behind: IResult<&[u8], &[u8]> = take_till(is_line_end)(input);
    behind.map_or(&[][..], |(rest, _)| rest)
}
