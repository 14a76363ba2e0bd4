//! Finding and reading what a command was given: machine files by name or path.

use super::files::read_text;
use crate::diagnostic::Result;
use crate::machine::{Machine, builtin};
use std::path::Path;

/// A machine with the text that it was read from.
pub(super) struct MachineFile {
    pub(super) machine: Machine,
    pub(super) text: String,
}

/// Reads a machine given by the name of one that comes along, or by a path that starts at `folder`.
pub(super) fn machine_file(given: &str, folder: &Path) -> Result<MachineFile> {
    let is_path = given.ends_with(".toml") || given.contains(['/', '\\']);
    if is_path {
        let path = folder.join(given);
        let text = read_text(&path)?;
        return Ok(MachineFile { machine: Machine::read(&path.display().to_string(), &text)?, text });
    }
    Ok(MachineFile { machine: Machine::named(given)?, text: builtin(given).unwrap_or_default().to_owned() })
}
