//! Catalogues of cutters: TOML, format `regulus-catalogue`, version 1. Each `[[tool]]` has the keys of a job's `[tool]`
//! and may have a `name`.

use super::limits::Checks;
use super::{raw, tool};
use crate::diagnostic::{Diagnostic, TomlText};
use crate::tool::Tool;
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    version: u32,
    #[serde(default)]
    tool: Vec<raw::Tool>,
}

/// A cutter on offer.
#[derive(Clone, Debug, PartialEq)]
pub struct CatalogueEntry {
    /// Its name; number and kind when left out.
    pub name: String,
    /// The cutter.
    pub tool: Tool,
}

/// Reads a catalogue; all findings at once.
pub fn read_catalogue(text: &str, file: &str) -> Result<Vec<CatalogueEntry>, Vec<Diagnostic>> {
    let text = TomlText::new(file, text);
    let raw: File = text.parse().map_err(|e| vec![*e])?;
    let mut checks = Checks::new(&text);
    checks.header((&raw.format, raw.version), ("regulus-catalogue", "a catalogue of tools"));
    if raw.tool.is_empty() {
        checks.refuse("version", "the catalogue has no tool", "add a [[tool]] with the keys of a job's [tool]");
    }
    let mut entries = Vec::new();
    for (i, raw) in raw.tool.into_iter().enumerate() {
        checks.read_tools_from(format!("tool[{i}]"));
        if matches!(raw.kind, raw::ToolKind::Optimize) {
            checks.refuse("tool.kind", "a catalogue holds tools, not wishes", "write the sizes of a tool");
            continue;
        }
        let name = raw.name.clone();
        if let Some(tool::ToolSpec::Given(tool)) = tool::build(&mut checks, raw) {
            let name = name.unwrap_or_else(|| format!("T{} {}", tool.number, tool.kind));
            entries.push(CatalogueEntry { name, tool: *tool });
        }
    }
    match checks.finish() {
        (findings, _) if findings.is_empty() => Ok(entries),
        (findings, _) => Err(findings),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"format = "regulus-catalogue"
version = 1

[[tool]]
name = "slim"
number = 1
kind = "cylinder"
diameter = 6.0
flute_length = 20.0
gauge_length = 80.0

[[tool]]
number = 2
kind = "barrel"
diameter = 10.0
barrel_radius = 85.0
flute_length = 20.0
gauge_length = 80.0
"#;

    #[test]
    fn tools_keep_their_order_and_names() {
        let entries = read_catalogue(GOOD, "c.toml").unwrap();
        let names: Vec<_> = entries.iter().map(|e| e.name.as_str()).collect();
        assert_eq!(names, ["slim", "T2 barrel"]);
    }

    #[test]
    fn bad_entries_are_refused_at_their_own_place() {
        let said =
            |from: &str, to: &str| read_catalogue(&GOOD.replacen(from, to, 1), "c.toml").unwrap_err()[0].to_string();
        assert!(said("diameter = 10.0", "diameter = -10.0").contains("c.toml:15:12"), "{}", said("= 10.0", "= -10.0"));
        assert!(said("barrel_radius = 85.0\n", "").contains("c.toml:12:1"));
        assert!(said("diameter = 10.0", "diameter = 10.0\nball_diameter = 3").contains("has no `ball_diameter`"));
        assert!(said("kind = \"barrel\"", "kind = \"optimize\"").contains("c.toml:14:8"));
        assert!(said("regulus-catalogue", "regulus-job").contains("c.toml:1:10"));
        let empty = read_catalogue("format = \"regulus-catalogue\"\nversion = 1\n", "c.toml").unwrap_err();
        assert!(empty[0].message.contains("no tool"));
    }
}
