//! The job file: what to mill, with which tool, how, on which machine. Raw keys are read by serde, then checked into a
//! [`Job`] that cannot be wrong; every complaint names line, column and remedy. Uses `diagnostic`, `geometry`, `part`,
//! `tool`, `motion`, `machine`, `plan`, `stock` and `verify`.

mod catalogue;
mod limits;
mod rajain;
mod raw;
mod stock;
mod tool;
mod tool_file;

use crate::diagnostic::{Diagnostic, TomlText};
use crate::geometry::{Degrees, RigidMotion, Vector};
use crate::machine::{Body, Dialect};
use crate::motion::FeedReference;
use crate::part::{ReadOptions, Triangles, Units};
use crate::plan::{Method, Strategy, StrategyKind, TipSide};
pub use catalogue::{CatalogueEntry, read_catalogue};
use limits::Checks;
pub use stock::{BlankSpec, StockSpec};
pub use tool::ToolSpec;
pub use tool_file::{fact_lines, read_tool, write_tool};

/// A checked job.
#[derive(Clone, Debug)]
pub struct Job {
    /// Name, for headers and reports.
    pub name: String,
    /// What to mill.
    pub part: PartSpec,
    /// The tool, or what it may be.
    pub tool: ToolSpec,
    /// How to plan.
    pub strategy: Strategy,
    /// File of machining directions at points of the part, relative to the job file's folder. Its content goes into
    /// `strategy` when it is read.
    pub direction_field: Option<String>,
    /// On which machine.
    pub machine: MachineSpec,
    /// How fast.
    pub feed: Feed,
    /// How to write.
    pub output: Output,
    /// The material before the program, where its way through it is to be followed.
    pub stock: Option<StockSpec>,
    /// What stands on the table beside the part, part frame. Those given by a file are without its content.
    pub fixtures: Vec<Body>,
    /// What the user should know although the job is good.
    pub warnings: Vec<Diagnostic>,
    text: TomlText,
}

/// The part's files and tolerance.
#[derive(Clone, Debug)]
pub struct PartSpec {
    /// The design surface's file, relative to the job file's folder.
    pub file: String,
    /// File of the finished part as a closed mesh, relative to the job file's folder.
    pub body: Option<String>,
    /// Files of surfaces that the tool must stay clear of, relative to the job file's folder.
    pub check: Vec<String>,
    /// Material that may be missing below the design surface, mm.
    pub overcut_tolerance: f64,
    /// Material that may be left above the design surface, mm.
    pub undercut_tolerance: f64,
    /// How to read `file`.
    pub reading: ReadOptions,
}

/// The machine and how the part stands on it.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineSpec {
    /// Name of a machine that comes with the program, or path of a machine file relative to the job file's folder.
    pub file: String,
    /// Work offset that the program calls, such as `G54`.
    pub work_offset: String,
    /// Origin of the part frame in machine coordinates at rotary zero, mm; the machine file's own when left out.
    pub offset: Option<[f64; 3]>,
    /// Whether the control keeps the tip on its path (TCP); the machine file's own choice when left out.
    pub tcp: Option<bool>,
    /// Dialect to write; the machine file's own when left out.
    pub dialect: Option<Dialect>,
}

/// Speeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feed {
    /// Speed of the reference point relative to the part, mm/min.
    pub cut: f64,
    /// Which point of the flank that is.
    pub reference: FeedReference,
    /// Spindle speed, 1/min.
    pub spindle_rpm: f64,
}

/// How to write the program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output {
    /// How far the flank may leave the tool path between blocks, rounding included, mm.
    pub linearization: f64,
    /// Number of the program, for controls that count programs.
    pub program_number: u32,
}

/// Weight of fairness against accuracy that leaves the planner's own balance as it is.
const NEUTRAL_FAIRNESS: f64 = 1e-6;
/// The same of kinks between strips.
const NEUTRAL_G1: f64 = 1e-3;

/// Angle between neighbouring triangles from which on their edge is sharp where the job does not say, degrees: more than
/// between facets of a round face, less than at the chamfers and edges of parts.
const CREASE_DEG: f64 = 30.0;

/// Share of the tighter tolerance that blocks may use up when the job does not say.
const LINEARIZATION_SHARE: f64 = 0.1;

