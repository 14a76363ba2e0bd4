//! Block durations from path length, stretched to the axis limits. Uses `geometry`, `motion` and `machine`.

use crate::machine::AxisMove;

/// A move and the time it takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedMove {
    /// The move.
    pub axes: AxisMove,
    /// Seconds; for rapids what the axes' top speeds allow.
    pub duration: f64,
    /// Length of the tip's path in the part frame, mm: what a TCP feed word refers to.
    pub tip_length: f64,
}
