//! Closest points on B-spline surfaces.

use super::Point;
use super::surface::SplineSurface;

/// One side of a parameter rectangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    /// Least u.
    LowU,
    /// Greatest u.
    HighU,
    /// Least v.
    LowV,
    /// Greatest v.
    HighV,
}

/// A part of the boundary of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundary {
    /// Inside one edge.
    Edge(Edge),
    /// Where an edge of least or greatest u (first) meets one of least or greatest v (second).
    Corner(Edge, Edge),
}

/// A closest point on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceFoot {
    /// Parameter.
    pub u: f64,
    /// Parameter.
    pub v: f64,
    /// The foot, mm.
    pub point: Point,
    /// Distance from the point asked for, mm, not negative.
    pub distance: f64,
    /// The edge or corner that the point asked for lies beyond; none when the foot is perpendicular.
    pub past_edge: Option<Boundary>,
}

/// Boxes around the Bezier patches of a surface.
#[derive(Clone, Debug)]
pub(super) struct PatchTree {}

impl PatchTree {
    pub(super) fn new(_surface: &SplineSurface) -> Self {
        Self {}
    }
}

impl SplineSurface {
    /// The closest point of the surface, edges and corners included.
    pub fn closest(&self, p: &Point) -> SurfaceFoot {
        let _ = (p, self.tree());
        unimplemented!()
    }

    /// The closest point near the parameters `near` on the tangentially extended surface, so u and v may lie outside
    /// the domain. Starts the full search when the iteration from `near` does not converge.
    pub fn closest_from(&self, p: &Point, near: (f64, f64)) -> SurfaceFoot {
        let _ = (p, near);
        unimplemented!()
    }
}
