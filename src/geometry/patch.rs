//! The Bezier patches of a B-spline surface, each in a slab-like oriented box around its control net (which holds the
//! patch: convex hull property, with positive weights too), and the tree over them. Uses `knots` and `bvh`.

use super::bvh::{Aabb, Bvh};
use super::knots::{Knots, MAX_DEGREE};
use super::{Point, Vector};

/// A patch is halved until the legs of its control net along one parameter turn less than this (cosine), so that its
/// box is thin and a search from its centre converges.
const LEG_TURN: f64 = 0.93;
/// Halvings per polynomial piece at most.
const MAX_HALVINGS: usize = 8;
/// Control points of a piece of the highest degree.
const MAX_NET: usize = (MAX_DEGREE + 1) * (MAX_DEGREE + 1);

/// A parameter rectangle, `[(u low, u high), (v low, v high)]`.
pub(super) type Rectangle = [(f64, f64); 2];

/// What a surface is made of: knots along u and v, control points row by row, weights in the same order.
#[derive(Clone, Copy)]
pub(super) struct Control<'a> {
    pub(super) knots: [&'a Knots; 2],
    pub(super) points: &'a [Point],
    pub(super) weights: Option<&'a [f64]>,
}

/// A piece of the surface, its parameter rectangle and an oriented box that holds it.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    rectangle: Rectangle,
    centre: Point,
    axes: [Vector; 3],
    half: Vector,
    /// Points of the patch closer to some p than this have a squared distance to p that is convex in (u, v).
    convex_within: f64,
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
    pub(super) fn distance_squared(&self, p: &Point) -> f64 {
        let offset = p - self.centre;
        let beyond = |k: usize| (offset.dot(&self.axes[k]).abs() - self.half[k]).max(0.0);
        let (x, y, z) = (beyond(0), beyond(1), beyond(2));
        x * x + y * y + z * z
    }

    /// Whether the squared distance from `p` is convex over the whole patch, so that one descent finds its least.
    pub(super) fn convex_from(&self, p: &Point) -> bool {
        (p - self.centre).norm() + self.half.norm() < self.convex_within
    }

    fn around(net: &Net, legs: &[Legs; 2], rectangle: Rectangle, rational: bool) -> Self {
        let axes = frame(&legs[0].mean, &legs[1].mean);
        let mut low = Vector::repeat(f64::INFINITY);
        let mut high = -low;
        for p in net.points() {
            let local = Vector::new(p.coords.dot(&axes[0]), p.coords.dot(&axes[1]), p.coords.dot(&axes[2]));
            (low, high) = (low.inf(&local), high.sup(&local));
        }
        let middle = (low + high) / 2.0;
        let centre = Point::from(axes[0] * middle.x + axes[1] * middle.y + axes[2] * middle.z);
        let exact = net.convexity_radius(legs);
        // The net of a rational piece bounds its derivatives only about; half of its radius is kept.
        let convex_within = if rational { exact / 2.0 } else { exact };
        Self { rectangle, centre, axes, half: (high - low) / 2.0, convex_within }
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
    /// The net of the piece of a surface on the knot spans `spans`, restricted to `rectangle` inside them.
    fn new(control: &Control<'_>, spans: [usize; 2], rectangle: &Rectangle) -> Self {
        let [knots_u, knots_v] = control.knots;
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
                        let w = control.weights.map_or(1.0, |w| w[start + b]) * row_share * column_share;
                        sum += control.points[start + b].coords * w;
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

    /// Rows of the net for side 0 (legs along u), columns for side 1, as a lookup of point k on line l.
    fn line(&self, side: usize, k: usize, l: usize) -> Point {
        if side == 0 { self.point(k, l) } else { self.point(l, k) }
    }

    fn size(&self, side: usize) -> usize {
        if side == 0 { self.rows } else { self.columns }
    }

    /// The legs along u (side 0) or v (side 1), gathered.
    fn legs(&self, side: usize) -> Legs {
        let (count, lines) = (self.size(side) - 1, self.size(1 - side));
        let leg = |k: usize, l: usize| self.line(side, k + 1, l) - self.line(side, k, l);
        let all = || (0..lines).flat_map(move |l| (0..count).map(move |k| (k, l)));
        let mean = all().fold(Vector::zeros(), |sum, (k, l)| sum + leg(k, l)) / (count * lines) as f64;
        let length = mean.norm();
        let (mut cosine, mut least) = (1.0f64, f64::INFINITY);
        for (k, l) in all() {
            let leg = leg(k, l);
            let along = leg.dot(&mean) / length;
            least = least.min(along);
            // At a pole a leg has no length and no direction.
            if leg.norm() > 1e-12 * length {
                cosine = cosine.min(along / leg.norm());
            }
        }
        Legs { mean, cosine, least }
    }

    /// A distance below which |S - p|² is convex. With the first derivatives at least U and V long and at most c the
    /// cosine between them, |a Su + b Sv|² >= (1 - c)(a² U² + b² V²); with the second derivatives at most M,
    /// |(S - p)·(a² Suu + 2ab Suv + b² Svv)| <= |S - p| k (a² U² + b² V²), k the greater eigenvalue of
    /// [Muu/U², Muv/UV; Muv/UV, Mvv/V²]. So (1 - c)/k serves. All bounds come from differences of the net.
    fn convexity_radius(&self, legs: &[Legs; 2]) -> f64 {
        let degrees = [self.rows as f64 - 1.0, self.columns as f64 - 1.0];
        let [u, v] = [degrees[0] * legs[0].least, degrees[1] * legs[1].least];
        let spread = legs[0].cosine.clamp(-1.0, 1.0).acos() + legs[1].cosine.clamp(-1.0, 1.0).acos();
        let between = legs[0].mean.angle(&legs[1].mean);
        let narrowest = between.min(std::f64::consts::PI - between) - spread;
        if !(u > 0.0 && v > 0.0 && narrowest > 0.0) {
            return 0.0;
        }
        let [muu, mvv] = [0, 1].map(|side| degrees[side] * (degrees[side] - 1.0) * self.bend(side));
        let mut twist = 0.0f64;
        for i in 1..self.rows {
            for j in 1..self.columns {
                let second =
                    self.point(i, j) - self.point(i - 1, j) - (self.point(i, j - 1) - self.point(i - 1, j - 1));
                twist = twist.max(second.norm());
            }
        }
        let (a, b, c) = (muu / (u * u), degrees[0] * degrees[1] * twist / (u * v), mvv / (v * v));
        let k = (a + c) / 2.0 + ((a - c) / 2.0).hypot(b);
        (1.0 - narrowest.cos()) / k
    }

    /// Longest second difference along one side.
    fn bend(&self, side: usize) -> f64 {
        let mut longest = 0.0f64;
        for l in 0..self.size(1 - side) {
            for k in 2..self.size(side) {
                let [a, b, c] = [k - 2, k - 1, k].map(|k| self.line(side, k, l));
                longest = longest.max(((c - b) - (b - a)).norm());
            }
        }
        longest
    }
}

/// The legs of a net along one parameter, gathered.
struct Legs {
    mean: Vector,
    /// Least cosine between a leg and the mean.
    cosine: f64,
    /// Least length of a leg along the mean.
    least: f64,
}

impl PatchTree {
    pub(super) fn new(control: &Control<'_>) -> Self {
        let mut patches = Vec::new();
        let mut boxes = Vec::new();
        for (span_u, u) in pieces(control.knots[0]) {
            for (span_v, v) in pieces(control.knots[1]) {
                divide(control, [span_u, span_v], [u, v], MAX_HALVINGS, &mut |net, patch| {
                    patches.push(patch);
                    boxes.push(Aabb::around(net.points()));
                });
            }
        }
        let scale = Aabb::around(control.points).diagonal();
        Self { tree: Bvh::new(&boxes), patches, scale }
    }

    /// Diagonal of the box around the surface's control points, mm.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    /// Visits the patches whose axis-aligned box lies within the bound, nearer ones first; see [`Bvh::nearest`].
    pub(super) fn nearest(&self, p: &Point, mut visit: impl FnMut(&Patch, f64) -> f64) {
        self.tree.nearest(p, f64::INFINITY, |index, bound| visit(&self.patches[index], bound));
    }
}

/// Knot spans of positive length inside the domain: index and interval.
fn pieces(knots: &Knots) -> impl Iterator<Item = (usize, (f64, f64))> {
    let values = knots.values();
    (knots.degree()..knots.controls()).map(|i| (i, (values[i], values[i + 1]))).filter(|(_, (a, b))| a < b)
}

/// Halves a piece across the direction in which its net turns more, until it is nearly flat.
fn divide(
    control: &Control<'_>,
    spans: [usize; 2],
    rectangle: Rectangle,
    halvings: usize,
    keep: &mut impl FnMut(&Net, Patch),
) {
    let net = Net::new(control, spans, &rectangle);
    let legs = [net.legs(0), net.legs(1)];
    if halvings == 0 || legs[0].cosine.min(legs[1].cosine) >= LEG_TURN {
        keep(&net, Patch::around(&net, &legs, rectangle, control.weights.is_some()));
        return;
    }
    let across = usize::from(legs[1].cosine < legs[0].cosine);
    let (low, high) = rectangle[across];
    let middle = (low + high) / 2.0;
    for half in [(low, middle), (middle, high)] {
        let mut part = rectangle;
        part[across] = half;
        divide(control, spans, part, halvings - 1, keep);
    }
}