impl Job {
    /// Reads and checks a job file's text; all findings of one look at once.
    pub fn read(text: &str, file: &str) -> Result<Self, Vec<Diagnostic>> {
        let text = TomlText::new(file, text);
        let raw: raw::Job = text.parse().map_err(|e| vec![*e])?;
        let mut checks = Checks::new(&text);
        checks.header((&raw.format, raw.version), ("regulus-job", "a job file"));
        let name = checks.name("name", raw.name);
        let part = part(&mut checks, raw.part);
        let tool = tool::build(&mut checks, raw.tool);
        let (strategy, direction_field) = strategy(&mut checks, raw.strategy);
        if strategy.method == Method::Rajain2023 && matches!(tool, Some(ToolSpec::Wanted(_))) {
            let help = "give a cone or a cylinder, of which [strategy.rajain] free = [\"length\", \"r1\", \"r2\"] may change sizes";
            checks.refuse("strategy.method", "method \"rajain-2023\" starts from a given tool", help);
        }
        let machine = machine(&mut checks, raw.machine);
        checks.within("feed.cut", raw.feed.cut, &limits::FEED);
        checks.within("feed.spindle", raw.feed.spindle, &limits::SPINDLE);
        let feed = Feed { cut: raw.feed.cut, reference: raw.feed.reference, spindle_rpm: raw.feed.spindle };
        let output = output(&mut checks, &raw.output, &part);
        let stock = raw.stock.and_then(|raw| stock::stock(&mut checks, raw));
        let fixtures = checks.fixtures(&raw.fixtures);
        match (checks.finish(), tool) {
            ((findings, warnings), Some(tool)) if findings.is_empty() => Ok(Self {
                name,
                part,
                tool,
                strategy,
                direction_field,
                machine,
                feed,
                output,
                stock,
                fixtures,
                warnings,
                text,
            }),
            ((findings, _), _) => Err(findings),
        }
    }

    /// The text it was read from.
    pub fn text(&self) -> &str {
        self.text.text()
    }

    /// The file's name as the user gave it.
    pub fn file(&self) -> &str {
        self.text.file()
    }

    /// A complaint about the value at a path of keys, such as `part.file`, with its line and column in the job file.
    pub fn blame(&self, key: &str, message: impl Into<String>) -> Box<Diagnostic> {
        self.text.blame(key, message)
    }
}

fn part(checks: &mut Checks<'_>, raw: raw::Part) -> PartSpec {
    let tolerance = raw.tolerance;
    checks.within("part.tolerance.overcut", tolerance.overcut, &limits::TOLERANCE);
    checks.within("part.tolerance.undercut", tolerance.undercut, &limits::TOLERANCE);
    if raw.face.is_some() {
        checks.refuse(
            "part.face",
            "a face is chosen among those of a CAD file; this kind of file holds one surface",
            "leave `face` out",
        );
    }
    if raw.sides.is_some() {
        checks.refuse(
            "part.sides",
            "only strategies for cavities mill two sides, and none is available",
            "give one surface as `file = \"…\"` and mill the sides by two jobs",
        );
    }
    let file = match raw.file {
        Some(file) => checks.path("part.file", file),
        None if raw.sides.is_none() => {
            checks.refuse("part", "key `file` is missing", "add `file = \"blade.json\"`");
            String::new()
        }
        None => String::new(),
    };
    let body = raw.body.map(|file| checks.path("part.body", file));
    let check = raw.check.into_iter().enumerate().map(|(i, f)| checks.path(&format!("part.check[{i}]"), f)).collect();
    let placement = raw.placement.unwrap_or_default();
    checks.all_within("part.placement.origin", &placement.origin, &limits::COORDINATE);
    checks.all_within("part.placement.rotate_deg", &placement.rotate_deg, &limits::ANGLE);
    let [rx, ry, rz] = placement.rotate_deg.map(f64::to_radians);
    let placement = RigidMotion::from_parts(
        Vector::from(placement.origin).into(),
        nalgebra::UnitQuaternion::from_euler_angles(rx, ry, rz),
    );
    let triangles = triangles(checks, std::iter::once(&file).chain(&body).chain(&check), raw.triangles, raw.crease_deg);
    let units = raw.units.map(|u| match u {
        raw::Units::Mm => Units::Millimetres,
        raw::Units::Inch => Units::Inches,
    });
    PartSpec {
        file,
        body,
        check,
        overcut_tolerance: tolerance.overcut,
        undercut_tolerance: tolerance.undercut,
        reading: ReadOptions { units, flip: raw.flip, placement, triangles },
    }
}

/// How the triangles of the part's files are meant. Flat ones are what a file says; what lies between their corners
/// otherwise only who made it knows. `files` are the part's own, its body's and those of its check surfaces.
fn triangles<'f>(
    checks: &mut Checks<'_>,
    files: impl Iterator<Item = &'f String> + Clone,
    given: Option<raw::Triangles>,
    crease: Option<f64>,
) -> Triangles {
    if let Some(crease) = crease {
        checks.within("part.crease_deg", crease, &limits::CREASE);
        if given != Some(raw::Triangles::Curved) {
            let message = "flat triangles need no crease_deg";
            checks.refuse("part.crease_deg", message, "add triangles = \"curved\", or leave crease_deg out");
        }
    }
    let mesh = |file: &String| [".stl", ".obj"].iter().any(|kind| file.to_ascii_lowercase().ends_with(kind));
    // What has no name has been refused for that.
    let mut named = files.filter(|file| !file.is_empty()).peekable();
    if given.is_some() && named.peek().is_some() && !named.clone().any(mesh) {
        let message = match named.clone().map(String::as_str).collect::<Vec<_>>().as_slice() {
            [file] => format!("{file} holds no triangles"),
            files => format!("none of {} holds triangles", files.join(", ")),
        };
        checks.refuse("part.triangles", message, "leave `triangles` out, or give an .stl or .obj file");
    }
    match given {
        Some(raw::Triangles::Curved) => Triangles::Curved { crease: Degrees(crease.unwrap_or(CREASE_DEG)).into() },
        Some(raw::Triangles::Flat) | None => Triangles::Flat,
    }
}

