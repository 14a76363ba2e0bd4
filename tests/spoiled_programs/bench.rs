//! The part that all programs cut, and programs for it: the exact envelope of a cone, in one sweep.

use regulus::job::Job;
use regulus::machine::{Dialect, DialectOptions, FeedMode, LengthUnit, Machine};
use regulus::motion::ToolPath;
use regulus::pipeline::{CheckRequest, InputFile, Inputs, Judging, PartFiles, PostRequest, check, judge, plan, post};
use regulus::simulate::{OwnTool, SegmentKind};
use regulus::verify::{FindingRecord, Verdict};
use std::sync::OnceLock;

const PART: &[u8] = include_bytes!("../../samples/exact-cone/surface.json");
const JOB: &str = include_str!("../../samples/exact-cone/job.toml");
/// Distance of neighbouring samples: between them the deviation is refined, mm.
const SPACING: f64 = 0.5;

/// A program and everything that it is judged by.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) text: String,
    pub(crate) inputs: Inputs,
    form: Form,
    /// Lines of the feed moves that cut, from 1.
    pub(crate) cuts: Vec<usize>,
}

/// What a program came to.
pub(crate) struct Judgement {
    pub(crate) passed: bool,
    pub(crate) findings: Vec<FindingRecord>,
}

/// How a program is written.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Form {
    pub(crate) machine: &'static str,
    /// The machine file's own where it is `None`.
    pub(crate) dialect: Option<Dialect>,
    pub(crate) per_minute: bool,
    pub(crate) inch: bool,
    /// Where the part stands, mm.
    pub(crate) offset: [f64; 3],
}

/// The machine's own form.
pub(crate) fn form(machine: &'static str) -> Form {
    Form { machine, dialect: None, per_minute: false, inch: false, offset: OFFSET }
}

/// Off the machine's centre, so that offsets matter.
const OFFSET: [f64; 3] = [3.0, -4.0, 5.0];

/// The job with the machine that it names, changed.
pub(crate) fn inputs(form: &Form, job: impl Fn(&str) -> String, change: impl Fn(&mut Machine)) -> Inputs {
    let mut machine = Machine::named(form.machine).unwrap();
    let control = &mut machine.control;
    if let Some(dialect) = form.dialect.filter(|dialect| *dialect != control.dialect) {
        (control.dialect, control.options) = (dialect, DialectOptions::of(dialect));
        control.tcp = control.options.tcp_on.is_some();
    }
    if form.per_minute {
        control.options.feed_mode = FeedMode::PerMinute;
    }
    if form.inch {
        control.options.units = LengthUnit::Inch;
    }
    // What is cut within a micron must be written finer.
    control.options.linear_digits = control.options.linear_digits.max(if form.inch { 6 } else { 5 });
    control.options.rotary_digits = control.options.rotary_digits.max(5);
    if control.dialect == Dialect::OkumaOsp {
        control.work_offsets[0].name = "G15 H1".to_owned();
    }
    for (axis, offset) in control.work_offsets[0].linear.iter_mut().zip(form.offset) {
        *axis += offset;
    }
    let first = control.work_offsets[0].clone();
    control.work_offsets.truncate(1);
    let mut other = first.clone();
    other.name = if first.name.starts_with("G15") { "G15 H2".to_owned() } else { "G55".to_owned() };
    other.linear[2] += 50.0;
    control.work_offsets.push(other);
    change(&mut machine);
    let text = JOB.replace("\"xyzac-trt\"", &format!("\"{}\"\nwork_offset = \"{}\"", form.machine, first.name));
    let job = Job::read(&job(&text), "job.toml").unwrap();
    let part = InputFile { name: "surface.json", bytes: PART };
    Inputs::read(job, &PartFiles::alone(part), &machine, "").unwrap()
}

/// The tool path is the same for every machine and control.
pub(crate) fn judged_path() -> &'static ToolPath {
    static PATH: OnceLock<ToolPath> = OnceLock::new();
    PATH.get_or_init(|| plan(&inputs(&form("xyzac-trt"), str::to_owned, |_| {})).unwrap().path)
}

