//! APT text cut into statements, each word with its place. Uses nothing of the crate.

/// Major words behind which everything is text.
const TEXTS: [&str; 5] = ["PARTNO", "PPRINT", "REMARK", "INSERT", "LETTER"];

/// A minor word or number.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Word {
    /// As written, upper case, without blanks around it.
    pub(super) text: String,
    /// Line, from 1.
    pub(super) line: usize,
    /// Column in characters, from 1.
    pub(super) column: usize,
}

impl Word {
    /// Its number, if it is one of a size that a machine has any use for.
    pub(super) fn number(&self) -> Option<f64> {
        let starts = self.text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        self.text.parse().ok().filter(|value: &f64| starts && value.abs() <= 1e9)
    }
}

/// One statement.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Statement {
    /// The major word.
    pub(super) major: Word,
    /// What stands behind the slash; for words of text one word, as written.
    pub(super) words: Vec<Word>,
}

/// Something in the file that is not understood.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unread {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// The word, or the statement where all of it is meant.
    pub word: String,
    /// What is wrong with it.
    pub reason: String,
    /// Whether the motion does not depend on it.
    pub harmless: bool,
}

/// Cuts a text into statements.
pub(super) fn split(text: &str) -> Vec<Statement> {
    let mut statements = Vec::new();
    // Characters of the statement with their places.
    let mut pending: Vec<(char, usize, usize)> = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let (code, continued) = code_of(line, pending.is_empty());
        pending.extend(code.chars().enumerate().map(|(column, c)| (c, index + 1, column + 1)));
        if continued {
            // A word does not go over the end of a line.
            continue;
        }
        statements.extend(statement(&std::mem::take(&mut pending)));
    }
    statements.extend(statement(&pending));
    statements
}

/// The part of a line that is code, and whether the statement goes on behind it.
fn code_of(line: &str, starts: bool) -> (&str, bool) {
    let head = line.trim_start().to_ascii_uppercase();
    if starts && TEXTS.iter().any(|text| head.starts_with(text)) {
        return (line, false);
    }
    match line.find('$') {
        None => (line, false),
        Some(at) => {
            let (code, mark) = line.split_at(at);
            // Two of them begin a comment, one continues the statement.
            (code, !mark.starts_with("$$"))
        }
    }
}

fn statement(code: &[(char, usize, usize)]) -> Option<Statement> {
    let first = code.iter().position(|(c, ..)| !c.is_whitespace())?;
    let code = &code[first..];
    let all: String = code.iter().map(|(c, ..)| *c).collect();
    let upper = all.to_ascii_uppercase();
    if let Some(text) = TEXTS.iter().find(|text| upper.starts_with(**text)) {
        let rest = all.get(text.len()..).unwrap_or_default();
        let rest = rest.trim_start().strip_prefix('/').unwrap_or(rest).trim();
        let at = |text: &str| Word { text: text.to_owned(), line: code[0].1, column: code[0].2 };
        return Some(Statement { major: at(text), words: vec![at(rest)] });
    }
    let slash = code.iter().position(|(c, ..)| *c == '/').unwrap_or(code.len());
    let major = word(&code[..slash])?;
    let minor = code.get(slash + 1..).unwrap_or_default();
    let words = minor.split(|(c, ..)| *c == ',').filter_map(word).collect();
    Some(Statement { major, words })
}

fn word(code: &[(char, usize, usize)]) -> Option<Word> {
    let text: String = code.iter().map(|(c, ..)| *c).collect();
    let (_, line, column) = *code.iter().find(|(c, ..)| !c.is_whitespace())?;
    Some(Word { text: text.trim().to_ascii_uppercase(), line, column })
}
