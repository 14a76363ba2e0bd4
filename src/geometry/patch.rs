//! The Bezier patches of a B-spline surface, each in a slab-like oriented box around its control net (which holds the
//! patch: convex hull property, with positive weights too), and the tree over them. Uses `surface`, `knots`, `bvh`.

use super::bvh::{Aabb, Bvh};
use super::knots::{Knots, MAX_DEGREE};
use super::surface::SplineSurface;
use super::surface_foot::Rectangle;
use super::{Point, Vector};

/// A patch is halved until the legs of its control net along one parameter turn less than this (cosine), so that its
/// box is thin and a search from its centre converges.
const LEG_TURN: f64 = 0.93;
/// Halvings per polynomial piece at most.
const MAX_HALVINGS: usize = 8;
/// Control points of a piece of the highest degree.
const MAX_NET: usize = (MAX_DEGREE + 1) * (MAX_DEGREE + 1);

/// A piece of the surface, its parameter rectangle and an oriented box that holds it.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    rectangle: Rectangle,
    centre: Point,
    axes: [Vector; 3],
    half: Vector,
}

/// All patches of a surface in a bounding volume hierarchy.
#[derive(Clone, Debug)]
pub(super) struct PatchTree {
    patches: Vec<Patch>,
    tree: Bvh,
    scale: f64,
}

impl Patch {
    pub(super) fn rectangle(&self) -> &Rectangle {
        &self.rectangle
    }

    /// Square of the distance from the oriented box.
    fn distance_squared(&self, p: &Point) -> f64 {
        let offset = p - self.centre;
        let beyond = |k: usize| (offset.dot(&self.axes[k]).abs() - self.half[k]).max(0.0);
        let (x, y, z) = (beyond(0), beyond(1), beyond(2));
        x * x + y * y + z * z
    }

    fn around(net: &Net, rectangle: Rectangle) -> Self {
        let points = net.points();
        let (i, j) = (net.rows - 1, net.columns - 1);
        let along_u = (net.point(i, 0) - net.point(0, 0)) + (net.point(i, j) - net.point(0, j));
        let along_v = (net.point(0, j) - net.point(0, 0)) + (net.point(i, j) - net.point(i, 0));
        let axes = frame(&along_u, &along_v);
        let mut low = Vector::repeat(f64::INFINITY);
        let mut high = -low;
        for p in points {
            let local = Vector::new(p.coords.dot(&axes[0]), p.coords.dot(&axes[1]), p.coords.dot(&axes[2]));
            (low, high) = (low.inf(&local), high.sup(&local));
        }
        let middle = (low + high) / 2.0;
        let centre = Point::from(axes[0] * middle.x + axes[1] * middle.y + axes[2] * middle.z);
        Self { rectangle, centre, axes, half: (high - low) / 2.0 }
    }
}

/// Orthonormal axes, the first along `first`, the last normal to both; any frame when they are degenerate.
fn frame(first: &Vector, second: &Vector) -> [Vector; 3] {
    let Some(x) = first.try_normalize(1e-300).or_else(|| second.try_normalize(1e-300)) else {
        return [Vector::x(), Vector::y(), Vector::z()];
    };
    let z = x.cross(second).try_normalize(1e-12 * second.norm()).unwrap_or_else(|| {
        // Any perpendicular: across the coordinate axis that x is least along.
        x.cross(&Vector::ith(x.iamin(), 1.0)).normalize()
    });
    [x, z.cross(&x), z]
}

/// Bezier control net of a piece, in fixed storage.
struct Net {
    rows: usize,
    columns: usize,
    store: [Point; MAX_NET],
}

impl Net {
    /// The net of the piece of `surface` on the knot spans `spans`, restricted to `rectangle` inside them.
    fn new(surface: &SplineSurface, spans: [usize; 2], rectangle: &Rectangle) -> Self {
        let (knots_u, knots_v) = (surface.knots_u(), surface.knots_v());
        let (p, q) = (knots_u.degree(), knots_v.degree());
        let [(u0, u1), (v0, v1)] = *rectangle;
        let (rows_u, rows_v) = (knots_u.bezier_rows(spans[0], u0, u1), knots_v.bezier_rows(spans[1], v0, v1));
        let mut net = Self { rows: p + 1, columns: q + 1, store: [Point::origin(); MAX_NET] };
        for (i, row) in rows_u.iter().enumerate().take(p + 1) {
            for (j, column) in rows_v.iter().enumerate().take(q + 1) {
                let (mut sum, mut weight) = (Vector::zeros(), 0.0);
                for (a, row_share) in row.iter().enumerate().take(p + 1) {
                    let start = (spans[0] - p + a) * knots_v.controls() + spans[1] - q;
                    for (b, column_share) in column.iter().enumerate().take(q + 1) {
                        let w = surface.weights().map_or(1.0, |w| w[start + b]) * row_share * column_share;
                        sum += surface.control()[start + b].coords * w;
                        weight += w;
                    }
                }
                net.store[i * (q + 1) + j] = Point::from(sum / weight);
            }
        }
        net
    }

