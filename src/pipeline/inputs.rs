//! Everything a job names, read and checked.

use super::reach::axis_bound;
use crate::diagnostic::{Diagnostic, Result};
use crate::job::{Job, MachineSpec};
use crate::machine::{Body, DialectOptions, Machine, WorkOffset};
use crate::part::{DesignSurface, Part, ReadOptions, read, require_closed};
use crate::plan::DirectionField;
use crate::stock::Blank;
use crate::tool::Tool;
use sha2::{Digest, Sha256};

/// Hexadecimal digits of an input hash: enough to tell the inputs of any two programs apart.
const HASH_DIGITS: usize = 16;

/// A file: its name for messages, whose extension says what it holds, and its bytes.
#[derive(Clone, Copy, Debug)]
pub struct InputFile<'a> {
    /// Name as the user can open it.
    pub name: &'a str,
    /// Content.
    pub bytes: &'a [u8],
}

/// What a job works on.
#[derive(Clone, Debug)]
pub struct Inputs {
    /// The job.
    pub job: Job,
    /// The part with its check surfaces, part frame.
    pub part: Part,
    /// The machine as the job uses it.
    pub machine: Machine,
    /// Hash of everything that went in, see [`hash`].
    pub hash: String,
    /// The tool, once it is known.
    tool: Option<Tool>,
    /// The stock's mesh, once it is read.
    blank: Option<Blank>,
    /// The fixtures, once their files are read.
    fixtures: Vec<Body>,
    /// Hash so far, to go on with.
    hasher: Sha256,
}

/// The files of a job's part.
#[derive(Clone, Copy, Debug)]
pub struct PartFiles<'a> {
    /// The design surface.
    pub surface: InputFile<'a>,
    /// The closed body, where the job names one.
    pub body: Option<InputFile<'a>>,
    /// The check surfaces, in the job's order.
    pub check: &'a [InputFile<'a>],
}

impl<'a> PartFiles<'a> {
    /// A design surface alone.
    pub fn alone(surface: InputFile<'a>) -> Self {
        Self { surface, body: None, check: &[] }
    }
}

impl Inputs {
    /// Reads the field of machining directions that the job names, which the method then follows. Its bytes go into the
    /// hash after all others.
    pub fn with_direction_field(mut self, file: InputFile<'_>) -> Result<Self> {
        let text = std::str::from_utf8(file.bytes).map_err(|e| {
            Diagnostic::error(format!("byte {} is no text in UTF-8", e.valid_up_to() + 1))
                .in_file(file.name)
                .help("save the file as text in UTF-8")
        })?;
        let reading = &self.job.part.reading;
        let scale = reading.units.unwrap_or_default().in_mm();
        let field = DirectionField::read(text, file.name, &self.part.surface, &reading.placement, scale)?;
        self.job.strategy.rajain.field = Some(field);
        self.hasher.update(file.bytes);
        self.hash = digits(&self.hasher);
        Ok(self)
    }

    /// Reads what a job names: its part's files and its machine, which comes with the text it was read from.
    pub fn read(
        mut job: Job,
        files: &PartFiles<'_>,
        machine: &Machine,
        machine_text: &str,
    ) -> Result<Self, Vec<Diagnostic>> {
        let mut findings = Vec::new();
        let mut keep = |file: &InputFile<'_>, options: &ReadOptions| {
            read(file.bytes, file.name, options).map_err(|e| findings.push(*e)).ok()
        };
        let surface = keep(&files.surface, &job.part.reading);
        let around = ReadOptions { flip: false, ..job.part.reading };
        let body = files.body.as_ref().and_then(|file| keep(file, &around));
        let check: Vec<_> = files.check.iter().filter_map(|file| keep(file, &around)).collect();
        if let (Some(body), Some(file)) = (&body, &files.body) {
            require_closed(body).unwrap_or_else(|e| findings.push(*e.in_file(file.name)));
        }
        let machine = machine_of_job(machine, &job).map_err(|e| findings.push(*e));
        let mut hashed = vec![job.text().as_bytes(), files.surface.bytes];
        hashed.extend(files.body.iter().chain(files.check).map(|file| file.bytes));
        hashed.push(machine_text.as_bytes());
        let hasher = hasher(&hashed);
        match (surface, machine) {
            (Some(surface), Ok(machine)) if findings.is_empty() => {
                faces_out_of_bodies(&job, &surface, body.iter().chain(&check)).map_err(|e| vec![*e])?;
                let part = Part { name: job.name.clone(), surface, body, check };
                let tool = job.tool.given().cloned();
                job.strategy.reach = axis_bound(&machine).map_err(|e| vec![*e])?;
                let fixtures = job.fixtures.clone();
                Ok(Self { job, part, machine, hash: digits(&hasher), tool, blank: None, fixtures, hasher })
            }
            _ => Err(findings),
        }
    }
}

