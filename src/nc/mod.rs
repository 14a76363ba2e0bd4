//! NC programs: text to words and blocks, blocks to commanded motion, and back; one dialect a file.
//!
//! Reading half ([`read`], [`Rules`], [`Program`], [`FeedRules`]): `block`, `scan`, `lexer`, `number`, `code`,
//! `block_codes`, `interpreter`, `program`, `radians`, `feed_rules`, `catalogue`, `finding`, with what `dialect` says about
//! reading. It uses `diagnostic` and of `machine` the control's options. Writing half ([`write()`]): `write`, `write_block`,
//! `write_feed`, `template`, `format`, with what `dialect` says about writing; it also uses `motion` and `feed`.

mod block;
mod block_codes;
mod catalogue;
pub mod code;
mod dialect;
mod feed_rules;
mod finding;
mod format;
mod interpreter;
mod lexer;
mod number;
pub mod program;
mod radians;
mod scan;
mod template;
#[cfg(test)]
mod tests;
mod write;
mod write_block;
mod write_feed;

pub use catalogue::{GROUPS, Rule, Weight};
pub use dialect::Rules;
pub use feed_rules::{FeedRules, Travelled};
pub use finding::{Finding, FindingCode, Findings};
pub use interpreter::read;
pub use program::Program;
pub use scan::MAX_PROGRAM_BYTES;
pub use write::{WriteRequest, Written, write};
