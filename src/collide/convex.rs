//! Convex pieces of rigid bodies by their support points, and how far two of them are apart.

use super::solid::Piece;
use crate::geometry::{Aabb, Point, RigidMotion, Vector};
use parry3d_f64::math::{Pose, Vector as Plain};
use parry3d_f64::query::details::contact_support_map_support_map_with_params;
use parry3d_f64::query::gjk::{GJKResult, VoronoiSimplex};
use parry3d_f64::shape::SupportMap;

/// A convex piece in the frame of its body, mm.
#[derive(Clone, Debug)]
pub(super) enum Convex {
    /// A solid of revolution: heights count from the foot along the unit axis.
    Round { foot: Point, axis: Vector, piece: Piece },
    /// A box along the axes.
    Box { centre: Point, half: Vector },
    /// A flat triangle.
    Triangle([Point; 3]),
}

impl Convex {
    /// The box around points.
    pub(super) fn around(bounds: &Aabb) -> Self {
        Self::Box { centre: bounds.centre(), half: (bounds.high - bounds.low) * 0.5 }
    }

    /// A point that lies farthest along `n`.
    pub(super) fn support(&self, n: &Vector) -> Point {
        match self {
            Self::Round { foot, axis, piece } => {
                let axial = axis.dot(n);
                let across = n - axis * axial;
                let radial = across.norm();
                let farthest = piece.support(axial, radial);
                // What rounding leaves across the axis has no direction of its own.
                let out = if radial > SHORT { across * (farthest.radius / radial) } else { Vector::zeros() };
                foot + axis * farthest.height + out
            }
            Self::Box { centre, half } => centre + half.zip_map(n, |half, n| half.copysign(n)),
            Self::Triangle(corners) => {
                let [a, b, c] = corners.map(|corner| n.dot(&corner.coords));
                if a >= b && a >= c {
                    corners[0]
                } else if b >= c {
                    corners[1]
                } else {
                    corners[2]
                }
            }
        }
    }

    /// The smallest box along the axes around it.
    pub(super) fn bounds(&self) -> Aabb {
        let farthest: [[Point; 2]; 3] = std::array::from_fn(|k| {
            let n = Vector::ith(k, 1.0);
            [self.support(&-n), self.support(&n)]
        });
        let [low, high] = [0, 1].map(|end| Point::from(Vector::from_fn(|k, _| farthest[k][end][k])));
        Aabb { low, high }
    }
}

/// A piece where a motion has brought it.
struct Placed<'a>(&'a Convex, &'a RigidMotion);

impl SupportMap for Placed<'_> {
    fn local_support_point(&self, direction: Plain) -> Plain {
        let n = self.1.inverse_transform_vector(&Vector::from(direction));
        (self.1 * self.0.support(&n)).coords.into()
    }
}

/// How far two pieces are apart: the length of the shortest way between them, or, negative, of the shortest way that
/// parts them; with the unit vector along it from `b` to `a`. `from_b` is a direction to begin with. What is returned is
/// the gap along that vector: the pieces are never nearer, even where the search for the best vector ends early, as it
/// does on curved pieces.
pub(super) fn separation(a: &Convex, motion: &RigidMotion, b: &Convex, from_b: &Vector) -> (f64, Vector) {
    let (still, start) = (RigidMotion::identity(), Some(Plain::from(*from_b)));
    let (first, second) = (Placed(b, &still), Placed(a, motion));
    let mut simplex = VoronoiSimplex::new();
    let found =
        contact_support_map_support_map_with_params(&Pose::IDENTITY, &first, &second, f64::MAX, &mut simplex, start);
    let gap = Gap { a, motion, b };
    let GJKResult::ClosestPoints(on_b, on_a, normal) = found else { return gap.widest(*from_b) };
    let (way, normal) = (Vector::from(on_a - on_b), Vector::from(normal));
    let tried = [way.try_normalize(SHORT), normal.try_normalize(SHORT)].into_iter().flatten();
    let along = |n: Vector| (gap.along(&n), n);
    let Some((apart, n)) = tried.map(along).reduce(|best, one| if one.0 > best.0 { one } else { best }) else {
        return gap.widest(*from_b);
    };
    let exact = (way.dot(&n) - apart).abs() < CONVERGED;
    if exact { (apart, n) } else { gap.widest(n) }
}

/// Vectors shorter than this have no direction.
const SHORT: f64 = 1e-9;
/// A gap that differs from the way between two points of the pieces by less is the distance, mm.
const CONVERGED: f64 = 1e-7;
/// Steps to a better direction.
const ROUNDS: usize = 60;
/// First step, as a share of the unit vector; how steps change when they succeed and when they fail.
const FIRST_STEP: f64 = 0.05;
const STEP_CHANGE: (f64, f64) = (1.6, 0.3);
/// Steps smaller than this change nothing.
const LAST_STEP: f64 = 1e-9;

/// Two pieces and the gap between them along a unit vector from `b` to `a`.
struct Gap<'a> {
    a: &'a Convex,
    motion: &'a RigidMotion,
    b: &'a Convex,
}

impl Gap<'_> {
    /// From the support point of `b` to that of `a`.
    fn way(&self, n: &Vector) -> Vector {
        self.motion * self.a.support(&-self.motion.inverse_transform_vector(n)) - self.b.support(n)
    }

    fn along(&self, n: &Vector) -> f64 {
        n.dot(&self.way(n))
    }

    /// The widest gap near a direction. The way between the support points is also the slope of the gap: it is climbed as
    /// long as the gap grows.
    fn widest(&self, n: Vector) -> (f64, Vector) {
        let mut way = self.way(&n);
        let (mut best, mut n, mut step) = (n.dot(&way), n, FIRST_STEP);
        for _ in 0..ROUNDS {
            let Some(uphill) = (way - n * n.dot(&way)).try_normalize(SHORT) else { break };
            let tried = (n + uphill * step).normalize();
            let there = self.way(&tried);
            if tried.dot(&there) > best {
                (best, n, way) = (tried.dot(&there), tried, there);
                step *= STEP_CHANGE.0;
            } else {
                step *= STEP_CHANGE.1;
            }
            if step < LAST_STEP {
                break;
            }
        }
        (best, n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_as_far_apart_as_their_faces_edges_and_corners() {
        let half = Vector::new(1.0, 2.0, 3.0);
        let one = Convex::Box { centre: Point::origin(), half };
        for (shift, truth) in [
            ([5.0, 0.0, 0.0], 3.0),
            ([5.0, 8.0, 0.5], 5.0),
            ([3.0, 5.0, 8.0], 6.0_f64.sqrt()),
            ([0.2, 0.1, 5.5], -0.5),
            ([-1.6, 0.3, 0.1], -0.4),
        ] {
            let motion = RigidMotion::translation(shift[0], shift[1], shift[2]);
            let (apart, n) = separation(&one, &motion, &one, &Vector::new(0.3, 0.2, 0.9).normalize());
            assert!((apart - truth).abs() < 1e-9, "{shift:?}: {apart} for {truth}");
            let gap = -one.support(&n).coords.dot(&n) + (motion * one.support(&-n)).coords.dot(&n);
            assert!((gap - apart).abs() < 1e-9);
        }
    }
}
