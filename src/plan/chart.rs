//! The design surface seen as a band to be milled: coordinate g runs across the strips from the tip's side to the
//! spindle's side, h runs along the cut. Both are 0..1 on the surface and go on past its edges (tangent extension).

use super::field::Field;
use crate::geometry::extend::extended;
use crate::geometry::{Point, SplineSurface, SurfaceJet, SurfacePlace, Vector};
use crate::part::OrientedSpline;
use nalgebra::Matrix2;
use std::sync::Arc;

/// The lines g = const, h = const on the surface.
#[derive(Clone, Debug)]
pub(super) enum Lines {
    /// Parameter lines: the cut runs along u, the tool's axis across it along v.
    AlongU,
    /// Parameter lines: the cut runs along v.
    AlongV,
    /// Level sets of two fields.
    Field(Arc<Field>),
}

impl Lines {
    /// Parameter lines, with the cut along u or along v.
    pub(super) fn parameter(along_u: bool) -> Self {
        if along_u { Self::AlongU } else { Self::AlongV }
    }
}

/// Coordinate lines and their sense.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    /// The lines.
    pub(super) lines: Lines,
    /// True: the tip is at the high end of the lines' own g.
    pub(super) tip_high: bool,
    /// True: the cut runs toward the low end of the lines' own h.
    pub(super) backward: bool,
}

/// A design surface with coordinates across and along the cut.
#[derive(Clone, Debug)]
pub(super) struct Chart<'a> {
    spline: &'a OrientedSpline,
    layout: Layout,
    /// The surface with its end polynomials continued a little, so that it does not lose its curvature at its edges.
    wide: Option<Arc<SplineSurface>>,
}

/// How far a widened chart continues the end polynomials, as a share of the parameter intervals.
const WIDER: f64 = 0.02;
/// Share of the way to a foot that may lie along the surface before the foot is none.
const SQUARE: f64 = 0.05;
/// The same, mm, for points on the surface.
const SLIP: f64 = 1e-3;

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
    /// How far the place lies beyond the surface's edges, as a share of its parameter intervals; 0 on the surface.
    pub(super) beyond: f64,
    /// The same in mm along the extension.
    pub(super) off: f64,
}

/// The closest surface point to a point in space.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChartFoot {
    /// Frame at the foot.
    pub(super) frame: Frame,
    /// Distance along the normal, mm: positive on the tool's side. Where the surface and its extension have no
    /// perpendicular, the distance of its nearest edge.
    pub(super) distance: f64,
    /// Where on the surface it is, for a search nearby to start from.
    pub(super) at: SurfacePlace,
}

impl Frame {
    /// True where the place is on the surface itself, not on its extension.
    pub(super) fn inside(&self) -> bool {
        self.within(0.0)
    }

    /// True where the place is on the surface or within `margin` of it, as a share of its parameter intervals.
    pub(super) fn within(&self, margin: f64) -> bool {
        self.beyond <= margin
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
        Self { spline, layout, wide: None }
    }

    /// The same on a surface that goes on as its end polynomials do before it goes on along its tangents.
    pub(super) fn widened(self) -> Self {
        let wide = extended(self.spline.surface(), WIDER).map(Arc::new);
        Self { wide, ..self }
    }

    fn surface(&self) -> &SplineSurface {
        self.wide.as_deref().unwrap_or(self.spline.surface())
    }

    fn domain(&self) -> [(f64, f64); 2] {
        self.spline.surface().domain()
    }

    /// How far beyond its edges, as a share of its parameter intervals, the surface goes on like itself.
    pub(super) fn continued(&self) -> f64 {
        if self.wide.is_some() { 0.5 * WIDER } else { 0.0 }
    }

    /// Chart coordinates and those of the lines themselves are each other's mirror images.
    fn turned(&self, (g, h): (f64, f64)) -> (f64, f64) {
        (if self.layout.tip_high { 1.0 - g } else { g }, if self.layout.backward { 1.0 - h } else { h })
    }

    fn parameters(&self, place: (f64, f64), exact: bool) -> (f64, f64) {
        let (g, h) = self.turned(place);
        let (s, t) = match &self.layout.lines {
            Lines::AlongU => (h, g),
            Lines::AlongV => (g, h),
            Lines::Field(field) if exact => field.at((g, h)),
            Lines::Field(field) => field.near((g, h)),
        };
        let [(u0, u1), (v0, v1)] = self.domain();
        (u0 + s * (u1 - u0), v0 + t * (v1 - v0))
    }

