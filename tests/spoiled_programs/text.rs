//! Words of a line, found and changed as a careless hand would.

/// A word's number in a line: bytes from and to.
pub(crate) type Span = std::ops::Range<usize>;

/// The number behind a letter that begins a word, plain or as `C=DC(12.5)`, and the whole word.
pub(crate) fn word(line: &str, letter: char) -> Option<(Span, Span)> {
    let bytes = line.as_bytes();
    let starts = line.char_indices().filter(|(_, c)| *c == letter).map(|(index, _)| index);
    for start in starts {
        if start > 0 && (bytes[start - 1].is_ascii_alphanumeric() || bytes[start - 1] == b'=') {
            continue;
        }
        let rest = &line[start + 1..];
        let skipped = if rest.starts_with("=DC(") { 4 } else { usize::from(rest.starts_with('=')) };
        let from = start + 1 + skipped;
        let length = line[from..].bytes().take_while(|b| b.is_ascii_digit() || b"+-.,".contains(b)).count();
        if length > 0 {
            let closed = usize::from(skipped == 4);
            return Some((from..from + length, start..from + length + closed));
        }
    }
    None
}

/// The value of a word.
pub(crate) fn value(line: &str, letter: char) -> Option<f64> {
    let (number, _) = word(line, letter)?;
    line[number].replace(',', ".").parse().ok()
}

/// The line with another number in a word.
pub(crate) fn with_number(line: &str, letter: char, number: &str) -> Option<String> {
    let (span, _) = word(line, letter)?;
    Some(format!("{}{number}{}", &line[..span.start], &line[span.end..]))
}

/// The line with a word's value changed, with as many decimals as it had.
pub(crate) fn with_value(line: &str, letter: char, change: impl Fn(f64) -> f64) -> Option<String> {
    let (span, _) = word(line, letter)?;
    let old = &line[span];
    let decimals = old.len() - old.find(['.', ',']).map_or(old.len(), |point| point + 1);
    let plus = if old.starts_with('+') { "+" } else { "" };
    let new = change(value(line, letter)?);
    let sign = if new < 0.0 { "" } else { plus };
    with_number(line, letter, &format!("{sign}{new:.decimals$}"))
}

/// The line without a word.
pub(crate) fn without(line: &str, letter: char) -> Option<String> {
    let (_, whole) = word(line, letter)?;
    Some(format!("{}{}", line[..whole.start].trim_end(), &line[whole.end..]))
}

/// A program with one line, from 1, made into others.
pub(crate) fn replaced(text: &str, line: usize, by: &[&str]) -> String {
    let lines =
        text.lines().enumerate().flat_map(|(index, old)| if index + 1 == line { by.to_vec() } else { vec![old] });
    lines.map(|line| format!("{line}\n")).collect()
}

/// A line of a program, from 1.
pub(crate) fn line(text: &str, number: usize) -> &str {
    text.lines().nth(number - 1).unwrap_or_default()
}

/// Number of the first line that holds a piece of text, from 1.
pub(crate) fn find(text: &str, piece: &str) -> Option<usize> {
    text.lines().position(|line| line.contains(piece)).map(|index| index + 1)
}

/// Klartext counts its lines: after lines came or went, they are counted again.
pub(crate) fn renumbered(text: &str) -> String {
    if !text.starts_with("0 BEGIN") {
        return text.to_owned();
    }
    let counted = text.lines().enumerate().map(|(index, line)| {
        let words = line.trim_start_matches(|c: char| c.is_ascii_digit());
        format!("{index}{}{words}\n", if words.starts_with(' ') { "" } else { " " })
    });
    counted.collect()
}
