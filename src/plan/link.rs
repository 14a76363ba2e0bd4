//! Everything between the cuts: lead-in and lead-out along the motion, retracts, and links through free space.
//!
//! Free space is the outside of a sphere around part and check surfaces. A link runs on a larger sphere with the tool
//! pointing away from its centre, so it is clear by construction; the ways in and out are tested all along.

use super::PlanRequest;
use super::chart::Chart;
use crate::collide::{Clearance, Leg, Move, Obstacle, Role, ToolSolid};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{Direction, Point, Vector};
use crate::motion::pose::{angle_between, great_circle};
use crate::motion::{Pass, PassKind, PassMotion, Pose, RuledMotion};
use crate::part::Part;
use crate::tool::Tool;

/// Surfaces that the tool must stay clear of, with a sphere around them.
struct Obstacles {
    surfaces: Vec<Obstacle>,
    centre: Point,
    radius: f64,
}

impl Obstacles {
    /// Triangles of the part's surfaces, fine against the stand-off that they are kept at.
    fn of(part: &Part) -> Option<Self> {
        let mut points: Vec<Point> = Vec::new();
        let mut surfaces = Vec::new();
        for surface in std::iter::once(&part.surface).chain(&part.body).chain(&part.check) {
            let grid = surface.sample((surface.area().sqrt() / 60.0).max(1e-3));
            let corners: Vec<Point> = grid.samples.iter().map(|s| s.point).collect();
            surfaces.push(Obstacle::new("surface", Role::Avoid, &corners, &grid.triangles).ok()?);
            points.extend(corners);
        }
        let first = points.first()?.coords;
        let (low, high) = points.iter().fold((first, first), |(l, h), p| (l.inf(&p.coords), h.sup(&p.coords)));
        let centre = Point::from((low + high) / 2.0);
        let radius = points.iter().map(|p| (p - centre).norm()).fold(0.0, f64::max);
        Some(Self { surfaces, centre, radius })
    }

    /// Least clearance of the whole tool on its way from pose to pose, mm, if below `margin`; negative where it enters
    /// a surface.
    fn clearance_below(&self, margin: f64, tool: &ToolSolid, (from, to): (&Pose, &Pose)) -> Option<f64> {
        let way = [Move { sweep: Leg { from: *from, to: *to }, cutting: false }];
        let resolution = 0.05 * margin;
        let near = Clearance { tool, obstacles: &self.surfaces, resolution }.below(&way, margin);
        near.iter().map(|approach| approach.clearance).min_by(f64::total_cmp)
    }
}

/// Sizes of the moves between cuts, mm.
#[derive(Clone, Copy, Debug)]
struct LinkSizes {
    /// Length of lead-in and lead-out.
    lead: f64,
    /// How far the tool stands off the surface before it leads in and after it leads out.
    stand_off: f64,
    /// Distance between the clearance sphere and everything inside.
    clearance: f64,
}

/// The poses around one cut.
struct Ways {
    outer_start: Pose,
    lateral_start: Pose,
    lead_start: Pose,
    start: Pose,
    end: Pose,
    lead_end: Pose,
    lateral_end: Pose,
    outer_end: Pose,
}

/// Leads, links and retracts around the strips of a plan, for a tool.
pub(super) fn passes(
    request: &PlanRequest<'_>,
    tool: &Tool,
    motions: &[RuledMotion],
    normals: &[(Vector, Vector)],
) -> Result<Vec<Pass>> {
    let obstacles = Obstacles::of(request.part).ok_or_else(|| Diagnostic::error("the part's surface has no points"))?;
    let sizes = LinkSizes {
        lead: request.strategy.lead.unwrap_or_else(|| tool.max_radius()),
        stand_off: request.strategy.stand_off.unwrap_or(2.0),
        clearance: 10.0,
    };
    link(motions, normals, tool, &obstacles, &sizes)
}

