//! The sources as a graph: which file uses which, with re-exports followed to where a name is defined.

use std::collections::BTreeMap;
use std::path::Path;

/// One source file.
#[derive(Clone, Debug)]
pub(crate) struct SourceFile {
    /// Path below `src`, with `/`.
    pub(crate) name: String,
    /// The whole text.
    pub(crate) text: String,
    /// The text without comments and without tests.
    pub(crate) code: String,
    /// Names from the crate down, such as `["geometry", "knots"]`.
    path: Vec<String>,
}

/// All source files, by module path.
pub(crate) struct SourceTree {
    files: BTreeMap<Vec<String>, SourceFile>,
}

impl SourceFile {
    fn new(name: &str, text: &str) -> Self {
        let stem = name.trim_end_matches(".rs");
        let path = stem.split('/').filter(|part| !["mod", "lib"].contains(part)).map(str::to_owned).collect();
        let code = without_tests(text);
        Self { name: name.to_owned(), text: text.to_owned(), code, path }
    }

    /// The top-level module, empty for `lib.rs`.
    pub(crate) fn module(&self) -> &str {
        self.path.first().map_or("", String::as_str)
    }

    /// Whether it makes program text.
    pub(crate) fn writes_programs(&self) -> bool {
        self.name.starts_with("nc/write") || self.name == "nc/format.rs"
    }

    /// Whether `other` lies in a folder of this module.
    pub(crate) fn is_parent_of(&self, other: &Self) -> bool {
        other.path.len() > self.path.len() && other.path.starts_with(&self.path)
    }
}

impl SourceTree {
    /// Reads all files below a folder.
    pub(crate) fn read(folder: &Path) -> std::io::Result<Self> {
        let mut files = Vec::new();
        collect(folder, folder, &mut files)?;
        Ok(Self::of(&files))
    }

    /// Takes files as (name, text).
    pub(crate) fn of(files: &[(impl AsRef<str>, impl AsRef<str>)]) -> Self {
        let files = files.iter().map(|(name, text)| SourceFile::new(name.as_ref(), text.as_ref()));
        let is_test = |name: &String| name == "tests" || name.ends_with("_tests");
        let files = files.filter(|f| !f.path.iter().any(is_test));
        Self { files: files.map(|f| (f.path.clone(), f)).collect() }
    }

    /// All files.
    pub(crate) fn files(&self) -> impl Iterator<Item = &SourceFile> {
        self.files.values()
    }

    /// Top-level modules in the order of `lib.rs`.
    pub(crate) fn order(&self) -> Vec<String> {
        let lib = &self.files[&Vec::new()].code;
        let names = lib.split("pub mod ").skip(1).filter_map(|rest| rest.split(';').next());
        names.map(|name| name.trim().to_owned()).collect()
    }

    /// Everything of the crate that a file names, as paths from the crate down.
    pub(crate) fn uses(&self, file: &SourceFile) -> Vec<Vec<String>> {
        let mut found = Vec::new();
        for (start, base) in anchors(&file.code, &file.path) {
            expand(&file.code[start..], &base, &mut found);
        }
        found
    }

    /// Whether `file` names something that `other` defines.
    pub(crate) fn uses_file(&self, file: &SourceFile, other: &SourceFile) -> bool {
        self.neighbours(file).iter().any(|f| f.name == other.name)
    }

    /// Every file that `file` depends on, with the way there; re-exports of a folder lead to the file behind them.
    pub(crate) fn reachable(&self, file: &SourceFile) -> Vec<(&SourceFile, Vec<String>)> {
        let mut found: Vec<(&SourceFile, Vec<String>)> = Vec::new();
        let mut open = vec![(file.clone(), vec![file.name.clone()])];
        while let Some((here, way)) = open.pop() {
            for next in self.neighbours(&here) {
                if next.name == file.name || found.iter().any(|(f, _)| f.name == next.name) {
                    continue;
                }
                let way: Vec<_> = way.iter().cloned().chain([next.name.clone()]).collect();
                found.push((next, way.clone()));
                open.push((next.clone(), way));
            }
        }
        found
    }

    fn neighbours(&self, file: &SourceFile) -> Vec<&SourceFile> {
        let mut found: Vec<&SourceFile> = Vec::new();
        for path in self.uses(file) {
            if let Some(target) = self.home(&path, 0).filter(|t| t.name != file.name)
                && !found.iter().any(|f| f.name == target.name)
            {
                found.push(target);
            }
        }
        found
    }

