//! What G and M codes mean, whatever number or word a dialect gives them. Uses `machine` for the ways a control turns
//! the tool.

use crate::machine::{OrientationWords, TcpInterpolation};

/// Interpolation of a motion code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// G0.
    Rapid,
    /// G1.
    Line,
    /// G2, G3.
    Arc {
        /// Seen from the positive end of the plane's normal.
        clockwise: bool,
    },
}

/// Plane of arcs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Plane {
    /// G17.
    #[default]
    Xy,
    /// G18.
    Zx,
    /// G19.
    Yz,
}

impl Plane {
    /// Indices of the first and second axis of the plane, and of its normal; right-handed.
    pub fn axes(self) -> [usize; 3] {
        match self {
            Self::Xy => [0, 1, 2],
            Self::Zx => [2, 0, 1],
            Self::Yz => [1, 2, 0],
        }
    }
}

/// How F words count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeedUnit {
    /// G93: one over minutes.
    InverseTime,
    /// G94: mm, inches or degrees per minute.
    PerMinute,
    /// G95: mm or inches per revolution of the spindle.
    PerRevolution,
}

/// What the control may do to corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathControl {
    /// Every vertex is passed exactly.
    Exact,
    /// Corners are rounded within a tolerance, mm.
    Tolerance(f64),
    /// Corners are rounded by as much as the control likes.
    Free,
}

/// A work offset as programs select it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct WorkOffsetCode {
    /// Ten times the G code: 540 is G54, 591 is G59.1; [`Self::PRESET`] for an entry of the preset table.
    pub tenths: u16,
    /// Letter and number of the word that chooses among several, or number of the preset; `None` without.
    pub chosen: Option<(u8, u16)>,
}

impl WorkOffsetCode {
    /// [`Self::tenths`] of an entry of a preset table (cycle 247).
    pub const PRESET: u16 = 2470;
}

impl std::fmt::Display for WorkOffsetCode {
    /// As machine files name it: `G54`, `G59.1`, `G54.1 P3`, `G15 H1`, `PRESET 1`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.tenths == Self::PRESET {
            return write!(f, "PRESET {}", self.chosen.map_or(0, |(_, number)| number));
        }
        write!(f, "G{}", self.tenths / 10)?;
        if !self.tenths.is_multiple_of(10) {
            write!(f, ".{}", self.tenths % 10)?;
        }
        if let Some((letter, number)) = self.chosen {
            write!(f, " {}{number}", char::from(letter))?;
        }
        Ok(())
    }
}

/// Meaning of a G code, or of a word of the language.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GCode {
    /// No code of the dialect.
    #[default]
    Unknown,
    /// Known to the control; its effect on motion is not followed here.
    Unsupported,
    /// No effect on the path; the letters, as bits from A, that it takes as parameters.
    Harmless(u32),
    /// G0 to G3.
    Motion(Motion),
    /// As fast as the machine can in this block, whatever its motion code (FMAX).
    RapidOnce,
    /// G80 where it ends the motion code in force.
    MotionOff,
    /// The centre of the arcs that follow (CC).
    CircleCentre,
    /// G4.
    Dwell,
    /// G17 to G19.
    Plane(Plane),
    /// G20, G21.
    Units {
        /// G20.
        inch: bool,
    },
    /// G28, G30: through the given point to the reference position of that number.
    Reference(u8),
    /// G40, G49 and others switch nothing off that was on; G49 ends the tool length offset.
    LengthOff {
        /// It also ends TCP.
        tcp: bool,
    },
    /// G43.
    LengthOn {
        /// It also begins TCP, and how blocks then give the orientation.
        tcp: Option<OrientationWords>,
    },
    /// Begins or ends TCP and leaves the tool length as it is.
    Tcp(bool),
    /// How the tool turns with TCP on.
    Interpolation(TcpInterpolation),
    /// Begins TCP and says how the tool turns (FUNCTION TCPM).
    TcpWith(TcpInterpolation),
    /// Puts a tool into the spindle and calls its length (TOOL CALL).
    ToolCall,
    /// G53.
    MachineFrame,
    /// G54 and so on; ten times the number.
    WorkOffset(u16),
    /// One of many offsets, by a number in another word.
    NumberedWorkOffset {
        /// Ten times its G code.
        tenths: u16,
        /// The other word's letter.
        letter: u8,
    },
    /// Whether the rotary axes count for the feed (FGROUP).
    FeedGroup(FeedGroup),
    /// G61, G61.1.
    ExactPath,
    /// G64.
    Blend,
    /// G90, G91.
    Distance {
        /// G91.
        incremental: bool,
    },
    /// G90.1, G91.1.
    ArcCentre {
        /// G90.1.
        absolute: bool,
    },
    /// G93 to G95.
    Feed(FeedUnit),
}