/// Joins motions over a chart of the part into passes, with the request's tool.
pub(super) fn chart_passes(request: &PlanRequest<'_>, chart: &Chart<'_>, motions: &[RuledMotion]) -> Result<Vec<Pass>> {
    let normal = |motion: &RuledMotion, t: f64| {
        let middle = nalgebra::center(&motion.lower.point(t), &motion.upper.point(t));
        chart.nearest(&middle).map(|foot| foot.frame.normal).ok_or_else(|| {
            Diagnostic::error("the surface's extension has no normal where the tool leads in or out")
                .help("give a shorter [strategy] lead")
        })
    };
    let ends = |motion: &RuledMotion| {
        let (start, end) = motion.domain();
        Ok((normal(motion, start)?, normal(motion, end)?))
    };
    let normals = motions.iter().map(ends).collect::<Result<Vec<_>>>()?;
    passes(request, request.tool, motions, &normals)
}

/// Joins the strips' motions, in order, into passes. `normals` are the outward normals at start and end of each strip.
fn link(
    strips: &[RuledMotion],
    normals: &[(Vector, Vector)],
    tool: &Tool,
    obstacles: &Obstacles,
    sizes: &LinkSizes,
) -> Result<Vec<Pass>> {
    let mut passes: Vec<Pass> = Vec::new();
    let mut before: Option<Pose> = None;
    for (index, (motion, normals)) in strips.iter().zip(normals).enumerate() {
        let strip = Some(index as u32);
        let ways = ways(motion, normals, tool, obstacles, sizes)
            .map_err(|d| Box::new(Diagnostic { message: format!("strip {}: {}", index + 1, d.message), ..*d }))?;
        let mut poses = |kind, poses: Vec<Pose>| passes.push(Pass { kind, strip, motion: PassMotion::Poses(poses) });
        let mut way_in = match before {
            None => vec![ways.outer_start],
            Some(pose) => over(&pose, &ways.outer_start, obstacles, sizes),
        };
        way_in.push(ways.lateral_start);
        poses(PassKind::Rapid, way_in);
        poses(PassKind::Approach, vec![ways.lateral_start, ways.lead_start]);
        poses(PassKind::LeadIn, vec![ways.lead_start, ways.start]);
        passes.push(Pass { kind: PassKind::Cut, strip, motion: PassMotion::Ruled(motion.clone()) });
        let mut poses = |kind, poses: Vec<Pose>| passes.push(Pass { kind, strip, motion: PassMotion::Poses(poses) });
        poses(PassKind::LeadOut, vec![ways.end, ways.lead_end]);
        poses(PassKind::Retract, vec![ways.lead_end, ways.lateral_end]);
        poses(PassKind::Rapid, vec![ways.lateral_end, ways.outer_end]);
        before = Some(ways.outer_end);
    }
    Ok(passes)
}

fn ways(
    motion: &RuledMotion,
    normals: &(Vector, Vector),
    tool: &Tool,
    obstacles: &Obstacles,
    sizes: &LinkSizes,
) -> Result<Ways> {
    let (first, last) = motion.domain();
    let degenerate = || Diagnostic::error("the fitted rails meet, so the tool has no axis there");
    let (start, lead_start) = lead(motion, first, -sizes.lead).ok_or_else(degenerate)?;
    let (end, lead_end) = lead(motion, last, sizes.lead).ok_or_else(degenerate)?;
    let (lateral_start, outer_start) = way_out(&lead_start, &normals.0, tool, obstacles, sizes)?;
    let (lateral_end, outer_end) = way_out(&lead_end, &normals.1, tool, obstacles, sizes)?;
    Ok(Ways { outer_start, lateral_start, lead_start, start, end, lead_end, lateral_end, outer_end })
}

