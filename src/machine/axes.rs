//! Positions and moves of the machine's axes, and the words that a program says them in. Uses `motion`.

use crate::motion::{PassKind, Pose};

/// Where the machine's five axes stand, as its control counts them (its signs, its zero).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisPosition {
    /// X, Y, Z, mm.
    pub linear: [f64; 3],
    /// First and second rotary axis in the order of the machine file, radians, not wrapped.
    pub rotary: [f64; 2],
}

impl AxisPosition {
    /// The position at `share` of the way to `other`, every axis linear.
    pub fn interpolate(&self, other: &Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * share;
        Self {
            linear: std::array::from_fn(|k| mix(self.linear[k], other.linear[k])),
            rotary: std::array::from_fn(|k| mix(self.rotary[k], other.rotary[k])),
        }
    }

    /// X, Y, Z, first and second rotary axis, mm and radians.
    pub fn values(&self) -> [f64; 5] {
        let ([x, y, z], [a, b]) = (self.linear, self.rotary);
        [x, y, z, a, b]
    }
}

/// The five numbers of a block as a program says them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProgramWords {
    /// X, Y, Z words, mm: tip in the part frame with TCP on, axes less work offset (and tool length) with TCP off.
    pub linear: [f64; 3],
    /// Rotary words in the order of the machine file, degrees.
    pub rotary: [f64; 2],
}

impl ProgramWords {
    /// The nearest words with the given numbers of decimals.
    #[must_use]
    pub fn rounded(&self, linear_digits: u8, rotary_digits: u8) -> Self {
        Self {
            linear: self.linear.map(|value| round_to(value, linear_digits)),
            rotary: self.rotary.map(|value| round_to(value, rotary_digits)),
        }
    }
}

/// The nearest number with `digits` decimals; never minus zero.
pub fn round_to(value: f64, digits: u8) -> f64 {
    let scale = 10f64.powi(i32::from(digits));
    (value * scale).round() / scale + 0.0
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
    /// Seconds that the path wants for it, where the path has times of its own.
    pub asked: Option<f64>,
}
