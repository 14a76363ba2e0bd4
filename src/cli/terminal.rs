//! Printing: results to standard output, progress and complaints to standard error. A reader that goes away is no
//! error.

use crate::diagnostic::Diagnostic;
use std::io::{IsTerminal, Write};

/// Standard output and standard error.
#[derive(Debug)]
pub(super) struct Terminal {
    /// Progress is for people: none when standard error is piped.
    shows_progress: bool,
    /// Whether a progress line is on the screen.
    busy: bool,
}

impl Terminal {
    pub(super) fn new() -> Self {
        Self { shows_progress: std::io::stderr().is_terminal(), busy: false }
    }

    /// Prints results. Once the reader has closed the pipe, the rest is dropped: it was not wanted.
    pub(super) fn print(&mut self, text: &str) {
        self.clear();
        let mut out = std::io::stdout().lock();
        let _closed = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    }

    /// Prints a warning or an error with its place and remedy.
    pub(super) fn complain(&mut self, finding: &Diagnostic) {
        self.clear();
        let _closed = writeln!(std::io::stderr().lock(), "{finding}");
    }

    /// Shows what is being done, in place of what was shown before.
    pub(super) fn progress(&mut self, doing: &str) {
        if self.shows_progress {
            self.busy = true;
            let mut err = std::io::stderr().lock();
            let _closed = write!(err, "\r\x1b[K{doing} …").and_then(|()| err.flush());
        }
    }

    fn clear(&mut self) {
        if std::mem::take(&mut self.busy) {
            let mut err = std::io::stderr().lock();
            let _closed = write!(err, "\r\x1b[K").and_then(|()| err.flush());
        }
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.clear();
    }
}
