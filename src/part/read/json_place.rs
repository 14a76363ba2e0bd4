//! Finds the place of a value in JSON text that has been parsed before, so that complaints about its meaning can name
//! line and column as complaints about its syntax do.

/// One step down into a JSON value.
#[derive(Clone, Copy, Debug)]
pub(super) enum Step<'a> {
    /// The value of this key (written without escapes).
    Key(&'a str),
    /// The element with this index.
    Index(usize),
}

/// Byte offset of the value at `path`; of the deepest value on the way that is there. `text` is valid JSON.
pub(super) fn offset(text: &str, path: &[Step]) -> usize {
    let mut reader = Reader { bytes: text.as_bytes(), at: 0 };
    reader.blanks();
    for step in path {
        let before = reader.at;
        if reader.enter(step).is_none() {
            return before;
        }
    }
    reader.at
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn blanks(&mut self) {
        while self.peek().is_some_and(|b| b.is_ascii_whitespace()) {
            self.at += 1;
        }
    }

    fn mark(&mut self, mark: u8) -> Option<()> {
        self.blanks();
        (self.peek()? == mark).then(|| self.at += 1)?;
        self.blanks();
        Some(())
    }

    /// From the start of a value to the start of the one inside it.
    fn enter(&mut self, step: &Step) -> Option<()> {
        match step {
            Step::Key(wanted) => {
                self.mark(b'{')?;
                loop {
                    let start = self.at;
                    self.skip()?;
                    let found = self.bytes.get(start + 1..self.at.checked_sub(1)?)? == wanted.as_bytes();
                    self.mark(b':')?;
                    if found {
                        return Some(());
                    }
                    self.skip()?;
                    self.mark(b',')?;
                }
            }
            Step::Index(index) => {
                self.mark(b'[')?;
                for _ in 0..*index {
                    self.skip()?;
                    self.mark(b',')?;
                }
                (self.peek()? != b']').then_some(())
            }
        }
    }

    /// Over one value.
    fn skip(&mut self) -> Option<()> {
        let mut depth = 0usize;
        loop {
            match self.peek()? {
                b'"' => self.string()?,
                b'{' | b'[' => {
                    depth += 1;
                    self.at += 1;
                }
                b'}' | b']' => {
                    depth = depth.checked_sub(1)?;
                    self.at += 1;
                }
                b',' | b':' | b' ' | b'\t' | b'\r' | b'\n' => self.at += 1,
                _ => self.scalar(),
            }
            if depth == 0 {
                return Some(());
            }
        }
    }

    fn scalar(&mut self) {
        while self.peek().is_some_and(|b| !b",:]} \t\r\n".contains(&b)) {
            self.at += 1;
        }
    }

    fn string(&mut self) -> Option<()> {
        self.at += 1;
        loop {
            match self.peek()? {
                b'"' => {
                    self.at += 1;
                    return Some(());
                }
                b'\\' => self.at += 2,
                _ => self.at += 1,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_values_past_strings_and_nested_ones() {
        let text = r#" { "a \" ]": [1, {"b": 2}], "list": [ [10, 20], [30 , "x,]"], [50] ], "c": true}"#;
        let at = |path: &[Step]| &text[offset(text, path)..];
        assert!(at(&[Step::Key("list"), Step::Index(1), Step::Index(0)]).starts_with("30"));
        assert!(at(&[Step::Key("list"), Step::Index(2), Step::Index(0)]).starts_with("50"));
        assert!(at(&[Step::Key("c")]).starts_with("true"));
        // Not there: the place of what should hold it.
        assert!(at(&[Step::Key("list"), Step::Index(9)]).starts_with("[ [10"));
        assert!(at(&[Step::Key("d")]).starts_with('{'));
    }
}
