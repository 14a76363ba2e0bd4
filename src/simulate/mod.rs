//! Program and machine to continuous tool motion in the part frame: what the control does with the text, block by
//! block, and what that asks of each axis. Uses `geometry`, `motion`, `machine` and the reading half of `nc`.

mod chain;
mod tool_motion;

pub use chain::{Chain, Turn};
pub use tool_motion::{Path, Segment, SegmentKind, ToolMotion};
