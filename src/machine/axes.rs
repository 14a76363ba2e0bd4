//! Positions and moves of the machine's axes.

use crate::motion::{PassKind, Pose};

/// Where the machine's five axes stand, as its control counts them (its signs, its zero).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisPosition {
    /// X, Y, Z, mm.
    pub linear: [f64; 3],
    /// First and second rotary axis in the order of the machine file, radians, not wrapped.
    pub rotary: [f64; 2],
}

/// One move of the machine to an end point; between its ends the control interpolates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisMove {
    /// Axis positions at the end.
    pub to: AxisPosition,
    /// Tool pose at the end, part frame.
    pub pose: Pose,
    /// What the move is for.
    pub kind: PassKind,
    /// Index of the pass in the tool path that it belongs to.
    pub pass: usize,
}
