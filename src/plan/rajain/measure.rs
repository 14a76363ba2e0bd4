//! What the emitted motion does to the part: its true envelope, sampled densely between the positions that the optimizer
//! saw, and the rest of the tool (Rajain 2023, Fig. 4). Uses `envelope`, `geometry`, `motion`, `part`, `tool` and the
//! rest of this method.

use super::sheet::{Foot, Place, Sheet, inside};
use crate::diagnostic::{Diagnostic, Result};
use crate::envelope::envelope_point;
use crate::geometry::{Point, Vector};
use crate::motion::{Pose, RuledMotion};
use crate::part::DesignSurface;
use crate::plan::Deviation;
use crate::tool::{Contact, Element, Tool};

/// Instants at which a strip is measured, for each position of the optimizer.
const FINER: usize = 4;
/// Heights of the flank at which it is measured.
const HEIGHTS: usize = 25;
/// Distance, mm, at which each element of flutes, shank and holder outside the engaged flank is sampled; each six times
/// at least, thirty at most.
const SPACING: f64 = 2.0;

/// The rest of the tool: what must not cut while the engaged part does.
#[derive(Clone, Debug)]
pub(super) struct Rest {
    /// Centre height and radius of spheres of the flutes below and above the engaged part.
    flutes: Vec<(f64, f64)>,
    /// Height and radius of points of shank and holder.
    body: Vec<(f64, f64)>,
}

impl Rest {
    /// Of a tool whose flank is engaged between two contact heights.
    pub(super) fn of(tool: &Tool, engaged: (f64, f64)) -> Self {
        let spheres = |contact: &Contact| (contact.sphere_height(), contact.sphere_radius());
        let shares = |element: &Element| {
            let count = (element.length() / SPACING).ceil().clamp(5.0, 30.0) as usize;
            (0..=count).map(move |k| k as f64 / count as f64)
        };
        let flutes = tool.flutes().iter().flat_map(|element| shares(element).map(|s| element.contact(s)));
        let outside = |c: &Contact| c.point.height < engaged.0 - 1e-9 || c.point.height > engaged.1 + 1e-9;
        let flutes = flutes.filter(|c| c.normal_radial > 1e-3 && outside(c)).map(|c| spheres(&c)).collect();
        let body = tool
            .body()
            .filter(|(_, element)| element.length() > 1e-9)
            .flat_map(|(_, element)| shares(element).map(|s| element.contact(s).point))
            .map(|point| (point.height, point.radius))
            .collect();
        Self { flutes, body }
    }

    /// Deepest entry into the part, mm, at a pose; not negative.
    fn gouge(&self, sheet: &Sheet<'_>, pose: &Pose, near: Place) -> Option<f64> {
        let mut deepest: f64 = 0.0;
        let mut near = near;
        for (height, radius) in &self.flutes {
            let foot = sheet.foot(&pose.at_height(*height), near)?;
            near = foot.frame.place;
            if inside(near) {
                deepest = deepest.max(radius - foot.distance);
            }
        }
        for (height, radius) in &self.body {
            let centre = pose.at_height(*height);
            let foot = sheet.foot(&centre, near)?;
            near = foot.frame.place;
            let side = sheet.foot(&toward(&centre, &pose.axis, *radius, &foot.frame.normal), near)?;
            if inside(side.frame.place) {
                deepest = deepest.max(-side.distance);
            }
        }
        Some(deepest)
    }

    /// True where flutes, shank or holder enter another surface deeper than `allowed` mm at a pose.
    fn enters(&self, surface: &DesignSurface, pose: &Pose, allowed: f64) -> bool {
        self.flutes.iter().chain(&self.body).any(|(height, radius)| {
            let foot = surface.foot(&pose.at_height(*height));
            !foot.past_edge && foot.signed_distance < radius - allowed
        })
    }
}

/// The point of a circle about the axis that is nearest the part.
fn toward(centre: &Point, axis: &Vector, radius: f64, normal: &Vector) -> Point {
    let across = normal - axis * normal.dot(axis);
    // Over a part that lies across the axis all of them are as near as the centre.
    across.try_normalize(1e-9).map_or(*centre, |across| centre - across * radius)
}

/// A strip's motion on the part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Subject<'a> {
    pub(super) sheet: Sheet<'a>,
    pub(super) tool: &'a Tool,
    /// Contact heights between which the flank is engaged.
    pub(super) engaged: (f64, f64),
    pub(super) rest: &'a Rest,
}

