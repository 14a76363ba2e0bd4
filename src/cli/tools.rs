//! `regulus tools`: which cutter of a catalogue suits a job's part; and the files of a tool that was found.

use super::files::{Outputs, read_text};
use super::inputs::job_inputs;
use super::{Outcome, Refusal, Terminal};
use crate::job::{CatalogueEntry, ToolSpec, read_catalogue, write_tool};
use crate::pipeline::{Inputs, to_json};
use crate::plan::choice::{Limit, Prospect, prospects, ranking};
use crate::tool::Tool;
use crate::tool::export::{csv, dxf, stl};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Distance of the rows of a tool's table, mm.
const TABLE_STEP: f64 = 0.1;
/// How far the facets of a tool's STL may leave it, mm.
const STL_CHORD: f64 = 0.002;

/// Adds a found tool as a tool file, a table, a drawing and a body, named `stem` with their extensions.
pub(super) fn tool_files(outputs: &mut Outputs, inputs: &Inputs, tool: &Tool, stem: &Path) {
    let fixture = match &inputs.job.tool {
        ToolSpec::Wanted(wish) => wish.fixture.clone(),
        ToolSpec::Given(given) => given.fixture(),
    };
    let mut add = |extension: &str, content: Vec<u8>| {
        let mut name = stem.as_os_str().to_owned();
        name.push(format!(".{extension}"));
        outputs.add(name.into(), content);
    };
    add("toml", write_tool(tool, &fixture, &inputs.job.name).into_bytes());
    add("csv", csv(tool, TABLE_STEP).into_bytes());
    add("dxf", dxf(tool).into_bytes());
    add("stl", stl(tool, STL_CHORD));
}

#[derive(Args)]
pub(super) struct Arguments {
    /// The job: part, tolerance, strategy and feed; its own tool is not looked at
    job: PathBuf,
    /// The cutters to choose from: format "regulus-catalogue", one `[[tool]]` each with the keys of a job's `[tool]`
    #[arg(long, value_name = "C.toml")]
    catalogue: PathBuf,
    /// Write the figures here
    #[arg(long, value_name = "F.json")]
    json: Option<PathBuf>,
}

/// The ranking as JSON.
#[derive(Serialize)]
struct Ranking<'a> {
    format: &'static str,
    version: u32,
    tools: Vec<Ranked<'a>>,
}

#[derive(Serialize)]
struct Ranked<'a> {
    name: &'a str,
    number: u32,
    kind: &'a str,
    #[serde(flatten)]
    prospect: &'a Prospect,
}

/// `regulus tools`: the cutters of a catalogue, ranked for a job's part.
pub(super) fn run(arguments: &Arguments, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    let inputs = job_inputs(&arguments.job, None, terminal)?;
    let file = arguments.catalogue.display().to_string();
    let catalogue = read_catalogue(&read_text(&arguments.catalogue)?, &file)?;
    terminal.progress("comparing tools");
    let job = &inputs.job;
    let tools: Vec<&Tool> = catalogue.iter().map(|entry| &entry.tool).collect();
    let tolerance = (job.part.overcut_tolerance, job.part.undercut_tolerance);
    let prospects = prospects(&inputs.part, &tools, &job.strategy, tolerance, job.feed.cut)?;
    let ranked: Vec<Ranked<'_>> = ranking(&prospects)
        .into_iter()
        .map(|i| {
            let CatalogueEntry { name, tool } = &catalogue[i];
            Ranked { name, number: tool.number, kind: &tool.kind, prospect: &prospects[i] }
        })
        .collect();
    let mut text = String::from("rank  error mm  strips   time s  limited by    tool\n");
    for (i, ranked) in ranked.iter().enumerate() {
        let Prospect { error_mm, strips, time_s, limited_by } = ranked.prospect;
        let number = |value: Option<f64>, digits: usize| value.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
        let limit = match limited_by {
            Limit::FluteLength => "flute length",
            Limit::Curvature => "curvature",
            Limit::None => "nothing",
            Limit::TooBig => "too big",
        };
        let strips = strips.map_or("-".to_owned(), |count| count.to_string());
        text += &format!(
            "{:<4}  {:>8}  {strips:>6}  {:>7}  {limit:<12}  {}\n",
            i + 1,
            number(*error_mm, 5),
            number(*time_s, 1),
            ranked.name
        );
    }
    if let Some(path) = &arguments.json {
        let mut outputs = Outputs::default();
        outputs.add(path.clone(), to_json(&Ranking { format: "regulus-tools", version: 1, tools: ranked })?);
        outputs.write()?;
    }
    terminal.print(&text);
    Ok(Outcome::Good)
}
