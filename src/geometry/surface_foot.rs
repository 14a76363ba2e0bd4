//! Closest points on B-spline surfaces: a tree over the Bezier patches, then Newton's method on the two orthogonality
//! equations (S - p)·Su = 0 and (S - p)·Sv = 0. Uses `surface`, `bvh` and `patch`.

use super::patch::{Patch, Rectangle};
use super::surface::{SplineSurface, SurfaceJet};
use super::{Point, Vector};

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
    /// The edge or corner that the point asked for lies beyond; none when the foot is perpendicular and inside.
    pub past_edge: Option<Boundary>,
}

const EVERYWHERE: Rectangle = [(f64::NEG_INFINITY, f64::INFINITY); 2];
/// Share of (surface size + distance) by which a foot may miss the perpendicular, in mm along the surface.
const PERPENDICULAR: f64 = 1e-12;
/// The same share, within which a point counts as above the edge and not beyond it.
const BEYOND: f64 = 1e-9;
/// The same share, for a last step after which no jet need be looked up: its square is what it leaves.
const SHORT_STEP: f64 = 1e-6;
const MAX_STEPS: usize = 40;
const MAX_HALVINGS: usize = 12;

impl SplineSurface {
    /// The closest point of the surface, edges and corners included. Exact up to rounding: every Bezier patch that could
    /// hold a closer point is searched.
    pub fn closest(&self, p: &Point) -> SurfaceFoot {
        let tree = self.tree();
        let mut best: Option<Descent> = None;
        tree.nearest(p, |patch, bound| {
            // A descent over the whole surface from the first patch gives a bound that spares most others.
            let known = *best.get_or_insert_with(|| {
                let start = middle(patch.rectangle());
                Descent::run(self, p, start, &self.domain(), tree.scale())
            });
            let bound = bound.min(known.value);
            if patch.distance_squared(p) >= bound {
                return bound;
            }
            let found = Descent::in_patch(self, p, patch, tree.scale(), &known);
            if found.value < bound {
                best = Some(found);
            }
            found.value.min(bound)
        });
        // A tree is never empty and every value is finite; the start of a descent is the answer of last resort.
        let best = best.unwrap_or_else(|| Descent::new(self, p, middle(&self.domain()), &self.domain()));
        best.foot(self, tree.scale())
    }

    /// The closest point near the parameters `near` on the tangentially extended surface
    /// ([`SplineSurface::extended_jet`]), so u and v may lie outside the domain; `past_edge` then says where. Starts the
    /// full search when the iteration from `near` does not converge.
    pub fn closest_from(&self, p: &Point, near: (f64, f64)) -> SurfaceFoot {
        let scale = self.tree().scale();
        let first = Descent::run(self, p, near, &EVERYWHERE, scale);
        if first.state == State::Minimum {
            return first.foot(self, scale);
        }
        let inside = self.closest(p);
        if inside.past_edge.is_none() {
            return inside;
        }
        let second = Descent::run(self, p, (inside.u, inside.v), &EVERYWHERE, scale);
        if second.state == State::Minimum { second.foot(self, scale) } else { inside }
    }

    /// Parameters and jet of the point of [`SplineSurface::closest_from`], from a place whose jet is known, for those who
    /// look again and again nearby: once the way left is so short that the jets along it differ by rounding only, the last
    /// step is taken on the jet at hand.
    pub fn place_closest_from(&self, p: &Point, near: &SurfacePlace) -> SurfacePlace {
        let scale = self.tree().scale();
        let start = Descent::at(*near, p);
        let found = start.fall::<true>(self, p, &EVERYWHERE, scale);
        if found.state == State::Minimum {
            return found.place();
        }
        let foot = self.closest_from(p, (near.u, near.v));
        self.place(foot.u, foot.v)
    }

    /// A place on the extended surface.
    pub fn place(&self, u: f64, v: f64) -> SurfacePlace {
        SurfacePlace { u, v, jet: self.extended_jet(u, v) }
    }
}

/// Parameters on the extended surface, with the jet there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePlace {
    /// Parameter.
    pub u: f64,
    /// Parameter.
    pub v: f64,
    /// Point and derivatives.
    pub jet: SurfaceJet,
}

fn middle([(u0, u1), (v0, v1)]: &Rectangle) -> (f64, f64) {
    ((u0 + u1) / 2.0, (v0 + v1) / 2.0)
}

/// How a descent ended, or what it may say of the place where it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Still falling.
    Falling,
    /// Perpendicular (or held by the rectangle), and the squared distance is convex there.
    Minimum,
    /// Perpendicular, but a maximum or a saddle of the distance.
    Stationary,
}

