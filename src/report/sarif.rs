//! Findings for other programs: SARIF 2.1.0 (OASIS), as continuous integration shows annotations from, and JUnit's XML, one
//! test case a rule. Uses `nc` and `verify`.

use crate::nc::{FindingCode, Weight};
use crate::verify::FindingRecord;
use serde_json::{Value, json};
use std::fmt::Write;

/// Bytes of a line that are shown.
const SHOWN: usize = 400;

/// The findings in a program as SARIF 2.1.0, ending in a line break. `file` is the program's name as the user gave it,
/// `text` its content.
pub fn sarif(findings: &[FindingRecord], file: &str, text: &[u8]) -> String {
    let uri = uri(file);
    let lines = Lines::of(text);
    let results: Vec<Value> = findings.iter().map(|finding| result(finding, &uri, &lines)).collect();
    let log = json!({
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{
            "tool": { "driver": {
                "name": "regulus",
                "version": env!("CARGO_PKG_VERSION"),
                "rules": FindingCode::ALL.iter().map(|code| rule(*code)).collect::<Vec<_>>(),
            }},
            "columnKind": "unicodeCodePoints",
            "artifacts": [{ "location": { "uri": uri } }],
            "results": results,
        }],
    });
    format!("{log:#}\n")
}

fn rule(code: FindingCode) -> Value {
    let rule = code.rule();
    let level = if rule.weight == Weight::Notice { "warning" } else { "error" };
    json!({
        "id": rule.id,
        "name": rule.name,
        "shortDescription": { "text": rule.name },
        "fullDescription": { "text": rule.explanation },
        "help": { "text": rule.remedy },
        "defaultConfiguration": { "level": level },
    })
}

fn result(finding: &FindingRecord, uri: &str, lines: &Lines<'_>) -> Value {
    let mut place = json!({ "artifactLocation": { "uri": uri } });
    if let Some(line) = finding.line {
        // Lines count from 1, also where a finding is about a program without any.
        let mut region = json!({ "startLine": line.max(1) });
        if let Some((start, end)) = finding.span.as_ref().and_then(|span| lines.columns(line, span.start, span.end)) {
            region["startColumn"] = json!(start);
            region["endColumn"] = json!(end);
        }
        if let Some(text) = lines.shown(line) {
            region["snippet"] = json!({ "text": text });
        }
        place["region"] = region;
    }
    let index = FindingCode::ALL.iter().position(|code| code.id() == finding.id);
    json!({
        "ruleId": finding.id,
        "ruleIndex": index,
        "level": finding.severity,
        "message": { "text": format!("{}. {}", finding.message, finding.help) },
        "locations": [{ "physicalLocation": place }],
    })
}

/// A file's name as a relative reference of RFC 3986, or an absolute one where it begins at the root.
fn uri(file: &str) -> String {
    let slashes = file.replace('\\', "/");
    let mut uri = if slashes.starts_with('/') { "file://".to_owned() } else { String::new() };
    for byte in slashes.bytes() {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' | b'/' => uri.push(char::from(byte)),
            // Writing to a string cannot fail.
            _ => drop(write!(uri, "%{byte:02X}")),
        }
    }
    uri
}

/// The lines of a text with the places where they begin.
struct Lines<'a> {
    text: &'a [u8],
    starts: Vec<usize>,
}

impl<'a> Lines<'a> {
    fn of(text: &'a [u8]) -> Self {
        let after = text.iter().enumerate().filter(|(_, byte)| **byte == b'\n').map(|(index, _)| index + 1);
        Self { text, starts: std::iter::once(0).chain(after).collect() }
    }

    fn start(&self, line: usize) -> Option<usize> {
        self.starts.get(line.checked_sub(1)?).copied()
    }

    /// The line without its end, cut where it is very long.
    fn shown(&self, line: usize) -> Option<String> {
        let rest = self.text.get(self.start(line)?..)?;
        let line = rest.split(|byte| *byte == b'\n').next()?;
        let line = line.get(..line.len().min(SHOWN))?;
        Some(String::from_utf8_lossy(line).trim_end().to_owned())
    }

    /// Columns in characters, from 1, of bytes of the text; `None` where they are not on that line, or far behind its
    /// start.
    fn columns(&self, line: usize, from: usize, to: usize) -> Option<(usize, usize)> {
        let start = self.start(line)?;
        let before = self.text.get(start..from)?;
        let meant = self.text.get(from..to)?;
        if before.len() > SHOWN || before.contains(&b'\n') {
            return None;
        }
        let meant = meant.get(..meant.len().min(SHOWN))?.split(|byte| *byte == b'\n').next()?;
        let length = |bytes: &[u8]| String::from_utf8_lossy(bytes).chars().count();
        let first = length(before) + 1;
        Some((first, first + length(meant)))
    }
}

