//! One file a control: how its programs are read and written. Uses `machine` for the options of a control.

mod fanuc_30i;
mod grblhal;
mod haas_ngc;
mod heidenhain_tnc;
mod iso;
mod linuxcnc;
mod mazak_smooth;
mod okuma_osp;
mod siemens_840d;
mod style;
#[cfg(test)]
mod tests;
mod words;

pub(super) use style::{Part, Style};

use super::block::Blocks;
use super::code::{GCode, MCode};
use super::lexer::{Lexical, lex};
use super::program::AxisSet;
use crate::machine::{Dialect, DialectOptions, InverseTimeUnit, Machine, OrientationWords, PointRule};

/// How a control understands programs.
#[derive(Clone, Debug)]
pub struct Rules {
    syntax: Syntax,
    /// By ten times the code.
    g: Vec<GCode>,
    m: Vec<MCode>,
    /// Words of the language.
    keywords: &'static [(&'static str, GCode)],
    /// Axis letters of the machine; all where none is given.
    pub(super) axes: AxisSet,
    /// Letters that may stand in any block, as bits from A.
    pub(super) free_letters: u32,
    /// What numbers without decimal point mean.
    pub(super) point: PointRule,
    /// What such a number counts, mm and degrees.
    pub(super) least_increment: f64,
    /// Seconds for a P of 1 in a dwell.
    pub(super) dwell_unit: f64,
    /// Whether F in a dwell is its seconds.
    pub(super) dwell_in_f: bool,
    /// What F counts in inverse-time feed.
    pub(super) inverse_time_unit: InverseTimeUnit,
    /// Radius at which rotary axes count for the feed where a program says nothing, mm; 0: not at all.
    pub(super) usual_feed_radius: f64,
    /// That where a program says that they count, and not at which radius.
    pub(super) group_radius: f64,
    /// Whether a tool length offset without number is that of the tool in the spindle.
    pub(super) own_length: bool,
    /// Whether D selects the tool length.
    pub(super) length_by_d: bool,
    /// Whether the control rounds corners freely until told otherwise.
    pub(super) blends_at_start: bool,
    /// Whether a tolerance for corners may come with one for rotary axes, read as a Q word, degrees.
    pub(super) rotary_tolerance: bool,
    /// Whether a program must say where it ends.
    pub(super) end_needed: bool,
    /// Whether the arc's P word counts turns.
    pub(super) arc_turns: bool,
    /// Whether the code that turns TCP on also says how the tool turns.
    pub(super) tcp_says_interpolation: bool,
    /// M codes the control takes in a block.
    pub(super) m_codes_per_block: usize,
    /// Output that switches TCP, and its values for on and off.
    pub(super) tcp_output: Option<TcpOutput>,
}

/// How a text is cut into words.
#[derive(Clone, Debug)]
enum Syntax {
    /// Letters with numbers.
    Words(Lexical),
    /// Siemens: also names, assignments and calls.
    Siemens { max_block_length: usize },
    /// Heidenhain Klartext.
    Klartext,
}

/// TCP switched by an analog output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TcpOutput {
    pub(super) output: f64,
    pub(super) on: f64,
    pub(super) off: f64,
}

impl Style {
    /// The style of a dialect.
    pub(super) fn of(dialect: Dialect) -> Self {
        match dialect {
            Dialect::LinuxCnc => linuxcnc::writing(),
            Dialect::Fanuc30i => fanuc_30i::writing(),
            Dialect::HaasNgc => haas_ngc::writing(),
            Dialect::Siemens840d => siemens_840d::writing(),
            Dialect::HeidenhainTnc => heidenhain_tnc::writing(),
            Dialect::MazakSmooth => mazak_smooth::writing(),
            Dialect::OkumaOsp => okuma_osp::writing(),
            Dialect::GrblHal => grblhal::writing(),
            Dialect::Iso => iso::writing(),
        }
    }
}

impl Rules {
    /// The rules of a machine's control.
    pub fn of(machine: &Machine) -> Self {
        let mut rules = Self::new(machine.control.dialect, &machine.control.options, &machine.present_letters());
        machine.control.work_offsets.iter().for_each(|offset| rules.name_offset(&offset.name));
        rules
    }

    /// The codes of work offsets are those that the machine file names them by.
    fn name_offset(&mut self, name: &str) {
        let tenths = |code: f64| (code * 10.0).round() as u16;
        match self.words_of(name)[..] {
            [(b'G', code)] => self.set_g(&[tenths(code)], GCode::WorkOffset(tenths(code))),
            [(b'G', code), (letter, _)] => {
                let tenths = tenths(code);
                self.set_g(&[tenths], GCode::NumberedWorkOffset { tenths, letter });
            }
            _ => {}
        }
    }

    /// The letters and numbers of a code.
    fn words_of(&self, code: &str) -> Vec<(u8, f64)> {
        self.cut(code.as_bytes()).words.iter().map(|word| (word.letter, word.value)).collect()
    }

