//! One block's codes and letters, sorted by what they are for. Uses `machine` for the ways a control turns the tool.

use super::block::{Word, WordMode, address};
use super::code::{Coolant, FeedGroup, FeedUnit, GCode, MCode, Motion, Plane, SpindleTurn, letters};
use super::program::{AxisSet, Turn, Turns};
use crate::machine::TcpInterpolation;

/// The words of a block, other than G and M, with their numbers.
#[derive(Default)]
pub(super) struct Letters {
    present: u32,
    values: [f64; address::COUNT],
    /// Letters whose word says itself that it counts from where the axis stands, or from zero.
    incremental: u32,
    absolute: u32,
    turns: Turns,
}

impl Letters {
    /// The bit of a letter or other address.
    pub(super) fn bit(letter: u8) -> u32 {
        1_u32.checked_shl(u32::from(letter.wrapping_sub(b'A'))).unwrap_or(0)
    }

    /// Adds a word with that value; true when its address was there already.
    pub(super) fn add(&mut self, word: &Word, value: f64) -> bool {
        let bit = Self::bit(word.letter);
        let repeated = self.present & bit != 0;
        self.present |= bit;
        if let Some(place) = self.values.get_mut(usize::from(word.letter.wrapping_sub(b'A'))) {
            *place = value;
        }
        if word.mode != WordMode::Plain {
            self.add_mode(word);
        }
        repeated
    }

    fn add_mode(&mut self, word: &Word) {
        let bit = Self::bit(word.letter);
        match word.mode {
            WordMode::Plain => return,
            WordMode::Incremental => self.incremental |= bit,
            _ => self.absolute |= bit,
        }
        let turn = match word.mode {
            WordMode::Shortest => Turn::Shortest,
            WordMode::Positive => Turn::Positive,
            WordMode::Negative => Turn::Negative,
            _ => Turn::Plain,
        };
        if matches!(word.letter, b'A'..=b'C') {
            self.turns = self.turns.with(usize::from(word.letter - b'A') + 3, turn);
        }
    }

    /// Which letters there are, as bits from A.
    pub(super) fn present(&self) -> u32 {
        self.present
    }

    /// A letter's number.
    pub(super) fn get(&self, letter: u8) -> Option<f64> {
        let value = self.values.get(usize::from(letter.wrapping_sub(b'A')))?;
        (self.present & Self::bit(letter) != 0).then_some(*value)
    }

    /// I, J, K are components of the tool axis.
    pub(super) fn take_vector(&mut self) {
        for (letter, to) in [b'I', b'J', b'K'].into_iter().zip(address::VECTOR) {
            if let Some(value) = self.get(letter) {
                self.present = self.present & !Self::bit(letter) | Self::bit(to);
                if let Some(place) = self.values.get_mut(usize::from(to - b'A')) {
                    *place = value;
                }
            }
        }
    }

    /// The components of the tool axis, where any is named; those that are not named are zero.
    pub(super) fn vector(&self) -> Option<[f64; 3]> {
        let components = address::VECTOR.map(|letter| self.get(letter));
        (components != [None; 3]).then(|| components.map(|component| component.unwrap_or(0.0)))
    }

    /// The axes named.
    pub(super) fn axis_set(&self) -> AxisSet {
        Self::axes_of(self.present)
    }

    /// The axes whose words count from where they stand; `modal` says it for words that say nothing.
    pub(super) fn incremental(&self, modal: bool) -> AxisSet {
        Self::axes_of(if modal { !self.absolute } else { self.incremental } & self.present)
    }

    /// Whether the centre of an arc counts from zero; `modal` says it for words that say nothing.
    pub(super) fn centre_is_absolute(&self, modal: bool) -> bool {
        let words = letters("IJK") & self.present;
        modal || (words != 0 && words & !self.absolute == 0)
    }

    /// Which way the rotary axes turn.
    pub(super) fn turns(&self) -> Turns {
        self.turns
    }

    fn axes_of(letters: u32) -> AxisSet {
        // A, B, C are bits 0 to 2, X, Y, Z bits 23 to 25.
        AxisSet(((letters >> 23) & 0b111) as u8 | ((letters & 0b111) << 3) as u8)
    }

    /// The numbers of the axes in `given`, X, Y, Z times `scale`; 0 for the others.
    pub(super) fn axes(&self, scale: f64, given: AxisSet) -> [f64; 6] {
        let [a, b, c, ..] = self.values;
        let [.., x, y, z, _, _, _, _, _] = self.values;
        let mut target = [x * scale, y * scale, z * scale, a, b, c];
        for (index, value) in target.iter_mut().enumerate() {
            if !given.has(index) {
                *value = 0.0;
            }
        }
        target
    }
}

