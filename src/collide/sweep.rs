//! Motions of a tool between two instants, and how far they can carry a convex piece of it.

use super::solid::Piece;
use crate::geometry::{Point, Vector};
use crate::motion::Pose;

/// A continuous motion of the tool over shares 0 to 1, part frame.
pub trait Sweep: Sync {
    /// The pose at a share.
    fn pose(&self, share: f64) -> Pose;

    /// Bound on how far the axis point at `height` mm above the tip leaves the even motion along the straight chord
    /// between its places at the shares `from` and `to`, mm. Must be convex in the height, and vanish faster than
    /// `to - from`.
    fn chord_bound(&self, from: f64, to: f64, height: f64) -> f64;
}

/// Tip on a straight line at even speed, axis on the great circle at even speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// Pose at share 0.
    pub from: Pose,
    /// Pose at share 1.
    pub to: Pose,
}

impl Sweep for Leg {
    fn pose(&self, share: f64) -> Pose {
        self.from.interpolate(&self.to, share)
    }

    /// The axis point runs on an arc of radius `height` over the angle w: it leaves its chord by at most
    /// height w² / 8.
    fn chord_bound(&self, from: f64, to: f64, height: f64) -> f64 {
        height.abs() * (self.from.axis_angle(&self.to) * (to - from)).powi(2) / 8.0
    }
}

/// A stretch of a sweep, seen from its middle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    pub(super) from: f64,
    pub(super) to: f64,
    start: Pose,
    middle: Pose,
    end: Pose,
    /// Bound on the change of the axis direction from the middle.
    turn: f64,
}

impl Interval {
    /// `length` is that of the whole tool, mm.
    pub(super) fn new(sweep: &impl Sweep, from: f64, to: f64, length: f64) -> Self {
        let (start, end) = (sweep.pose(from), sweep.pose(to));
        // The axis is the difference of two axis points over their distance, and so are its deviations.
        let bend = (sweep.chord_bound(from, to, 0.0) + sweep.chord_bound(from, to, length)) / length;
        let turn = 0.5 * (end.axis.into_inner() - start.axis.into_inner()).norm() + 2.0 * bend;
        Self { from, to, start, middle: sweep.pose(0.5 * (from + to)), end, turn }
    }

    pub(super) fn halves(&self) -> [(f64, f64); 2] {
        let middle = self.share(0.0);
        [(self.from, middle), (middle, self.to)]
    }

    /// The share of the sweep at a place of the interval, -1 at its start, 1 at its end.
    pub(super) fn share(&self, place: f64) -> f64 {
        0.5 * ((1.0 - place) * self.from + (1.0 + place) * self.to)
    }
}

/// A convex piece of the tool during an interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct MovingPiece<'a> {
    piece: &'a Piece,
    /// Pose half way.
    pose: Pose,
    /// Half the chords of the axis points at both ends of the piece, and their mean.
    chords: [Vector; 2],
    drift: Vector,
    /// Bound on how far these points leave the even motion along their chords, twice.
    bend: f64,
    turn: f64,
}

/// Lower bound on the signed distance of a moving piece from every point of a convex set at every instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound {
    /// Never undercut, mm.
    pub(super) least: f64,
    /// What the size of the set takes from the bound, mm.
    pub(super) spread: f64,
    /// What the motion takes from it, mm.
    pub(super) moved: f64,
    /// Where in the interval the piece is about nearest to the point, -1 to 1.
    pub(super) place: f64,
}

/// Halvings that look for the nearest place of the piece along its drift.
const PLACE_STEPS: usize = 12;

impl<'a> MovingPiece<'a> {
    pub(super) fn new(sweep: &impl Sweep, piece: &'a Piece, interval: &Interval) -> Self {
        let heights = [piece.low.height, piece.high.height];
        let bends = heights.map(|h| 2.0 * sweep.chord_bound(interval.from, interval.to, h));
        let chords = heights.map(|h| (interval.end.at_height(h) - interval.start.at_height(h)) * 0.5);
        Self {
            piece,
            pose: interval.middle,
            chords,
            drift: (chords[0] + chords[1]) * 0.5,
            bend: bends[0].max(bends[1]),
            turn: interval.turn,
        }
    }