impl Inputs {
    /// The tool; a complaint where the job leaves it to the planner and nobody has said yet which it became.
    pub fn tool(&self) -> Result<&Tool> {
        self.tool.as_ref().ok_or_else(|| {
            self.job
                .blame("tool.kind", "which tool this job is milled with is found by planning")
                .help("give its file, tool.toml, which `regulus run` wrote beside the program: --tool FILE")
        })
    }

    /// The stock that its file holds, where it has been read.
    pub(super) fn blank(&self) -> Option<&Blank> {
        self.blank.as_ref()
    }

    /// What stands on the table beside the part, part frame.
    pub(super) fn fixtures(&self) -> &[Body] {
        &self.fixtures
    }

    /// Reads the closed mesh that a fixture of the job names. Its bytes go into the hash: the program keeps clear of it.
    pub fn with_fixture_file(mut self, index: usize, file: InputFile<'_>) -> Result<Self> {
        self.hasher.update(file.bytes);
        self.hash = digits(&self.hasher);
        if let Some(fixture) = self.fixtures.get_mut(index) {
            *fixture = fixture.clone().with_file(file.name, file.bytes)?;
        }
        Ok(self)
    }

    /// Takes the bytes of a further file of the machine, such as that of a body, into the hash.
    #[must_use]
    pub fn with_machine_source(mut self, bytes: &[u8]) -> Self {
        self.hasher.update(bytes);
        self.hash = digits(&self.hasher);
        self
    }

    /// Settles what the stock's file holds; its bytes go into the hash.
    pub(super) fn with_blank(mut self, blank: Blank, bytes: &[u8]) -> Self {
        self.hasher.update(bytes);
        self.hash = digits(&self.hasher);
        Self { blank: Some(blank), ..self }
    }

    /// Settles which tool the job is milled with.
    #[must_use]
    pub fn with_tool(self, tool: Tool) -> Self {
        Self { tool: Some(tool), ..self }
    }
}

/// A closed mesh is a body that the part's surface may bound: then it tells on which side the material is.
fn faces_out_of_bodies<'a>(
    job: &Job,
    surface: &DesignSurface,
    bodies: impl Iterator<Item = &'a DesignSurface>,
) -> Result<()> {
    for body in bodies {
        surface.facing_of_body(body).require().map_err(|finding| {
            let located = job.blame("part.file", finding.message);
            finding.help.into_iter().fold(located, |located, help| located.help(help))
        })?;
    }
    Ok(())
}

/// The first 16 hexadecimal digits of the SHA-256 of the inputs one after the other, as they are: job, part, its body,
/// check surfaces, machine. `cat` of the same files to `sha256sum` gives the same digits.
pub fn hash(inputs: &[&[u8]]) -> String {
    digits(&hasher(inputs))
}

fn hasher(inputs: &[&[u8]]) -> Sha256 {
    let mut sha = Sha256::new();
    for input in inputs {
        sha.update(input);
    }
    sha
}

fn digits(sha: &Sha256) -> String {
    sha.clone().finalize().iter().take(HASH_DIGITS / 2).map(|byte| format!("{byte:02x}")).collect()
}

