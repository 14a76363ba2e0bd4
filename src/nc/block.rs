//! The text of a program as words in blocks, each with its place in the text. Uses nothing of the crate.

use super::finding::Findings;
use std::ops::Range;

/// Addresses of words that are no single letter stand for themselves behind Z.
pub(super) mod address {
    /// Components of the tool axis.
    pub(in crate::nc) const VECTOR: [u8; 3] = [b'Z' + 1, b'Z' + 2, b'Z' + 3];
    /// Radius at which rotary axes count for the feed, mm.
    pub(in crate::nc) const FEED_RADIUS: u8 = b'Z' + 4;
    /// A word of the language; its number is the index in the dialect's table.
    pub(in crate::nc) const KEYWORD: u8 = b'Z' + 5;
    /// How many there are, letters included.
    pub(in crate::nc) const COUNT: usize = 31;
}

/// How a word says its value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum WordMode {
    /// As the modal state has it.
    #[default]
    Plain,
    /// From where the axis stands.
    Incremental,
    /// From zero.
    Absolute,
    /// From zero, by the shorter way.
    Shortest,
    /// From zero, turning positive.
    Positive,
    /// From zero, turning negative.
    Negative,
}

/// An address with a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Word {
    /// The number's value.
    pub(super) value: f64,
    /// First byte in the text.
    start: u32,
    /// Byte after the last.
    end: u32,
    /// The letter, upper case, or one of [`address`].
    pub(super) letter: u8,
    /// Whether the number has a decimal point.
    pub(super) point: bool,
    /// Digits written after the point.
    pub(super) decimals: u8,
    /// How the value is meant.
    pub(super) mode: WordMode,
}

impl Word {
    /// Joins a word; `span` in bytes of the text.
    pub(super) fn new(letter: u8, number: super::number::Decimal, mode: WordMode, span: Range<u32>) -> Self {
        Self {
            value: number.value,
            start: span.start,
            end: span.end,
            letter,
            point: number.point,
            decimals: number.decimals,
            mode,
        }
    }

    /// A word of the language, by its index in the dialect's table.
    pub(super) fn keyword(index: usize, span: Range<u32>) -> Self {
        let number = super::number::Decimal { value: index as f64, point: false, decimals: 0 };
        Self::new(address::KEYWORD, number, WordMode::Plain, span)
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
    /// Whether the text says where the program ends (%, END PGM).
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
