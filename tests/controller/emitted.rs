//! Programs of a short job for any machine, and of the samples, and what this project says that they do.

use crate::rig::Rig;
use regulus::job::Job;
use regulus::machine::{DialectOptions, Machine, Setup, builtin};
use regulus::motion::ToolPath;
use regulus::nc::{Program, Rules, read};
use regulus::pipeline::{InputFile, Inputs, Judging, PartFiles, judge, plan, post_job};
use regulus::simulate::ToolMotion;
use regulus::verify::{DeviationRecord, Settings, Subject, verify};
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

const JOB: &str = include_str!("job.toml");
const PART: &[u8] = include_bytes!("arc.json");
/// Where the part stands: off every axis.
const OFFSET: [f64; 3] = [35.0, -20.0, 12.5];
/// In the order of the controller's coordinate systems, from 1.
const WORK_OFFSETS: [&str; 6] = ["G54", "G55", "G56", "G57", "G58", "G59"];

/// A program, and all that belongs to it.
pub(crate) struct Emitted {
    inputs: Inputs,
    pub(crate) text: String,
    pub(crate) program: Program,
    pub(crate) motion: ToolMotion,
    pub(crate) deviation: DeviationRecord,
}

/// The job on a machine; `change` says what it has other than its file says.
fn inputs(name: &str, tcp: bool, offset: [f64; 3], change: impl Fn(&mut Machine)) -> Inputs {
    let text = JOB.replace("MACHINE", name).replace("OFFSET", &format!("{offset:?}")).replace("TCP", &tcp.to_string());
    let job = Job::read(&text, "job.toml").unwrap();
    let part = InputFile { name: "arc.json", bytes: PART };
    let mut machine = Machine::named(name).unwrap();
    change(&mut machine);
    Inputs::read(job, &PartFiles::alone(part), &machine, builtin(name).unwrap()).unwrap()
}

/// A sample's job.
fn sample(name: &str) -> Inputs {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples").join(name);
    let job = Job::read(&fs::read_to_string(folder.join("job.toml")).unwrap(), "job.toml").unwrap();
    assert!(job.part.check.is_empty(), "sample {name} has check surfaces, which are not read here");
    let bytes = fs::read(folder.join(&job.part.file)).unwrap();
    let (file, machine) = (job.part.file.clone(), job.machine.file.clone());
    let part = InputFile { name: &file, bytes: &bytes };
    Inputs::read(job, &PartFiles::alone(part), &Machine::named(&machine).unwrap(), builtin(&machine).unwrap()).unwrap()
}

impl Emitted {
    /// Plans, writes, reads back, follows and verifies the program for a machine, with TCP on or off.
    pub(crate) fn new(machine: &str, tcp: bool) -> Self {
        Self::with(machine, tcp, |_| {})
    }

    /// The same where the control has other options than the machine's file says.
    pub(crate) fn with(machine: &str, tcp: bool, change: impl Fn(&mut DialectOptions)) -> Self {
        Self::on(machine, tcp, OFFSET, |machine| change(&mut machine.control.options))
    }

    /// The same where the part stands elsewhere and the machine differs from its file.
    pub(crate) fn on(machine: &str, tcp: bool, offset: [f64; 3], change: impl Fn(&mut Machine)) -> Self {
        // The tool path is the same for every machine.
        static PATH: OnceLock<ToolPath> = OnceLock::new();
        let inputs = inputs(machine, tcp, offset, change);
        let path = PATH.get_or_init(|| plan(&inputs).unwrap().path);
        Self::from_path(inputs, path)
    }

    /// The same for a sample and its machine.
    pub(crate) fn sample(name: &str) -> Self {
        let inputs = sample(name);
        let path = plan(&inputs).unwrap().path;
        Self::from_path(inputs, &path)
    }

    fn from_path(inputs: Inputs, path: &ToolPath) -> Self {
        let text = post_job(&inputs, path).unwrap().text;
        let file = InputFile { name: "program.ngc", bytes: text.as_bytes() };
        let judged = judge(&inputs, file, Some(path), &Judging::default()).unwrap();
        let program = read(text.as_bytes(), &Rules::of(&inputs.machine));
        let deviation = judged.verified.record.deviation;
        Self { inputs, text, program, motion: judged.motion, deviation }
    }

    /// The machine with its part and its tool.
    pub(crate) fn setup(&self) -> &Setup {
        self.motion.setup()
    }

    /// The controller of this machine, with its part and its tool.
    pub(crate) fn rig(&self) -> Rig {
        let (setup, job) = (self.setup(), &self.inputs.job);
        Rig {
            machine: setup.machine().name.clone(),
            tool: job.tool.number(),
            tool_length: setup.tool_length(),
            system: WORK_OFFSETS.iter().position(|name| *name == job.machine.work_offset).unwrap() + 1,
            offset: setup.work_offset(),
            geometry: Vec::new(),
            identity_first: false,
            m428_selects: 0,
        }
    }

    /// What another motion of the tool leaves of the part.
    pub(crate) fn deviation_of(&self, motion: &ToolMotion) -> DeviationRecord {
        let (tool, part) = (self.inputs.tool().unwrap(), &self.inputs.part);
        let program = Program::default();
        let subject =
            Subject { program: &program, motion, tool, part, tolerance: self.deviation.tolerance, path: None };
        verify(&subject, &Settings::default()).record.deviation
    }
}
