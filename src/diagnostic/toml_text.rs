//! A TOML file with its text kept, so that every complaint about it names line and column: syntax, unknown and missing
//! keys, wrong types, numbers that are not finite, and later whatever a reader finds wrong with a value.

use super::{Diagnostic, Result};
use serde::de::DeserializeOwned;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The text of a TOML file and its name in messages.
#[derive(Clone, Debug, PartialEq)]
pub struct TomlText {
    file: String,
    text: String,
}

/// One step of a path of keys.
#[derive(Debug, PartialEq)]
enum Step<'a> {
    Key(&'a str),
    Index(usize),
}

impl TomlText {
    /// Keeps a text and its file's name as the user gave it.
    pub fn new(file: impl Into<String>, text: impl Into<String>) -> Self {
        Self { file: file.into(), text: text.into() }
    }

    /// The file's name as the user gave it.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Reads the text into `T`. Refuses bad syntax, whatever `T` refuses (unknown keys, if it says so), and every
    /// number that is NaN or infinite.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T> {
        let table = DeTable::parse(&self.text).map_err(|e| self.explain(&e))?;
        if let Some(span) = non_finite_in_table(table.get_ref()) {
            let value = self.text.get(span.clone()).unwrap_or_default();
            return Err(self
                .at(span.start, format!("{value} is not a finite number"))
                .help("write a number with digits, such as 0.5"));
        }
        T::deserialize(toml::Deserializer::from(table)).map_err(|e| self.explain(&e))
    }

    /// A complaint about the value at a path of keys such as `tool.spheres.r1` or `part.placement.origin[1]`. Where
    /// the path does not exist, the place is the innermost table on the way to it.
    pub fn blame(&self, path: &str, message: impl Into<String>) -> Box<Diagnostic> {
        match DeTable::parse(&self.text) {
            Ok(table) => self.at(self.find(&table, path).start, message),
            Err(_) => Diagnostic::error(message).in_file(&self.file),
        }
    }

    /// The keys of the table at a path, in alphabetical order; none where there is no such table.
    pub fn keys(&self, path: &str) -> Vec<String> {
        let Ok(table) = DeTable::parse(&self.text) else { return Vec::new() };
        let names = |table: &DeTable<'_>| table.keys().map(|k| k.get_ref().to_string()).collect();
        let mut here: Option<&DeValue<'_>> = None;
        for step in steps(path) {
            let inner = match (step, here) {
                (Step::Key(key), None) => table.get_ref().get(key),
                (Step::Key(key), Some(DeValue::Table(inner))) => inner.get(key),
                (Step::Index(index), Some(DeValue::Array(inner))) => inner.get(index),
                _ => None,
            };
            let Some(inner) = inner else { return Vec::new() };
            here = Some(inner.get_ref());
        }
        match here {
            None => names(table.get_ref()),
            Some(DeValue::Table(inner)) => names(inner),
            Some(_) => Vec::new(),
        }
    }

    /// A complaint about a byte offset of the text.
    fn at(&self, offset: usize, message: impl Into<String>) -> Box<Diagnostic> {
        Diagnostic::error(message).in_file(&self.file).at_offset(&self.text, offset)
    }

    fn find(&self, root: &Spanned<DeTable<'_>>, path: &str) -> Range<usize> {
        let mut steps = steps(path);
        let Some(Step::Key(first)) = steps.next() else { return root.span() };
        let Some(mut here) = root.get_ref().get(first) else { return 0..0 };
        for step in steps {
            let inner = match (step, here.get_ref()) {
                (Step::Key(key), DeValue::Table(table)) => table.get(key),
                (Step::Index(index), DeValue::Array(array)) => array.get(index),
                _ => None,
            };
            match inner {
                Some(inner) => here = inner,
                None => break,
            }
        }
        here.span()
    }

    /// Turns the parser's error into plain words with a remedy.
    fn explain(&self, error: &toml::de::Error) -> Box<Diagnostic> {
        let offset = error.span().map_or(0, |span| span.start);
        let message = error.message();
        if let Some((name, known)) = unknown_name(message, "unknown field") {
            return self.at(offset, format!("unknown key `{name}`")).help(choices(name, &known, "keys"));
        }
        if let Some((name, known)) = unknown_name(message, "unknown variant") {
            return self.at(offset, format!("unknown value \"{name}\"")).help(choices(name, &known, "values"));
        }
        if let Some(name) = message.strip_prefix("missing field ").map(|m| m.trim_matches('`')) {
            return self
                .at(offset, format!("key `{name}` is missing"))
                .help(format!("add a line `{name} = …` to this table"));
        }
        if let Some((found, wanted)) = message.strip_prefix("invalid ").and_then(|m| m.split_once(", expected ")) {
            let found = found.replacen("type:", "wrong type:", 1).replacen("value:", "wrong value:", 1).replacen(
                "length ",
                "a list of length ",
                1,
            );
            return self.at(offset, found).help(format!("write {}", plain_type(wanted)));
        }
        let help = match message.starts_with("duplicate key") {
            true => "leave one of them out",
            false => "write [table] headers and lines key = value; text stands in quotes, lists in square brackets",
        };
        self.at(offset, message.to_owned()).help(help)
    }
}

