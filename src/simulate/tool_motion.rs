//! The motion a program makes: segments in time, each exact between its ends.

use super::Chain;
use crate::geometry::Point;
use crate::machine::AxisPosition;
use crate::motion::Pose;

/// Whether the program feeds or goes as fast as it can.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SegmentKind {
    /// Rapid traverse.
    Rapid,
    /// At a programmed feed: cuts, or may cut.
    Feed,
}

/// How the control gets from one end of a segment to the other. The rotary axes turn linearly with the share in every
/// case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Path {
    /// Every axis moves linearly (TCP off).
    Joints,
    /// The tip moves on a straight line of the part frame (TCP on).
    Tip {
        /// Where the tip starts, part frame, mm.
        from: Point,
        /// Where it ends.
        to: Point,
    },
}

/// One move of the program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Line of the program, from 1.
    pub line: usize,
    /// Rapid or feed.
    pub kind: SegmentKind,
    /// When it begins, s from the first move.
    pub start: f64,
    /// How long it takes, s.
    pub duration: f64,
    /// Axes at its beginning.
    pub from: AxisPosition,
    /// Axes at its end.
    pub to: AxisPosition,
    /// The way between.
    pub path: Path,
}

/// Everything a program makes the tool do, in the part frame.
#[derive(Clone, Debug)]
pub struct ToolMotion {
    chain: Chain,
    segments: Vec<Segment>,
}

impl ToolMotion {
    /// Joins a chain and what moves on it.
    pub fn new(chain: Chain, segments: Vec<Segment>) -> Self {
        Self { chain, segments }
    }

    /// The segments in order of time; each starts where the one before ends, unless a finding says that it jumps.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Time at which the last segment ends, s.
    pub fn duration(&self) -> f64 {
        self.segments.last().map_or(0.0, |last| last.start + last.duration)
    }

    /// Tool pose in the part frame at `share` (0 to 1) of `segment`, exactly as the control interpolates.
    pub fn pose(&self, segment: &Segment, share: f64) -> Pose {
        let rotary = interpolate(&segment.from, &segment.to, share).rotary;
        match segment.path {
            Path::Joints => self.chain.pose(&interpolate(&segment.from, &segment.to, share)),
            Path::Tip { from, to } => Pose { tip: from + (to - from) * share, axis: self.chain.axis(rotary) },
        }
    }

    /// Axis positions at `share` (0 to 1) of `segment`.
    pub fn axes(&self, segment: &Segment, share: f64) -> AxisPosition {
        match segment.path {
            Path::Joints => interpolate(&segment.from, &segment.to, share),
            Path::Tip { .. } => {
                let rotary = interpolate(&segment.from, &segment.to, share).rotary;
                AxisPosition { linear: self.chain.linear_for(self.pose(segment, share).tip, rotary), rotary }
            }
        }
    }

    /// Bound on how far the axis point at `height` mm above the tip leaves the straight chord between its places at
    /// the shares `from` and `to` of `segment`, mm. The chord bound is convex in the height, so for a stretch of the
    /// axis the larger of both ends holds.
    pub fn chord_bound(&self, segment: &Segment, from: f64, to: f64, height: f64) -> f64 {
        self.chain.chord_bound(segment, from, to, height)
    }
}

fn interpolate(from: &AxisPosition, to: &AxisPosition, share: f64) -> AxisPosition {
    let mix = |a: f64, b: f64| a + (b - a) * share;
    AxisPosition {
        linear: std::array::from_fn(|i| mix(from.linear[i], to.linear[i])),
        rotary: std::array::from_fn(|i| mix(from.rotary[i], to.rotary[i])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Direction, RigidMotion, Vector};
    use crate::simulate::Turn;
    use nalgebra::Matrix3;
    use proptest::prelude::*;

    fn turn(axis: usize, pivot: [f64; 3], direction: Vector) -> Turn {
        Turn { axis, pivot: Point::from(pivot), direction: Direction::new_normalize(direction) }
    }

    /// Table turns, head turns, or one of each, all with pivots apart from each other.
    fn chain(kind: usize) -> Chain {
        let first = turn(0, [3.0, -20.0, 40.0], Vector::new(-1.0, 0.0, 0.1));
        let second = turn(1, [-12.0, 8.0, 15.0], Vector::new(0.2, 0.0, -1.0));
        let (table, head) = match kind {
            0 => (vec![first, second], vec![]),
            1 => (vec![], vec![second, first]),
            _ => (vec![second], vec![first]),
        };
        let tool = Pose { tip: Point::new(5.0, 6.0, 200.0), axis: Direction::new_normalize(Vector::z()) };
        let placement = RigidMotion::translation(11.0, -7.0, 30.0);
        Chain::new(table, head, Matrix3::identity(), tool, placement).unwrap()
    }

    fn axes() -> impl Strategy<Value = AxisPosition> {
        (prop::array::uniform3(-200.0..200.0), prop::array::uniform2(-4.0..4.0))
            .prop_map(|(linear, rotary)| AxisPosition { linear, rotary })
    }

    proptest! {
        #[test]
        fn linear_axes_put_the_tip_where_it_is_asked(kind in 0usize..3, position in axes()) {
            let chain = chain(kind);
            let back = chain.linear_for(chain.pose(&position).tip, position.rotary);
            for i in 0..3 {
                prop_assert!((back[i] - position.linear[i]).abs() < 1e-9);
            }
        }

        #[test]
        fn axis_points_stay_within_the_chord_bound(
            kind in 0usize..3, from in axes(), to in axes(), tcp in any::<bool>(),
            (low, high) in (0.0..0.5, 0.5..1.0), height in 0.0..80.0, shrink in 0.01..1.0,
        ) {
            let chain = chain(kind);
            // From a full sweep down to a short block.
            let mut to = to;
            for i in 0..3 { to.linear[i] = from.linear[i] + (to.linear[i] - from.linear[i]) * shrink; }
            for i in 0..2 { to.rotary[i] = from.rotary[i] + (to.rotary[i] - from.rotary[i]) * shrink; }
            let path = if tcp {
                Path::Tip { from: chain.pose(&from).tip, to: chain.pose(&to).tip }
            } else {
                Path::Joints
            };
            let segment =
                Segment { line: 1, kind: SegmentKind::Feed, start: 0.0, duration: 1.0, from, to, path };
            let motion = ToolMotion::new(chain, vec![segment]);
            let bound = motion.chord_bound(&segment, low, high, height);
            let place = |share: f64| motion.pose(&segment, share).at_height(height);
            let (start, end) = (place(low), place(high));
            for k in 0..=20 {
                let t = f64::from(k) / 20.0;
                let chord = start + (end - start) * t;
                let off = (place(low + (high - low) * t) - chord).norm();
                prop_assert!(off <= bound + 1e-9, "{off} {bound}");
            }
        }
    }
}
