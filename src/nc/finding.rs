//! What is remarkable in a program: where, why, and what to write instead. Uses `catalogue` and `diagnostic`.

pub use super::catalogue::FindingCode;
use super::catalogue::Weight;
use crate::diagnostic::{Diagnostic, Severity};
use std::ops::Range;

/// One finding in a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Which rule.
    pub code: FindingCode,
    /// An error keeps the program from passing; see [`Self::leaves_doubt`] for whether it can be judged at all.
    pub severity: Severity,
    /// Line, from 1.
    pub line: usize,
    /// Bytes of the program that are meant, where there are any.
    pub span: Option<Range<usize>>,
    /// What is wrong.
    pub message: String,
    /// What to write instead.
    pub help: String,
}

impl Finding {
    /// A finding of the weight that its rule has.
    pub fn new(code: FindingCode, line: usize, message: impl Into<String>, help: &str) -> Self {
        let (message, help) = (message.into(), help.to_owned());
        let severity = match code.rule().weight {
            Weight::Doubt | Weight::Fault => Severity::Error,
            Weight::Notice => Severity::Warning,
        };
        Self { code, severity, line, span: None, message, help }
    }

    /// The same about these bytes of the program.
    #[must_use]
    pub fn at(self, span: Range<usize>) -> Self {
        Self { span: Some(span), ..self }
    }

    /// The same with another weight.
    #[must_use]
    pub fn weighing(self, severity: Severity) -> Self {
        Self { severity, ..self }
    }

    /// Whether the control may do something else than what is followed here, so that no verdict can rest on the program.
    pub fn leaves_doubt(&self) -> bool {
        self.severity == Severity::Error && self.code.rule().weight == Weight::Doubt
    }

    /// The finding as a message for people; `text` is the program it was found in.
    pub fn diagnostic(&self, file: &str, text: &[u8]) -> Box<Diagnostic> {
        let message = format!("{} [{} {}]", self.message, self.code.id(), self.code.name());
        let mut diagnostic = match self.severity {
            Severity::Warning => Diagnostic::warning(message),
            Severity::Error => Diagnostic::error(message),
        };
        diagnostic = diagnostic.in_file(file).help(self.help.clone());
        if let Some(place) = &mut diagnostic.place {
            place.line = Some(self.line);
        }
        let Some(before) = self.span.as_ref().and_then(|span| text.get(span.start.saturating_sub(SHOWN)..span.start))
        else {
            return diagnostic;
        };
        // In a line of absurd length there is no column to look at.
        let line_start = before.iter().rposition(|b| *b == b'\n').map(|i| i + 1);
        let Some(start) = line_start.or((before.len() < SHOWN).then_some(0)) else { return diagnostic };
        let (before, offset) =
            (before.get(start..).unwrap_or_default(), self.span.as_ref().map_or(0, |span| span.start));
        let line = text.get(offset - before.len()..).unwrap_or_default();
        let line = line.get(..line.len().min(SHOWN)).unwrap_or_default();
        let line = line.split(|b| *b == b'\n').next().unwrap_or_default();
        diagnostic = diagnostic.at(self.line, String::from_utf8_lossy(before).chars().count() + 1);
        diagnostic.source_line = Some(String::from_utf8_lossy(line).trim_end().to_owned());
        diagnostic
    }
}

/// Bytes of a line in which a column is counted, and of which a line is shown.
const SHOWN: usize = 1 << 16;

/// Findings in the order of the text, no more than can be read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Findings {
    list: Vec<Finding>,
    omitted: usize,
}

/// How many findings are kept; the others are counted.
const KEPT: usize = 1000;

impl Findings {
    /// Adds a finding, or counts it when there are too many.
    pub fn push(&mut self, finding: Finding) {
        if self.list.len() < KEPT {
            self.list.push(finding);
        } else {
            self.omitted += 1;
        }
    }

    /// Adds those of another pass and sorts them by their place.
    pub fn merge(&mut self, other: Self) {
        self.omitted += other.omitted;
        self.list.extend(other.list);
        self.list.sort_by_key(|finding| (finding.line, finding.span.as_ref().map(|span| span.start)));
    }

    /// Those kept.
    pub fn list(&self) -> &[Finding] {
        &self.list
    }

    /// How many were only counted.
    pub fn omitted(&self) -> usize {
        self.omitted
    }

    /// Whether any is an error. What was only counted may be one.
    pub fn any_error(&self) -> bool {
        self.omitted > 0 || self.list.iter().any(|finding| finding.severity == Severity::Error)
    }

    /// Whether any leaves it uncertain what the control does, so that no verdict can rest on the program. What was only
    /// counted may be such.
    pub fn any_doubt(&self) -> bool {
        self.omitted > 0 || self.list.iter().any(Finding::leaves_doubt)
    }
}