fn strategy(checks: &mut Checks<'_>, raw: raw::Strategy) -> (Strategy, Option<String>) {
    let mut strategy = Strategy::new(match raw.kind {
        raw::StrategyKind::SingleSweep => StrategyKind::SingleSweep,
        raw::StrategyKind::MultiStrip => StrategyKind::MultiStrip,
    });
    strategy.method = match raw.method {
        raw::Method::Regulus => Method::Regulus,
        raw::Method::Rulings => Method::Rulings,
        raw::Method::Rajain2023 => Method::Rajain2023,
    };
    strategy.tip = raw.tip.map(|side| match side {
        raw::TipSide::Low => TipSide::Low,
        raw::TipSide::High => TipSide::High,
    });
    strategy.direction = checks.vector("strategy.direction", raw.direction);
    strategy.spindle = checks.vector("strategy.spindle", raw.spindle);
    strategy.climb = raw.climb.unwrap_or(strategy.climb);
    for (key, value) in [("engage_from", raw.engage_from), ("lead", raw.lead), ("stand_off", raw.stand_off)] {
        if let Some(value) = value {
            checks.within(&format!("strategy.{key}"), value, &limits::LENGTH);
        }
    }
    (strategy.engage_from, strategy.lead, strategy.stand_off) = (raw.engage_from, raw.lead, raw.stand_off);
    if let Some(strips) = raw.strips {
        checks.within("strategy.strips", f64::from(strips), &limits::STRIPS);
        strategy.strips = Some(strips as usize);
    }
    let mut direction_field = None;
    if strategy.method == Method::Rajain2023 {
        (strategy.rajain, direction_field) = rajain::settings(checks, &raw);
    } else {
        rajain::refuse_foreign_keys(checks, &raw);
        if let Some(weights) = &raw.weights {
            (strategy.fairness, strategy.smoothness) = balance(checks, weights);
            if weights.g1.is_some() && strategy.kind == StrategyKind::SingleSweep {
                checks.warn("strategy.weights.g1", "a single sweep has no seams: `g1` has no effect", "leave it out");
            }
        }
        if let Some(weight) = raw.weights.as_ref().and_then(|weights| weights.direction) {
            checks.within("strategy.weights.direction", weight, &limits::WEIGHT);
            strategy.direction_weight = weight;
        }
    }
    (strategy, direction_field)
}

/// What the weights make of the planner's own balance: fairness and kinks between strips, each against accuracy and as a
/// multiple of its neutral weight.
fn balance(checks: &mut Checks<'_>, weights: &raw::Weights) -> (f64, f64) {
    let mut weight = |key: &str, value: Option<f64>, neutral: f64, limit: &limits::Limit| {
        let value = value.unwrap_or(neutral);
        checks.within(&format!("strategy.weights.{key}"), value, limit);
        value / neutral
    };
    let accuracy = weight("accuracy", weights.accuracy, 1.0, &limits::WEIGHT);
    let fairness = weight("fairness", weights.fairness, NEUTRAL_FAIRNESS, &limits::WEIGHT);
    let kinks = weight("g1", weights.g1, NEUTRAL_G1, &limits::ZERO_WEIGHT);
    (fairness / accuracy, kinks / accuracy)
}

fn machine(checks: &mut Checks<'_>, raw: raw::Machine) -> MachineSpec {
    if let Some(offset) = &raw.offset {
        checks.all_within("machine.offset", offset, &limits::COORDINATE);
    }
    checks.work_offset("machine.work_offset", &raw.work_offset);
    MachineSpec {
        file: checks.path("machine.file", raw.file),
        work_offset: raw.work_offset,
        offset: raw.offset,
        tcp: raw.tcp,
        dialect: raw.dialect,
    }
}

fn output(checks: &mut Checks<'_>, raw: &raw::Output, part: &PartSpec) -> Output {
    let tolerance = part.overcut_tolerance.min(part.undercut_tolerance);
    let linearization = match raw.linearization {
        Some(linearization) => {
            checks.within("output.linearization", linearization, &limits::LINEARIZATION);
            linearization
        }
        None => limits::LINEARIZATION.clamp(tolerance * LINEARIZATION_SHARE),
    };
    let program_number = raw.program_number.unwrap_or(1);
    checks.within("output.program_number", f64::from(program_number), &limits::PROGRAM_NUMBER);
    Output { linearization, program_number }
}

#[cfg(test)]
mod tests;
