//! The text of a program as words in blocks, each with its place in the text.

use super::finding::Findings;
use std::ops::Range;

/// A letter with a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Word {
    /// The number's value.
    pub(super) value: f64,
    /// First byte in the text.
    start: u32,
    /// Byte after the last.
    end: u32,
    /// The letter, upper case.
    pub(super) letter: u8,
    /// Whether the number has a decimal point.
    pub(super) point: bool,
    /// Digits written after the point.
    pub(super) decimals: u8,
}

impl Word {
    /// Joins a word; `span` in bytes of the text.
    pub(super) fn new(letter: u8, number: super::number::Decimal, span: Range<u32>) -> Self {
        Self {
            value: number.value,
            start: span.start,
            end: span.end,
            letter,
            point: number.point,
            decimals: number.decimals,
        }
    }

    /// Bytes of the text.
    pub(super) fn span(&self) -> Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// A line with at least one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Block {
    /// Line, from 1.
    pub(super) line: u32,
    /// Index of its first word.
    pub(super) first: u32,
    /// Index after its last word.
    pub(super) last: u32,
    /// Whether it begins with a block delete (/).
    pub(super) deletable: bool,
}

/// A program's text cut into blocks and words.
#[derive(Clone, Debug, Default)]
pub(super) struct Blocks {
    pub(super) words: Vec<Word>,
    pub(super) blocks: Vec<Block>,
    /// Whether a % ended the text.
    pub(super) closed: bool,
    /// Lines up to the end of the program.
    pub(super) lines: usize,
    pub(super) findings: Findings,
}

impl Blocks {
    /// The words of a block.
    pub(super) fn words(&self, block: &Block) -> &[Word] {
        self.words.get(block.first as usize..block.last as usize).unwrap_or_default()
    }
}
