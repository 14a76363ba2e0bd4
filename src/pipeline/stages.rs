//! The stages of a job, each from what the stage before it gave: plan, post, verify.

use super::check::doubts;
use super::scene::{met_in_job, scene_of_machine, stands_of_job};
use super::stock::mill;
use super::suspect::suspicion;
use super::{InputFile, Inputs};
use crate::diagnostic::{Diagnostic, Result};
use crate::feed::{Loss, Schedule, excesses};
use crate::job::ToolSpec;
use crate::machine::{Choice, LinearizeOptions, Machine, Scene, Setup, linearize};
use crate::motion::ToolPath;
use crate::nc::{self, Program, Rules, WriteRequest, write};
use crate::plan::meridian::{ToolRequest, ToolWish, find_tool, plan_found};
use crate::plan::{self, Observer, Plan, PlanRequest};
use crate::simulate::{OwnTool, ToolMotion, simulate};
use crate::tool::Tool;
use crate::verify::{Milled, Settings, Subject, ToleranceRecord, Verified, verify};

/// How a program is to be written.
#[derive(Clone, Copy, Debug)]
pub struct PostRequest<'a> {
    /// The tool path.
    pub path: &'a ToolPath,
    /// The machine.
    pub machine: &'a Machine,
    /// G code of one of the machine's work offsets.
    pub work_offset: &'a str,
    /// Number of the program, for controls that count programs.
    pub number: u32,
    /// Hash of everything the program is made from, see [`super::hash`].
    pub input_hash: &'a str,
}

/// A program and what writing it cost.
#[derive(Clone, Debug)]
pub struct Posted {
    /// The program.
    pub text: String,
    /// Extension of a program's file on its control.
    pub extension: &'static str,
    /// Moves, the first included.
    pub moves: usize,
    /// Largest distance of the flank from the tool path between blocks, rounding included, mm.
    pub linearization: f64,
    /// What the choice of rotary branches and turns costs, and what none can be below.
    pub choice: Choice,
    /// Lines whose feed a ceiling of the control lowers.
    pub slowed: Vec<usize>,
    /// Seconds that the moves take as written.
    pub duration: f64,
    /// What holds the moves back from the feed, and what that costs, the most costly first.
    pub losses: Vec<Loss>,
}

/// A program followed and measured.
#[derive(Clone, Debug)]
pub struct Judged {
    /// What the program makes the tool do.
    pub motion: ToolMotion,
    /// Figures and verdict.
    pub verified: Verified,
    /// The way through the stock, where the job has one.
    pub milled: Option<Milled>,
}

/// How a program is to be judged.
#[derive(Clone, Copy, Debug, Default)]
pub struct Judging {
    /// Although the control may do something else with text that is not known.
    pub despite_unknown_text: bool,
    /// With upper bounds of overcut and undercut that hold between the samples, too.
    pub bounds: bool,
    /// With what the machine's tolerances would change on the part, see [`crate::machine::Tolerances`].
    pub uncertainty: bool,
    /// Number of the tool's length offset in the control's table; the tool's own when left out.
    pub length_offset: Option<u32>,
    /// Distance of neighbouring samples of the part, mm; from its area when left out.
    pub spacing: Option<f64>,
}

/// Guaranteed bounds are brought this near the sampled extremes where they can be, mm.
const BOUND_RESOLUTION: f64 = 1e-3;

/// Plans the tool path of a job, and finds the tool where the job leaves that open: then the plan holds it.
pub fn plan(inputs: &Inputs) -> Result<Plan> {
    plan_observed(inputs, &plan::Unobserved)
}

/// Plans the tool path of a job under the eyes of an observer, who may end it with the best found so far.
pub fn plan_observed(inputs: &Inputs, observer: &dyn Observer) -> Result<Plan> {
    let planned = match &inputs.job.tool {
        ToolSpec::Given(tool) => plan::plan(&plan_request(inputs, tool, observer)),
        ToolSpec::Wanted(wish) => plan_unknown_tool(inputs, wish, observer),
    };
    planned.map_err(|e| if e.place.is_some() { e } else { e.in_file(inputs.job.file()) })
}

fn plan_unknown_tool(inputs: &Inputs, wish: &ToolWish, observer: &dyn Observer) -> Result<Plan> {
    let job = &inputs.job;
    let found = find_tool(&ToolRequest {
        part: &inputs.part,
        wish,
        strategy: &job.strategy,
        tolerance: job.part.overcut_tolerance.min(job.part.undercut_tolerance),
        observer,
    })?;
    let mut plan = plan_found(&plan_request(inputs, &found.tool, observer), &found)?;
    plan.found = Some(Box::new(found));
    Ok(plan)
}

fn plan_request<'a>(inputs: &'a Inputs, tool: &'a Tool, observer: &'a dyn Observer) -> PlanRequest<'a> {
    let job = &inputs.job;
    PlanRequest {
        name: &job.name,
        part: &inputs.part,
        tool,
        strategy: &job.strategy,
        overcut_tolerance: job.part.overcut_tolerance,
        undercut_tolerance: job.part.undercut_tolerance,
        cut_feed: job.feed.cut,
        feed_reference: job.feed.reference,
        spindle_rpm: job.feed.spindle_rpm,
        linearization: job.output.linearization,
        observer,
    }
}

/// Writes the program of a tool path. Where the tool leaves the part to turn back, bodies of the machine and the tool's
/// axis stay clear of each other.
pub fn post(request: &PostRequest<'_>) -> Result<Posted> {
    post_among(request, scene_of_machine)
}

