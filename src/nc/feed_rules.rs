//! What an F word means to a control: which way it is divided by, and where the control does not keep it. Uses of
//! `machine` the control's options.

use crate::machine::{Dialect, DialectOptions};

/// Shorter ways of X, Y, Z count as none, mm.
const NO_LENGTH: f64 = 1e-7;

/// How a control applies F words to a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeedRules {
    /// Slowest feed that the control makes of an inverse-time word, mm/min, or degrees/min where only rotary axes move.
    slowest_inverse_time: Option<f64>,
    rotary: RotaryShare,
}

/// How rotary axes count for a feed per minute with TCP off.
#[derive(Clone, Copy, Debug, PartialEq)]
enum RotaryShare {
    /// Not where X, Y, Z move; alone by degrees.
    None,
    /// A degree as a unit of length of the program.
    Degrees,
    /// By the way at a radius: mm per degree.
    Radius(f64),
}

impl RotaryShare {
    fn at(radius: f64) -> Self {
        let mm_per_degree = radius.to_radians();
        match mm_per_degree {
            _ if mm_per_degree <= 0.0 => Self::None,
            _ if (mm_per_degree - 1.0).abs() < 1e-4 => Self::Degrees,
            _ => Self::Radius(mm_per_degree),
        }
    }
}

/// The way of a block in the program's own coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Travelled {
    /// Of X, Y, Z, mm, along the arc where it is one.
    pub linear: f64,
    /// Of the rotary axes, root of the sum of squares, degrees.
    pub rotary: f64,
}

impl Travelled {
    /// Whether the feed is that of X, Y, Z: they move, or nothing else does.
    pub fn is_linear(&self) -> bool {
        self.linear > NO_LENGTH || self.rotary == 0.0
    }

    /// Whether nothing moves.
    pub fn is_none(&self) -> bool {
        self.linear == 0.0 && self.rotary == 0.0
    }
}

impl FeedRules {
    /// The rules of a control.
    pub fn new(dialect: Dialect, options: &DialectOptions) -> Self {
        // LinuxCNC runs no block slower than this.
        let slowest_inverse_time = (dialect == Dialect::LinuxCnc).then_some(0.1);
        Self { slowest_inverse_time, rotary: RotaryShare::at(options.feed_radius) }
    }

    /// The same with rotary axes counting at a radius, mm; 0: not at all.
    #[must_use]
    pub fn at_radius(self, radius: f64) -> Self {
        Self { rotary: RotaryShare::at(radius), ..self }
    }

    /// The way that a feed per minute is the speed along, in the units of F: lengths of `unit` mm, or degrees.
    pub fn length(&self, way: Travelled, tcp: bool, unit: f64) -> f64 {
        let share = if tcp { RotaryShare::None } else { self.rotary };
        match (share, way.is_linear()) {
            (RotaryShare::None, true) => way.linear / unit,
            (RotaryShare::None, false) | (RotaryShare::Degrees, false) => way.rotary,
            (RotaryShare::Degrees, true) => (way.linear / unit).hypot(way.rotary),
            (RotaryShare::Radius(mm), _) => way.linear.hypot(way.rotary * mm) / unit,
        }
    }

    /// Seconds that a block takes whose inverse-time word (1/min) the control does not keep, because it makes a speed of
    /// it that is below its slowest; `None` where it keeps the word.
    pub fn inverse_time_floor(&self, word: f64, way: Travelled) -> Option<f64> {
        let length = if way.is_linear() { way.linear } else { way.rotary };
        let slowest = self.slowest_inverse_time.filter(|slowest| word * length < *slowest)?;
        Some(60.0 * length / slowest)
    }
}