/// The program of a path for inputs.
pub(crate) fn posted(inputs: &Inputs, path: &ToolPath) -> Result<String, String> {
    let request = PostRequest {
        path,
        machine: &inputs.machine,
        work_offset: &inputs.job.machine.work_offset,
        number: 1,
        input_hash: "0",
    };
    post(&request).map(|posted| posted.text).map_err(|e| e.to_string())
}

impl Case {
    pub(crate) fn new(form: &Form) -> Self {
        let inputs = inputs(form, str::to_owned, |_| {});
        let text = posted(&inputs, judged_path()).unwrap();
        let dialect = inputs.machine.control.dialect.name();
        let feed = if form.per_minute { "per minute" } else { "own feed" };
        let name = format!("{} {dialect} {feed}{}", form.machine, if form.inch { " inch" } else { "" });
        let mut case = Self { name, text, inputs, form: *form, cuts: Vec::new() };
        let program = InputFile { name: "program.nc", bytes: case.text.as_bytes() };
        let how = Judging { spacing: Some(SPACING), ..Judging::default() };
        let judged = judge(&case.inputs, program, None, &how).unwrap();
        let touching =
            judged.verified.part.samples.iter().filter_map(|sample| sample.touch.map(|touch| touch.when.block));
        let (first, last) = touching.fold((usize::MAX, 0), |(first, last), block| (block.min(first), block.max(last)));
        let blocks = judged.motion.segments().iter().take(last).skip(first + 1);
        case.cuts = blocks.filter(|segment| segment.kind == SegmentKind::Feed).map(|segment| segment.line).collect();
        case
    }

    fn check(&self, text: &str) -> regulus::pipeline::Checked {
        let tool = self.inputs.tool().unwrap();
        check(&CheckRequest {
            program: InputFile { name: "program.nc", bytes: text.as_bytes() },
            machine: &self.inputs.machine,
            work_offset: Some(&self.inputs.job.machine.work_offset),
            gauge_length: tool.gauge_length(),
            tool: Some(OwnTool::from(tool.number)),
            despite_unknown_text: false,
        })
        .unwrap()
    }

    /// What a program comes to, by other inputs than the case's where there are any; one whose motion is uncertain does not pass.
    pub(crate) fn judge(&self, text: &str, inputs: Option<&Inputs>) -> Judgement {
        judge_on(inputs.unwrap_or(&self.inputs), text)
            .unwrap_or_else(|| Judgement { passed: false, findings: self.check(text).record.findings })
    }

    /// Line of the cut at a share of all, from 1.
    pub(crate) fn cut(&self, share: f64) -> usize {
        self.cuts[(self.cuts.len() as f64 * share) as usize]
    }
}

/// The inputs of a case with another job or machine.
pub(crate) fn inputs_of(case: &Case, job: impl Fn(&str) -> String, change: impl Fn(&mut Machine)) -> Inputs {
    inputs(&case.form, job, change)
}

/// What a program comes to on a machine; `None` where there is no verdict.
pub(crate) fn judge_on(inputs: &Inputs, text: &str) -> Option<Judgement> {
    let program = InputFile { name: "program.nc", bytes: text.as_bytes() };
    let how = Judging { spacing: Some(SPACING), ..Judging::default() };
    let record = judge(inputs, program, None, &how).ok()?.verified.record;
    Some(Judgement { passed: record.verdict == Verdict::Pass, findings: record.findings })
}

/// Programs of all kinds of machines and controls.
pub(crate) fn cases() -> &'static [Case] {
    static CASES: OnceLock<Vec<Case>> = OnceLock::new();
    CASES.get_or_init(|| {
        let forms = [
            form("xyzac-trt"),
            Form { per_minute: true, ..form("trunnion-ac-30i") },
            form("huron-kx100"),
            Form { offset: [3.0, -4.0, 160.0], ..form("dmg-dmu50-evolution") },
            Form { dialect: Some(Dialect::GrblHal), ..form("head-b-table-c") },
        ];
        forms.iter().map(Case::new).collect()
    })
}