    /// The rules of a control; with no `letters`, a machine with any axes is supposed.
    pub fn new(dialect: Dialect, options: &DialectOptions, letters: &[char]) -> Self {
        let mut rules = match dialect {
            Dialect::LinuxCnc => linuxcnc::reading(options),
            Dialect::Fanuc30i => fanuc_30i::reading(),
            Dialect::HaasNgc => haas_ngc::reading(),
            Dialect::Siemens840d => siemens_840d::reading(options),
            Dialect::HeidenhainTnc => heidenhain_tnc::reading(),
            Dialect::MazakSmooth => mazak_smooth::reading(),
            Dialect::OkumaOsp => okuma_osp::reading(),
            Dialect::GrblHal => grblhal::reading(options),
            Dialect::Iso => iso::reading(),
        };
        if !letters.is_empty() {
            let named = super::program::AXIS_LETTERS.iter().enumerate().filter(|(_, letter)| letters.contains(letter));
            rules.axes = AxisSet(named.fold(0, |bits, (index, _)| bits | 1 << index));
        }
        rules.point = options.number_without_point;
        rules.least_increment = options.least_increment;
        rules.inverse_time_unit = options.inverse_time_unit;
        rules.usual_feed_radius = options.feed_radius;
        let [on, off] = &options.length_codes;
        for (code, meaning) in [(on, GCode::LengthOn { tcp: None }), (off, GCode::LengthOff { tcp: false })] {
            if let [(b'G', code)] = rules.words_of(code)[..] {
                rules.set_g(&[(code * 10.0).round() as u16], meaning);
            }
        }
        rules.switch_tcp(options);
        rules
    }

    /// Cuts a text into words and blocks.
    pub(super) fn cut(&self, text: &[u8]) -> Blocks {
        match &self.syntax {
            Syntax::Words(lexical) => lex(text, lexical),
            Syntax::Siemens { max_block_length } => siemens_840d::lex(text, *max_block_length),
            Syntax::Klartext => heidenhain_tnc::lex(text),
        }
    }

    /// Puts the machine's own codes for TCP into the tables.
    fn switch_tcp(&mut self, options: &DialectOptions) {
        let words = |code: &Option<String>| self.words_of(code.as_deref().unwrap_or_default());
        let (on, vectors, off) = (words(&options.tcp_on), words(&options.tcp_on_vectors), words(&options.tcp_off));
        if let ([(b'M', code), (b'E', output), (b'Q', on)], [.., (b'Q', off)]) = (&on[..], &off[..]) {
            if *code == 68.0 {
                self.tcp_output = Some(TcpOutput { output: *output, on: *on, off: *off });
            }
            return;
        }
        let on_with = |words| GCode::LengthOn { tcp: Some(words) };
        for (words, length, tcp) in [
            (on, on_with(OrientationWords::Angles), true),
            (vectors, on_with(OrientationWords::Vectors), true),
            (off, GCode::LengthOff { tcp: true }, false),
        ] {
            match words.first() {
                Some((b'M', code)) => self.set_m(&[*code as usize], MCode::Tcp(tcp)),
                Some((b'G', code)) => self.set_g(&[(*code * 10.0).round() as u16], length),
                _ => {}
            }
        }
    }

    /// Rules with empty tables.
    fn empty(syntax: Syntax) -> Self {
        Self {
            syntax,
            g: vec![GCode::Unknown; 10_000],
            m: vec![MCode::Unknown; 1000],
            keywords: &[],
            axes: AxisSet(0b11_1111),
            free_letters: 0,
            point: PointRule::Required,
            least_increment: 0.001,
            dwell_unit: 1.0,
            dwell_in_f: false,
            inverse_time_unit: InverseTimeUnit::PerMinute,
            usual_feed_radius: 0.0,
            group_radius: 180.0 / std::f64::consts::PI,
            own_length: false,
            length_by_d: false,
            blends_at_start: false,
            rotary_tolerance: false,
            end_needed: false,
            arc_turns: false,
            tcp_says_interpolation: false,
            m_codes_per_block: usize::MAX,
            tcp_output: None,
        }
    }

    /// Rules of a control whose programs are letters with numbers.
    fn of_words(lexical: Lexical) -> Self {
        let mut rules = Self::empty(Syntax::Words(lexical));
        rules.common_codes();
        rules
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

    /// Meaning of a word of the language, by its index.
    pub(super) fn keyword(&self, index: f64) -> GCode {
        self.keywords.get(index as usize).map_or(GCode::Unknown, |(_, meaning)| *meaning)
    }
}

/// Index of a word in a table of a language's words, whatever its case.
fn keyword_index(table: &[(&str, GCode)], name: &[u8]) -> Option<usize> {
    table.iter().position(|(known, _)| known.as_bytes().eq_ignore_ascii_case(name))
}