/// The findings in a program as JUnit's XML: a test case for each rule, which fails where the rule finds an error;
/// warnings are its output.
pub fn junit(findings: &[FindingRecord], file: &str) -> String {
    let failed = |code: &FindingCode| findings.iter().any(|finding| finding.id == code.id() && finding.is_error());
    let failures = FindingCode::ALL.iter().filter(|code| failed(code)).count();
    let counts = format!("tests=\"{}\" failures=\"{failures}\" errors=\"0\"", FindingCode::ALL.len());
    let suite = xml(&format!("regulus verify {file}"));
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites {counts}>\n  <testsuite name=\"{suite}\" {counts} skipped=\"0\">\n"
    );
    for code in FindingCode::ALL {
        text.push_str(&case(*code, findings, file));
    }
    text + "  </testsuite>\n</testsuites>\n"
}

fn case(code: FindingCode, findings: &[FindingRecord], file: &str) -> String {
    let found = || findings.iter().filter(|finding| finding.id == code.id());
    let line = |finding: &FindingRecord| {
        let place = finding.line.map_or(file.to_owned(), |line| format!("{file}:{line}"));
        format!("{place}: {}. {}\n", finding.message, finding.help)
    };
    let errors: Vec<&FindingRecord> = found().filter(|finding| finding.is_error()).collect();
    let warnings: String = found().filter(|finding| !finding.is_error()).map(line).collect();
    let name = format!("    <testcase classname=\"{}\" name=\"{} {}\"", xml(file), code.id(), code.name());
    let mut body = String::new();
    if let Some(first) = errors.first() {
        let all: String = errors.iter().copied().map(line).collect();
        // Writing to a string cannot fail.
        let _ = writeln!(
            body,
            "      <failure type=\"{}\" message=\"{}\">{}</failure>",
            code.id(),
            xml(line(first).trim_end()),
            xml(&all)
        );
    }
    if !warnings.is_empty() {
        let _ = writeln!(body, "      <system-out>{}</system-out>", xml(&warnings));
    }
    if body.is_empty() { format!("{name}/>\n") } else { format!("{name}>\n{body}    </testcase>\n") }
}

/// Text for XML 1.0; characters that it cannot hold are replaced.
fn xml(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\t' => out.push(character),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nc::Finding;

    const TEXT: &[u8] = "(größer) G777 X1\r\nX2\n".as_bytes();

    fn findings() -> Vec<FindingRecord> {
        let unknown = Finding::new(FindingCode::UnknownCode, 1, "G777 <is> no code", "remove \"it\"").at(11..15);
        let other = FindingRecord::new(FindingCode::OtherWorkOffset, Some(2), "G55".into());
        let uncut = FindingRecord::new(FindingCode::Uncut, None, "no pass".into());
        vec![FindingRecord::from(&unknown), other, uncut]
    }

    #[test]
    fn sarif_names_rule_level_line_and_columns() {
        let log: Value = serde_json::from_str(&sarif(&findings(), "a b/ü.ngc", TEXT)).unwrap();
        let run = &log["runs"][0];
        assert_eq!(log["version"], "2.1.0");
        let results = run["results"].as_array().unwrap();
        let rules = run["tool"]["driver"]["rules"].as_array().unwrap();
        for result in results {
            let index = result["ruleIndex"].as_u64().unwrap() as usize;
            assert_eq!(rules[index]["id"], result["ruleId"]);
            let uri = &result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"];
            assert_eq!(uri, "a%20b/%C3%BC.ngc");
        }
        let levels: Vec<_> = results.iter().map(|r| r["level"].as_str().unwrap()).collect();
        assert_eq!(levels, ["error", "warning", "error"]);
        let region = &results[0]["locations"][0]["physicalLocation"]["region"];
        let wanted =
            json!({"startLine": 1, "startColumn": 10, "endColumn": 14, "snippet": {"text": "(größer) G777 X1"}});
        assert_eq!(region, &wanted);
        assert!(results[2]["locations"][0]["physicalLocation"].get("region").is_none());
        assert_eq!(uri("/tmp/x.nc"), "file:///tmp/x.nc");
    }

    #[test]
    fn junit_has_a_case_for_each_rule_and_fails_where_there_are_errors() {
        let text = junit(&findings(), "p.ngc");
        assert_eq!(text.matches("<testcase ").count(), FindingCode::ALL.len());
        assert_eq!((text.matches("<failure ").count(), text.matches("<system-out>").count()), (2, 1));
        assert!(text.contains("failures=\"2\""));
        assert!(text.contains("message=\"p.ngc:1: G777 &lt;is&gt; no code. remove &quot;it&quot;\""), "{text}");
        assert_eq!(xml("a\u{0}b"), "a\u{fffd}b");
    }
}
