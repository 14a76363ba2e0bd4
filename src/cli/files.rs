//! Reading inputs and writing outputs: all outputs of a command or none.

use crate::diagnostic::{Diagnostic, Result};
use crate::nc::MAX_PROGRAM_BYTES;
use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// Where relative names start, unless a job names the file.
pub(super) const FROM_CURRENT_FOLDER: &str = "the current folder";
/// Larger inputs are refused before they fill the memory.
const MAX_INPUT_BYTES: u64 = 1 << 30;

/// Reads a whole file.
pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    read_within(path, MAX_INPUT_BYTES)
}

/// Reads a whole NC program.
pub(super) fn read_program(path: &Path) -> Result<Vec<u8>> {
    read_within(path, MAX_PROGRAM_BYTES as u64)
}

fn read_within(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let failed = |e: io::Error| unreadable(path, &e);
    let about = fs::metadata(path).map_err(failed)?;
    if about.is_dir() {
        return Err(Diagnostic::error(format!("{} is a folder, not a file", path.display())).help("name a file in it"));
    }
    let too_large = || {
        Diagnostic::error(format!("{} is larger than {} MiB", path.display(), limit >> 20))
            .help("give a smaller file, or split it")
    };
    if about.len() > limit {
        return Err(too_large());
    }
    // Pipes and devices do not say their length.
    let mut bytes = Vec::with_capacity(about.len() as usize);
    fs::File::open(path).and_then(|file| file.take(limit + 1).read_to_end(&mut bytes)).map_err(failed)?;
    if bytes.len() as u64 > limit { Err(too_large()) } else { Ok(bytes) }
}

/// Reads a whole text file in UTF-8.
pub(super) fn read_text(path: &Path) -> Result<String> {
    let bytes = read_bytes(path)?;
    String::from_utf8(bytes).map_err(|e| {
        let valid = e.utf8_error().valid_up_to();
        let before = String::from_utf8_lossy(e.as_bytes().get(..valid).unwrap_or_default()).into_owned();
        Diagnostic::error("this byte is no text in UTF-8")
            .in_file(path.display().to_string())
            .at_offset(&before, valid)
            .help("save the file as text in UTF-8")
    })
}

fn unreadable(path: &Path, error: &io::Error) -> Box<Diagnostic> {
    let help = match error.kind() {
        io::ErrorKind::NotFound => format!("check the name; relative names start at {FROM_CURRENT_FOLDER}"),
        io::ErrorKind::PermissionDenied => "allow this user to read the file".to_owned(),
        _ => "name a file that can be read".to_owned(),
    };
    Diagnostic::error(format!("{} cannot be read: {error}", path.display())).help(help)
}

/// Outputs of a command, kept until all are known.
#[derive(Default)]
pub(super) struct Outputs {
    files: Vec<(PathBuf, Vec<u8>)>,
}

/// A file or folder that goes away again unless it is kept.
struct Provisional {
    path: PathBuf,
    kept: bool,
}

impl Drop for Provisional {
    fn drop(&mut self) {
        if !self.kept {
            // A folder is removed only when it is empty; what cannot be removed was not there.
            let _gone = fs::remove_file(&self.path).or_else(|_| fs::remove_dir(&self.path));
        }
    }
}

impl Outputs {
    /// Adds a file to be written.
    pub(super) fn add(&mut self, path: PathBuf, content: impl Into<Vec<u8>>) {
        self.files.push((path, content.into()));
    }