/// What the G and M codes of a block ask for.
#[derive(Default)]
pub(super) struct BlockCodes {
    groups: u32,
    parameters: u32,
    /// M codes so far.
    pub(super) m_codes: usize,
    pub(super) motion: Option<Motion>,
    pub(super) motion_off: bool,
    pub(super) rapid_once: bool,
    pub(super) circle_centre: bool,
    pub(super) plane: Option<Plane>,
    pub(super) inch: Option<bool>,
    pub(super) incremental: Option<bool>,
    pub(super) arc_absolute: Option<bool>,
    pub(super) feed_unit: Option<FeedUnit>,
    /// A length code, on or off.
    pub(super) length: Option<GCode>,
    /// Ten times its code.
    pub(super) work_offset: Option<u16>,
    /// The letter of the offset's number, where it has one.
    pub(super) offset_letter: Option<u8>,
    pub(super) interpolation: Option<TcpInterpolation>,
    pub(super) feed_group: Option<FeedGroup>,
    pub(super) shortest_way: Option<bool>,
    pub(super) tool_call: bool,
    pub(super) reference: Option<u8>,
    pub(super) machine_frame: bool,
    pub(super) exact_path: bool,
    pub(super) blend: bool,
    pub(super) dwell: bool,
    /// A code whose effect is not known: axis words of the block may be its parameters.
    pub(super) not_followed: bool,
    pub(super) canned_cycle: bool,
    pub(super) spindle: Option<SpindleTurn>,
    pub(super) coolant: Option<Coolant>,
    pub(super) tool_change: bool,
    pub(super) tcp: Option<bool>,
    pub(super) analog_output: bool,
    pub(super) stop: bool,
    pub(super) end: bool,
}

impl BlockCodes {
    /// Takes a G code of that number; false when one of its group is there already.
    pub(super) fn add_g(&mut self, code: GCode, number: f64) -> bool {
        match code {
            GCode::Unknown | GCode::Unsupported => {
                self.not_followed = true;
                self.canned_cycle |= code == GCode::Unsupported && (73.0..90.0).contains(&number);
                self.parameters = u32::MAX;
            }
            GCode::Harmless(taken) => self.parameters |= taken,
            GCode::Motion(motion) => self.motion = Some(motion),
            GCode::MotionOff => self.motion_off = true,
            GCode::RapidOnce => self.rapid_once = true,
            GCode::CircleCentre => self.circle_centre = true,
            GCode::Tcp(on) => self.tcp = Some(on),
            GCode::Interpolation(how) => self.interpolation = Some(how),
            GCode::TcpWith(how) => {
                self.tcp = Some(true);
                self.interpolation = Some(how);
            }
            GCode::ToolCall => {
                self.tool_change = true;
                self.tool_call = true;
            }
            GCode::FeedGroup(group) => self.feed_group = Some(group),
            GCode::Dwell => {
                self.dwell = true;
                self.parameters |= letters("P");
            }
            GCode::Plane(plane) => self.plane = Some(plane),
            GCode::Units { inch } => self.inch = Some(inch),
            GCode::Reference(number) => self.reference = Some(number),
            GCode::LengthOn { .. } => {
                self.length = Some(code);
                self.parameters |= letters("H");
            }
            GCode::LengthOff { .. } => self.length = Some(code),
            GCode::MachineFrame => self.machine_frame = true,
            GCode::WorkOffset(tenths) => self.work_offset = Some(tenths),
            GCode::NumberedWorkOffset { tenths, letter } => {
                self.work_offset = Some(tenths);
                self.offset_letter = Some(letter);
                self.parameters |= Letters::bit(letter);
            }
            GCode::ExactPath => self.exact_path = true,
            GCode::Blend => {
                self.blend = true;
                self.parameters |= letters("PQ");
            }
            GCode::Distance { incremental } => self.incremental = Some(incremental),
            GCode::ArcCentre { absolute } => self.arc_absolute = Some(absolute),
            GCode::Feed(unit) => self.feed_unit = Some(unit),
        }
        self.take_group(code.group())
    }

    /// Takes an M code; false when one of its group is there already.
    pub(super) fn add_m(&mut self, code: MCode) -> bool {
        self.m_codes += 1;
        match code {
            MCode::Unknown | MCode::Unsupported => self.parameters = u32::MAX,
            MCode::Harmless(taken) => self.parameters |= taken,
            MCode::Stop => self.stop = true,
            MCode::End => self.end = true,
            MCode::Spindle(turn) => self.spindle = Some(turn),
            MCode::Coolant(coolant) => self.coolant = Some(coolant),
            MCode::ToolChange => self.tool_change = true,
            MCode::Tcp(on) => self.tcp = Some(on),
            MCode::ShortestWay(on) => self.shortest_way = Some(on),
            MCode::MachineFrame => self.machine_frame = true,
            MCode::AnalogOutput => {
                self.analog_output = true;
                self.parameters |= letters("EQ");
            }
        }
        self.take_group(code.group())
    }

    fn take_group(&mut self, group: u32) -> bool {
        let free = self.groups & group == 0;
        self.groups |= group;
        free
    }

    /// The letters that mean something in the block, as bits from A.
    pub(super) fn parameters(&self, any: bool, arc: bool) -> u32 {
        // Addresses behind Z are read only where they mean something.
        const ALWAYS: u32 = letters("XYZABCFSTNO") | !((1 << 26) - 1);
        const ARC: u32 = letters("IJKRP");
        if any { u32::MAX } else { ALWAYS | self.parameters | if arc { ARC } else { 0 } }
    }
}
