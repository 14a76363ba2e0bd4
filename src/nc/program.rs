//! What a program commands: moves and changes of state in the order of the text, in its own coordinates. Uses `machine`
//! for the ways a control turns the tool.

use super::code::{Coolant, PathControl, Plane, SpindleTurn, WorkOffsetCode};
use super::finding::Findings;
use crate::machine::TcpInterpolation;

/// The letters of axis words, in the order of [`Move::target`].
pub const AXIS_LETTERS: [char; 6] = ['X', 'Y', 'Z', 'A', 'B', 'C'];

/// Which axes a block names: bits in the order of [`AXIS_LETTERS`], and [`Self::VECTOR`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxisSet(pub u8);

impl AxisSet {
    /// The block names the tool axis by its components.
    pub const VECTOR: Self = Self(1 << 6);

    /// Whether there is nothing in the set.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether the tool axis is named by its components.
    pub fn has_vector(self) -> bool {
        self.0 & Self::VECTOR.0 != 0
    }

    /// Whether axis `index` of [`AXIS_LETTERS`] is in the set.
    pub fn has(self, index: usize) -> bool {
        self.0 & (1 << index) != 0
    }

    /// The indices of the axes in the set.
    pub fn indices(self) -> impl Iterator<Item = usize> {
        (0..AXIS_LETTERS.len()).filter(move |index| self.has(*index))
    }
}

/// Which way a rotary axis turns to its target.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Turn {
    /// As the control has it where a word says no more.
    #[default]
    Plain,
    /// The shorter way.
    Shortest,
    /// Positive.
    Positive,
    /// Negative.
    Negative,
}

/// Ways of the axes A, B, C in one block: two bits each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Turns(u8);

impl Turns {
    /// The shorter way for each axis.
    pub const SHORTEST: Self = Self(0b01_01_01);

    /// The way of axis `index` of [`AXIS_LETTERS`].
    pub fn of(self, index: usize) -> Turn {
        match (self.0 >> (2 * index.saturating_sub(3).min(3))) & 0b11 {
            0 => Turn::Plain,
            1 => Turn::Shortest,
            2 => Turn::Positive,
            _ => Turn::Negative,
        }
    }

    /// The same with that way for axis `index` of [`AXIS_LETTERS`].
    #[must_use]
    pub fn with(self, index: usize, turn: Turn) -> Self {
        let shift = 2 * index.saturating_sub(3).min(3);
        Self(self.0 & !(0b11 << shift) | (turn as u8) << shift)
    }
}

/// In which coordinates a target is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame {
    /// Work offset and tool length in force.
    Work,
    /// Machine coordinates (G53).
    Machine,
    /// The machine's reference position of that number, whatever the target says (G28, G30).
    Reference(u8),
}

/// A feed that is in force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feed {
    /// The move takes one minute over this.
    InverseTime(f64),
    /// The move takes this long, s.
    Duration(f64),
    /// Speed.
    PerMinute {
        /// For moves of X, Y, Z: mm/min.
        linear: f64,
        /// For moves of rotary axes alone: degrees/min.
        rotary: f64,
    },
    /// mm per revolution of the spindle.
    PerRevolution(f64),
    /// None: the block has a finding.
    Missing,
}

/// How a move gets to its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Way {
    /// As fast as the machine can.
    Rapid,
    /// Straight at a feed.
    Line(Feed),
    /// On an arc at a feed; index into [`Program::arcs`].
    Arc(Feed, u32),
}

/// A commanded move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// X, Y, Z in mm, A, B, C in degrees, as written (inches converted); 0 where not given. With
    /// [`AxisSet::VECTOR`] the last three are the components of the tool axis in the part frame, from the tip toward
    /// the spindle, of any length but zero.
    pub target: [f64; 6],
    /// How.
    pub way: Way,
    /// Line of the program, from 1.
    pub line: u32,
    /// How many of [`Program::changes`] come before this move.
    pub changes: u32,
    /// Which axes the block names; the others stay.
    pub given: AxisSet,
    /// In which coordinates.
    pub frame: Frame,
    /// Axes whose target counts from where they stand.
    pub incremental: AxisSet,
    /// Which way the rotary axes turn.
    pub turns: Turns,
}

/// What determines an arc besides its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArcCentre {
    /// I, J, K in mm, 0 where not given.
    Point {
        /// Their values.
        words: [f64; 3],
        /// They count from the work zero (G90.1), not from the start of the arc.
        absolute: bool,
    },
    /// R in mm; negative for the longer arc.
    Radius(f64),
}

/// An arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArcWords {
    /// Its plane.
    pub plane: Plane,
    /// Seen from the positive end of the plane's normal.
    pub clockwise: bool,
    /// Its centre.
    pub centre: ArcCentre,
    /// Turns begun (P word), at least 1.
    pub turns: u32,
}

/// A change of state between moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// TCP on or off.
    Tcp(bool),
    /// How the tool turns with TCP on, whatever the words; `None`: as the control has it for their form.
    Interpolation(Option<TcpInterpolation>),
    /// Radius at which rotary axes count for a feed per minute with TCP off, mm; 0: not at all.
    FeedRadius(f64),
    /// Tool length offset: its number in the control's table, `None` for the tool's own, or off.
    Length(LengthOffset),
    /// Work offset.
    WorkOffset(WorkOffsetCode),
    /// Tool in the spindle.
    Tool(u32),
    /// Spindle.
    Spindle {
        /// What it does.
        turn: SpindleTurn,
        /// 1/min; 0 when never programmed.
        rpm: f64,
    },
    /// What the control does to corners.
    PathControl(PathControl),
    /// How far rotary axes may leave their way at corners that may be rounded, degrees, where the program says it.
    RoundingRotary(Option<f64>),
    /// Unit of lengths.
    Units {
        /// Inches; else millimetres.
        inch: bool,
    },
    /// Waits, s.
    Dwell(f64),
    /// Waits for the operator.
    Stop,
    /// Coolant.
    Coolant(Coolant),
}

/// Which tool length offset is in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LengthOffset {
    /// None.
    Off,
    /// That of the tool in the spindle.
    OwnTool,
    /// That of this number (H).
    Number(u32),
}

/// A change of state and where it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChangeAt {
    /// Line of the program, from 1.
    pub line: u32,
    /// What changes.
    pub change: Change,
}

/// A program as its control understands it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Program {
    /// In the order of the text.
    pub moves: Vec<Move>,
    /// What [`Way::Arc`] refers to.
    pub arcs: Vec<ArcWords>,
    /// In the order of the text; [`Move::changes`] says how many come before a move.
    pub changes: Vec<ChangeAt>,
    /// Blocks up to the end of the program: lines with at least one word.
    pub blocks: usize,
    /// Lines up to the end of the program.
    pub lines: usize,
    /// What is remarkable, in the order of the text.
    pub findings: Findings,
}