/// A place on the way down of f(u, v) = |E(u, v) - p|², E the extended surface.
#[derive(Clone, Copy, Debug)]
struct Descent {
    u: f64,
    v: f64,
    jet: SurfaceJet,
    /// E - p.
    offset: Vector,
    /// f.
    value: f64,
    state: State,
}

/// What Newton's method wants next.
struct Step {
    du: f64,
    dv: f64,
    /// Half the slope of f along the step; negative.
    slope: f64,
    /// Length on the surface, mm, of a step of Newton's in both parameters; infinite for any other.
    length: f64,
}

impl Descent {
    fn new(surface: &SplineSurface, p: &Point, (u, v): (f64, f64), limits: &Rectangle) -> Self {
        let [(u0, u1), (v0, v1)] = *limits;
        Self::at(surface.place(u.max(u0).min(u1), v.max(v0).min(v1)), p)
    }

    fn at(SurfacePlace { u, v, jet }: SurfacePlace, p: &Point) -> Self {
        let offset = jet.point - p;
        Self { u, v, jet, offset, value: offset.norm_squared(), state: State::Falling }
    }

    fn place(&self) -> SurfacePlace {
        SurfacePlace { u: self.u, v: self.v, jet: self.jet }
    }

    /// The end of a step that is the last, so short that second derivatives are the same there and what is left beyond it,
    /// of the order of its square, is rounding.
    fn ended(mut self, Step { du, dv, .. }: Step, p: &Point) -> Self {
        let SurfaceJet { point, su, sv, suu, suv, svv } = &mut self.jet;
        *point += *su * du + *sv * dv + (*suu * (du * du) + *svv * (dv * dv)) * 0.5 + *suv * (du * dv);
        *su += *suu * du + *suv * dv;
        *sv += *suv * du + *svv * dv;
        let end = Self::at(SurfacePlace { u: self.u + du, v: self.v + dv, jet: self.jet }, p);
        Self { state: State::Minimum, ..end }
    }

    /// Least distance inside one patch. Where the distance is convex over the patch, one descent finds it, and it is
    /// `known` when that minimum lies in the patch. Where it is not (p beyond the centres of curvature), several starts
    /// are taken.
    fn in_patch(surface: &SplineSurface, p: &Point, patch: &Patch, scale: f64, known: &Self) -> Self {
        let limits = patch.rectangle();
        let [(u0, u1), (v0, v1)] = *limits;
        let convex = patch.convex_from(p);
        let inside = (u0..=u1).contains(&known.u) && (v0..=v1).contains(&known.v);
        if convex && inside && known.state == State::Minimum {
            return *known;
        }
        let mut best = Self::run(surface, p, middle(limits), limits, scale);
        if convex && best.state == State::Minimum {
            return best;
        }
        let at = |a: f64, b: f64| (u0 + (u1 - u0) * a, v0 + (v1 - v0) * b);
        for a in [0.0, 0.5, 1.0] {
            for b in [0.0, 0.5, 1.0] {
                let other = Self::run(surface, p, at(a, b), limits, scale);
                if other.value < best.value {
                    best = other;
                }
            }
        }
        best
    }

    fn run(surface: &SplineSurface, p: &Point, start: (f64, f64), limits: &Rectangle, scale: f64) -> Self {
        Self::new(surface, p, start, limits).fall::<false>(surface, p, limits, scale)
    }

    /// Newton's method with halved steps, held inside `limits`; with `SHORT` its last step is taken as it is.
    fn fall<const SHORT: bool>(mut self, surface: &SplineSurface, p: &Point, limits: &Rectangle, scale: f64) -> Self {
        for _ in 0..MAX_STEPS {
            let tolerance = PERPENDICULAR * (scale + self.value.sqrt());
            let Some(step) = self.step(limits, tolerance) else {
                return self;
            };
            if SHORT && step.length <= SHORT_STEP * (scale + self.value.sqrt()) {
                return self.ended(step, p);
            }
            let Some(next) = self.advance(surface, p, limits, &step, scale) else {
                return self;
            };
            self = next;
        }
        self
    }