    /// The file that defines what a path names.
    fn home(&self, path: &[String], depth: usize) -> Option<&SourceFile> {
        let length = (0..=path.len()).rev().find(|n| self.files.contains_key(&path[..*n]))?;
        let file = &self.files[&path[..length]];
        let Some(name) = path.get(length).filter(|_| depth < 8) else { return Some(file) };
        for exported in re_exports(&file.code, &file.path) {
            if exported.last() == Some(name) && exported.as_slice() != path {
                let inside: Vec<_> = exported.iter().chain(&path[length + 1..]).cloned().collect();
                return self.home(&inside, depth + 1);
            }
        }
        Some(file)
    }
}

/// Comments and everything from the test module on are no part of the product.
fn without_tests(text: &str) -> String {
    let product = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let lines = product.lines().map(|line| line.split("//").next().unwrap_or_default());
    // `std::{fs, fmt}` is spelled out, so that a search for `std::fs` finds it.
    let joined: String = lines.map(|l| format!("{l}\n")).collect();
    let mut spelled = joined.clone();
    for part in joined.split("std::{").skip(1) {
        let mut found = Vec::new();
        expand(&format!("{{{part}"), &["std".to_owned()], &mut found);
        spelled.push_str(&found.iter().map(|path| format!("use {};\n", path.join("::"))).collect::<String>());
    }
    spelled
}

fn collect(root: &Path, folder: &Path, files: &mut Vec<(String, String)>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(root, &path, files)?;
        } else if path.extension().is_some_and(|e| e == "rs") {
            let name = path.strip_prefix(root).unwrap_or(&path).to_string_lossy().replace('\\', "/");
            files.push((name, std::fs::read_to_string(&path)?));
        }
    }
    Ok(())
}

/// Places after `crate::` and `super::`, with the module path each starts from.
fn anchors(code: &str, own: &[String]) -> Vec<(usize, Vec<String>)> {
    let mut found = Vec::new();
    let word_before =
        |at: usize| code[..at].chars().next_back().is_some_and(|c| c.is_alphanumeric() || "_:$".contains(c));
    for (at, _) in code.match_indices("crate::").filter(|(at, _)| !word_before(*at)) {
        found.push((at + "crate::".len(), Vec::new()));
    }
    for (at, _) in code.match_indices("super::").filter(|(at, _)| !word_before(*at)) {
        let mut start = at;
        let mut base = own.to_vec();
        while code[start..].starts_with("super::") {
            start += "super::".len();
            base.pop();
        }
        found.push((start, base));
    }
    found
}

/// Paths that a file passes on under its own name: `pub use child::Name`.
fn re_exports(code: &str, own: &[String]) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    for keyword in ["pub use ", "pub(crate) use ", "pub(super) use "] {
        for (at, _) in code.match_indices(keyword) {
            let rest = &code[at + keyword.len()..];
            match rest.strip_prefix("crate::") {
                Some(rest) => expand(rest, &[], &mut found),
                None => expand(rest.strip_prefix("self::").unwrap_or(rest), own, &mut found),
            }
        }
    }
    found
}

/// Spells out a use tree such as `a::{b, c::{d, self}}` that `text` begins with.
fn expand(text: &str, base: &[String], found: &mut Vec<Vec<String>>) {
    let mut path = base.to_vec();
    let mut rest = text.trim_start();
    loop {
        if let Some(inner) = rest.strip_prefix('{') {
            for branch in branches(inner) {
                expand(branch, &path, found);
            }
            return;
        }
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        let (name, after) = rest.split_at(end);
        if !name.is_empty() && name != "self" {
            path.push(name.to_owned());
        }
        match after.strip_prefix("::") {
            Some(next) if !name.is_empty() => rest = next,
            _ => break,
        }
    }
    if path.len() > base.len() || text.trim_start().starts_with("self") {
        found.push(path);
    }
}

/// The branches of a tree after its opening brace, split at its own commas.
fn branches(inner: &str) -> Vec<&str> {
    let (mut depth, mut start, mut list) = (0usize, 0, Vec::new());
    for (at, c) in inner.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => {
                list.push(inner[start..at].trim());
                break;
            }
            '}' => depth -= 1,
            ',' if depth == 0 => {
                list.push(inner[start..at].trim());
                start = at + 1;
            }
            _ => {}
        }
    }
    list.retain(|branch| !branch.is_empty());
    list
}