/// The steps of a path such as `a.b[2].c`.
fn steps(path: &str) -> impl Iterator<Item = Step<'_>> {
    path.split(['.', '[']).filter(|part| !part.is_empty()).map(|part| {
        match part.strip_suffix(']').and_then(|index| index.parse().ok()) {
            Some(index) => Step::Index(index),
            None => Step::Key(part),
        }
    })
}

/// The place of the first number that is NaN or infinite.
fn non_finite(value: &Spanned<DeValue<'_>>) -> Option<Range<usize>> {
    match value.get_ref() {
        DeValue::Float(number) => {
            let finite = number.as_str().replace('_', "").parse::<f64>().is_ok_and(f64::is_finite);
            (!finite).then(|| value.span())
        }
        DeValue::Array(array) => array.iter().find_map(non_finite),
        DeValue::Table(table) => non_finite_in_table(table),
        _ => None,
    }
}

fn non_finite_in_table(table: &DeTable<'_>) -> Option<Range<usize>> {
    table.iter().filter_map(|(_, value)| non_finite(value)).min_by_key(|span| span.start)
}

/// Takes "unknown field `x`, expected one of `a`, `b`" apart.
fn unknown_name<'a>(message: &'a str, start: &str) -> Option<(&'a str, Vec<&'a str>)> {
    let mut quoted = message.strip_prefix(start)?.split('`').skip(1).step_by(2);
    let name = quoted.next()?;
    Some((name, quoted.collect()))
}

fn choices(name: &str, known: &[&str], what: &str) -> String {
    if known.is_empty() {
        return format!("no {what} are known here");
    }
    let list = known.join(", ");
    match nearest(name, known) {
        Some(near) => format!("did you mean `{near}`? The {what} known here: {list}"),
        None => format!("the {what} known here: {list}"),
    }
}

/// The candidate nearest to a misspelled name, if one is near enough to be meant.
pub fn nearest<'a>(name: &str, candidates: &[&'a str]) -> Option<&'a str> {
    let limit = (name.chars().count() / 3).max(1);
    let scored = candidates.iter().map(|c| (edit_distance(name, c), *c));
    scored.filter(|(distance, _)| *distance <= limit).min_by_key(|(distance, _)| *distance).map(|(_, c)| c)
}

/// Fewest insertions, deletions and replacements of characters that turn one text into the other (Levenshtein).
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = i;
        let mut left = i + 1;
        for (cell, cb) in row.iter_mut().skip(1).zip(&b) {
            let replaced = diagonal + usize::from(ca != *cb);
            diagonal = *cell;
            left = replaced.min(diagonal + 1).min(left + 1);
            *cell = left;
        }
        if let Some(first) = row.first_mut() {
            *first = i + 1;
        }
    }
    row.last().copied().unwrap_or_default()
}

