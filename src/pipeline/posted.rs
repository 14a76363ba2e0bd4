//! A written program in figures, as JSON for other programs.

use super::Posted;
use serde::Serialize;

/// Format and version of the JSON.
const FORMAT: (&str, u32) = ("regulus-post", 1);

/// A written program in figures. Lengths mm, times s.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PostRecord {
    format: &'static str,
    version: u32,
    /// Moves, the first included.
    pub moves: usize,
    /// What the moves take as written.
    pub duration_s: f64,
    /// Largest distance of the flank from the tool path between blocks.
    pub linearization_mm: f64,
    /// Branches and turns of the rotary axes.
    pub rotary_choice: RotaryChoice,
    /// Lines whose feed a ceiling of the control lowers.
    pub slowed_lines: Vec<usize>,
}

/// What the chosen branches and turns of the rotary axes cost over the whole path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RotaryChoice {
    /// Time that the slowest axes need for their ways at top speed, turns in place and nearness to limits included.
    pub seconds: f64,
    /// What no choice can be below: proved.
    pub least_seconds: f64,
    /// How often the tool leaves the part to turn back.
    pub rewinds: usize,
}

impl PostRecord {
    /// The figures of a program.
    pub fn of(posted: &Posted) -> Self {
        Self {
            format: FORMAT.0,
            version: FORMAT.1,
            moves: posted.moves,
            duration_s: posted.duration,
            linearization_mm: posted.linearization,
            rotary_choice: RotaryChoice {
                seconds: posted.choice.seconds,
                least_seconds: posted.choice.least,
                rewinds: posted.choice.rewinds,
            },
            slowed_lines: posted.slowed.clone(),
        }
    }
}
