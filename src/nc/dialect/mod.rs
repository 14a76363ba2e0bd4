//! One file a control: how its programs are read and written. Uses `machine` for the options of a control.

mod fanuc_30i;
mod linuxcnc;

use super::code::{GCode, MCode};
use super::feed_rules::FeedRules;
use super::lexer::Lexical;
use super::program::AxisSet;
use crate::machine::{Dialect, DialectOptions, Machine};

/// How a control understands programs.
#[derive(Clone, Debug)]
pub struct Rules {
    pub(super) lexical: Lexical,
    /// By ten times the code.
    g: Vec<GCode>,
    m: Vec<MCode>,
    /// Axis letters of the machine; all where none is given.
    pub(super) axes: AxisSet,
    /// Whether numbers without decimal point may count increments.
    pub(super) point_needed: bool,
    /// Seconds for a P of 1 in a dwell.
    pub(super) dwell_unit: f64,
    /// Whether a tool length offset without number is that of the tool in the spindle.
    pub(super) own_length: bool,
    /// Whether the control rounds corners freely until told otherwise.
    pub(super) blends_at_start: bool,
    /// Whether a program must say where it ends.
    pub(super) end_needed: bool,
    /// Whether the arc's P word counts turns.
    pub(super) arc_turns: bool,
    /// M codes the control takes in a block.
    pub(super) m_codes_per_block: usize,
    /// Output that switches TCP, and its values for on and off.
    pub(super) tcp_output: Option<TcpOutput>,
}

/// How programs of a dialect are written, beyond the options of a control.
pub(super) struct Style {
    /// Lines before everything else, from program number and name.
    pub(super) opening: fn(u32, &str) -> Vec<String>,
    /// Text as it may stand in a comment.
    pub(super) comment: fn(&str) -> String,
    /// Block that puts every modal group into a known state.
    pub(super) safe_start: &'static str,
    /// Lines at the end.
    pub(super) closing: &'static [&'static str],
    /// Whether the code that turns TCP on brings the tool length along (H) and moves; else G43 comes before it.
    pub(super) tcp_with_length: bool,
    /// Whether spindle speeds must be whole.
    pub(super) whole_spindle_speed: bool,
}

impl Style {
    /// The style of a dialect.
    pub(super) fn of(dialect: Dialect) -> Self {
        match dialect {
            Dialect::LinuxCnc => linuxcnc::writing(),
            Dialect::Fanuc30i => fanuc_30i::writing(),
        }
    }
}

impl FeedRules {
    /// The rules of a dialect.
    pub fn of(dialect: Dialect) -> Self {
        match dialect {
            Dialect::LinuxCnc => linuxcnc::feed_rules(),
            Dialect::Fanuc30i => fanuc_30i::feed_rules(),
        }
    }
}

/// Printable ASCII without what ends or nests a comment; anything else becomes a question mark.
fn plain(text: &str) -> String {
    let allowed = |c: char| (c.is_ascii_graphic() || c == ' ') && !"()%;".contains(c);
    text.chars().map(|c| if allowed(c) { c } else { '?' }).collect()
}

/// TCP switched by an analog output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TcpOutput {
    pub(super) output: f64,
    pub(super) on: f64,
    pub(super) off: f64,
}

impl Rules {
    /// The rules of a machine's control.
    pub fn of(machine: &Machine) -> Self {
        Self::new(machine.control.dialect, &machine.control.options, &machine.present_letters())
    }

    /// The rules of a control; with no `letters`, a machine with any axes is supposed.
    pub fn new(dialect: Dialect, options: &DialectOptions, letters: &[char]) -> Self {
        let mut rules = match dialect {
            Dialect::LinuxCnc => linuxcnc::reading(options),
            Dialect::Fanuc30i => fanuc_30i::reading(),
        };
        if !letters.is_empty() {
            let named = super::program::AXIS_LETTERS.iter().enumerate().filter(|(_, letter)| letters.contains(letter));
            rules.axes = AxisSet(named.fold(0, |bits, (index, _)| bits | 1 << index));
        }
        rules.switch_tcp(options.tcp_on.as_deref(), options.tcp_off.as_deref());
        rules
    }

