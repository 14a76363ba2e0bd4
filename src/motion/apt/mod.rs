//! CL files of other CAM systems: APT and CLSF text (ISO 4343's words) to operations and back. Uses `diagnostic`,
//! `geometry` and the rest of `motion`.
//!
//! A statement is a major word, a slash and minor words or numbers parted by commas; `$` at the end of a line continues
//! it, `$$` begins a comment. Places are in the part frame; the tool axis points from the tip toward the spindle. What
//! is not understood is listed with line and word, never left out in silence.

mod motion;
mod operation;
mod statement;
#[cfg(test)]
mod tests;
mod words;
mod write;

pub use operation::{Assumptions, Operation};
pub use statement::Unread;
pub use write::write;

use motion::Reader;

/// An APT file as it is understood.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AptFile {
    /// Name of the part (PARTNO), empty where there is none.
    pub name: String,
    /// One a tool call, in the order of the file; those that move nothing are left out.
    pub operations: Vec<Operation>,
    /// What is not understood, in the order of the file.
    pub unread: Vec<Unread>,
    /// Lines of the file.
    pub lines: usize,
    /// Statements.
    pub statements: usize,
    /// Whether the file says its units; else they are millimetres.
    pub has_units: bool,
}

/// Reads an APT file; circles become chords that leave them by at most `chord`, mm.
pub fn read(text: &str, chord: f64) -> AptFile {
    let mut reader = Reader::new(chord);
    let statements = statement::split(text);
    for statement in &statements {
        reader.statement(statement);
    }
    let mut file = reader.finish();
    file.lines = text.lines().count();
    file.statements = statements.len();
    file
}
