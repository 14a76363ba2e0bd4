//! The files of a found tool.

use super::files::Outputs;
use crate::job::{ToolSpec, write_tool};
use crate::pipeline::Inputs;
use crate::tool::Tool;
use crate::tool::export::{csv, dxf, stl};
use std::path::Path;

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
