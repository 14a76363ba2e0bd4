//! Where a straight line enters the body of a tool: closed form per meridian element (frustum and sphere by quadratics,
//! torus by a monotone Newton iteration on a convex function, hollow arcs by a certified bisection). Uses `geometry`
//! and `motion`.

use super::body::{Body, Piece, Profile, Span};
use crate::geometry::{Direction, Point};
use crate::motion::Pose;

/// Newton and bisection steps; both end long before.
const STEPS: usize = 200;

/// A sample of the part with its outward unit normal: the line `origin + lambda normal`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalRay {
    /// Point of the part, part frame, mm.
    pub origin: Point,
    /// Out of the material.
    pub normal: Direction,
}

/// The line seen from a tool: height and squared radius as polynomials of lambda.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalRay {
    /// Height above the tip at lambda 0, and its rate.
    height: [f64; 2],
    /// Squared distance from the axis: `square[0] + 2 square[1] lambda + square[2] lambda^2`.
    square: [f64; 3],
}

/// The first point of a body on a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) lambda: f64,
    /// Height above the tip, mm.
    pub(super) height: f64,
    /// Outward unit normal of the body, in the half plane.
    pub(super) axial: f64,
    pub(super) radial: f64,
}

impl LocalRay {
    pub(super) fn new(ray: &NormalRay, pose: &Pose) -> Self {
        let offset = ray.origin - pose.tip;
        let height = [offset.dot(&pose.axis), ray.normal.dot(&pose.axis)];
        let radial = offset - pose.axis.into_inner() * height[0];
        let rate = ray.normal.into_inner() - pose.axis.into_inner() * height[1];
        Self { height, square: [radial.norm_squared(), radial.dot(&rate), rate.norm_squared()] }
    }

    pub(super) fn height(&self, lambda: f64) -> f64 {
        self.height[0] + lambda * self.height[1]
    }

    fn square(&self, lambda: f64) -> f64 {
        (self.square[0] + lambda * (2.0 * self.square[1] + lambda * self.square[2])).max(0.0)
    }

    pub(super) fn radius(&self, lambda: f64) -> f64 {
        self.square(lambda).sqrt()
    }

    /// The part of `[low, high]` whose heights lie in a slab.
    fn clip(&self, low: f64, high: f64, slab: (f64, f64)) -> Option<(f64, f64)> {
        let rate = self.height[1];
        let (first, last) = if rate.abs() < 1e-300 {
            let inside = (slab.0..=slab.1).contains(&self.height[0]);
            return inside.then_some((low, high));
        } else if rate > 0.0 {
            ((slab.0 - self.height[0]) / rate, (slab.1 - self.height[0]) / rate)
        } else {
            ((slab.1 - self.height[0]) / rate, (slab.0 - self.height[0]) / rate)
        };
        let (first, last) = (first.max(low), last.min(high));
        (first <= last).then_some((first, last))
    }
}

impl Body {
    /// The smallest lambda in `[low, high]` at which the line is in the body.
    pub(super) fn entry(&self, ray: &LocalRay, low: f64, high: f64) -> Option<Entry> {
        let mut first: Option<Entry> = None;
        for piece in &self.pieces {
            let limit = first.map_or(high, |e| e.lambda);
            if let Some(entry) = piece.entry(ray, low, limit)
                && first.is_none_or(|e| entry.lambda < e.lambda)
            {
                first = Some(entry);
            }
        }
        first
    }
}

impl Piece {
    pub(super) fn entry(&self, ray: &LocalRay, low: f64, high: f64) -> Option<Entry> {
        let (bottom, top) = (self.spans.first()?.low, self.spans.last()?.high);
        let whole = ray.clip(low, high, (bottom, top))?;
        let upward = ray.height[1] >= 0.0;
        let count = self.spans.len();
        for index in 0..count {
            let span = &self.spans[if upward { index } else { count - 1 - index }];
            let Some((from, to)) = ray.clip(whole.0, whole.1, (span.low, span.high)) else { continue };
            if let Some(lambda) = span.first_inside(ray, from, to) {
                return Some(self.describe(span, ray, lambda, whole.0, low));
            }
        }
        None
    }

    /// Names the surface at an entry: an end disc where the line comes in through one, the profile otherwise.
    fn describe(&self, span: &Span, ray: &LocalRay, lambda: f64, whole: f64, low: f64) -> Entry {
        let height = ray.height(lambda);
        let through_disc = lambda <= whole && whole > low && ray.radius(lambda) < span.radius_at(height) - 1e-9;
        let (axial, radial) =
            if through_disc { (-ray.height[1].signum(), 0.0) } else { span.normal_at(height, ray.radius(lambda)) };
        Entry { lambda, height, axial, radial }
    }
}

