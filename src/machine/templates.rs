//! Templates for the parts of a program that every shop writes its own way: what they may use, and whether they hold.
//! Uses `diagnostic`.

use minijinja::{Environment, UndefinedBehavior, Value, context};
use std::collections::BTreeMap;

/// A template and where it stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Template {
    /// Its text.
    pub text: String,
    /// The machine file it is from.
    pub file: String,
    /// Line of the machine file on which its key stands.
    pub line: usize,
}

/// The templates of a machine file; what is left out is as the dialect has it. Each has a key of the same name in
/// `[control.templates]`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Templates {
    /// Before everything else: program name, what the program is for, a known state.
    pub header: Option<Template>,
    /// Brings the tool to a safe place with TCP off: before the tool call, and after the path.
    pub retract: Option<Template>,
    /// Tool, work offset, length, spindle.
    pub tool_call: Option<Template>,
    /// From there to where the path begins, in the coordinates of the path.
    pub approach: Option<Template>,
    /// Behind the last retract.
    pub end: Option<Template>,
}

/// What templates may use, each with its meaning. Numbers are written in the control's own way already.
pub const FIELDS: [(&str, &str); 35] = [
    ("name", "text: name of the tool path, as a comment may hold it"),
    ("number", "whole number: number of the program"),
    ("machine", "text: name of the machine"),
    ("dialect", "text: name of the dialect"),
    ("version", "text: version of regulus"),
    ("input", "text: hash of everything the program was made from"),
    ("tool_number", "whole number"),
    ("tool_description", "text"),
    ("gauge_length", "text: tip to gauge line, mm"),
    ("overcut", "text: tolerance of the part, mm"),
    ("undercut", "text: tolerance of the part, mm"),
    ("work_offset", "text: the code that selects it, such as G54"),
    ("spindle", "text: revolutions per minute"),
    ("inch", "true or false: units of the program"),
    ("tcp", "true or false: whether the path runs with TCP on"),
    ("vectors", "true or false: whether blocks give the tool axis by its components"),
    ("great_circle", "true or false: whether the control turns the tool axis along great circles"),
    ("tcp_on", "text: code that turns TCP on; empty where there is none"),
    ("tcp_off", "text: code that turns TCP off; empty where there is none"),
    ("switchable", "true or false: whether TCP can be off"),
    ("length_on", "text: code that calls the tool length in a block of its own; empty where none is needed"),
    ("length_off", "text: code that ends it; empty where none is needed"),
    (
        "turn_feed",
        "text: degrees/min at which rotary axes may turn from anywhere, where TCP cannot be off and the control does not \
         keep the axes' speeds; else empty",
    ),
    ("feed_radius", "text: radius at which rotary axes count for F with TCP off; 0: not at all"),
    ("per_minute", "true or false: whether feeds are per minute"),
    ("wrapped", "true or false: whether a rotary axis counts from 0 to 360 degrees only"),
    ("letters", "list: letters of the rotary axes"),
    ("start_lines", "list: lines of the option of that name"),
    ("retract_lines", "list: lines of the option of that name"),
    ("end_lines", "list: lines of the option of that name"),
    ("rotary", "text, approach only: words of the rotary axes where the path begins"),
    ("across", "text, approach only: words of X and Y there, TCP off"),
    ("joint", "text, approach only: words of all axes there, TCP off"),
    ("start", "text, approach only: words of X, Y, Z there, in the coordinates of the path"),
    ("start_words", "list, approach only: the same one by one"),
];

/// What is wrong with a template, with the line of the template, from 1, where it is known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fault {
    pub(super) line: usize,
    pub(super) message: String,
    pub(super) help: String,
}

/// The environment that templates are rendered in: `comment` makes a comment of a text, the filter `pad` writes a whole
/// number with at least so many digits.
pub fn environment<'a>(comment: impl Fn(&str) -> String + Send + Sync + 'static) -> Environment<'a> {
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.add_filter("comment", move |text: &str| comment(text));
    environment.add_filter("pad", |number: u32, width: u32| format!("{number:0width$}", width = width.min(9) as usize));
    environment
}