/// The pose at `t`, and the one `way` mm farther along the path of the flank's middle. The axis is held: turning on at
/// the motion's rate could swing shank and flutes into the part beside the strip.
fn lead(motion: &RuledMotion, t: f64, way: f64) -> Option<(Pose, Pose)> {
    let rate = motion.pose_rate(t)?;
    let middle = (motion.upper.point(t) - motion.lower.point(t)).norm() / 2.0 + motion.lower_height;
    let tangent = Direction::try_new(rate.tip_rate + rate.axis_rate * middle, 1e-9)?;
    Some((rate.pose, Pose { tip: rate.pose.tip + tangent.into_inner() * way, axis: rate.pose.axis }))
}

/// Off the surface along its normal, then out of the clearance sphere along the tool's axis.
fn way_out(
    from: &Pose,
    normal: &Vector,
    tool: &Tool,
    obstacles: &Obstacles,
    sizes: &LinkSizes,
) -> Result<(Pose, Pose)> {
    let sphere = link_radius(tool, obstacles, sizes);
    let solid = ToolSolid::of(tool);
    let mut best = f64::NEG_INFINITY;
    for factor in [1.0, 2.0, 4.0, 8.0] {
        let lateral = Pose { tip: from.tip + normal * (sizes.stand_off * factor), axis: from.axis };
        let way = distance_to_sphere(&lateral, &obstacles.centre, sphere);
        let outer = Pose { tip: lateral.at_height(way), axis: lateral.axis };
        let Some(least) = obstacles.clearance_below(0.2 * sizes.stand_off, &solid, (&lateral, &outer)) else {
            return Ok((lateral, outer));
        };
        best = best.max(least);
    }
    Err(Diagnostic::error(format!(
        "the tool cannot leave along its axis without coming within {best:.3} mm of the part or a check surface"
    ))
    .help("give a longer lead, a smaller shank or holder, or turn the part so that the tool can leave freely"))
}

/// Radius of the sphere of tool tips on which links run.
fn link_radius(tool: &Tool, obstacles: &Obstacles, sizes: &LinkSizes) -> f64 {
    obstacles.radius + tool.body_radius() + sizes.clearance
}

/// How far a tip travels along its axis until it leaves a sphere around `centre`; 0 when it is outside already and
/// moving away.
fn distance_to_sphere(pose: &Pose, centre: &Point, radius: f64) -> f64 {
    let from = pose.tip - centre;
    let along = from.dot(&pose.axis);
    let root = along * along - from.norm_squared() + radius * radius;
    if root <= 0.0 { 0.0 } else { (root.sqrt() - along).max(0.0) }
}

/// From pose to pose outside the clearance sphere: up to the link sphere, over it, and down again.
fn over(from: &Pose, to: &Pose, obstacles: &Obstacles, sizes: &LinkSizes) -> Vec<Pose> {
    let radial = |pose: &Pose| Direction::try_new(pose.tip - obstacles.centre, 1e-9);
    let (Some(first), Some(last)) = (radial(from), radial(to)) else { return vec![*from, *to] };
    let steps = (angle_between(&first, &last).to_degrees() / 4.0).ceil().max(1.0) as usize;
    let reach = (from.tip - obstacles.centre).norm().max((to.tip - obstacles.centre).norm()) + 0.1 * sizes.clearance;
    let arc = |axis: &dyn Fn(f64, &Direction) -> Direction| -> Vec<Pose> {
        (0..=steps)
            .map(|i| {
                let share = i as f64 / steps as f64;
                let out = great_circle(&first, &last, share);
                Pose { tip: obstacles.centre + out.into_inner() * reach, axis: axis(share, &out) }
            })
            .collect()
    };
    let turned = arc(&|share, _| great_circle(&from.axis, &to.axis, share));
    let outward = |p: &Pose| (p.tip - obstacles.centre).dot(&p.axis) >= 0.0;
    let mut way = vec![*from];
    if turned.iter().all(outward) {
        way.extend(turned);
    } else {
        // Turning the axis outward first keeps the whole tool outside the sphere all the way.
        way.extend(arc(&|_, out| *out));
    }
    way.push(*to);
    way
}