fn post_among(request: &PostRequest<'_>, scene: impl FnOnce(&Setup) -> Result<Scene>) -> Result<Posted> {
    let PostRequest { path, machine, work_offset, number, input_hash } = *request;
    let setup = Setup::new(machine, work_offset, path.tool.gauge_length)?;
    let tcp = machine.control.tcp;
    let scene = scene(&setup)?;
    let options = LinearizeOptions { scene: Some(&scene), ..LinearizeOptions::default() };
    let linearized = linearize(path, &setup, tcp, &options)?;
    let mut schedule = Schedule::new(path, &setup, tcp, &linearized.moves);
    let write = |schedule: &Schedule| {
        let moves = schedule.moves();
        write(&WriteRequest { path, moves, setup: &setup, work_offset, tcp, input_hash, number, modal: true })
    };
    let (mut written, mut slowed) = (write(&schedule)?, Vec::new());
    for _ in 0..WORD_ROUNDS {
        slowed.append(&mut written.slowed);
        if excesses(schedule.moves(), &written.seconds, machine).is_empty() {
            break;
        }
        schedule.slow_to(&written.seconds);
        written = write(&schedule)?;
    }
    slowed.append(&mut written.slowed);
    slowed.sort_unstable();
    slowed.dedup();
    Ok(Posted {
        text: written.text,
        extension: machine.control.dialect.extension(),
        moves: schedule.moves().len(),
        linearization: linearized.deviation,
        choice: linearized.choice,
        slowed,
        duration: schedule.total(),
        losses: schedule.losses(),
    })
}

/// Rounds in which blocks are fitted to neighbours that their feed words slow; what is left after that is found when the
/// program is verified.
const WORD_ROUNDS: usize = 8;

/// Writes the program of a job's tool path. Where the tool leaves the part to turn back, it stays clear of fixtures and
/// bodies of the machine.
pub fn post_job(inputs: &Inputs, path: &ToolPath) -> Result<Posted> {
    let job = &inputs.job;
    let request = PostRequest {
        path,
        machine: &inputs.machine,
        work_offset: &job.machine.work_offset,
        number: job.output.program_number,
        input_hash: &inputs.hash,
    };
    post_among(&request, |setup| stands_of_job(inputs, setup))
}

/// Follows a program's text and measures what it leaves of the job's part. `path` is the tool path that it was posted
/// from, where there is one. Text whose effect is not known refuses the verdict, unless `how` says otherwise.
pub fn judge(
    inputs: &Inputs,
    program: InputFile<'_>,
    path: Option<&ToolPath>,
    how: &Judging,
) -> Result<Judged, Vec<Diagnostic>> {
    let job = &inputs.job;
    let refuse = |e: Box<Diagnostic>| vec![*e];
    let tool = inputs.tool().map_err(refuse)?;
    let (read, motion) = follow(inputs, program, how)?;
    let subject = Subject {
        program: &read,
        motion: &motion,
        tool,
        part: &inputs.part,
        tolerance: ToleranceRecord { overcut: job.part.overcut_tolerance, undercut: job.part.undercut_tolerance },
        path,
    };
    let bound = how.bounds.then_some(BOUND_RESOLUTION);
    let settings = Settings {
        despite_unknown_text: how.despite_unknown_text,
        bound,
        spacing: how.spacing,
        uncertainty: how.uncertainty,
        ..Settings::default()
    };
    let mut verified = verify(&subject, &settings);
    if let Some(suspicion) = suspicion(&read, motion.setup(), inputs, tool, &verified) {
        verified.record.add(suspicion);
    }
    verified = verified.with_bodies(&met_in_job(inputs, &motion, tool).map_err(refuse)?);
    let milled = mill(inputs, &motion).map_err(refuse)?;
    let verified = match &milled {
        Some(milled) => verified.with_stock(milled),
        None => verified,
    };
    Ok(Judged { motion, verified, milled })
}

/// Takes a program through the job's stock, without looking at the part.
pub fn mill_program(inputs: &Inputs, program: InputFile<'_>, how: &Judging) -> Result<Milled, Vec<Diagnostic>> {
    let (_, motion) = follow(inputs, program, how)?;
    let milled = mill(inputs, &motion).map_err(|e| vec![*e])?;
    milled.ok_or_else(|| {
        let help = "add, for example, [stock] with box = { min = [0, 0, 0], max = [60, 20, 40] }";
        vec![*Diagnostic::error("the job has no stock").in_file(inputs.job.file()).help(help)]
    })
}

/// Reads a program and follows it as the job's machine would. Refuses one with text whose effect is not known, unless
/// `how` says otherwise.
fn follow(inputs: &Inputs, program: InputFile<'_>, how: &Judging) -> Result<(Program, ToolMotion), Vec<Diagnostic>> {
    let refuse = |e: Box<Diagnostic>| vec![*e];
    let tool = inputs.tool().map_err(refuse)?;
    let setup = Setup::new(&inputs.machine, &inputs.job.machine.work_offset, tool.gauge_length()).map_err(refuse)?;
    let read = nc::read(program.bytes, &Rules::of(&inputs.machine));
    let own = OwnTool { number: tool.number, length_offset: how.length_offset.unwrap_or(tool.number) };
    let motion = simulate(&read, &setup, Some(own));
    let doubts = if how.despite_unknown_text { Vec::new() } else { doubts(&motion, program) };
    if doubts.is_empty() { Ok((read, motion)) } else { Err(doubts) }
}
