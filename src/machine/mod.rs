//! The kinematic chain of a machine from its file, forward and inverse, branch choice, limits, blocks between poses.
//! Uses `diagnostic`, `geometry` and `motion`.

pub mod axes;

pub use axes::{AxisMove, AxisPosition};
