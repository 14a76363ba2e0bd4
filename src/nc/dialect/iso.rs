//! ISO 6983 words and nothing else: no TCP, no codes of any one maker.

use super::style::Style;
use super::words::style;
use super::{Lexical, Rules};
use crate::nc::code::GCode;

/// How a plain control reads programs.
pub(super) fn reading() -> Rules {
    let mut rules =
        Rules::of_words(Lexical { blanks_in_numbers: false, semicolon_comments: true, max_block_length: None });
    rules.set_g(&[610], GCode::ExactPath);
    rules.set_g(&[640], GCode::Harmless(0));
    rules
}

/// How programs for a plain control are written.
pub(super) fn writing() -> Style {
    style()
}
