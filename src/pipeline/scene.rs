//! What stands and moves on the machine of a job or of a program, for whoever must stay clear of it.

use super::Inputs;
use crate::diagnostic::Result;
use crate::geometry::{Aabb, Point};
use crate::machine::{PART, Scene, Setup};
use crate::part::DesignSurface;
use crate::simulate::ToolMotion;
use crate::tool::Tool;
use crate::verify::{BodiesMet, bodies_met};

/// Samples of a part's surface that bodies of the machine must stay clear of.
const SAMPLES: f64 = 20_000.0;

/// What of the machine, the fixtures and the tool comes too near each other, and what of the machine too near the part.
pub(super) fn met_in_job(inputs: &Inputs, motion: &ToolMotion, tool: &Tool) -> Result<Vec<BodiesMet>> {
    let scene = stands(inputs, motion.setup())?.with_tool(tool);
    let part = &inputs.part;
    let surfaces = || std::iter::once(&part.surface).chain(&part.body).chain(&part.check);
    let bounds = surfaces().fold(Aabb::empty(), |sum, surface| sum.union(&surface.bounds()));
    // Most machines stay far from their parts: a box about it is enough to tell.
    let met = bodies_met(motion, &scene.clone().with_part_box(&bounds));
    if !met.iter().any(|one| one.names.iter().any(|name| name == PART)) {
        return Ok(met);
    }
    Ok(bodies_met(motion, &scene.with_part(&surfaces().flat_map(triangles).collect::<Vec<_>>())))
}

/// Bodies of the machine, fixtures and the tool, or its axis as long as the tool is not found; and of the finished part
/// what the path itself says nothing of.
pub(super) fn stands_of_job(inputs: &Inputs, setup: &Setup) -> Result<Scene> {
    let mut scene = stands(inputs, setup)?;
    if let Some(body) = &inputs.part.body {
        scene = scene.with_finished("finished part", &triangles(body), body.mesh());
    }
    for surface in &inputs.part.check {
        scene = scene.with_finished("check surface", &triangles(surface), surface.mesh());
    }
    Ok(match inputs.tool() {
        Ok(tool) => scene.with_tool(tool),
        Err(_) => scene.with_tool_axis(),
    })
}

fn stands(inputs: &Inputs, setup: &Setup) -> Result<Scene> {
    Scene::new(setup)?.with_fixtures(inputs.fixtures())
}

/// Bodies of the machine, and the axis of a tool of which only the length is known; nothing without a length, for then
/// nobody knows where the spindle stands.
pub(super) fn scene_of_machine(setup: &Setup) -> Result<Scene> {
    if setup.tool_length() == 0.0 {
        return Ok(Scene::empty(setup));
    }
    Ok(Scene::new(setup)?.with_tool_axis())
}

fn triangles(surface: &DesignSurface) -> Vec<[Point; 3]> {
    let grid = surface.sample((surface.area() / SAMPLES).sqrt().max(1e-3));
    let corner = |index: u32| grid.samples.get(index as usize).map(|sample| sample.point);
    grid.triangles.iter().filter_map(|[a, b, c]| Some([corner(*a)?, corner(*b)?, corner(*c)?])).collect()
}