impl GCode {
    /// The modal group as a bit; codes without one share none.
    pub fn group(self) -> u32 {
        match self {
            Self::Unknown | Self::Unsupported | Self::Harmless(_) | Self::FeedGroup(_) | Self::RapidOnce => 0,
            Self::Motion(_) | Self::MotionOff => 1,
            Self::Plane(_) => 1 << 1,
            Self::Distance { .. } => 1 << 2,
            Self::Feed(_) => 1 << 3,
            Self::Units { .. } => 1 << 4,
            Self::LengthOff { .. } | Self::LengthOn { .. } => 1 << 5,
            Self::WorkOffset(_) | Self::NumberedWorkOffset { .. } => 1 << 6,
            Self::ExactPath | Self::Blend => 1 << 7,
            Self::ArcCentre { .. } => 1 << 8,
            Self::Dwell | Self::Reference(_) | Self::MachineFrame | Self::CircleCentre | Self::ToolCall => 1 << 9,
            Self::Tcp(_) | Self::TcpWith(_) => 1 << 10,
            Self::Interpolation(_) => 1 << 11,
        }
    }
}

/// Which axes a feed per minute is the speed along, with TCP off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FeedGroup {
    /// As the control has it.
    #[default]
    Usual,
    /// X, Y, Z.
    Linear,
    /// Rotary axes too.
    All,
}

/// What the spindle does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SpindleTurn {
    /// M5.
    #[default]
    Off,
    /// M3.
    Clockwise,
    /// M4.
    Counterclockwise,
}

/// Meaning of an M code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MCode {
    /// No code of the dialect.
    #[default]
    Unknown,
    /// Known to the control; its effect on motion is not followed here.
    Unsupported,
    /// No effect on the path; the letters, as bits from A, that it takes as parameters.
    Harmless(u32),
    /// M0, M1.
    Stop,
    /// M2, M30.
    End,
    /// M3, M4, M5.
    Spindle(SpindleTurn),
    /// M6.
    ToolChange,
    /// Begins or ends TCP.
    Tcp(bool),
    /// M67, M68: E sets which output, Q to what.
    AnalogOutput,
    /// Whether rotary axes take the shorter way (M126, M127).
    ShortestWay(bool),
    /// Machine coordinates in this block (M91).
    MachineFrame,
    /// M7, M8, M9.
    Coolant(Coolant),
}

/// What the coolant does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coolant {
    /// M9.
    #[default]
    Off,
    /// M7.
    Mist,
    /// M8.
    Flood,
}

impl MCode {
    /// The modal group as a bit; codes without one share none.
    pub fn group(self) -> u32 {
        match self {
            Self::Unknown | Self::Unsupported | Self::Harmless(_) | Self::Coolant(_) => 0,
            Self::Stop | Self::End => 1 << 16,
            Self::Spindle(_) => 1 << 17,
            Self::ToolChange => 1 << 18,
            Self::Tcp(_) => 1 << 19,
            Self::AnalogOutput => 1 << 20,
            Self::ShortestWay(_) => 1 << 21,
            Self::MachineFrame => 1 << 22,
        }
    }
}

/// Letters as bits from A.
pub(super) const fn letters(text: &str) -> u32 {
    let bytes = text.as_bytes();
    let (mut bits, mut index) = (0, 0);
    while index < bytes.len() {
        bits |= 1 << (bytes[index] - b'A');
        index += 1;
    }
    bits
}
