//! What is remarkable in a program: where, why, and what to write instead. Uses `diagnostic`.

use crate::diagnostic::{Diagnostic, Severity};
use std::ops::Range;

/// Which rule a finding is about; its name is stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum FindingCode {
    /// Text that is no word of the dialect.
    UnreadableText,
    /// A comment that is nested or not closed.
    BadComment,
    /// More characters than the control takes in a block.
    BlockTooLong,
    /// A letter that means nothing in this block.
    UnusedWord,
    /// A letter twice in one block.
    RepeatedWord,
    /// A number that the word cannot carry.
    BadNumber,
    /// A G or M code the dialect does not know.
    UnknownCode,
    /// A code the control knows, whose effect is not followed here.
    UnsupportedCode,
    /// Two codes of one modal group in a block.
    GroupConflict,
    /// Axis words with no motion code in force.
    NoMotionCode,
    /// An axis word for an axis the machine lacks.
    MissingAxis,
    /// A feed move without a feed word that is in force.
    MissingFeed,
    /// A feed move while the spindle stands still.
    SpindleOff,
    /// A number without decimal point where the control may count increments.
    MissingPoint,
    /// G43 or the like without the number of the offset.
    MissingOffsetNumber,
    /// An arc that its words do not determine.
    BadArc,
    /// No M2, M30 or % at the end.
    MissingEnd,
    /// Blocks that the control never reaches.
    UnreachedText,
    /// The control rounds corners.
    Blending,
    /// Blocks with block delete, taken as executed.
    BlockDelete,
    /// Rotary words that look like radians.
    RadiansSuspected,
    /// A work offset the machine file does not give.
    UnknownWorkOffset,
    /// The tool or its length offset is not the job's.
    OtherTool,
    /// TCP on with no tool length offset in force.
    TcpWithoutLength,
    /// A tool axis that the machine's rotary axes cannot make.
    UnreachableAxis,
    /// The tool length or TCP changes while tilted so that the machine jumps.
    Jump,
    /// An axis that moves before the program has said where it is.
    UnknownStart,
    /// A code in a state of TCP in which the control refuses it or does something else.
    WrongTcpState,
    /// A feed that the control does not keep: it clamps or reinterprets the word.
    FeedTrap,
}

impl FindingCode {
    /// Stable name for files and filters.
    pub fn name(self) -> &'static str {
        match self {
            Self::UnreadableText => "unreadable-text",
            Self::BadComment => "bad-comment",
            Self::BlockTooLong => "block-too-long",
            Self::UnusedWord => "unused-word",
            Self::RepeatedWord => "repeated-word",
            Self::BadNumber => "bad-number",
            Self::UnknownCode => "unknown-code",
            Self::UnsupportedCode => "unsupported-code",
            Self::GroupConflict => "group-conflict",
            Self::NoMotionCode => "no-motion-code",
            Self::MissingAxis => "missing-axis",
            Self::MissingFeed => "missing-feed",
            Self::SpindleOff => "spindle-off",
            Self::MissingPoint => "missing-point",
            Self::MissingOffsetNumber => "missing-offset-number",
            Self::BadArc => "bad-arc",
            Self::MissingEnd => "missing-end",
            Self::UnreachedText => "unreached-text",
            Self::Blending => "blending",
            Self::BlockDelete => "block-delete",
            Self::RadiansSuspected => "radians-suspected",
            Self::UnknownWorkOffset => "unknown-work-offset",
            Self::OtherTool => "other-tool",
            Self::TcpWithoutLength => "tcp-without-length",
            Self::UnreachableAxis => "unreachable-axis",
            Self::Jump => "jump",
            Self::UnknownStart => "unknown-start",
            Self::WrongTcpState => "wrong-tcp-state",
            Self::FeedTrap => "feed-trap",
        }
    }
}

impl FindingCode {
    /// What it weighs, unless the place where it is found says otherwise.
    fn severity(self) -> Severity {
        match self {
            Self::UnreachedText | Self::Blending | Self::BlockDelete | Self::OtherTool | Self::FeedTrap => {
                Severity::Warning
            }
            _ => Severity::Error,
        }
    }
}

/// One finding in a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Which rule.
    pub code: FindingCode,
    /// An error means: what the control does is not what is followed here, or it refuses, or it harms; no verdict can
    /// rest on the program.
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
        Self { code, severity: code.severity(), line, span: None, message, help }
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

    /// The finding as a message for people; `text` is the program it was found in.
    pub fn diagnostic(&self, file: &str, text: &[u8]) -> Box<Diagnostic> {
        let message = format!("{} [{}]", self.message, self.code.name());
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

    /// Whether any is an error, so that no verdict can rest on the program.
    pub fn any_error(&self) -> bool {
        self.omitted > 0 || self.list.iter().any(|finding| finding.severity == Severity::Error)
    }
}