fn plain_type(wanted: &str) -> &str {
    match wanted {
        "f64" => "a number",
        "u32" | "u64" | "usize" | "i64" => "a whole number",
        "a string" => "text in quotes",
        "a boolean" => "true or false",
        "a sequence" => "a list in square brackets",
        "an array of length 2" => "a list of 2 in square brackets",
        "an array of length 3" => "a list of 3 in square brackets",
        other => other.strip_prefix("struct ").map_or(other, |_| "a table of keys"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Outer {
        #[serde(rename = "name")]
        _name: String,
        #[serde(rename = "inner")]
        _inner: Inner,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Inner {
        #[serde(rename = "flute_length")]
        _flute_length: f64,
        #[serde(rename = "kind")]
        _kind: Option<Kind>,
        #[serde(rename = "list", default)]
        _list: Vec<[f64; 2]>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    enum Kind {
        Cone,
        TaperedBall,
    }

    fn complaint(text: &str) -> String {
        TomlText::new("a.toml", text).parse::<Outer>().unwrap_err().to_string()
    }

    #[test]
    fn good_text_is_read() {
        let text = "name = \"x\"\n[inner]\nflute_length = 4\nlist = [[1, 2.5]]\nkind = \"tapered-ball\"\n";
        TomlText::new("a.toml", text).parse::<Outer>().unwrap();
    }

    #[test]
    fn typing_error_in_a_key_names_the_key_that_was_meant() {
        let said = complaint("name = \"x\"\n[inner]\nflut_length = 4.0\n");
        assert!(said.contains("unknown key `flut_length`\n  --> a.toml:3:1"), "{said}");
        assert!(said.contains("did you mean `flute_length`?"), "{said}");
    }

    #[test]
    fn unknown_value_lists_the_known_ones() {
        let said = complaint("name = \"x\"\n[inner]\nflute_length = 4.0\nkind = \"cube\"\n");
        assert!(said.contains("unknown value \"cube\"\n  --> a.toml:4:8"), "{said}");
        assert!(said.contains("the values known here: cone, tapered-ball"), "{said}");
    }

    #[test]
    fn missing_key_points_to_its_table() {
        let said = complaint("name = \"x\"\n[inner]\n");
        assert!(said.contains("key `flute_length` is missing\n  --> a.toml:2:1"), "{said}");
    }

    #[test]
    fn wrong_type_says_what_to_write() {
        let said = complaint("name = \"x\"\n[inner]\nflute_length = \"long\"\n");
        assert!(said.contains("wrong type: string \"long\"\n  --> a.toml:3:16"), "{said}");
        assert!(said.contains("help: write a number"), "{said}");
    }

    #[test]
    fn lists_of_wrong_length_say_how_many_are_wanted() {
        let said = complaint("name = \"x\"\n[inner]\nflute_length = 4.0\nlist = [[1]]\n");
        assert!(said.contains("a list of length 1\n  --> a.toml:4:9"), "{said}");
        assert!(said.contains("help: write a list of 2 in square brackets"), "{said}");
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused_wherever_they_stand() {
        for number in ["nan", "inf", "-inf", "+nan", "1e999"] {
            let said = complaint(&format!("name = \"x\"\n[inner]\nflute_length = 4.0\nlist = [[0.0, {number}]]\n"));
            assert!(said.contains("is not a finite number\n  --> a.toml:4:15"), "{said}");
        }
    }

    #[test]
    fn bad_syntax_is_located() {
        let said = complaint("name = \"x\"\n[inner\n");
        assert!(said.contains("--> a.toml:2:") && said.contains("help: write [table] headers"), "{said}");
        assert!(complaint("name = \"x\"\nname = \"y\"\n").contains("--> a.toml:2:1"), "duplicate key");
    }

    #[test]
    fn blame_finds_the_value_or_the_table_that_lacks_it() {
        let file = TomlText::new("a.toml", "[t]\na = { b = [1, 22] }\n");
        let place = |path: &str| {
            let place = file.blame(path, "bad").place.unwrap();
            (place.line.unwrap(), place.column.unwrap())
        };
        assert_eq!(place("t.a.b[1]"), (2, 15));
        assert_eq!(place("t.a.c"), (2, 5));
        assert_eq!(place("t.x.y"), (1, 1));
        assert_eq!(place("u"), (1, 1));
        assert_eq!(file.keys("t.a"), ["b"]);
    }

    #[test]
    fn edit_distance_counts_single_changes() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("", "abc"), 3);
        assert_eq!(nearest("zzz", &["overcut", "undercut"]), None);
    }
}