    fn points(&self) -> &[Point] {
        &self.store[..self.rows * self.columns]
    }

    fn point(&self, i: usize, j: usize) -> Point {
        self.store[i * self.columns + j]
    }

    /// Least cosine between a leg of the net along u (v) and the mean of all legs along u (v); legs of no length (at a
    /// pole) do not count.
    fn leg_turns(&self) -> [f64; 2] {
        let legs_u = |k: usize| {
            let (i, j) = (k / self.columns, k % self.columns);
            self.point(i + 1, j) - self.point(i, j)
        };
        let legs_v = |k: usize| {
            let (i, j) = (k / (self.columns - 1), k % (self.columns - 1));
            self.point(i, j + 1) - self.point(i, j)
        };
        let turn = |count: usize, leg: &dyn Fn(usize) -> Vector| -> f64 {
            let mean = (0..count).fold(Vector::zeros(), |sum, k| sum + leg(k));
            (0..count).fold(1.0, |least: f64, k| {
                let leg = leg(k);
                let lengths = leg.norm() * mean.norm();
                if lengths > 1e-12 * mean.norm_squared() { least.min(leg.dot(&mean) / lengths) } else { least }
            })
        };
        [turn((self.rows - 1) * self.columns, &legs_u), turn(self.rows * (self.columns - 1), &legs_v)]
    }
}

impl PatchTree {
    pub(super) fn new(surface: &SplineSurface) -> Self {
        let mut patches = Vec::new();
        let mut boxes = Vec::new();
        for (span_u, u) in pieces(surface.knots_u()) {
            for (span_v, v) in pieces(surface.knots_v()) {
                divide(surface, [span_u, span_v], [u, v], MAX_HALVINGS, &mut |net, rectangle| {
                    patches.push(Patch::around(net, rectangle));
                    boxes.push(Aabb::around(net.points()));
                });
            }
        }
        let scale = surface.bounds().diagonal();
        Self { tree: Bvh::new(&boxes), patches, scale }
    }

    /// Diagonal of the box around the surface's control points, mm.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    /// Visits the patches that may hold a point closer than the bound, nearer ones first; see [`Bvh::nearest`].
    pub(super) fn nearest(&self, p: &Point, mut visit: impl FnMut(&Patch, f64) -> f64) {
        self.tree.nearest(p, f64::INFINITY, |index, bound| {
            let patch = &self.patches[index];
            if patch.distance_squared(p) >= bound { bound } else { visit(patch, bound) }
        });
    }
}

/// Knot spans of positive length inside the domain: index and interval.
fn pieces(knots: &Knots) -> impl Iterator<Item = (usize, (f64, f64))> {
    let values = knots.values();
    (knots.degree()..knots.controls()).map(|i| (i, (values[i], values[i + 1]))).filter(|(_, (a, b))| a < b)
}

/// Halves a piece across the direction in which its net turns more, until it is nearly flat.
fn divide(
    surface: &SplineSurface,
    spans: [usize; 2],
    rectangle: Rectangle,
    halvings: usize,
    keep: &mut impl FnMut(&Net, Rectangle),
) {
    let net = Net::new(surface, spans, &rectangle);
    let turns = net.leg_turns();
    if halvings == 0 || turns[0].min(turns[1]) >= LEG_TURN {
        keep(&net, rectangle);
        return;
    }
    let across = usize::from(turns[1] < turns[0]);
    let (low, high) = rectangle[across];
    let middle = (low + high) / 2.0;
    for half in [(low, middle), (middle, high)] {
        let mut part = rectangle;
        part[across] = half;
        divide(surface, spans, part, halvings - 1, keep);
    }
}