/// Measures a strip that starts over `place` and has `positions`.
pub(super) fn measure(
    subject: &Subject<'_>,
    motion: &RuledMotion,
    place: Place,
    positions: usize,
) -> Result<Deviation> {
    let Subject { sheet, tool, engaged, rest } = subject;
    let (start, end) = motion.domain();
    let instants = FINER * positions;
    let mut worst = Deviation::NONE;
    let mut near = vec![place; HEIGHTS];
    for j in 0..=instants {
        let t = start + (end - start) * j as f64 / instants as f64;
        let broken = || Diagnostic::error(format!("at parameter {t:.3} motion or surface is degenerate"));
        let rate = motion.pose_rate(t).ok_or_else(broken)?;
        for (k, near) in near.iter_mut().enumerate() {
            let height = engaged.0 + (engaged.1 - engaged.0) * k as f64 / (HEIGHTS - 1) as f64;
            let contact = tool.contact_at(height).ok_or_else(broken)?;
            let below = sheet.foot(&rate.pose.at_height(contact.sphere_height()), *near).ok_or_else(broken)?;
            *near = below.frame.place;
            // Where the motion leaves a height without an envelope of its own, its sphere tells at least how near it came.
            let foot = match envelope_point(&rate, &contact, &-below.frame.normal) {
                Ok(touch) => sheet.foot(&touch.point, *near).ok_or_else(broken)?,
                Err(_) => Foot { distance: below.distance - contact.sphere_radius(), ..below },
            };
            if inside(foot.frame.place) {
                worst.overcut = worst.overcut.max(-foot.distance);
                worst.undercut = worst.undercut.max(foot.distance);
                worst.samples += 1;
            }
        }
        worst.outside = worst.outside.max(rest.gouge(sheet, &rate.pose, near[HEIGHTS / 2]).ok_or_else(broken)?);
    }
    Ok(worst)
}

/// Positions of a strip at which flutes, shank or holder enter the part deeper than `allowed` mm, or a surface around it: the
/// distance check of Fig. 4.
pub(super) fn colliding(
    subject: &Subject<'_>,
    poses: &[(Pose, Place)],
    around: &[&DesignSurface],
    allowed: f64,
) -> usize {
    let Subject { sheet, rest, .. } = subject;
    let hits = |(pose, place): &&(Pose, Place)| {
        let gouges = rest.gouge(sheet, pose, *place).is_none_or(|depth| depth > allowed);
        gouges || around.iter().any(|surface| rest.enters(surface, pose, allowed))
    };
    poses.iter().filter(hits).count()
}

/// Normals of the part below the middle of the flank at both ends of a motion, for leads.
pub(super) fn end_normals(sheet: &Sheet<'_>, motion: &RuledMotion, places: (Place, Place)) -> Result<(Vector, Vector)> {
    let (start, end) = motion.domain();
    let at = |t: f64, place: Place| {
        let middle = nalgebra::center(&motion.lower.point(t), &motion.upper.point(t));
        sheet.foot(&middle, place).map(|Foot { frame, .. }| frame.normal).ok_or_else(|| {
            Diagnostic::error("the surface's extension has no normal where the tool leads in or out")
                .help("give a shorter [strategy] lead")
        })
    };
    Ok((at(start, places.0)?, at(end, places.1)?))
}

#[cfg(test)]
mod tests {
    use super::super::fixtures;
    use super::*;
    use crate::geometry::Direction;
    use crate::tool::{CutterShape, Fixture};

    #[test]
    fn a_shank_wider_than_the_flank_is_found_in_the_part_and_only_there() {
        let shape = CutterShape::Cylinder { diameter: 4.0, corner_radius: 0.0, flute_length: 5.0 };
        let fixture = Fixture { shank_diameter: Some(8.0), gauge_length: 30.0, holder: Vec::new() };
        let tool = Tool::new(1, &shape, &fixture).unwrap();
        let plate = fixtures::graph(40.0, 40.0, |_, _| 0.0);
        let sheet = Sheet::new(&plate);
        let rest = Rest::of(&tool, (0.0, 5.0));
        let subject = Subject { sheet, tool: &tool, engaged: (0.0, 5.0), rest: &rest };
        let pose = |y: f64| Pose { tip: Point::new(0.0, y, 2.0), axis: Direction::new_normalize(Vector::y()) };
        // The flank lies on the plate; the shank, from 5 mm above the tip, is 2 mm deep in it, or hangs over its edge.
        let at = |y: f64| colliding(&subject, &[(pose(y), (0.5, 0.5))], &[], 0.01);
        assert_eq!((at(0.0), at(14.9), at(15.1)), (1, 1, 0));
        let depth = rest.gouge(&sheet, &pose(0.0), (0.5, 0.5)).unwrap();
        assert!((depth - 2.0).abs() < 1e-9, "{depth}");
    }
}
