//! What an F word means to a control: which way it is divided by, and where the control does not keep it. Uses nothing
//! of the crate.

/// Shorter ways of X, Y, Z count as none, mm.
const NO_LENGTH: f64 = 1e-7;

/// How a control applies F words to a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeedRules {
    /// Slowest feed that the control makes of an inverse-time word, mm/min, or degrees/min where only rotary axes move.
    pub(super) slowest_inverse_time: Option<f64>,
    /// With TCP off F is the speed along all axes together, a degree counting as a millimetre; else X, Y, Z alone count
    /// where any of them moves.
    pub(super) degrees_count_without_tcp: bool,
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
    /// The way that a feed per minute is the speed along, mm or degrees.
    pub fn length(&self, way: Travelled, tcp: bool) -> f64 {
        match way.is_linear() {
            true if self.degrees_count_without_tcp && !tcp => way.linear.hypot(way.rotary),
            true => way.linear,
            false => way.rotary,
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
