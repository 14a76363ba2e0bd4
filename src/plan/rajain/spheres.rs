//! The straight flank of a tool as the paper has it: two end spheres and the distance of their centres (Rajain 2023,
//! equations 1 and 2). Uses `diagnostic` and `tool`.

use crate::diagnostic::{Diagnostic, Result};
use crate::tool::{CutterShape, Element, Tool};

/// The engaged part of a cone or cylinder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cone {
    /// Radius of the sphere toward the tip, mm.
    pub(super) r1: f64,
    /// Radius of the sphere toward the spindle, mm.
    pub(super) r2: f64,
    /// Distance L of their centres, mm.
    pub(super) length: f64,
}

impl Cone {
    /// Distance of the lines in which it touches a plane along both end spheres: `sqrt(L^2 - (r2 - r1)^2)`.
    pub(super) fn distance(&self) -> f64 {
        (self.length * self.length - (self.r2 - self.r1).powi(2)).max(0.0).sqrt()
    }

    /// Radius at share `s` of the axis.
    pub(super) fn radius(&self, s: f64) -> f64 {
        self.r1 + (self.r2 - self.r1) * s
    }
}

/// A tool with a straight flank, and how much of it is engaged.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flank {
    /// The whole flank.
    whole: Cone,
    /// Height above the tip of its first sphere's centre, mm.
    height: f64,
    /// Contact heights of its ends, mm.
    contacts: (f64, f64),
    /// Engaged shares of the axis, from tip to spindle.
    engaged: (f64, f64),
}

impl Flank {
    /// The last piece of the flutes, which must be straight, from `engage_from` mm above the tip upward; of it the
    /// shares `engaged`.
    pub(super) fn of(tool: &Tool, engage_from: Option<f64>, engaged: (f64, f64)) -> Result<Self> {
        let Some(Element::Line { from, to }) =
            tool.flutes().last().filter(|e| e.end().height - e.start().height > 1e-9)
        else {
            return Err(Diagnostic::error("method \"rajain-2023\" mills with a straight flank, this tool has none")
                .help("use a cone or a cylinder, or [strategy] method = \"regulus\""));
        };
        let start = engage_from.unwrap_or(from.height).clamp(from.height, to.height);
        let ends = tool.contact_at(start).zip(tool.contact_at(to.height));
        let Some((low, high)) = ends.filter(|(low, high)| high.sphere_height() - low.sphere_height() > 1e-6) else {
            return Err(Diagnostic::error(format!("the tool has no flank above {start} mm to mill with"))
                .help("give a longer flute_length, or a smaller [strategy] engage_from"));
        };
        let whole = Cone {
            r1: low.sphere_radius(),
            r2: high.sphere_radius(),
            length: high.sphere_height() - low.sphere_height(),
        };
        Ok(Self { whole, height: low.sphere_height(), contacts: (start, to.height), engaged })
    }

    /// The engaged part.
    pub(super) fn engaged(&self) -> Cone {
        let (from, to) = self.engaged;
        Cone { r1: self.whole.radius(from), r2: self.whole.radius(to), length: self.whole.length * (to - from) }
    }

    /// Height above the tip of the engaged part's first sphere centre, mm.
    pub(super) fn engaged_height(&self) -> f64 {
        self.height + self.whole.length * self.engaged.0
    }

    /// Contact heights above the tip between which the flank is engaged, mm.
    pub(super) fn engaged_contacts(&self) -> (f64, f64) {
        // On a straight flank contacts go with the spheres in proportion.
        let at = |share: f64| self.contacts.0 + (self.contacts.1 - self.contacts.0) * share;
        (at(self.engaged.0), at(self.engaged.1))
    }

    /// The tool whose engaged part is `cone`: its radii and length carried on over the whole flank.
    pub(super) fn tool_with(&self, cone: &Cone, tool: &Tool) -> Result<Tool> {
        let (from, to) = self.engaged;
        let slope = (cone.r2 - cone.r1) / (to - from);
        let shape = CutterShape::EndSpheres {
            r1: cone.r1 - slope * from,
            r2: cone.r2 + slope * (1.0 - to),
            length: cone.length / (to - from),
        };
        tool.with_flutes(&shape).map_err(|e| {
            Diagnostic::error(format!("the tool that the method finds cannot be: {}", e.message))
                .help("leave less of it free in [strategy.rajain], or give a tool nearer to what the part needs")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixtures;
    use super::*;

    #[test]
    fn the_papers_cone_comes_back_and_half_of_it_is_half() {
        let tool = fixtures::cone();
        let whole = Flank::of(&tool, None, (0.0, 1.0)).unwrap().engaged();
        assert!((whole.r1 - 0.3).abs() < 1e-12 && (whole.r2 - 1.0).abs() < 1e-12, "{whole:?}");
        assert!((whole.length - 1.717).abs() < 1e-12);
        let upper = Flank::of(&tool, None, (0.5, 1.0)).unwrap();
        let half = upper.engaged();
        assert!((half.r1 - 0.65).abs() < 1e-12 && (half.length - 0.8585).abs() < 1e-12, "{half:?}");
        assert!((upper.tool_with(&half, &tool).unwrap().flute_length() - tool.flute_length()).abs() < 1e-12);
    }

    #[test]
    fn a_barrel_is_refused() {
        let shape = CutterShape::Barrel {
            diameter: 10.0,
            barrel_radius: 80.0,
            half_angle: crate::geometry::Degrees(0.0),
            corner_radius: 0.0,
            flute_length: 20.0,
        };
        let said = Flank::of(&fixtures::tool(&shape), None, (0.0, 1.0)).unwrap_err();
        assert!(said.message.contains("straight flank") && said.help.is_some());
    }
}