/// The machine with what the job overrules: work offset, TCP, dialect. A work offset that the machine file does not
/// have, and the job does not place, is refused.
pub fn machine_of_job(machine: &Machine, job: &Job) -> Result<Machine> {
    let MachineSpec { work_offset, offset, tcp, dialect, .. } = &job.machine;
    let mut machine = machine.clone();
    let control = &mut machine.control;
    let known = control.work_offsets.iter_mut().find(|known| known.name == *work_offset);
    match (known, offset) {
        (Some(known), Some(offset)) => known.linear = *offset,
        (Some(_), None) => {}
        (None, Some(offset)) => {
            control.work_offsets.push(WorkOffset { name: work_offset.clone(), linear: *offset });
        }
        (None, None) => {
            let names: Vec<_> = control.work_offsets.iter().map(|known| known.name.as_str()).collect();
            let message = format!("machine {} has no work offset {work_offset}", machine.name);
            return Err(job.blame("machine.work_offset", message).help(format!(
                "write one of {}, or say where it is: offset = [x, y, z] of the part's zero in machine coordinates",
                names.join(", ")
            )));
        }
    }
    if let Some(tcp) = tcp {
        control.tcp = *tcp;
    }
    // The options of the machine file are those of its own dialect.
    if let Some(dialect) = dialect.filter(|dialect| *dialect != control.dialect) {
        control.dialect = dialect;
        control.options = DialectOptions::of(dialect);
    }
    Ok(machine)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job(machine: &str) -> Job {
        let text = format!(
            "format = \"regulus-job\"\nversion = 1\nname = \"x\"\n\
             [part]\nfile = \"p.json\"\ntolerance = {{ overcut = 0.01, undercut = 0.01 }}\n\
             [tool]\nnumber = 1\nkind = \"ball\"\ndiameter = 6\nflute_length = 20\ngauge_length = 100\n\
             [strategy]\nkind = \"multi-strip\"\n[feed]\ncut = 600\nspindle = 8000\n\
             [machine]\nfile = \"xyzac-trt\"\n{machine}\n"
        );
        Job::read(&text, "job.toml").unwrap()
    }

    #[test]
    fn hash_is_that_of_the_files_in_a_row() {
        // printf abc | sha256sum
        assert_eq!(hash(&[b"a", b"", b"bc"]), "ba7816bf8f01cfea");
    }

    #[test]
    fn every_file_that_is_followed_is_in_the_hash() {
        const PART: &[u8] = br#"{"format": "regulus-bspline", "version": 1, "degree": [1, 1], "knots_u": [0, 0, 1, 1],
            "knots_v": [0, 0, 1, 1], "control": [[[0, 0, 0], [0, 9, 0]], [[9, 0, 0], [9, 9, 0]]]}"#;
        const BODY: &[u8] = b"v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
        let (job, machine) = (job(""), Machine::named("xyzac-trt").unwrap());
        let text = job.text().to_owned();
        let files = PartFiles::alone(InputFile { name: "p.json", bytes: PART });
        let inputs = Inputs::read(job, &files, &machine, "machine").unwrap().with_machine_source(b"head");
        assert_eq!(inputs.hash, hash(&[text.as_bytes(), PART, b"machine", b"head"]));
        let inputs = inputs.with_stock_file(InputFile { name: "stock.obj", bytes: BODY }).unwrap();
        let inputs = inputs.with_fixture_file(0, InputFile { name: "jaw.obj", bytes: BODY }).unwrap();
        assert_eq!(inputs.hash, hash(&[text.as_bytes(), PART, b"machine", b"head", BODY, BODY]));
    }

    #[test]
    fn the_job_overrules_the_machine_file() {
        let machine = Machine::named("xyzac-trt").unwrap();
        assert_eq!(machine_of_job(&machine, &job("")).unwrap(), machine);
        let other = machine_of_job(
            &machine,
            &job("work_offset = \"G55\"\noffset = [1, 2, 3]\ntcp = false\ndialect = \"fanuc-30i\""),
        )
        .unwrap();
        assert!(!other.control.tcp);
        assert_eq!(other.control.options, DialectOptions::of(crate::machine::Dialect::Fanuc30i));
        let found = other.control.work_offsets.iter().find(|o| o.name == "G55").unwrap();
        assert_eq!(found.linear, [1.0, 2.0, 3.0]);
        let moved = machine_of_job(&machine, &job("offset = [4, 5, 6]")).unwrap();
        assert_eq!(moved.control.work_offsets.len(), machine.control.work_offsets.len());
        assert_eq!(moved.control.work_offsets[0].linear, [4.0, 5.0, 6.0]);
    }

    #[test]
    fn a_work_offset_that_nobody_places_is_refused() {
        let machine = Machine::named("xyzac-trt").unwrap();
        let said = machine_of_job(&machine, &job("work_offset = \"G57\"")).unwrap_err();
        assert_eq!(said.place.as_ref().unwrap().line, Some(20));
        assert!(said.help.as_ref().unwrap().contains("offset = [x, y, z]"), "{said}");
    }

    #[test]
    fn every_bad_input_is_named_at_once() {
        let machine = Machine::named("xyzac-trt").unwrap();
        let bad = |name| InputFile { name, bytes: b"{" };
        let files = PartFiles { surface: bad("p.json"), body: Some(bad("b.stl")), check: &[bad("c.stl")] };
        let findings = Inputs::read(job("work_offset = \"G57\""), &files, &machine, "").unwrap_err();
        let files: Vec<_> = findings.iter().map(|f| f.place.as_ref().unwrap().file.as_str()).collect();
        assert_eq!(files, ["p.json", "b.stl", "c.stl", "job.toml"]);
    }
}
