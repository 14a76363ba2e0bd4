//! Tool paths in whichever file they come: own CL, or APT of another CAM system. Uses `diagnostic` and `motion`.

use crate::diagnostic::{Diagnostic, Severity};
use crate::motion::apt::{self, AptFile, Assumptions, Unread};
use crate::motion::{ToolPath, cl};

/// Extensions of APT files.
const APT: [&str; 4] = ["apt", "cls", "clsf", "as"];
/// Complaints that are reported at once.
const REPORTED: usize = 50;

/// Whether a file's name says that it holds APT.
pub fn is_apt(name: &str) -> bool {
    name.rsplit_once('.').is_some_and(|(_, extension)| APT.contains(&extension.to_lowercase().as_str()))
}

/// How a file is to be read that does not say everything.
#[derive(Clone, Copy, Debug)]
pub struct Reading<'a> {
    /// What the user says in its place.
    pub given: Assumptions<'a>,
    /// Which of the file's operations, from 1; needed where there are several.
    pub operation: Option<usize>,
    /// How far chords of circles may leave them, mm.
    pub chord: f64,
    /// Go on although words on which the motion may depend are not understood.
    pub despite_unknown_text: bool,
}

/// Reads a tool path, with warnings about it.
///
/// # Errors
/// What is wrong with the file, or not understood, or not said in it, up to fifty at once, each with its place.
pub fn read_path(
    text: &str,
    file: &str,
    reading: &Reading<'_>,
) -> Result<(ToolPath, Vec<Diagnostic>), Vec<Diagnostic>> {
    if !is_apt(file) {
        return cl::read(text, file).map(|path| (path, Vec::new())).map_err(|e| vec![*e]);
    }
    let read = apt::read(text, reading.chord);
    let mut warnings = complaints(&read, file, text);
    let strict = !reading.despite_unknown_text;
    let mut errors: Vec<Diagnostic> =
        warnings.iter().filter(|finding| finding.severity == Severity::Error).cloned().collect();
    if strict && !errors.is_empty() {
        let left = errors.len().saturating_sub(REPORTED);
        errors.truncate(REPORTED);
        let more = if left > 0 { format!("; {left} more words are not shown") } else { String::new() };
        let message = format!("the motion may depend on words that are not understood{more}");
        let help = "remove them, or give --despite-unknown to take the rest of the file as it is understood";
        errors.push(*Diagnostic::error(message).in_file(file).help(help));
        return Err(errors);
    }
    for warning in &mut warnings {
        warning.severity = Severity::Warning;
    }
    if !read.has_units {
        let message = "the file does not say its units: millimetres are taken";
        warnings.push(*Diagnostic::warning(message).in_file(file).help("write UNITS/MM or UNITS/INCHES"));
    }
    let operation = choose(&read, file, reading.operation).map_err(|e| vec![*e])?;
    let chosen = &read.operations[operation];
    let path = chosen
        .tool_path(&read.name, &reading.given)
        .map_err(|findings| findings.into_iter().map(|finding| *Box::new(finding).in_file(file)).collect::<Vec<_>>())?;
    if chosen.coolant {
        let message = "coolant is asked for and not carried";
        warnings.push(*Diagnostic::warning(message).in_file(file).help("put it into start_lines of [control.options]"));
    }
    Ok((path, warnings))
}

/// Index of the operation to take.
fn choose(read: &AptFile, file: &str, wanted: Option<usize>) -> Result<usize, Box<Diagnostic>> {
    let count = read.operations.len();
    match wanted {
        _ if count == 0 => {
            Err(Diagnostic::error("the file moves no tool").in_file(file).at(1, 1).help("write GOTO statements"))
        }
        None if count == 1 => Ok(0),
        Some(number) if (1..=count).contains(&number) => Ok(number - 1),
        _ => {
            let list = read.operations.iter().enumerate().map(|(index, operation)| {
                let tool = operation.tool.map_or(String::new(), |tool| format!(" tool {tool},"));
                format!("{}:{tool} line {}", index + 1, operation.line)
            });
            let list: Vec<_> = list.collect();
            Err(Diagnostic::error(format!("the file holds {count} operations, and a program holds one tool"))
                .in_file(file)
                .at(read.operations.get(1).map_or(1, |operation| operation.line), 1)
                .help(format!("give --operation N for one of {}", list.join("; "))))
        }
    }
}

