//! Tool poses, ruled surfaces of the tool axis, passes, and CL files. Uses `diagnostic`, `geometry` and `tool`.

pub mod apt;
pub mod cl;
pub mod compare;
pub mod path;
pub mod pose;

pub use path::{FeedReference, Pass, PassKind, PassMotion, RuledMotion, TimedPoses, ToolPath, ToolSummary};
pub use pose::Pose;
