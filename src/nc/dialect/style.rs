//! How programs of a dialect look, beyond the options of a control.

use crate::machine::Templates as OwnTemplates;
use crate::nc::format::NumberStyle;

/// How programs of a dialect are written.
#[derive(Clone, Copy)]
pub(in crate::nc) struct Style {
    /// The parts around the path, where a machine file gives none.
    pub(in crate::nc) templates: Templates,
    /// Text as it may stand in a comment.
    pub(in crate::nc) plain_text: fn(&str) -> String,
    /// What stands before and behind a comment.
    pub(in crate::nc) comment_marks: [&'static str; 2],
    /// Whether spindle speeds must be whole.
    pub(in crate::nc) whole_spindle_speed: bool,
    /// Whether each line begins with its number, from 0.
    pub(in crate::nc) numbered_lines: bool,
    /// How numbers look.
    pub(in crate::nc) numbers: NumberStyle,
    /// Codes for inverse-time feed and feed per minute; `None` where there is only the latter.
    pub(in crate::nc) feed_units: Option<[&'static str; 2]>,
    /// What a rapid begins with, and what stands for its feed.
    pub(in crate::nc) rapid: &'static str,
    pub(in crate::nc) rapid_feed: &'static str,
    /// What a straight feed move begins with.
    pub(in crate::nc) line: &'static str,
    /// Whether these stay in force.
    pub(in crate::nc) motion_stays: bool,
    /// Addresses of the components of the tool axis.
    pub(in crate::nc) vector: [&'static str; 3],
    /// Whether a block with a tool vector is an LN, with X, Y, Z and all components.
    pub(in crate::nc) whole_vectors: bool,
    /// How the number of a wrapped rotary axis is wrapped.
    pub(in crate::nc) wrapped: Wrapped,
    /// Whether the tool call brings the tool length along, so that no block of its own is needed.
    pub(in crate::nc) length_with_tool: bool,
    /// Whether the code that turns TCP on brings the tool length along.
    pub(in crate::nc) length_with_tcp: bool,
}

/// What stands around a number.
#[derive(Clone, Copy)]
pub(in crate::nc) struct Wrapped {
    pub(in crate::nc) before: &'static str,
    pub(in crate::nc) behind: &'static str,
}

/// The parts around the path; see [`OwnTemplates`].
#[derive(Clone, Copy)]
pub(in crate::nc) struct Templates {
    pub(in crate::nc) header: &'static str,
    pub(in crate::nc) retract: &'static str,
    pub(in crate::nc) tool_call: &'static str,
    pub(in crate::nc) approach: &'static str,
    pub(in crate::nc) end: &'static str,
}

/// A part of a program that comes from a template.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::nc) enum Part {
    Header,
    Retract,
    ToolCall,
    Approach,
    End,
}

impl Part {
    /// Its key in a machine file.
    pub(in crate::nc) fn name(self) -> &'static str {
        match self {
            Self::Header => "header",
            Self::Retract => "retract",
            Self::ToolCall => "tool_call",
            Self::Approach => "approach",
            Self::End => "end",
        }
    }

    /// The machine's own template, or the dialect's, with the file and the line of its key where it is the machine's.
    pub(in crate::nc) fn text<'a>(self, own: &'a OwnTemplates, style: &Style) -> (&'a str, Option<(&'a str, usize)>) {
        let (own, default) = match self {
            Self::Header => (&own.header, style.templates.header),
            Self::Retract => (&own.retract, style.templates.retract),
            Self::ToolCall => (&own.tool_call, style.templates.tool_call),
            Self::Approach => (&own.approach, style.templates.approach),
            Self::End => (&own.end, style.templates.end),
        };
        own.as_ref().map_or((default, None), |own| (own.text.as_str(), Some((own.file.as_str(), own.line))))
    }
}

impl Style {
    /// What a block with a tool vector begins with.
    pub(in crate::nc) fn vector_line(&self, rapid: bool) -> &'static str {
        match (self.whole_vectors, rapid) {
            (true, _) => "LN ",
            (false, true) => self.rapid,
            (false, false) => self.line,
        }
    }

    /// Lines of comment for a text, no longer than `longest` characters.
    pub(in crate::nc) fn comment(&self, text: &str, longest: usize) -> String {
        let text = (self.plain_text)(text);
        let [before, behind] = self.comment_marks;
        // A line number may come before it.
        let room = longest.saturating_sub(before.len() + behind.len() + 8).max(1);
        // Plain ASCII, so every byte is a character.
        let pieces = text.as_bytes().chunks(room);
        let lines: Vec<_> = pieces.map(|piece| format!("{before}{}{behind}", String::from_utf8_lossy(piece))).collect();
        lines.join("\n")
    }
}
