//! What stands and moves on the machine of a job or of a program, for whoever must stay clear of it.

use super::Inputs;
use crate::diagnostic::Result;
use crate::geometry::Point;
use crate::machine::{Link, Scene, Setup};
use crate::part::DesignSurface;
use crate::tool::Tool;

/// Samples of a part's surface that bodies of the machine must stay clear of.
const SAMPLES: f64 = 20_000.0;

/// Bodies of the machine, fixtures, the tool, and where anything could come near it, the part.
pub(super) fn scene_of_job(inputs: &Inputs, setup: &Setup, tool: &Tool) -> Result<Scene> {
    let scene = stands(inputs, setup)?.with_tool(tool);
    let moves = |link: Link| !matches!(link, Link::Base | Link::Table);
    if !setup.machine().bodies.iter().any(|body| moves(body.link)) {
        return Ok(scene);
    }
    let part = &inputs.part;
    let surfaces = std::iter::once(&part.surface).chain(&part.body).chain(&part.check);
    Ok(scene.with_part(&surfaces.flat_map(triangles).collect::<Vec<_>>()))
}

/// Bodies of the machine, fixtures and the tool, or its axis as long as the tool is not found.
pub(super) fn stands_of_job(inputs: &Inputs, setup: &Setup) -> Result<Scene> {
    let scene = stands(inputs, setup)?;
    Ok(match inputs.tool() {
        Ok(tool) => scene.with_tool(tool),
        Err(_) => scene.with_tool_axis(),
    })
}

fn stands(inputs: &Inputs, setup: &Setup) -> Result<Scene> {
    Scene::new(setup)?.with_fixtures(inputs.fixtures())
}

/// Bodies of the machine, and the axis of a tool of which only the length is known.
pub(super) fn scene_of_machine(setup: &Setup) -> Result<Scene> {
    Ok(Scene::new(setup)?.with_tool_axis())
}

fn triangles(surface: &DesignSurface) -> Vec<[Point; 3]> {
    let grid = surface.sample((surface.area() / SAMPLES).sqrt().max(1e-3));
    let corner = |index: u32| grid.samples.get(index as usize).map(|sample| sample.point);
    grid.triangles.iter().filter_map(|[a, b, c]| Some([corner(*a)?, corner(*b)?, corner(*c)?])).collect()
}
