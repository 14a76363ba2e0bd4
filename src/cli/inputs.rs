//! Finding and reading what a command was given: jobs with the files they name, machines by name or path.

use super::files::{FROM_CURRENT_FOLDER, read_bytes, read_text};
use super::{Refusal, Terminal};
use crate::diagnostic::{Diagnostic, Result};
use crate::job::{BlankSpec, Job};
use crate::machine::{Body, Form, Machine, builtin};
use crate::pipeline::{InputFile, Inputs, PartFiles};
use std::path::Path;

/// A machine with the text that it was read from, and the files of its bodies in the text's order.
pub(super) struct MachineFile {
    pub(super) machine: Machine,
    pub(super) text: String,
    bodies: Vec<Vec<u8>>,
}

impl MachineFile {
    /// Everything that it was read from, for hashes.
    pub(super) fn sources(&self) -> impl Iterator<Item = &[u8]> {
        std::iter::once(self.text.as_bytes()).chain(self.bodies.iter().map(Vec::as_slice))
    }
}

/// Reads a machine given by the name of one that comes along, or by a path that starts at `folder`.
pub(super) fn machine_file(given: &str, folder: &Path) -> Result<MachineFile> {
    let is_path = given.ends_with(".toml") || given.contains(['/', '\\']);
    if is_path {
        let path = folder.join(given);
        let text = read_text(&path)?;
        let mut machine = Machine::read(&path.display().to_string(), &text)?;
        let files: Vec<(usize, String)> = machine.body_files().map(|(index, file)| (index, file.to_owned())).collect();
        let mut bodies = Vec::with_capacity(files.len());
        for (index, file) in files {
            let beside = path.parent().unwrap_or(Path::new(""));
            let (name, bytes) = named_file(beside, &file).map_err(|e| named_by_body(&machine.bodies, index, *e))?;
            machine = machine.with_body_file(index, &name, &bytes)?;
            bodies.push(bytes);
        }
        return Ok(MachineFile { machine, text, bodies });
    }
    let (machine, text) = (Machine::named(given)?, builtin(given).unwrap_or_default().to_owned());
    Ok(MachineFile { machine, text, bodies: Vec::new() })
}

/// Reads a job and every file that it names, relative to its own folder. `machine` replaces the job's machine. Warnings
/// about the job go to the terminal.
pub(super) fn job_inputs(path: &Path, machine: Option<&str>, terminal: &mut Terminal) -> Result<Inputs, Refusal> {
    let job = Job::read(&read_text(path)?, &path.display().to_string())?;
    for warning in &job.warnings {
        terminal.complain(warning);
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut findings = Vec::new();
    let mut keep = |key: &str, found: Result<(String, Vec<u8>)>| match found {
        Ok(file) => Some(file),
        Err(e) => {
            findings.push(named_by_job(&job, key, *e));
            None
        }
    };
    let part = keep("part.file", named_file(folder, &job.part.file));
    let body = job.part.body.as_ref().and_then(|file| keep("part.body", named_file(folder, file)));
    let mut check = Vec::new();
    for (i, file) in job.part.check.iter().enumerate() {
        check.extend(keep(&format!("part.check[{i}]"), named_file(folder, file)));
    }
    let field = job.direction_field.as_ref().and_then(|file| keep("strategy.rajain.field", named_file(folder, file)));
    let stock = match job.stock.as_ref().map(|stock| &stock.blank) {
        Some(BlankSpec::File(file)) => keep("stock.file", named_file(folder, file)),
        _ => None,
    };
    let mut fixtures = Vec::new();
    for (index, fixture) in job.fixtures.iter().enumerate() {
        if let Form::File(file) = &fixture.form {
            let found = keep(&format!("fixtures[{index}].file"), named_file(folder, file));
            fixtures.extend(found.map(|(name, bytes)| (index, name, bytes)));
        }
    }
    let machine = match machine {
        Some(given) => machine_file(given, Path::new("")),
        None => machine_file(&job.machine.file, folder),
    };
    let machine = machine.map_err(|e| findings.push(named_by_job(&job, "machine.file", *e)));
    let (Some((name, bytes)), Ok(machine), true) = (part, machine, findings.is_empty()) else {
        return Err(Refusal(findings));
    };
    let check: Vec<_> = check.iter().map(|(name, bytes)| InputFile { name, bytes }).collect();
    let body = body.as_ref().map(|(name, bytes)| InputFile { name, bytes });
    let files = PartFiles { surface: InputFile { name: &name, bytes: &bytes }, body, check: &check };
    let mut inputs = Inputs::read(job, &files, &machine.machine, &machine.text)?;
    for bytes in machine.sources().skip(1) {
        inputs = inputs.with_machine_source(bytes);
    }
    if let Some((name, bytes)) = &stock {
        inputs = inputs.with_stock_file(InputFile { name, bytes })?;
    }
    for (index, name, bytes) in &fixtures {
        inputs = inputs.with_fixture_file(*index, InputFile { name, bytes })?;
    }
    match field {
        Some((name, bytes)) => Ok(inputs.with_direction_field(InputFile { name: &name, bytes: &bytes })?),
        None => Ok(inputs),
    }
}

fn named_file(folder: &Path, file: &str) -> Result<(String, Vec<u8>)> {
    let path = folder.join(file);
    Ok((path.display().to_string(), read_bytes(&path)?))
}

/// A complaint about the file of a body that has no place of its own is placed where the machine file gives the body.
fn named_by_body(bodies: &[Body], index: usize, finding: Diagnostic) -> Box<Diagnostic> {
    match bodies.get(index) {
        Some(body) if finding.place.is_none() => {
            let help = finding.help.unwrap_or_default().replace(FROM_CURRENT_FOLDER, "the folder of the machine file");
            body.blame(finding.message).help(help)
        }
        _ => Box::new(finding),
    }
}

/// A complaint that has no place of its own is placed where the job names the file.
fn named_by_job(job: &Job, key: &str, finding: Diagnostic) -> Diagnostic {
    if finding.place.is_some() {
        return finding;
    }
    let help = finding.help.unwrap_or_default().replace(FROM_CURRENT_FOLDER, "the folder of the job file");
    *job.blame(key, finding.message).help(help)
}