/// Looks for bad syntax, unknown fields, and whatever else makes a template fail.
pub(super) fn check(text: &str) -> Result<(), Fault> {
    let environment = environment(str::to_owned);
    let template = environment.template_from_str(text).map_err(|e| fault(&e))?;
    let known = |name: &str| FIELDS.iter().any(|(field, _)| *field == name);
    let globals: Vec<String> = environment.globals().map(|(name, _)| name.to_owned()).collect();
    let mut unknown: Vec<String> = template.undeclared_variables(false).into_iter().collect();
    unknown.retain(|name| !known(name) && !globals.contains(name));
    unknown.sort();
    if let Some(name) = unknown.first() {
        let line = text.lines().position(|line| mentions(line, name)).map_or(1, |line| line + 1);
        let known: Vec<&str> = FIELDS.iter().map(|(field, _)| *field).collect();
        let meant = crate::diagnostic::nearest(name, &known).map(|near| format!("did you mean {near}? "));
        let help = format!("{}Fields are {}", meant.unwrap_or_default(), known.join(", "));
        return Err(Fault { line, message: format!("template field {name} is not known"), help });
    }
    for (tcp, inch, vectors) in [(true, false, true), (false, true, false), (true, true, false)] {
        template.render(sample(tcp, inch, vectors)).map_err(|e| fault(&e))?;
    }
    Ok(())
}

/// Whether a line holds a name that is not part of a longer one.
fn mentions(line: &str, name: &str) -> bool {
    let part = |c: char| c.is_alphanumeric() || c == '_';
    line.match_indices(name).any(|(at, _)| !line[..at].ends_with(part) && !line[at + name.len()..].starts_with(part))
}

fn fault(error: &minijinja::Error) -> Fault {
    let message = error.detail().map_or_else(|| error.kind().to_string(), str::to_owned);
    let help = "write {{ field }}, {% if field %} … {% endif %}, {{ \"text\" | comment }}";
    Fault { line: error.line().unwrap_or(1), message: format!("template: {message}"), help: help.to_owned() }
}

/// A value for every field.
fn sample(tcp: bool, inch: bool, vectors: bool) -> Value {
    let flags = context! {
        tcp, inch, vectors, wrapped => tcp, great_circle => vectors, switchable => tcp, per_minute => !inch, number => 1, tool_number => 1,
        letters => ["A", "C"], start_words => ["X1.", "Y2.", "Z3."], start_lines => ["G61"], retract_lines => ["G53 G0 Z0."], end_lines => ["M9"],
    };
    let texts = FIELDS.iter().filter(|(_, meaning)| meaning.starts_with("text"));
    let texts: BTreeMap<&str, Value> = texts.map(|(field, _)| (*field, Value::from("1"))).collect();
    context! { ..flags, ..Value::from(texts) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_field_has_a_sample() {
        for (field, _) in FIELDS {
            assert_eq!(check(&format!("{{% if {field} %}}{{{{ {field} }}}}{{% endif %}}")), Ok(()), "{field}");
        }
    }

    #[test]
    fn faults_have_their_line_and_a_remedy() {
        for (text, line, message) in [
            ("G21\n{{ tool_numbr }}", 2, "template field tool_numbr is not known"),
            ("{% if not tcp %}\n\n{{ spindel }}{% endif %}", 3, "template field spindel is not known"),
            ("G21\n{% if tcp %}", 2, "template: "),
            ("{{ name | reverse_polish }}", 1, "template: "),
            ("{{ number }}\n{{ letters.first }}", 2, "template: "),
        ] {
            let fault = check(text).unwrap_err();
            assert_eq!(fault.line, line, "{text}: {fault:?}");
            assert!(fault.message.starts_with(message) && !fault.help.is_empty(), "{fault:?}");
        }
        assert!(check("{{ tool_numbr }}").unwrap_err().help.contains("did you mean tool_number?"));
    }
}
