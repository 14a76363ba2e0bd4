//! The design surface seen as a band to be milled: coordinate g runs across the strips from the tip's side to the
//! spindle's side, h runs along the cut. Both are 0..1 on the surface and go on past its edges (tangent extension).

use crate::geometry::{Point, SplineSurface, Vector};
use crate::part::OrientedSpline;

/// Which parameter of the surface plays which role.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    /// True: the cut runs along u, the tool's axis across it along v.
    pub(super) along_u: bool,
    /// True: the tip is at the high end of the crossing parameter.
    pub(super) tip_high: bool,
    /// True: the cut runs toward the low end of its parameter.
    pub(super) backward: bool,
}

/// A design surface with roles given to its parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chart<'a> {
    spline: &'a OrientedSpline,
    layout: Layout,
}

/// A surface point with its frame in chart coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Coordinates (g, h).
    pub(super) place: (f64, f64),
    /// The surface point, mm.
    pub(super) point: Point,
    /// Unit normal out of the material.
    pub(super) normal: Vector,
    /// Derivative of the point along g, mm per unit.
    pub(super) across: Vector,
    /// Derivative of the point along h, mm per unit.
    pub(super) along: Vector,
}

/// The closest surface point to a point in space.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChartFoot {
    /// Frame at the foot.
    pub(super) frame: Frame,
    /// Distance along the normal, mm: positive on the tool's side.
    pub(super) distance: f64,
}

impl Frame {
    /// True where the place is on the surface itself, not on its extension.
    pub(super) fn inside(&self) -> bool {
        self.within(0.0)
    }

    /// True where the place is on the surface or within `margin` of it, in chart coordinates.
    pub(super) fn within(&self, margin: f64) -> bool {
        let range = -margin..=1.0 + margin;
        range.contains(&self.place.0) && range.contains(&self.place.1)
    }

    /// Unit tangent perpendicular to the lines g = const, and the rate of g along it, 1/mm.
    pub(super) fn across_gauge(&self) -> Option<(Vector, f64)> {
        gauge(&self.across, &self.along)
    }

    /// Unit tangent perpendicular to the lines h = const, and the rate of h along it, 1/mm.
    pub(super) fn along_gauge(&self) -> Option<(Vector, f64)> {
        gauge(&self.along, &self.across)
    }
}

fn gauge(wanted: &Vector, other: &Vector) -> Option<(Vector, f64)> {
    let part = wanted - other * (wanted.dot(other) / other.norm_squared());
    let length = part.norm();
    (length > 1e-9).then(|| (part / length, 1.0 / length))
}

impl<'a> Chart<'a> {
    /// Gives roles to the parameters of `spline`.
    pub(super) fn new(spline: &'a OrientedSpline, layout: Layout) -> Self {
        Self { spline, layout }
    }

    fn surface(&self) -> &SplineSurface {
        self.spline.surface()
    }

    fn parameters(&self, (g, h): (f64, f64)) -> (f64, f64) {
        let g = if self.layout.tip_high { 1.0 - g } else { g };
        let h = if self.layout.backward { 1.0 - h } else { h };
        let (su, sv) = if self.layout.along_u { (h, g) } else { (g, h) };
        let [(u0, u1), (v0, v1)] = self.surface().domain();
        (u0 + su * (u1 - u0), v0 + sv * (v1 - v0))
    }

    fn place(&self, u: f64, v: f64) -> (f64, f64) {
        let [(u0, u1), (v0, v1)] = self.surface().domain();
        let (su, sv) = ((u - u0) / (u1 - u0), (v - v0) / (v1 - v0));
        let (g, h) = if self.layout.along_u { (sv, su) } else { (su, sv) };
        (if self.layout.tip_high { 1.0 - g } else { g }, if self.layout.backward { 1.0 - h } else { h })
    }

    fn frame_at(&self, u: f64, v: f64) -> Option<Frame> {
        let jet = self.surface().extended_jet(u, v);
        let normal = jet.normal()?.into_inner();
        let normal = if self.spline.flip() { -normal } else { normal };
        let [(u0, u1), (v0, v1)] = self.surface().domain();
        let (by_u, by_v) = (jet.su * (u1 - u0), jet.sv * (v1 - v0));
        let (across, along) = if self.layout.along_u { (by_v, by_u) } else { (by_u, by_v) };
        Some(Frame {
            place: self.place(u, v),
            point: jet.point,
            normal,
            across: if self.layout.tip_high { -across } else { across },
            along: if self.layout.backward { -along } else { along },
        })
    }

    /// The frame at chart coordinates; `None` where the surface has no normal.
    pub(super) fn frame(&self, place: (f64, f64)) -> Option<Frame> {
        let (u, v) = self.parameters(place);
        self.frame_at(u, v)
    }

    /// Normal curvature at a place of the surface, 1/mm, along `direction`: positive where the surface is hollow, as
    /// seen from the tool's side.
    pub(super) fn curvature(&self, place: (f64, f64), direction: &Vector) -> Option<f64> {
        let (u, v) = self.parameters(place);
        let value = self.surface().jet(u, v).curvature()?.normal_curvature(direction)?;
        Some(if self.spline.flip() { -value } else { value })
    }

    /// The foot of `p` on the extended surface, found from a place nearby.
    pub(super) fn foot(&self, p: &Point, near: (f64, f64)) -> Option<ChartFoot> {
        let foot = self.surface().closest_from(p, self.parameters(near));
        let frame = self.frame_at(foot.u, foot.v)?;
        let distance = (p - frame.point).dot(&frame.normal);
        distance.is_finite().then_some(ChartFoot { frame, distance })
    }
}
