//! A whole tool path: passes, each a continuous motion of the tool in the part frame.

use super::Pose;
use crate::geometry::{Direction, Point, SplineCurve, Vector};
use crate::tool::Tool;

/// The rigid motion of a tool whose axis rules a surface between two rails (Rajain 2023, R3).
///
/// The rails only span the axis: its direction is `(upper - lower)` made a unit vector, so whatever the rails do, the
/// tool is rigid (R4 by construction). Height `lower_height` of the tool rides on the lower rail.
#[derive(Clone, Debug, PartialEq)]
pub struct RuledMotion {
    /// Rail nearer the tip.
    pub lower: SplineCurve,
    /// Rail nearer the spindle, with the same knots.
    pub upper: SplineCurve,
    /// Height above the tip of the axis point that rides on the lower rail, mm.
    pub lower_height: f64,
}

/// A pose and its derivative with respect to the path parameter.
#[derive(Clone, Copy, Debug)]
pub struct PoseRate {
    /// The pose.
    pub pose: Pose,
    /// Derivative of the tip, mm per unit of parameter.
    pub tip_rate: Vector,
    /// Derivative of the axis direction, per unit of parameter.
    pub axis_rate: Vector,
}

impl RuledMotion {
    /// Parameter interval.
    pub fn domain(&self) -> (f64, f64) {
        self.lower.knots().domain()
    }

    /// The pose at `t`; `None` where the rails meet and span no axis.
    pub fn pose(&self, t: f64) -> Option<Pose> {
        let lower = self.lower.point(t);
        let axis = Direction::try_new(self.upper.point(t) - lower, 1e-9)?;
        Some(Pose { tip: lower - axis.into_inner() * self.lower_height, axis })
    }

    /// Pose and its derivative at `t`.
    pub fn pose_rate(&self, t: f64) -> Option<PoseRate> {
        let [lower, lower_rate, _] = self.lower.jet(t);
        let [upper, upper_rate, _] = self.upper.jet(t);
        let span = upper - lower;
        let length = span.norm();
        let axis = Direction::try_new(span, 1e-9)?;
        let span_rate = upper_rate - lower_rate;
        let axis_rate = (span_rate - axis.into_inner() * axis.dot(&span_rate)) / length;
        let tip = Point::from(lower) - axis.into_inner() * self.lower_height;
        Some(PoseRate { pose: Pose { tip, axis }, tip_rate: lower_rate - axis_rate * self.lower_height, axis_rate })
    }
}

/// How a pass moves.
#[derive(Clone, Debug, PartialEq)]
pub enum PassMotion {
    /// Along a ruled surface, over its whole parameter interval.
    Ruled(RuledMotion),
    /// Through poses: tip straight, axis on the great circle in between.
    Poses(Vec<Pose>),
    /// The same with times of its own.
    Timed(TimedPoses),
}

/// A motion with times of its own, as a program or the CL file of another system gives them: poses so close together
/// that tip straight and axis on the great circle is the motion.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedPoses {
    /// At least one.
    pub poses: Vec<Pose>,
    /// Seconds from the start of the pass at each pose; never falling.
    pub seconds: Vec<f64>,
    /// Indices of the poses where the motion may have a corner, ascending; the first and the last always count.
    pub corners: Vec<usize>,
    /// Line of the file that it was read from whose motion leads to each pose; empty where there is none.
    pub lines: Vec<usize>,
}

impl TimedPoses {
    /// Begins at a pose that a line leads to.
    pub fn starting(pose: Pose, line: usize) -> Self {
        Self { poses: vec![pose], seconds: vec![0.0], corners: vec![0], lines: vec![line] }
    }

    /// Goes on to a pose in `seconds`.
    pub fn push(&mut self, pose: Pose, seconds: f64, line: usize, corner: bool) {
        if corner {
            self.corners.push(self.poses.len());
        }
        let before = self.seconds.last().copied().unwrap_or_default();
        self.poses.push(pose);
        self.seconds.push(before + seconds);
        self.lines.push(line);
    }

    /// Seconds from the start at parameter `t`.
    fn seconds_at(&self, t: f64) -> f64 {
        let leg = (t.max(0.0) as usize).min(self.seconds.len().saturating_sub(1));
        let from = self.seconds.get(leg).copied().unwrap_or_default();
        let to = self.seconds.get(leg + 1).copied().unwrap_or(from);
        from + (to - from) * (t - leg as f64).clamp(0.0, 1.0)
    }

    /// Line of the file whose motion leads to the pose nearest to a place.
    pub fn line_near(&self, pose: &Pose) -> Option<usize> {
        let off = |index: &usize| {
            let other = &self.poses[*index];
            (other.tip - pose.tip).norm() + other.axis_angle(pose)
        };
        let nearest = (0..self.poses.len()).min_by(|a, b| off(a).total_cmp(&off(b)))?;
        self.lines.get(nearest).copied()
    }
}