impl Span {
    /// The smallest lambda in `[from, to]`, whose heights all lie in this span, at which the line is in the body.
    fn first_inside(&self, ray: &LocalRay, from: f64, to: f64) -> Option<f64> {
        match self.profile {
            Profile::Line { radius, slope } => {
                // rho^2 <= r^2 with r = alpha + beta lambda, written about `from`.
                let alpha = radius + slope * (ray.height(from) - self.low);
                let beta = slope * ray.height[1];
                let square = [
                    ray.square(from) - alpha * alpha,
                    ray.square[1] + ray.square[2] * from - alpha * beta,
                    ray.square[2] - beta * beta,
                ];
                first_root(square, to - from).map(|step| from + step)
            }
            Profile::Bulge { height, radius: 0.0, arc } => {
                let lift = ray.height(from) - height;
                let square = [
                    ray.square(from) + lift * lift - arc * arc,
                    ray.square[1] + ray.square[2] * from + lift * ray.height[1],
                    ray.square[2] + ray.height[1] * ray.height[1],
                ];
                first_root(square, to - from).map(|step| from + step)
            }
            Profile::Bulge { height, radius, arc } => first_in_torus(ray, (height, radius, arc), from, to),
            Profile::Hollow { .. } => first_in_hollow(self, ray, from, to),
        }
    }
}

/// The smallest t in `[0, end]` with `c[0] + 2 c[1] t + c[2] t^2 <= 0`.
fn first_root(c: [f64; 3], end: f64) -> Option<f64> {
    if c[0] <= 0.0 {
        return Some(0.0);
    }
    let discriminant = c[1] * c[1] - c[0] * c[2];
    if discriminant < 0.0 {
        return None;
    }
    // Of the two roots c0 / k and k / c2 with k = -c1 + root (c1 < 0), the first is the smaller where c2 > 0; where
    // c2 <= 0 the other is negative. For c1 >= 0 only c2 < 0 leads inside, at k / c2.
    let root = discriminant.sqrt();
    let first = if c[1] < 0.0 {
        c[0] / (root - c[1])
    } else if c[2] < 0.0 {
        -(c[1] + root) / c[2]
    } else {
        return None;
    };
    (first <= end).then_some(first)
}

/// First point of a line inside the torus part `(max(rho - radius, 0))^2 + (h - height)^2 <= arc^2`.
///
/// The left side is a convex function of lambda (the square of a convex, nonnegative one, plus the square of a linear
/// one), so Newton's iteration from a point outside never passes the entry, and a rising slope outside means a miss.
fn first_in_torus(ray: &LocalRay, (height, radius, arc): (f64, f64, f64), from: f64, to: f64) -> Option<f64> {
    let mut lambda = from;
    for _ in 0..STEPS {
        let rho = ray.radius(lambda);
        let (out, lift) = ((rho - radius).max(0.0), ray.height(lambda) - height);
        let value = out * out + lift * lift - arc * arc;
        if value <= 1e-15 * arc * arc {
            return Some(lambda);
        }
        let rho_rate = if rho > 0.0 { (ray.square[1] + ray.square[2] * lambda) / rho } else { 0.0 };
        let slope = 2.0 * (out * rho_rate + lift * ray.height[1]);
        if slope >= 0.0 {
            return None;
        }
        let step = -value / slope;
        lambda += step;
        if lambda > to {
            return None;
        }
        if step <= 1e-15 * lambda.abs().max(1.0) {
            return Some(lambda);
        }
    }
    Some(lambda)
}

/// First point of a line inside a hollow span: bisection, dropping stretches where the distance to the surface is
/// certainly positive. With a hollow profile r(h) is convex, so `rho - r` is bounded below by a tangent of rho minus a
/// chord of r, a linear function.
fn first_in_hollow(span: &Span, ray: &LocalRay, from: f64, to: f64) -> Option<f64> {
    let outside = |lambda: f64| ray.radius(lambda) - span.radius_at(ray.height(lambda));
    if outside(from) <= 0.0 {
        return Some(from);
    }
    let mut stack = vec![(from, to)];
    while let Some((a, b)) = stack.pop() {
        let middle = 0.5 * (a + b);
        let rho = ray.radius(middle);
        let rate = if rho > 0.0 { (ray.square[1] + ray.square[2] * middle) / rho } else { 0.0 };
        let tangent = |lambda: f64| rho + rate * (lambda - middle);
        let clear = |lambda: f64| tangent(lambda) - span.radius_at(ray.height(lambda)) > 0.0;
        if clear(a) && clear(b) {
            continue;
        }
        if b - a < 1e-13 * b.abs().max(1.0) {
            return Some(b);
        }
        // Narrow touches below the resolution of the numbers end here too.
        if outside(b) <= 0.0 && b - a < 1e-12 {
            return Some(b);
        }
        stack.push((middle, b));
        stack.push((a, middle));
    }
    None
}