    /// Puts the machine's own codes for TCP into the tables.
    fn switch_tcp(&mut self, on: Option<&str>, off: Option<&str>) {
        let words = |code: Option<&str>| -> Vec<(u8, f64)> {
            let blocks = super::lexer::lex(code.unwrap_or_default().as_bytes(), &self.lexical);
            blocks.words.iter().map(|word| (word.letter, word.value)).collect()
        };
        let (on, off) = (words(on), words(off));
        if let ([(b'M', code), (b'E', output), (b'Q', on)], [.., (b'Q', off)]) = (&on[..], &off[..]) {
            if *code == 68.0 {
                self.tcp_output = Some(TcpOutput { output: *output, on: *on, off: *off });
            }
            return;
        }
        for (words, tcp) in [(on, true), (off, false)] {
            match words.first() {
                Some((b'M', code)) => self.set_m(&[*code as usize], MCode::Tcp(tcp)),
                Some((b'G', code)) => {
                    let meaning = if tcp { GCode::LengthOn { tcp } } else { GCode::LengthOff { tcp: true } };
                    self.set_g(&[(*code * 10.0).round() as u16], meaning);
                }
                _ => {}
            }
        }
    }

    /// Rules with empty tables.
    fn empty(lexical: Lexical) -> Self {
        Self {
            lexical,
            g: vec![GCode::Unknown; 1000],
            m: vec![MCode::Unknown; 1000],
            axes: AxisSet(0b11_1111),
            point_needed: false,
            dwell_unit: 1.0,
            own_length: false,
            blends_at_start: false,
            end_needed: false,
            arc_turns: false,
            m_codes_per_block: usize::MAX,
            tcp_output: None,
        }
    }

    /// `codes` are ten times the G codes.
    fn set_g(&mut self, codes: &[u16], meaning: GCode) {
        for code in codes {
            if let Some(entry) = self.g.get_mut(usize::from(*code)) {
                *entry = meaning;
            }
        }
    }

    fn set_m(&mut self, codes: &[usize], meaning: MCode) {
        for code in codes {
            if let Some(entry) = self.m.get_mut(*code) {
                *entry = meaning;
            }
        }
    }

    /// Codes that mean the same in every dialect derived from RS-274-D.
    fn common_codes(&mut self) {
        use super::code::{FeedUnit, Motion, Plane, SpindleTurn};
        let g = [
            (0, GCode::Motion(Motion::Rapid)),
            (10, GCode::Motion(Motion::Line)),
            (20, GCode::Motion(Motion::Arc { clockwise: true })),
            (30, GCode::Motion(Motion::Arc { clockwise: false })),
            (40, GCode::Dwell),
            (170, GCode::Plane(Plane::Xy)),
            (180, GCode::Plane(Plane::Zx)),
            (190, GCode::Plane(Plane::Yz)),
            (200, GCode::Units { inch: true }),
            (210, GCode::Units { inch: false }),
            (280, GCode::Reference(1)),
            (300, GCode::Reference(2)),
            (400, GCode::Harmless(0)),
            (430, GCode::LengthOn { tcp: false }),
            (490, GCode::LengthOff { tcp: false }),
            (530, GCode::MachineFrame),
            (800, GCode::Harmless(0)),
            (900, GCode::Distance { incremental: false }),
            (910, GCode::Distance { incremental: true }),
            (930, GCode::Feed(FeedUnit::InverseTime)),
            (940, GCode::Feed(FeedUnit::PerMinute)),
            (950, GCode::Feed(FeedUnit::PerRevolution)),
            (970, GCode::Harmless(0)),
            (980, GCode::Harmless(0)),
            (990, GCode::Harmless(0)),
        ];
        for (code, meaning) in g {
            self.set_g(&[code], meaning);
        }
        for code in [540, 550, 560, 570, 580, 590] {
            self.set_g(&[code], GCode::WorkOffset(code));
        }
        self.set_g(&[410, 420, 810, 820, 830, 840, 850, 860, 870, 880, 890, 520, 920, 100, 730], GCode::Unsupported);
        self.set_m(&[0, 1], MCode::Stop);
        self.set_m(&[2, 30], MCode::End);
        self.set_m(&[3], MCode::Spindle(SpindleTurn::Clockwise));
        self.set_m(&[4], MCode::Spindle(SpindleTurn::Counterclockwise));
        self.set_m(&[5], MCode::Spindle(SpindleTurn::Off));
        self.set_m(&[6], MCode::ToolChange);
        self.set_m(&[7, 8, 9], MCode::Harmless(0));
        self.set_m(&[98, 99], MCode::Unsupported);
    }

    /// Meaning of a G word's number.
    pub(super) fn g_code(&self, value: f64) -> GCode {
        let tenths = value * 10.0;
        let whole = tenths.round();
        if (tenths - whole).abs() > 1e-6 || whole < 0.0 {
            return GCode::Unknown;
        }
        self.g.get(whole as usize).copied().unwrap_or_default()
    }

    /// Meaning of an M word's number.
    pub(super) fn m_code(&self, value: f64) -> MCode {
        if value.fract() != 0.0 || value < 0.0 {
            return MCode::Unknown;
        }
        self.m.get(value as usize).copied().unwrap_or_default()
    }
}
