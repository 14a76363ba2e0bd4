//! The motion a program makes: segments in time, each exact between its ends. Uses `geometry`, `machine` and `motion`.

use super::bound;
use super::rounding::{Rounding, ToolReach};
use super::segment::{Path, Segment};
use crate::machine::{AxisPosition, Setup};
use crate::motion::Pose;
use crate::nc::Findings;

/// Everything a program makes the tool do, in the part frame.
#[derive(Clone, Debug)]
pub struct ToolMotion {
    setup: Setup,
    segments: Vec<Segment>,
    findings: Findings,
    rounding: Rounding,
}

impl ToolMotion {
    /// Joins a machine with a part and a tool, what moves on it, and what was found remarkable.
    pub fn new(setup: Setup, segments: Vec<Segment>, findings: Findings) -> Self {
        Self { setup, segments, findings, rounding: Rounding::default() }
    }

    /// The same where the program lets the control round corners between feed moves.
    pub(super) fn rounded(self, rounding: Rounding) -> Self {
        Self { rounding, ..self }
    }

    /// By how much the program lets the control round corners between feed moves at most, mm of the linear axes.
    pub fn blending(&self) -> f64 {
        self.rounding.tolerance
    }

    /// How far a rotary axis may leave its way where corners may be rounded, at most, radians: as far as two blocks laid
    /// over each other bring it, or as the machine file says.
    pub fn rotary_blending(&self) -> f64 {
        self.rounding.rotary(&self.setup, &self.segments)
    }

    /// How far any point of the tool may leave its way where corners may be rounded, mm: a band about this motion. `clear`
    /// says for a segment how far the tool is from what matters where it begins, about that corner: rotary axes may bring
    /// it that near without harm.
    pub fn blending_band(&self, reach: &ToolReach, clear: impl Fn(usize) -> f64 + Sync) -> f64 {
        self.rounding.tolerance + self.rounding.at_tool(&self.setup, &self.segments, reach, clear)
    }

    /// The machine with its part and tool.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// The segments in order of time. Moves before the program has said where each of its axes stands are not among
    /// them, because nobody knows where they begin.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// What is remarkable in the program and in its motion, in the order of the text.
    pub fn findings(&self) -> &Findings {
        &self.findings
    }

    /// Time at which the last segment ends, s; dwells count, stops at the ends of blocks where the control makes them,
    /// tool changes do not.
    pub fn duration(&self) -> f64 {
        self.segments.last().map_or(0.0, |last| last.start + last.duration)
    }

    /// Tool pose in the part frame at `share` (0 to 1) of `segment`, exactly as the control interpolates.
    pub fn pose(&self, segment: &Segment, share: f64) -> Pose {
        segment.pose(&self.setup, share)
    }

    /// Axis positions at `share` (0 to 1) of `segment`. With vector interpolation the rotary axes are those near the
    /// straight way between the ends.
    pub fn axes(&self, segment: &Segment, share: f64) -> AxisPosition {
        segment.axes(&self.setup, share)
    }

    /// Bound on how far the axis point at `height` mm above the tip leaves the straight chord between its places at
    /// the shares `from` and `to` of `segment`, mm. The bound is convex in the height, so for a stretch of the axis
    /// the larger of both ends holds.
    pub fn chord_bound(&self, segment: &Segment, from: f64, to: f64, height: f64) -> f64 {
        bound::chord_bound(&self.setup, segment, (from, to), height)
    }

    /// Length of the tip's way in the part frame, mm.
    pub fn tip_length(&self, segment: &Segment) -> f64 {
        match &segment.path {
            Path::Tip { from, to } => (to - from).norm(),
            Path::TipArc(arc) => arc.length(),
            Path::Vector { from, to } => (to.tip - from.tip).norm(),
            Path::Joints | Path::JointArc(_) => {
                const PIECES: u32 = 16;
                let tip = |k: u32| self.pose(segment, f64::from(k) / f64::from(PIECES)).tip;
                (0..PIECES).map(|k| (tip(k + 1) - tip(k)).norm()).sum()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::arc::Arc;
    use super::super::segment::{Path, SegmentKind};
    use super::*;
    use crate::geometry::Point;
    use crate::machine::{BUILTIN, Machine};
    use proptest::prelude::*;

    fn axes() -> impl Strategy<Value = AxisPosition> {
        (prop::array::uniform3(-200.0..200.0), prop::array::uniform2(-2.0..2.0))
            .prop_map(|(linear, rotary)| AxisPosition { linear, rotary })
    }

    fn paths(setup: &Setup, from: &AxisPosition, to: &AxisPosition) -> [Path; 5] {
        let (start, end) = (setup.forward(from), setup.forward(to));
        let arc = |from: Point, to: Point| Arc {
            centre: from + (to - from) * 0.5,
            radius: (from - to) * 0.5,
            normal: (to - from).cross(&nalgebra::Vector3::new(0.3, 0.5, 0.7)).normalize(),
            angle: std::f64::consts::PI,
            rise: (to - from) * 0.1,
            growth: 0.99,
        };
        [
            Path::Joints,
            Path::JointArc(arc(Point::from(from.linear), Point::from(to.linear))),
            Path::Tip { from: start.tip, to: end.tip },
            Path::TipArc(arc(start.tip, end.tip)),
            Path::Vector { from: start, to: end },
        ]
    }

    proptest! {
        #[test]
        fn axis_points_stay_within_the_chord_bound(
            machine in 0..BUILTIN.len(), kind in 0_usize..5, from in axes(), to in axes(),
            (low, high) in (0.0..0.5, 0.5..1.0), height in 0.0..80.0, shrink in 0.01..1.0,
        ) {
            let machine = Machine::named(BUILTIN[machine].0).unwrap();
            let setup = Setup::at(&machine, [30.0, -20.0, 10.0], 120.0).unwrap();
            // From a full sweep down to a short block.
            let to = from.interpolate(&to, shrink);
            let path = paths(&setup, &from, &to)[kind];
            let segment = Segment { line: 1, kind: SegmentKind::Feed, start: 0.0, duration: 1.0, programmed: 1.0, from, to, path };
            let motion = ToolMotion::new(setup, vec![segment], Findings::default());
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

        #[test]
        fn axes_and_pose_agree_inside_every_kind_of_segment(
            machine in 0..BUILTIN.len(), kind in 0_usize..5, from in axes(), to in axes(), share in 0.0..1.0,
        ) {
            let machine = Machine::named(BUILTIN[machine].0).unwrap();
            let setup = Setup::at(&machine, [30.0, -20.0, 10.0], 120.0).unwrap();
            let to = from.interpolate(&to, 0.05);
            let path = paths(&setup, &from, &to)[kind];
            let segment = Segment { line: 1, kind: SegmentKind::Feed, start: 0.0, duration: 1.0, programmed: 1.0, from, to, path };
            let (pose, back) = (segment.pose(&setup, share), setup.forward(&segment.axes(&setup, share)));
            prop_assert!((pose.tip - back.tip).norm() < 1e-9);
            prop_assert!(pose.axis_angle(&back) < 1e-9);
        }
    }
}