    /// Writes every file under a temporary name beside its place, then renames them all. On an error nothing is left
    /// behind, and files of an earlier run stay as they were. Devices and pipes are written to, not replaced.
    pub(super) fn write(self) -> Result<()> {
        let mut folders = Vec::new();
        let mut written = Vec::new();
        let mut streams = Vec::new();
        for (path, content) in &self.files {
            // A link keeps pointing where it points.
            let path = &fs::canonicalize(path).unwrap_or_else(|_| path.clone());
            let failed = |e: &io::Error| {
                Diagnostic::error(format!("{} cannot be written: {e}", path.display()))
                    .help("name a folder in which this user may write")
            };
            if path.is_dir() {
                return Err(failed(&io::Error::from(io::ErrorKind::IsADirectory)).help("name a file, not a folder"));
            }
            if path.exists() && !path.is_file() {
                streams.push((path.clone(), content));
                continue;
            }
            make_folder(path, &mut folders).map_err(|e| failed(&e))?;
            let temporary = Provisional { path: temporary_name(path, written.len()), kept: false };
            let store = || -> io::Result<()> {
                let mut file = fs::File::create(&temporary.path)?;
                file.write_all(content)?;
                file.sync_all()
            };
            store().map_err(|e| failed(&e))?;
            written.push((temporary, path.clone()));
        }
        for (path, content) in streams {
            fs::write(&path, content)
                .map_err(|e| Diagnostic::error(format!("{} cannot be written: {e}", path.display())))?;
        }
        for (mut temporary, path) in written {
            fs::rename(&temporary.path, &path)
                .map_err(|e| Diagnostic::error(format!("{} cannot be replaced: {e}", path.display())))?;
            temporary.kept = true;
        }
        for folder in &mut folders {
            folder.kept = true;
        }
        Ok(())
    }
}

/// Makes the folder of a file; those that were missing are noted, the innermost last.
fn make_folder(file: &Path, made: &mut Vec<Provisional>) -> io::Result<()> {
    let folder = file.parent().unwrap_or(Path::new(""));
    let missing: Vec<_> = folder.ancestors().take_while(|f| !f.as_os_str().is_empty() && !f.exists()).collect();
    for folder in missing.into_iter().rev() {
        fs::create_dir(folder)?;
        // Dropped in order: the innermost folder must be removed first.
        made.insert(0, Provisional { path: folder.to_owned(), kept: false });
    }
    Ok(())
}

fn temporary_name(path: &Path, index: usize) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}-{index}.tmp", std::process::id()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn all_outputs_are_written_into_folders_made_for_them() {
        let root = tempfile::tempdir().unwrap();
        let mut outputs = Outputs::default();
        outputs.add(root.path().join("a/b/one.txt"), "1");
        outputs.add(root.path().join("a/two.txt"), "2");
        outputs.write().unwrap();
        assert_eq!(fs::read_to_string(root.path().join("a/b/one.txt")).unwrap(), "1");
        assert_eq!(names(&root.path().join("a")), ["b", "two.txt"]);
    }

    #[test]
    fn when_one_output_cannot_be_written_none_is() {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("old.txt"), "old").unwrap();
        fs::create_dir(root.path().join("folder")).unwrap();
        for blocked in ["folder", "old.txt/x.txt"] {
            let mut outputs = Outputs::default();
            outputs.add(root.path().join("old.txt"), "new");
            outputs.add(root.path().join("new/deep/file.txt"), "new");
            outputs.add(root.path().join(blocked), "new");
            let said = outputs.write().unwrap_err();
            assert!(said.message.contains("cannot be written") && said.help.is_some(), "{said}");
            assert_eq!(names(root.path()), ["folder", "old.txt"], "{blocked}");
            assert_eq!(fs::read_to_string(root.path().join("old.txt")).unwrap(), "old");
        }
    }

    #[test]
    #[cfg(unix)]
    fn devices_are_written_to_and_links_keep_their_target() {
        let root = tempfile::tempdir().unwrap();
        let (target, link) = (root.path().join("target.txt"), root.path().join("link.txt"));
        fs::write(&target, "old").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        let mut outputs = Outputs::default();
        outputs.add(PathBuf::from("/dev/null"), "gone");
        outputs.add(link.clone(), "new");
        outputs.write().unwrap();
        assert!(!Path::new("/dev/null").is_file());
        assert!(link.is_symlink());
        assert_eq!(fs::read_to_string(&target).unwrap(), "new");
    }

    #[test]
    fn inputs_that_cannot_be_read_are_named() {
        let root = tempfile::tempdir().unwrap();
        assert!(read_bytes(&root.path().join("no.json")).unwrap_err().message.contains("no.json cannot be read"));
        assert!(read_bytes(root.path()).unwrap_err().message.contains("is a folder"));
        let latin = root.path().join("latin.toml");
        fs::write(&latin, b"name = \"a\"\nx = \"\xe4\"\n").unwrap();
        let place = read_text(&latin).unwrap_err().place.unwrap();
        assert_eq!((place.line, place.column), (Some(2), Some(6)));
    }
}
