//! Notices rotary words that were written in radians. Uses nothing of the crate.

use super::block::{Block, Word};
use super::finding::{Finding, FindingCode};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Fewest rotary words to judge by.
const ENOUGH: usize = 8;
/// Digits after the point that no post writes for degrees but formatted radians have.
const MANY_DECIMALS: u8 = 7;

/// Looks at every rotary word until one cannot be in radians.
#[derive(Default)]
pub(super) struct RadiansWatch {
    seen: usize,
    many_decimals: usize,
    /// The first word near a quarter turn.
    quarter: Option<(u32, std::ops::Range<usize>, f64)>,
    excluded: bool,
}

impl RadiansWatch {
    /// Whether the words so far may be radians.
    pub(super) fn possible(&self) -> bool {
        !self.excluded
    }

    pub(super) fn see(&mut self, block: &Block, word: &Word) {
        self.seen += 1;
        self.many_decimals += usize::from(word.decimals >= MANY_DECIMALS);
        self.excluded |= word.value.abs() > TAU + 1e-3;
        let quarters = word.value / FRAC_PI_2;
        if self.quarter.is_none() && quarters.abs() > 0.5 && (quarters - quarters.round()).abs() < 1e-3 {
            self.quarter = Some((block.line, word.span(), word.value));
        }
    }

    /// A finding when no word exceeds a full turn in radians, most have more decimals than degrees would, and one is
    /// a quarter turn in radians.
    pub(super) fn finding(&self) -> Option<Finding> {
        let (line, span, value) = self.quarter.clone()?;
        let suspect = !self.excluded && self.seen >= ENOUGH && self.many_decimals * 2 > self.seen;
        let message = format!("the rotary words look like radians: {value} is a quarter turn, none exceeds a turn");
        let help = "write rotary words in degrees";
        let finding = Finding::new(FindingCode::RadiansSuspected, line as usize, message, help).at(span);
        suspect.then_some(finding)
    }
}