    /// The bound for a convex set, from the distance and the support plane at one of its points.
    ///
    /// The reference is the piece as it is half way, shifted along its drift to where it is about nearest to the
    /// point: then the plane lies along the drift, or the place is an end of the interval, and the motion takes little.
    /// `spread` is the largest value of `normal . (point - x)` over the points x of the set. A bound at or above
    /// `ceiling` is not made tighter.
    pub(super) fn bound(&self, point: &Point, ceiling: f64, spread: impl Fn(&Vector) -> f64) -> Bound {
        let at_place = |place: f64| {
            let signed = self.piece.signed(&self.pose, &(point - self.drift * place));
            let (spread, moved) = (spread(&signed.normal), self.moved(&signed.normal, place));
            let rising = signed.normal.dot(&self.drift) < 0.0;
            (Bound { least: signed.distance - spread - moved, spread, moved, place }, rising)
        };
        let (mut best, rising) = at_place(0.0);
        if best.least >= ceiling || self.drift == Vector::zeros() {
            return best;
        }
        // The distance is convex in the place: its slope, the negative of normal . drift, changes its sign once.
        let (mut low, mut high) = if rising { (-1.0, 0.0) } else { (0.0, 1.0) };
        let outer = at_place(if rising { -1.0 } else { 1.0 });
        if outer.0.least > best.least {
            best = outer.0;
        }
        if outer.1 != rising {
            for _ in 0..PLACE_STEPS {
                let middle = 0.5 * (low + high);
                let (bound, rising) = at_place(middle);
                if bound.least > best.least {
                    best = bound;
                }
                if rising {
                    high = middle;
                } else {
                    low = middle;
                }
            }
        }
        best
    }

    /// Bound on how far any point of the piece moves along the unit vector `n` during the interval, from the reference
    /// at `place`, mm.
    ///
    /// A point is an axis point at a height between both ends, plus a vector u across the axis, |u| <= radius. The
    /// motion of axis points is linear in the height, so the larger of both ends bounds it. The least rotation that
    /// takes the axis a to b = a + D turns u into u - (u.b) (a + b) / (1 + a.b), so
    /// n.(change of u) <= radius |D| (|n.a| + |D| / 2) / (1 - |D|² / 4).
    fn moved(&self, n: &Vector, place: f64) -> f64 {
        let chord = self.chords.iter().map(|c| n.dot(c).abs()).fold(0.0, f64::max) - place * n.dot(&self.drift);
        if self.turn == 0.0 {
            return chord + self.bend;
        }
        if self.turn >= 1.0 {
            return f64::INFINITY;
        }
        let across = n.dot(&self.pose.axis).abs() + 0.5 * self.turn;
        chord + self.bend + self.piece.radius * self.turn * across / (1.0 - 0.25 * self.turn * self.turn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Direction;
    use crate::tool::{CutterShape, Fixture, Tool};
    use proptest::prelude::*;

    fn pose() -> impl Strategy<Value = Pose> {
        prop::array::uniform6(-1.0..1.0f64).prop_map(|[a, b, c, d, e, f]| Pose {
            tip: Point::new(20.0 * a, 20.0 * b, 20.0 * c),
            axis: Direction::new_normalize(Vector::new(0.6 * d, 0.6 * e, 1.2 + 0.4 * f)),
        })
    }

    proptest! {
        /// At any instant of an interval, any point keeps at least the bound.
        #[test]
        fn no_instant_undercuts_the_bound(
            from in pose(), to in pose(), start in 0.0..1.0f64, width in 0.0..1.0f64, inner in 0.0..1.0f64,
            point in prop::array::uniform3(-40.0..60.0f64)
        ) {
            let shape = CutterShape::Cylinder { diameter: 10.0, corner_radius: 5.0, flute_length: 20.0 };
            let fixture = Fixture { shank_diameter: Some(14.0), gauge_length: 60.0, holder: vec![] };
            let solid = super::super::ToolSolid::of(&Tool::new(1, &shape, &fixture).unwrap());
            let leg = Leg { from, to };
            let end = start + (1.0 - start) * width;
            let interval = Interval::new(&leg, start, end, solid.length);
            let (point, instant) = (Point::from(point), leg.pose(start + (end - start) * inner));
            for (_, piece) in &solid.pieces {
                let bound = MovingPiece::new(&leg, piece, &interval).bound(&point, f64::INFINITY, |_| 0.0);
                prop_assert!(piece.signed(&instant, &point).distance >= bound.least - 1e-9);
            }
        }
    }
}
