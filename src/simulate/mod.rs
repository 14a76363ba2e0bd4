//! Program and machine to continuous tool motion in the part frame: what the control does with the text, block by
//! block, and what that asks of each axis. Uses `diagnostic`, `geometry`, `motion`, `machine` and the reading half of
//! `nc`.

mod arc;
mod axis_course;
mod bound;
mod duration;
mod follow;
mod rapid;
mod rollover;
mod rounding;
mod segment;
mod statistics;
#[cfg(test)]
mod tests;
mod tool_motion;

pub use arc::Arc;
pub use axis_course::SegmentCourse;
pub use follow::{OwnTool, simulate};
pub use rounding::ToolReach;
pub use segment::{Path, Segment, SegmentKind};
pub use statistics::{AxisReport, AxisStatistics, LimitKind, LimitViolation};
pub use tool_motion::ToolMotion;
