//! One block's codes and letters, sorted by what they are for. Uses nothing of the crate.

use super::code::{FeedUnit, GCode, MCode, Motion, Plane, SpindleTurn, letters};
use super::program::AxisSet;

/// The letters of a block, other than G and M, with their numbers.
#[derive(Default)]
pub(super) struct Letters {
    present: u32,
    values: [f64; 26],
}

impl Letters {
    /// The bit of a letter.
    pub(super) fn bit(letter: u8) -> u32 {
        1_u32.checked_shl(u32::from(letter.wrapping_sub(b'A'))).unwrap_or(0)
    }

    /// Adds a word; true when the letter was there already.
    pub(super) fn add(&mut self, letter: u8, value: f64) -> bool {
        let bit = Self::bit(letter);
        let repeated = self.present & bit != 0;
        self.present |= bit;
        if let Some(place) = self.values.get_mut(usize::from(letter.wrapping_sub(b'A'))) {
            *place = value;
        }
        repeated
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

    /// The axes named.
    pub(super) fn axis_set(&self) -> AxisSet {
        // A, B, C are bits 0 to 2, X, Y, Z bits 23 to 25.
        AxisSet(((self.present >> 23) & 0b111) as u8 | ((self.present & 0b111) << 3) as u8)
    }

    /// The numbers of the axes in `given`, X, Y, Z times `scale`; 0 for the others.
    pub(super) fn axes(&self, scale: f64, given: AxisSet) -> [f64; 6] {
        let [a, b, c, .., x, y, z] = self.values;
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
    pub(super) plane: Option<Plane>,
    pub(super) inch: Option<bool>,
    pub(super) incremental: Option<bool>,
    pub(super) arc_absolute: Option<bool>,
    pub(super) feed_unit: Option<FeedUnit>,
    /// A length code, on or off.
    pub(super) length: Option<GCode>,
    /// Ten times its code.
    pub(super) work_offset: Option<u16>,
    pub(super) extended_offset: bool,
    pub(super) reference: Option<u8>,
    pub(super) machine_frame: bool,
    pub(super) exact_path: bool,
    pub(super) blend: bool,
    pub(super) dwell: bool,
    /// A code whose effect is not known: axis words of the block may be its parameters.
    pub(super) not_followed: bool,
    pub(super) canned_cycle: bool,
    pub(super) spindle: Option<SpindleTurn>,
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
            GCode::ExtendedWorkOffset(tenths) => {
                self.work_offset = Some(tenths);
                self.extended_offset = true;
                self.parameters |= letters("P");
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
            MCode::ToolChange => self.tool_change = true,
            MCode::Tcp(on) => self.tcp = Some(on),
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
        const ALWAYS: u32 = letters("XYZABCFSTNO");
        const ARC: u32 = letters("IJKRP");
        if any { u32::MAX } else { ALWAYS | self.parameters | if arc { ARC } else { 0 } }
    }
}