/// What is not understood, as messages: errors where the motion may depend on it.
pub(super) fn complaints(read: &AptFile, file: &str, text: &str) -> Vec<Diagnostic> {
    let lines: Vec<&str> = text.lines().collect();
    let one = |unread: &Unread| {
        let message = format!("{}: {}", unread.word, unread.reason);
        let finding = if unread.harmless { Diagnostic::warning(message) } else { Diagnostic::error(message) };
        let mut finding = *finding.in_file(file).at(unread.line, unread.column).help("check what it is for");
        finding.source_line =
            unread.line.checked_sub(1).and_then(|index| lines.get(index)).map(|line| (*line).to_owned());
        finding
    };
    read.unread.iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str =
        "UNITS/MM\nLOADTL/1,LENGTH,90\nSPINDL/5000,RPM\nGOTO/0,0,9,0,0.6,0.8\nFEDRAT/600\nGOTO/0,0,0\nFINI\n";

    fn reading(operation: Option<usize>) -> Reading<'static> {
        let given = Assumptions { name: "p", flute_length: Some(20.0), linearization: 0.001, ..Assumptions::default() };
        Reading { given, operation, chord: 0.001, despite_unknown_text: false }
    }

    #[test]
    fn a_file_is_read_by_its_name() {
        assert!(is_apt("a/B.CLS") && is_apt("x.as") && !is_apt("x.cl") && !is_apt("apt"));
        let (path, warnings) = read_path(TEXT, "p.apt", &reading(None)).unwrap();
        assert_eq!((path.tool.gauge_length, path.passes.len(), warnings.len()), (90.0, 1, 0));
        let own = cl::write(&path).unwrap();
        assert_eq!(read_path(&own, "p.cl", &reading(None)).unwrap().0, path);
    }

    #[test]
    fn words_that_the_motion_may_depend_on_refuse_it() {
        let text = format!("MACHIN/X\nTRANS/1,0,0\nCOOLNT/ON\n{}", TEXT.replace("UNITS/MM\n", ""));
        let findings = read_path(&text, "p.apt", &reading(None)).unwrap_err();
        let place = findings[0].place.as_ref().unwrap();
        assert!(
            findings.len() == 2 && findings[0].message.starts_with("TRANS: ") && place.line == Some(2),
            "{findings:?}"
        );
        assert_eq!(findings[0].source_line.as_deref(), Some("TRANS/1,0,0"));
        let despite = Reading { despite_unknown_text: true, ..reading(None) };
        let (_, warnings) = read_path(&text, "p.apt", &despite).unwrap();
        assert!(warnings.iter().all(|w| w.severity == Severity::Warning) && warnings.len() == 3, "{warnings:?}");
        let many = "TRANS/1\n".repeat(80) + TEXT;
        assert_eq!(read_path(&many, "p.apt", &reading(None)).unwrap_err().len(), 51);
    }

    #[test]
    fn one_of_several_operations_is_chosen() {
        let text = TEXT.replace("FINI\n", "LOADTL/2,LENGTH,80\nSPINDL/100\nGOTO/1,0,0\nGOTO/2,0,0\n");
        let said = read_path(&text, "p.apt", &reading(None)).unwrap_err().remove(0);
        assert!(said.message.contains("2 operations") && said.help.unwrap().contains("2: tool 2, line 7"));
        assert_eq!(read_path(&text, "p.apt", &reading(Some(2))).unwrap().0.tool.number, 2);
        assert!(
            read_path(&text, "p.apt", &reading(Some(3))).is_err() && read_path("", "p.apt", &reading(None)).is_err()
        );
    }
}
