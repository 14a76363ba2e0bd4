//! What the methods of the papers come to on the same surfaces: strips by Rajain 2023 with the weights that it prints,
//! and tools that are found together with their sweeps (Bo 2016).

use crate::cases::{GEAR, S1, S1B, S2, S5, S6};
use crate::measure::{Figures, measure};
use crate::processor_seconds;
use regulus::diagnostic::{Diagnostic, Result};
use regulus::geometry::Vector;
use regulus::motion::FeedReference;
use regulus::part::{Part, ReadOptions, read};
use regulus::plan::meridian::{MeridianFamily, MeridianWeights, ToolRequest, ToolWish, find_tool, plan_found};
use regulus::plan::{Method, PlanRequest, Strategy, StrategyKind, Unobserved, plan};
use regulus::tool::{CutterShape, Fixture, Tool};
use std::time::Instant;

/// A file's name and bytes.
type File = (&'static str, &'static [u8]);

/// What is planned.
pub(crate) enum Task {
    /// Strips by Rajain 2023: spheres of the cone, direction, number of strips.
    Strips([f64; 3], [f64; 3], Option<usize>),
    /// A free meridian and one sweep.
    Meridian,
    /// A cone between end spheres of given radii, its length and its sweeps.
    Ends(f64, f64),
}

/// One line of the table.
pub(crate) struct Case {
    /// What it is called.
    pub(crate) name: &'static str,
    file: File,
    task: Task,
    tolerance: f64,
}

macro_rules! data {
    ($name:literal) => {
        ($name, include_bytes!(concat!("../../data/", $name)))
    };
}

/// Every case, in the table's order.
pub(crate) fn all() -> Vec<Case> {
    let strips = |name, file, length: f64, direction: [f64; 3], tolerance: f64| Case {
        name,
        file,
        task: Task::Strips([0.3, 1.0, length], direction, None),
        tolerance,
    };
    let exact = Task::Strips([3.0, 6.0, 14.0], [0.981_963_973, 0.140_737_554, 0.126_252_511], Some(1));
    let ends = |name, file| Case { name, file, task: Task::Ends(0.3, 1.0), tolerance: 0.005 };
    let side = |name, file| Case { name, file, task: Task::Meridian, tolerance: 5e-4 };
    vec![
        strips("rajain-2023 s1", S1, 1.717, GEAR, 0.004),
        strips("rajain-2023 s1b", S1B, 1.717, GEAR, 0.004),
        strips("rajain-2023 s2", S2, 2.46, [1.0, 0.0, 0.0], 0.004),
        strips("rajain-2023 s5", S5, 2.64, [1.0, 0.0, 0.0], 0.054),
        Case { name: "rajain-2023 s6, one strip", file: S6, task: exact, tolerance: 0.004 },
        side("bo-2016 c4 side 1, tool unknown", data!("cavity_c4_side1.json")),
        side("bo-2016 c4 side 2, tool unknown", data!("cavity_c4_side2.json")),
        ends("bo-2016 bevel convex, cone 0.3 to 1.0", data!("spiral_bevel_gap_convex.csv")),
        ends("bo-2016 bevel concave, cone 0.3 to 1.0", data!("spiral_bevel_gap_concave.csv")),
    ]
}

/// Plans a case; what it came to, and wall and processor seconds of planning.
pub(crate) fn run(case: &Case) -> Result<(Figures, [f64; 2])> {
    let (name, bytes) = case.file;
    let units = name.ends_with("csv").then_some(regulus::part::Units::Millimetres);
    let surface = read(bytes, name, &ReadOptions { units, ..ReadOptions::default() })?;
    let part = Part { name: "bench".into(), surface, check: Vec::new(), body: None };
    let (wall, cpu) = (Instant::now(), processor_seconds());
    let (tool, path) = match case.task {
        Task::Strips([r1, r2, length], direction, strips) => {
            let shape = CutterShape::EndSpheres { r1, r2, length };
            let tool = Tool::new(1, &shape, &fixture()).map_err(|e| Diagnostic::error(e.to_string()))?;
            let (method, direction) = (Method::Rajain2023, Some(Vector::from(direction)));
            let strategy = Strategy { method, direction, strips, ..Strategy::new(StrategyKind::MultiStrip) };
            let path = plan(&request(case, &part, &tool, &strategy))?.path;
            (tool, path)
        }
        Task::Meridian => found(case, &part, None)?,
        Task::Ends(r1, r2) => found(case, &part, Some((r1, r2)))?,
    };
    let spent = [wall.elapsed().as_secs_f64(), processor_seconds() - cpu];
    Ok((measure(&part, &tool, &path)?, spent))
}

/// The tool that is found, free or a cone between given ends, with its path.
fn found(case: &Case, part: &Part, ends: Option<(f64, f64)>) -> Result<(Tool, regulus::motion::ToolPath)> {
    let wish = ToolWish {
        number: 1,
        family: if ends.is_some() { MeridianFamily::Cone } else { MeridianFamily::Free },
        coefficients: None,
        radius: ends.unwrap_or((1.0, 20.0)),
        ends,
        seed: None,
        length: (0.0, 60.0),
        weights: MeridianWeights::default(),
        fixture: fixture(),
    };
    let strategy = Strategy::new(if ends.is_some() { StrategyKind::MultiStrip } else { StrategyKind::SingleSweep });
    let (wish, tolerance) = (&wish, case.tolerance);
    let found = find_tool(&ToolRequest { part, wish, strategy: &strategy, tolerance, observer: &Unobserved })?;
    let path = plan_found(&request(case, part, &found.tool, &strategy), &found)?.path;
    Ok((found.tool, path))
}

fn fixture() -> Fixture {
    Fixture { gauge_length: 100.0, ..Fixture::default() }
}

fn request<'a>(case: &'a Case, part: &'a Part, tool: &'a Tool, strategy: &'a Strategy) -> PlanRequest<'a> {
    PlanRequest {
        name: case.name,
        part,
        tool,
        strategy,
        overcut_tolerance: case.tolerance,
        undercut_tolerance: case.tolerance,
        cut_feed: 600.0,
        feed_reference: FeedReference::Mid,
        spindle_rpm: 8000.0,
        linearization: 0.0,
        observer: &Unobserved,
    }
}
