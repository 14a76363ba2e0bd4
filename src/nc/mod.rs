//! NC programs: text to words and blocks, blocks to commanded motion, and back; one dialect a file.
//!
//! Reading half ([`read`], [`Rules`], [`Program`]): `block`, `lexer`, `number`, `code`, `block_codes`, `interpreter`,
//! `program`, `radians`, `finding`, with what `dialect` says about reading. It uses `diagnostic` and of `machine` the
//! control's options. Writing half ([`write`]): `write` with what `dialect` says about writing; it also uses `motion`
//! and `feed`.

mod block;
mod block_codes;
pub mod code;
mod dialect;
mod finding;
mod interpreter;
mod lexer;
mod number;
pub mod program;
mod radians;

pub use dialect::Rules;
pub use finding::{Finding, FindingCode, Findings};
pub use interpreter::read;
pub use program::Program;
