//! The sizes that a job may ask for, all in one place, and the checks against them.

use crate::diagnostic::{Diagnostic, Severity, TomlText};
use crate::geometry::Vector;
use crate::machine::{Body, RawBody};

/// A closed or half-open interval of sensible values.
pub(super) struct Limit {
    low: f64,
    high: f64,
    /// Whether `low` itself is allowed.
    low_allowed: bool,
    unit: &'static str,
}

/// Any length of a tool, mm.
pub(super) const LENGTH: Limit = Limit { low: 0.0, high: 10_000.0, low_allowed: true, unit: "mm" };
/// A size that a tool may be wished to have, mm.
pub(super) const SIZE: Limit = Limit { low: 0.0, high: 10_000.0, low_allowed: false, unit: "mm" };
/// Coefficients of a free meridian: a cubic needs 4.
pub(super) const COEFFICIENTS: Limit = Limit { low: 4.0, high: 64.0, low_allowed: true, unit: "coefficients" };
/// A coordinate of a placement or offset, mm.
pub(super) const COORDINATE: Limit = Limit { low: -100_000.0, high: 100_000.0, low_allowed: true, unit: "mm" };
/// A rotation of the part, degrees.
pub(super) const ANGLE: Limit = Limit { low: -360.0, high: 360.0, low_allowed: true, unit: "degrees" };
/// Angle between neighbouring triangles from which on their edge is sharp, degrees.
pub(super) const CREASE: Limit = Limit { low: 0.0, high: 90.0, low_allowed: false, unit: "degrees" };
/// The part's tolerance, mm. Zero is allowed: then any overcut at all fails.
pub(super) const TOLERANCE: Limit = Limit { low: 0.0, high: 10.0, low_allowed: true, unit: "mm" };
/// Deviation between blocks, mm; below it a control's own resolution decides.
pub(super) const LINEARIZATION: Limit = Limit { low: 1e-5, high: 1.0, low_allowed: true, unit: "mm" };
/// Cutting feed, mm/min.
pub(super) const FEED: Limit = Limit { low: 0.0, high: 200_000.0, low_allowed: false, unit: "mm/min" };
/// Spindle speed, 1/min. Zero is a spindle that stands, for a dry run.
pub(super) const SPINDLE: Limit = Limit { low: 0.0, high: 500_000.0, low_allowed: true, unit: "1/min" };
/// Weight of a term of the planner's objective.
pub(super) const WEIGHT: Limit = Limit { low: 0.0, high: 1e12, low_allowed: false, unit: "" };
/// Weight of a term that may be left out.
pub(super) const ZERO_WEIGHT: Limit = Limit { low: 0.0, high: 1e12, low_allowed: true, unit: "" };
/// A share of something.
pub(super) const SHARE: Limit = Limit { low: 0.0, high: 1.0, low_allowed: true, unit: "" };
/// Samples on one position of the axis.
pub(super) const SAMPLES: Limit = Limit { low: 3.0, high: 1000.0, low_allowed: true, unit: "" };
/// Number of a program: what the controls at hand count up to.
pub(super) const PROGRAM_NUMBER: Limit = Limit { low: 1.0, high: 9999.0, low_allowed: true, unit: "" };
/// Number of strips.
pub(super) const STRIPS: Limit = Limit { low: 1.0, high: 1000.0, low_allowed: true, unit: "strips" };
/// Tool number of a control's table.
pub(super) const TOOL_NUMBER: Limit = Limit { low: 1.0, high: 99_999_999.0, low_allowed: true, unit: "" };

/// Characters that a name may have at most: the shortest comment line of the controls at hand.
const NAME_LENGTH: usize = 60;

impl Limit {
    fn holds(&self, value: f64) -> bool {
        (value > self.low || (self.low_allowed && value == self.low)) && value <= self.high
    }

    /// The nearest allowed value.
    pub(super) fn clamp(&self, value: f64) -> f64 {
        value.clamp(self.low, self.high)
    }

    fn describe(&self) -> String {
        let bound = if self.low_allowed { "from" } else { "above" };
        format!("{bound} {} up to {} {}", self.low, self.high, self.unit).trim_end().to_owned()
    }
}

/// Collects findings, so that one run names all wrong values.
pub(super) struct Checks<'a> {
    text: &'a TomlText,
    findings: Vec<Diagnostic>,
    warnings: Vec<Diagnostic>,
    keys: Vec<String>,
    /// Where the keys of a tool are, which checks know as `tool`.
    tools: String,
}

impl<'a> Checks<'a> {
    pub(super) fn new(text: &'a TomlText) -> Self {
        Self { text, findings: Vec::new(), warnings: Vec::new(), keys: Vec::new(), tools: "tool".to_owned() }
    }

    /// Everything found and everything warned of, in order of place.
    pub(super) fn finish(mut self) -> (Vec<Diagnostic>, Vec<Diagnostic>) {
        self.findings.sort_by_key(|d| d.place.as_ref().map(|p| (p.line, p.column)));
        (self.findings, self.warnings)
    }

    /// From here on `tool` is the table at this path, such as `tool[2]`.
    pub(super) fn read_tools_from(&mut self, path: String) {
        self.tools = path;
    }

