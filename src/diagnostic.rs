//! What is wrong, where, and what to write instead: the one error type that reaches a user.
//!
//! Uses nothing of the crate. Inner modules may return their own error enums; whoever knows the file turns them into
//! a [`Diagnostic`].

mod toml_text;

pub use toml_text::{TomlText, nearest};

use std::fmt;

/// How much a finding weighs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Work goes on; the user should know.
    Warning,
    /// Work stops.
    Error,
}

/// A place in an input: file, and where it is known, line and column (both from 1).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// File name as the user gave it.
    pub file: String,
    /// Line, from 1.
    pub line: Option<usize>,
    /// Column in characters, from 1.
    pub column: Option<usize>,
}

/// One finding: what is wrong, where, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Weight.
    pub severity: Severity,
    /// What is wrong, one sentence, with the offending name, value and limit.
    pub message: String,
    /// Where.
    pub place: Option<Place>,
    /// The offending source line, if there is one worth showing.
    pub source_line: Option<String>,
    /// What to write or do instead.
    pub help: Option<String>,
}

/// Result whose error is meant for the user.
pub type Result<T, E = Box<Diagnostic>> = std::result::Result<T, E>;

impl Diagnostic {
    /// An error with a message only.
    pub fn error(message: impl Into<String>) -> Box<Self> {
        Box::new(Self {
            severity: Severity::Error,
            message: message.into(),
            place: None,
            source_line: None,
            help: None,
        })
    }

    /// A warning with a message only.
    pub fn warning(message: impl Into<String>) -> Box<Self> {
        let mut warning = Self::error(message);
        warning.severity = Severity::Warning;
        warning
    }

    /// Says in which file; keeps a line and column already known.
    #[must_use]
    pub fn in_file(mut self: Box<Self>, file: impl Into<String>) -> Box<Self> {
        self.place.get_or_insert_with(Place::default).file = file.into();
        self
    }

    /// Says on which line and in which column, both from 1.
    #[must_use]
    pub fn at(mut self: Box<Self>, line: usize, column: usize) -> Box<Self> {
        let place = self.place.get_or_insert_with(Place::default);
        place.line = Some(line);
        place.column = Some(column);
        self
    }

    /// Finds line and column from a byte offset into `text`, and keeps the offending line for display.
    #[must_use]
    pub fn at_offset(self: Box<Self>, text: &str, offset: usize) -> Box<Self> {
        let mut end = offset.min(text.len());
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let before = &text[..end];
        let line = before.bytes().filter(|b| *b == b'\n').count() + 1;
        let start = before.rfind('\n').map_or(0, |i| i + 1);
        let mut located = self.at(line, text[start..end].chars().count() + 1);
        located.source_line = text[start..].lines().next().map(str::to_owned);
        located
    }

    /// Adds the remedy.
    #[must_use]
    pub fn help(mut self: Box<Self>, help: impl Into<String>) -> Box<Self> {
        self.help = Some(help.into());
        self
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
            if let Some(column) = self.column {
                write!(f, ":{column}")?;
            }
        }
        Ok(())
    }
}

impl fmt::Display for Diagnostic {
    /// `error: message`, then place, source line with a caret, and remedy, each on its own line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = match self.severity {
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        write!(f, "{severity}: {}", self.message)?;
        if let Some(place) = &self.place {
            write!(f, "\n  --> {place}")?;
            if let (Some(line), Some(source)) = (place.line, &self.source_line) {
                let shown: String = source.chars().take(160).collect();
                write!(f, "\n{line:>5} | {shown}")?;
                if let Some(column) = place.column.filter(|c| *c <= 160) {
                    write!(f, "\n      | {:>column$}", "^")?;
                }
            }
        }
        if let Some(help) = &self.help {
            write!(f, "\n  help: {help}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Diagnostic {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offset_becomes_line_and_column_with_caret_below_it() {
        let text = "alpha\nbeta = ö1\ngamma";
        let offset = text.find('1').unwrap();
        let shown = Diagnostic::error("bad").in_file("job.toml").at_offset(text, offset).help("write 2").to_string();
        assert_eq!(shown, "error: bad\n  --> job.toml:2:9\n    2 | beta = ö1\n      |         ^\n  help: write 2");
    }

    #[test]
    fn offset_past_the_end_is_the_end() {
        let located = Diagnostic::error("bad").at_offset("ab", 99);
        assert_eq!(located.place.unwrap().column, Some(3));
    }
}