    /// The next step, or none at the end of the descent; then `state` says which end.
    fn step(&mut self, limits: &Rectangle, tolerance: f64) -> Option<Step> {
        let jet = &self.jet;
        let (gu, gv) = (self.offset.dot(&jet.su), self.offset.dot(&jet.sv));
        let [e, f, g] = [jet.su.norm_squared(), jet.su.dot(&jet.sv), jet.sv.norm_squared()];
        let [l, m, n] = self.hessian();
        let [(u0, u1), (v0, v1)] = *limits;
        let held = |x: f64, low: f64, high: f64, slope: f64| (x <= low && slope >= 0.0) || (x >= high && slope <= 0.0);
        let free_u = e > 0.0 && !held(self.u, u0, u1, gu);
        let free_v = g > 0.0 && !held(self.v, v0, v1, gv);
        let even_u = !free_u || gu.abs() <= tolerance * e.sqrt();
        let even_v = !free_v || gv.abs() <= tolerance * g.sqrt();
        if even_u && even_v {
            let convex = match (free_u, free_v) {
                (true, true) => self.convex(),
                (true, false) => l >= 0.0,
                (false, true) => n >= 0.0,
                (false, false) => true,
            };
            self.state = if convex { State::Minimum } else { State::Stationary };
            return None;
        }
        let mut length = f64::INFINITY;
        let (du, dv) = match (free_u, free_v) {
            (true, true) => {
                let determinant = l * n - m * m;
                if self.convex() && determinant > 1e-9 * l * n {
                    let (du, dv) = ((m * gv - n * gu) / determinant, (m * gu - l * gv) / determinant);
                    length = (jet.su * du + jet.sv * dv).norm();
                    (du, dv)
                } else {
                    // Gauss-Newton: the metric alone, damped so that nearly parallel derivatives do no harm.
                    let (e, g) = (e * (1.0 + 1e-9), g * (1.0 + 1e-9));
                    let determinant = e * g - f * f;
                    ((f * gv - g * gu) / determinant, (f * gu - e * gv) / determinant)
                }
            }
            (true, false) => (-gu / if l > 1e-6 * e { l } else { e }, 0.0),
            _ => (0.0, -gv / if n > 1e-6 * g { n } else { g }),
        };
        Some(Step { du, dv, slope: gu * du + gv * dv, length })
    }

    /// Halves the step until the distance falls; none when it does not.
    fn advance(&self, surface: &SplineSurface, p: &Point, limits: &Rectangle, step: &Step, scale: f64) -> Option<Self> {
        // Rounding of f, below which a true descent cannot be seen: coordinates of size `scale` are off by epsilon.
        let distance = self.value.sqrt();
        let rounding = 8.0 * f64::EPSILON * distance * (scale + distance);
        let mut share = 1.0;
        for _ in 0..MAX_HALVINGS {
            let next = Self::new(surface, p, (self.u + share * step.du, self.v + share * step.dv), limits);
            if next.value <= self.value + 2e-4 * share * step.slope + rounding {
                return Some(next);
            }
            share *= 0.5;
        }
        None
    }

    /// Half the second derivatives of f: Su·Su + (E - p)·Suu, and so on.
    fn hessian(&self) -> [f64; 3] {
        let jet = &self.jet;
        [
            jet.su.norm_squared() + self.offset.dot(&jet.suu),
            jet.su.dot(&jet.sv) + self.offset.dot(&jet.suv),
            jet.sv.norm_squared() + self.offset.dot(&jet.svv),
        ]
    }

    fn convex(&self) -> bool {
        let [l, m, n] = self.hessian();
        l > 0.0 && n > 0.0 && l * n > m * m
    }

    fn foot(&self, surface: &SplineSurface, scale: f64) -> SurfaceFoot {
        let distance = self.value.sqrt();
        let past_edge = self.past_edge(surface, BEYOND * (scale + distance));
        SurfaceFoot { u: self.u, v: self.v, point: self.jet.point, distance, past_edge }
    }

    /// Beyond a side: by the parameter on the extended surface, by the direction of the offset on the surface itself.
    fn past_edge(&self, surface: &SplineSurface, tolerance: f64) -> Option<Boundary> {
        let side = |x: f64, (low, high): (f64, f64), along: &Vector, sides: [Edge; 2]| -> Option<Edge> {
            let length = along.norm();
            // The offset runs from the point asked for to the foot, so it points inward where that point is beyond.
            let inward = if length > 0.0 { self.offset.dot(along) / length } else { 0.0 };
            if x <= low {
                return ((low - x) * length > tolerance || inward > tolerance).then_some(sides[0]);
            }
            (x >= high && ((x - high) * length > tolerance || -inward > tolerance)).then_some(sides[1])
        };
        let [u, v] = surface.domain();
        let edge_u = side(self.u, u, &self.jet.su, [Edge::LowU, Edge::HighU]);
        let edge_v = side(self.v, v, &self.jet.sv, [Edge::LowV, Edge::HighV]);
        match (edge_u, edge_v) {
            (Some(a), Some(b)) => Some(Boundary::Corner(a, b)),
            (Some(edge), None) | (None, Some(edge)) => Some(Boundary::Edge(edge)),
            (None, None) => None,
        }
    }
}

#[cfg(test)]
#[path = "surface_foot_tests.rs"]
mod tests;
