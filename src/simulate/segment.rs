//! One move of a program and the way the control takes it. Uses `geometry`, `machine` and `motion`.

use super::arc::Arc;
use crate::geometry::Point;
use crate::machine::{AxisPosition, Setup};
use crate::motion::Pose;

/// Whether the program feeds or goes as fast as it can.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SegmentKind {
    /// Rapid traverse.
    Rapid,
    /// At a programmed feed: cuts, or may cut.
    Feed,
}

/// How the control gets from one end of a segment to the other. Where nothing else is said, the rotary axes turn
/// linearly with the share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Path {
    /// Every axis moves linearly (TCP off).
    Joints,
    /// X, Y, Z move on an arc of their own coordinates (TCP off).
    JointArc(Arc),
    /// The tip moves on a straight line of the part frame (TCP on).
    Tip {
        /// Where the tip starts, part frame, mm.
        from: Point,
        /// Where it ends.
        to: Point,
    },
    /// The tip moves on an arc of the part frame (TCP on).
    TipArc(Arc),
    /// The tip moves straight, the tool axis on the great circle (TCP on, vector interpolation).
    Vector {
        /// Pose at the start, part frame.
        from: Pose,
        /// Pose at the end.
        to: Pose,
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
    /// How long it would take without a stop at its ends, s: what the program's feed asks for. The same as the duration
    /// where the control does not stop, and for rapids.
    pub programmed: f64,
    /// Axes at its beginning.
    pub from: AxisPosition,
    /// Axes at its end.
    pub to: AxisPosition,
    /// The way between.
    pub path: Path,
}

impl Segment {
    /// See [`super::ToolMotion::pose`].
    pub(super) fn pose(&self, setup: &Setup, share: f64) -> Pose {
        let straight = self.from.interpolate(&self.to, share);
        match &self.path {
            Path::Joints => setup.forward(&straight),
            Path::JointArc(arc) => setup.forward(&AxisPosition { linear: arc.point(share).into(), ..straight }),
            Path::Tip { from, to } => Pose { tip: from + (to - from) * share, axis: setup.axis(straight.rotary) },
            Path::TipArc(arc) => Pose { tip: arc.point(share), axis: setup.axis(straight.rotary) },
            Path::Vector { from, to } => from.interpolate(to, share),
        }
    }

    /// See [`super::ToolMotion::axes`].
    pub(super) fn axes(&self, setup: &Setup, share: f64) -> AxisPosition {
        let straight = self.from.interpolate(&self.to, share);
        match &self.path {
            Path::Joints => straight,
            Path::JointArc(arc) => AxisPosition { linear: arc.point(share).into(), ..straight },
            Path::Tip { .. } | Path::TipArc(_) => setup.with_rotary(&self.pose(setup, share).tip, straight.rotary),
            Path::Vector { .. } => setup.inverse_near(&self.pose(setup, share), straight.rotary).unwrap_or(straight),
        }
    }
}
