//! The parts of a program around its path, from templates. Uses `diagnostic` and `machine`.

use super::dialect::{Part, Style};
use crate::diagnostic::{Diagnostic, Result};
use crate::machine::{Templates, template_environment};
use serde::Serialize;

/// What the templates of a program may use; see [`crate::machine::TEMPLATE_FIELDS`] for their meanings.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct Fields<'a> {
    pub(super) name: String,
    pub(super) number: u32,
    pub(super) machine: &'a str,
    pub(super) dialect: &'a str,
    pub(super) version: &'a str,
    pub(super) input: &'a str,
    pub(super) tool_number: u32,
    pub(super) tool_description: String,
    pub(super) gauge_length: String,
    pub(super) overcut: String,
    pub(super) undercut: String,
    pub(super) work_offset: &'a str,
    pub(super) spindle: String,
    pub(super) inch: bool,
    pub(super) tcp: bool,
    pub(super) vectors: bool,
    pub(super) great_circle: bool,
    pub(super) tcp_on: &'a str,
    pub(super) tcp_off: &'a str,
    pub(super) switchable: bool,
    pub(super) length_on: String,
    pub(super) length_off: String,
    pub(super) turn_feed: String,
    pub(super) feed_radius: String,
    pub(super) per_minute: bool,
    pub(super) wrapped: bool,
    pub(super) letters: Vec<String>,
    pub(super) start_lines: &'a [String],
    pub(super) retract_lines: &'a [String],
    pub(super) end_lines: &'a [String],
    #[serde(flatten)]
    pub(super) approach: Option<Approach>,
}

/// Where the path begins, in words.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct Approach {
    pub(super) rotary: String,
    pub(super) across: String,
    pub(super) joint: String,
    pub(super) start: String,
    pub(super) start_words: Vec<String>,
}

/// The lines of a part of a program; empty ones are left out. `longest` bounds comments, characters.
pub(super) fn render(
    part: Part,
    own: &Templates,
    style: &Style,
    longest: usize,
    fields: &Fields<'_>,
) -> Result<Vec<String>> {
    let (text, place) = part.text(own, style);
    let look = *style;
    let environment = template_environment(move |text| look.comment(text, longest));
    let rendered =
        environment.render_str(text, minijinja::Value::from(minijinja::value::Serde(fields))).map_err(|e| {
            let reason = e.detail().map_or_else(|| e.kind().to_string(), str::to_owned);
            let message = format!("template {} cannot be filled in: {reason}", part.name());
            let help = "some fields exist in the approach only; `regulus machine schema` lists all of them";
            let error = Diagnostic::error(message).help(help);
            match place {
                Some((file, line)) => error.in_file(file).at(line, 1),
                None => error,
            }
        })?;
    let lines = rendered.lines().map(str::trim).filter(|line| !line.is_empty());
    Ok(lines.map(str::to_owned).collect())
}