    /// The path of a key in the text.
    fn path_of(&self, key: &str) -> String {
        match key.strip_prefix("tool") {
            Some(rest) if rest.is_empty() || rest.starts_with('.') => format!("{}{rest}", self.tools),
            _ => key.to_owned(),
        }
    }

    /// The keys of a table.
    pub(super) fn keys(&self, table: &str) -> Vec<String> {
        self.text.keys(&self.path_of(table))
    }

    /// Notes a finding about the value at `key`, with its remedy.
    pub(super) fn refuse(&mut self, key: &str, message: impl Into<String>, help: impl Into<String>) {
        let path = self.path_of(key);
        self.findings.push(*self.text.blame(&path, message).help(help));
        self.keys.push(path);
    }

    /// Notes a warning about the value at `key`, with its remedy.
    pub(super) fn warn(&mut self, key: &str, message: &str, help: &str) {
        let mut warning = *self.text.blame(key, message).help(help);
        warning.severity = Severity::Warning;
        self.warnings.push(warning);
    }

    /// Whether something was found in a table.
    pub(super) fn found_under(&self, table: &str) -> bool {
        let table = self.path_of(table);
        self.keys.iter().any(|key| key.split('.').next() == Some(table.as_str()))
    }

    pub(super) fn within(&mut self, key: &str, value: f64, limit: &Limit) {
        if !limit.holds(value) {
            self.refuse(
                key,
                format!("{key} = {value} is out of range"),
                format!("write a number {}", limit.describe()),
            );
        }
    }

    pub(super) fn all_within(&mut self, key: &str, values: &[f64], limit: &Limit) {
        for (i, value) in values.iter().enumerate() {
            self.within(&format!("{key}[{i}]"), *value, limit);
        }
    }

    /// A vector that gives a direction.
    pub(super) fn vector(&mut self, key: &str, value: Option<[f64; 3]>) -> Option<Vector> {
        let vector = Vector::from(value?);
        let length = vector.norm();
        if (1e-6..=1e6).contains(&length) {
            return Some(vector);
        }
        let message = format!("a vector of length {length} gives no direction");
        self.refuse(key, message, "write a vector about as long as 1, such as [1.0, 0.0, 0.0], or leave it out");
        None
    }

    /// The fixtures that are right.
    pub(super) fn fixtures(&mut self, raw: &[RawBody]) -> Vec<Body> {
        let mut fixtures: Vec<Body> = Vec::with_capacity(raw.len());
        for (index, raw) in raw.iter().enumerate() {
            let path = format!("fixtures[{index}]");
            match raw.fixture(self.text, &path) {
                Ok(body) if fixtures.iter().any(|other| other.name == body.name) => {
                    let message = format!("a second fixture is called \"{}\"", body.name);
                    self.refuse(&format!("{path}.name"), message, "give each fixture a name of its own");
                }
                Ok(body) => fixtures.push(body),
                Err(finding) => self.findings.push(*finding),
            }
        }
        fixtures
    }

    /// Format and version of the file, against what this kind of file, in words, has to say.
    pub(super) fn header(&mut self, (format, version): (&str, u32), (wanted, words): (&str, &str)) {
        if format != wanted {
            self.refuse(
                "format",
                format!("format \"{format}\" is not that of {words}"),
                format!("write format = \"{wanted}\""),
            );
        }
        if version != 1 {
            self.refuse(
                "version",
                format!("version {version} of the {wanted} format is not known"),
                "write version = 1",
            );
        }
    }

    /// A name that fits a comment line of a program.
    pub(super) fn name(&mut self, key: &str, name: String) -> String {
        let length = name.chars().count();
        if name.trim().is_empty() || length > NAME_LENGTH || name.chars().any(char::is_control) {
            self.refuse(
                key,
                "the name must be one line with a visible character",
                format!("write 1 to {NAME_LENGTH} characters; these are {length}"),
            );
        }
        name
    }

    /// A file's name.
    pub(super) fn path(&mut self, key: &str, path: String) -> String {
        if path.trim().is_empty() || path.chars().any(char::is_control) {
            self.refuse(key, "this names no file", "write a path relative to the folder of the job file");
        }
        path
    }

    /// A work offset word: G54 to G59, G59.1 to G59.3, or one of many by its number, as a control has them.
    pub(super) fn work_offset(&mut self, key: &str, word: &str) {
        let plain = ["G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"].contains(&word);
        let numbered =
            [("G54.1 P", 1..=300), ("G154 P", 1..=99), ("G15 H", 1..=200), ("PRESET ", 0..=9999), ("G", 505..=599)];
        let is_numbered = numbered.into_iter().any(|(before, range)| {
            let number = word.strip_prefix(before).and_then(|number| number.parse::<u32>().ok());
            number.is_some_and(|number| range.contains(&number))
        });
        if !plain && !is_numbered {
            self.refuse(
                key,
                format!("\"{word}\" is not a work offset"),
                "write G54 to G59, G59.1 to G59.3, or one by its number: G54.1 P1, G154 P1, G505, G15 H1, PRESET 1",
            );
        }
    }
}