impl PassMotion {
    /// Parameter interval: that of the rails, or 0 to the number of legs.
    pub fn domain(&self) -> (f64, f64) {
        match self {
            Self::Ruled(motion) => motion.domain(),
            Self::Poses(poses) | Self::Timed(TimedPoses { poses, .. }) => (0.0, poses.len().saturating_sub(1) as f64),
        }
    }

    /// Seconds that the motion itself wants between two parameters; `None` where it has no times of its own.
    pub fn seconds(&self, from: f64, to: f64) -> Option<f64> {
        match self {
            Self::Timed(timed) => Some(timed.seconds_at(to) - timed.seconds_at(from)),
            Self::Ruled(_) | Self::Poses(_) => None,
        }
    }

    /// Pose at parameter `t`, clamped to the domain; `None` for an empty or degenerate motion.
    pub fn pose(&self, t: f64) -> Option<Pose> {
        match self {
            Self::Ruled(motion) => {
                let (low, high) = motion.domain();
                motion.pose(t.clamp(low, high))
            }
            Self::Poses(poses) | Self::Timed(TimedPoses { poses, .. }) => {
                let last = poses.len().checked_sub(1)?;
                let leg = (t.max(0.0) as usize).min(last);
                let share = (t - leg as f64).clamp(0.0, 1.0);
                match poses.get(leg + 1) {
                    Some(next) if share > 0.0 => Some(poses[leg].interpolate(next, share)),
                    _ => poses.get(leg).copied(),
                }
            }
        }
    }

    /// Parameters at which the motion may have a corner, ends included.
    pub fn breaks(&self) -> Vec<f64> {
        match self {
            Self::Ruled(motion) => motion.lower.knots().breaks(),
            Self::Poses(poses) | Self::Timed(TimedPoses { poses, .. }) => (0..poses.len()).map(|i| i as f64).collect(),
        }
    }
}

/// What a pass is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PassKind {
    /// Cuts a strip.
    Cut,
    /// Enters along the motion, at cutting feed.
    LeadIn,
    /// Leaves along the motion, at cutting feed.
    LeadOut,
    /// Moves to the material in free space, at cutting feed.
    Approach,
    /// Moves away from the material in free space, at cutting feed.
    Retract,
    /// Moves in free space, as fast as the machine goes.
    Rapid,
}

impl PassKind {
    /// True where the machine may go as fast as it can.
    pub fn is_rapid(self) -> bool {
        self == Self::Rapid
    }
}

/// One pass: a continuous motion; each starts where the one before ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Pass {
    /// What it is for.
    pub kind: PassKind,
    /// Strip it belongs to, from 0.
    pub strip: Option<u32>,
    /// How it moves.
    pub motion: PassMotion,
}

/// Which point of the flank the feed is the speed of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FeedReference {
    /// The tip.
    Tip,
    /// Half the flute length.
    #[default]
    Mid,
    /// The end of the flutes.
    Top,
    /// The fastest of tip and top in each block.
    Fastest,
    /// The mean over the length of the flutes.
    Mean,
}

/// What posting needs to know of the tool.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ToolSummary {
    /// Number in the control's table.
    pub number: u32,
    /// Kind and main sizes in words, one line, for the program's header.
    pub description: String,
    /// Tip to gauge line, mm.
    pub gauge_length: f64,
    /// Tip to end of flutes, mm.
    pub flute_length: f64,
}

impl ToolSummary {
    /// Takes what posting needs from a tool.
    pub fn of(tool: &Tool) -> Self {
        Self {
            number: tool.number,
            description: format!(
                "{} D{:.3} flute {:.3} gauge {:.3}",
                tool.kind,
                2.0 * tool.max_radius(),
                tool.flute_length(),
                tool.gauge_length()
            ),
            gauge_length: tool.gauge_length(),
            flute_length: tool.flute_length(),
        }
    }
}

/// A whole tool path in the part frame: what a plan makes and a post reads.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolPath {
    /// Name of the job.
    pub name: String,
    /// The tool.
    pub tool: ToolSummary,
    /// Speed of the reference point relative to the part, mm/min.
    pub cut_feed: f64,
    /// Which point that is.
    pub feed_reference: FeedReference,
    /// Spindle speed, 1/min.
    pub spindle_rpm: f64,
    /// How far the flank may leave the path between blocks, rounding included, mm.
    pub linearization: f64,
    /// The part's tolerance, for the program's header, mm.
    pub overcut_tolerance: f64,
    /// The part's tolerance, for the program's header, mm.
    pub undercut_tolerance: f64,
    /// In order of execution.
    pub passes: Vec<Pass>,
}