    fn frame_at(&self, (u, v): (f64, f64), jet: &SurfaceJet) -> Option<Frame> {
        let normal = jet.normal()?.into_inner();
        let normal = if self.spline.flip() { -normal } else { normal };
        let [(u0, u1), (v0, v1)] = self.domain();
        let (by_s, by_t) = (jet.su * (u1 - u0), jet.sv * (v1 - v0));
        let (s, t) = ((u - u0) / (u1 - u0), (v - v0) / (v1 - v0));
        let (own, across, along) = match &self.layout.lines {
            Lines::AlongU => ((t, s), by_t, by_s),
            Lines::AlongV => ((s, t), by_s, by_t),
            Lines::Field(field) => {
                let (place, by) = field.jet((s, t));
                let back: Matrix2<f64> = by.try_inverse()?;
                let derivative = |k: usize| by_s * back[(0, k)] + by_t * back[(1, k)];
                (place, derivative(0), derivative(1))
            }
        };
        let (over_s, over_t) = (s - s.clamp(0.0, 1.0), t - t.clamp(0.0, 1.0));
        Some(Frame {
            place: self.turned(own),
            point: jet.point,
            normal,
            across: if self.layout.tip_high { -across } else { across },
            along: if self.layout.backward { -along } else { along },
            beyond: over_s.abs().max(over_t.abs()),
            off: (by_s * over_s + by_t * over_t).norm(),
        })
    }

    /// Least and greatest h on the surface between the lines g = `low` and g = `high`.
    pub(super) fn span(&self, low: f64, high: f64) -> (f64, f64) {
        let Lines::Field(field) = &self.layout.lines else { return (0.0, 1.0) };
        let ((a, _), (b, _)) = (self.turned((low, 0.0)), self.turned((high, 0.0)));
        let (first, last) = field.span(a.min(b), a.max(b)).unwrap_or((0.0, 1.0));
        let ((_, x), (_, y)) = (self.turned((0.0, first)), self.turned((0.0, last)));
        (x.min(y), x.max(y))
    }

    /// The frame at chart coordinates; `None` where the surface has no normal.
    pub(super) fn frame(&self, place: (f64, f64)) -> Option<Frame> {
        let (u, v) = self.parameters(place, true);
        self.frame_at((u, v), &self.surface().extended_jet(u, v))
    }

    /// Normal curvature at a place of the surface, 1/mm, along `direction`: positive where the surface is hollow, as
    /// seen from the tool's side.
    pub(super) fn curvature(&self, place: (f64, f64), direction: &Vector) -> Option<f64> {
        let (u, v) = self.parameters(place, true);
        let value = self.surface().jet(u, v).curvature()?.normal_curvature(direction)?;
        Some(if self.spline.flip() { -value } else { value })
    }

    /// The foot of `p` on the extended surface, found from a place nearby.
    pub(super) fn foot(&self, p: &Point, near: (f64, f64)) -> Option<ChartFoot> {
        self.foot_from(p, &self.seat(near))
    }

    /// Where a search may start that begins near chart coordinates.
    pub(super) fn seat(&self, near: (f64, f64)) -> SurfacePlace {
        let (u, v) = self.parameters(near, false);
        self.surface().place(u, v)
    }

    /// The foot of `p` on the extended surface, found from where another one nearby was.
    pub(super) fn foot_from(&self, p: &Point, near: &SurfacePlace) -> Option<ChartFoot> {
        self.foot_at(p, self.surface().place_closest_from(p, near))
    }

    /// The foot of `p` on the extended surface, nothing known.
    pub(super) fn nearest(&self, p: &Point) -> Option<ChartFoot> {
        let inside = self.surface().closest(p);
        self.foot_from(p, &self.surface().place(inside.u, inside.v))
    }

    fn foot_at(&self, p: &Point, at: SurfacePlace) -> Option<ChartFoot> {
        let frame = self.frame_at((at.u, at.v), &at.jet)?;
        let way = p - frame.point;
        let along_normal = way.dot(&frame.normal);
        // Off the surface's side there may be no perpendicular: then its edge is what is nearest.
        let slipped = (way - frame.normal * along_normal).norm() > SLIP + SQUARE * way.norm();
        let distance = if slipped { way.norm() } else { along_normal };
        distance.is_finite().then_some(ChartFoot { frame, distance, at })
    }
}
