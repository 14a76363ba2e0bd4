//! Writes the program of a tool path: header, approach, timed blocks, end. Uses `diagnostic`, `motion`, `machine` and
//! `feed`.

use super::code::FeedUnit;
use super::dialect::Style;
use super::feed_rules::{FeedRules, Travelled};
use super::format::{push_steps, steps, value_of};
use super::write_feed::{FeedWord, NoFeedWord, feed_word};
use crate::diagnostic::{Diagnostic, Result};
use crate::feed::TimedMove;
use crate::machine::{AxisZero, DialectOptions, Setup, Travel};
use crate::motion::ToolPath;

/// What to write.
#[derive(Clone, Copy, Debug)]
pub struct WriteRequest<'a> {
    /// Name, tool, spindle speed and tolerances.
    pub path: &'a ToolPath,
    /// The path's moves. The first only says where it begins: the machine gets there by rapids.
    pub moves: &'a [TimedMove],
    /// The machine with its part and tool.
    pub setup: &'a Setup,
    /// G code of the setup's work offset, such as `G54`.
    pub work_offset: &'a str,
    /// With TCP on; else as axis positions.
    pub tcp: bool,
    /// Hash of everything the program was made from, for its header.
    pub input_hash: &'a str,
    /// Program number, for controls that have one.
    pub number: u32,
    /// Leave out words that stay as they were.
    pub modal: bool,
}

/// A program, and what its control's words cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The text, lines ended by a line feed.
    pub text: String,
    /// Lines, from 1, whose feed a ceiling of the control lowers by more than the rounding of the word, in order.
    pub slowed: Vec<usize>,
    /// Seconds by which the program takes longer than asked, rounding and ceilings together.
    pub lost: f64,
}

/// Share by which rounding alone may lower a feed.
const ROUNDING: f64 = 0.01;

/// Writes a program. The same request gives the same bytes.
///
/// # Errors
/// No moves; numbers that are not finite or too large; a state of TCP that the control cannot be in; a block that is too
/// long for the control, or too slow for any F word; a turn of a wrapped axis by half a turn or more.
pub fn write(request: &WriteRequest) -> Result<Written> {
    let mut writer = Writer::new(request)?;
    writer.header()?;
    let Some((first, moves)) = request.moves.split_first() else {
        return Err(Diagnostic::error("the path has no moves, so there is no program to write"));
    };
    writer.approach(first)?;
    for step in moves {
        writer.step(step)?;
    }
    writer.end()?;
    Ok(writer.out)
}

/// Words of a block in steps of their last decimals: X, Y, Z, then the rotary axes in the machine's order.
type Words = [i64; 5];

struct Writer<'a> {
    request: &'a WriteRequest<'a>,
    options: &'a DialectOptions,
    style: Style,
    rules: FeedRules,
    letters: [char; 5],
    out: Written,
    line: usize,
    /// Words in force; `None` before the first.
    words: [Option<i64>; 5],
    motion: Option<&'static str>,
    feed_unit: FeedUnit,
    /// F in force for feeds per minute, in steps.
    feed: Option<i64>,
    /// Durations of blocks too short to be written, s.
    owed: f64,
    block: String,
}

impl<'a> Writer<'a> {
    fn new(request: &'a WriteRequest<'a>) -> Result<Self> {
        let machine = request.setup.machine();
        let options = &machine.control.options;
        let reachable = match request.tcp {
            true => options.tcp_on.is_some() || options.tcp_at_start,
            false => options.tcp_off.is_some() || !options.tcp_at_start,
        };
        if !reachable {
            let state = if request.tcp { "on" } else { "off" };
            return Err(Diagnostic::error(format!("the control of {} cannot turn TCP {state}", machine.name))
                .help("give the code in [control.options], or write the program the other way"));
        }
        Ok(Self {
            request,
            options,
            style: Style::of(machine.control.dialect),
            rules: FeedRules::of(machine.control.dialect),
            letters: machine.letters(),
            out: Written { text: String::with_capacity(request.moves.len() * 60), slowed: Vec::new(), lost: 0.0 },
            line: 0,
            words: [None; 5],
            motion: None,
            feed_unit: FeedUnit::PerMinute,
            feed: None,
            owed: 0.0,
            block: String::new(),
        })
    }

    /// Adds one line; refuses one that the control does not take.
    fn push(&mut self, line: &str) -> Result<()> {
        if line.len() > self.options.max_block_length {
            return Err(Diagnostic::error(format!(
                "block {} would have {} characters; the control takes {}",
                self.line + 1,
                line.len(),
                self.options.max_block_length
            ))
            .help("lower linear_digits or rotary_digits, or raise max_block_length if the control takes more"));
        }
        self.line += 1;
        self.out.text.push_str(line);
        self.out.text.push('\n');
        Ok(())
    }

    fn lines(&mut self, lines: &[String]) -> Result<()> {
        lines.iter().try_for_each(|line| self.push(line))
    }

    fn comment(&mut self, text: &str) -> Result<()> {
        let text = (self.style.comment)(text);
        let room = self.options.max_block_length.saturating_sub(2).max(1);
        // Plain ASCII, so every byte is a character.
        for piece in text.as_bytes().chunks(room) {
            self.push(&format!("({})", String::from_utf8_lossy(piece)))?;
        }
        Ok(())
    }

    fn header(&mut self) -> Result<()> {
        let (request, options) = (self.request, self.options);
        let (path, machine) = (request.path, request.setup.machine());
        let number = path.tool.number;
        self.lines(&(self.style.opening)(request.number, &path.name))?;
        self.comment(&format!("tool T{number} {}", path.tool.description))?;
        self.comment(&format!(
            "part tolerance overcut {:.4} undercut {:.4}",
            path.overcut_tolerance, path.undercut_tolerance
        ))?;
        self.comment(&format!("input {}", request.input_hash))?;
        self.comment(&format!("machine {} dialect {}", machine.name, machine.control.dialect.name()))?;
        self.comment(&format!("regulus {}", env!("CARGO_PKG_VERSION")))?;
        self.push(self.style.safe_start)?;
        self.lines(&options.start_lines)?;
        self.tcp_off()?;
        self.lines(&options.retract_lines)?;
        self.push(&format!("T{number} M6"))?;
        self.push(request.work_offset)?;
        if self.plain_length() {
            self.push(&format!("G43 H{number}"))?;
        }
        let speed = self.spindle_speed()?;
        self.push(&format!("S{speed} M3"))
    }

    fn spindle_speed(&self) -> Result<String> {
        let rpm = self.request.path.spindle_rpm;
        let rpm = if self.style.whole_spindle_speed { rpm.round() } else { rpm };
        if !(rpm.is_finite() && rpm > 0.0) {
            return Err(Diagnostic::error(format!("spindle speed {rpm} is not a positive number"))
                .help("write the speed in revolutions per minute"));
        }
        Ok(format!("{rpm}"))
    }

    /// Whether G43 comes before the path.
    fn plain_length(&self) -> bool {
        if self.request.tcp {
            let in_kinematics = self.request.setup.machine().spindle.axis_zero == AxisZero::GaugePoint;
            !self.style.tcp_with_length && in_kinematics
        } else {
            self.options.length_offset_without_tcp
        }
    }

    fn tcp_off(&mut self) -> Result<()> {
        match &self.options.tcp_off {
            Some(code) => self.push(code),
            None => Ok(()),
        }
    }

    /// Rotary axes, then across the spindle, then to where the path begins; with TCP off as far as the control can.
    fn approach(&mut self, first: &TimedMove) -> Result<()> {
        let start = self.words_of(first, false)?;
        if self.request.setup.machine().has_axis(3) {
            self.motion_block("G0", &self.only(&start, &[3, 4]), None)?;
        }
        let switchable = self.options.tcp_off.is_some() || !self.options.tcp_at_start;
        if switchable {
            self.motion_block("G0", &self.only(&start, &[0, 1]), None)?;
        }
        if !self.request.tcp {
            return self.motion_block("G0", &start.map(Some), None);
        }
        let start = self.words_of(first, true)?;
        // The linear words mean something else from here on.
        self.words = [None; 5];
        if let Some(code) = &self.options.tcp_on {
            if self.style.tcp_with_length {
                self.block = format!("{code} H{} ", self.request.path.tool.number);
            } else {
                self.push(code)?;
            }
        }
        self.motion_block("G0", &start.map(Some), None)
    }

    fn only(&self, words: &Words, indices: &[usize]) -> [Option<i64>; 5] {
        std::array::from_fn(|index| words.get(index).copied().filter(|_| indices.contains(&index)))
    }

    /// The words of a move.
    fn words_of(&self, step: &TimedMove, tcp: bool) -> Result<Words> {
        let exact = self.request.setup.words(&step.axes.to, tcp);
        let ([x, y, z], [a, b]) = (exact.linear, exact.rotary);
        let mut words = [0; 5];
        for (index, value) in [x, y, z, a, b].into_iter().enumerate() {
            words[index] = steps(value, self.digits(index)).ok_or_else(|| {
                Diagnostic::error(format!(
                    "{} {value} after block {} is no number that a control reads",
                    self.letters[index], self.line
                ))
                .help("check the path: its poses must be finite and within reach")
            })?;
        }
        for (slot, axis) in self.request.setup.machine().rotary.iter().enumerate() {
            if axis.travel == Travel::Wrapped {
                words[3 + slot] = words[3 + slot].rem_euclid(self.turn());
            }
        }
        Ok(words)
    }

    fn digits(&self, index: usize) -> u8 {
        if index < 3 { self.options.linear_digits } else { self.options.rotary_digits }
    }

    /// One turn of a rotary axis in steps.
    fn turn(&self) -> i64 {
        360 * 10_i64.pow(u32::from(self.options.rotary_digits.min(12)))
    }

    fn step(&mut self, step: &TimedMove) -> Result<()> {
        let words = self.words_of(step, self.request.tcp)?;
        let way = self.way(&words)?;
        if way.is_none() {
            // The control would not move; the time goes to the next block.
            self.owed += if step.axes.kind.is_rapid() { 0.0 } else { step.duration };
            return Ok(());
        }
        if step.axes.kind.is_rapid() {
            return self.motion_block("G0", &words.map(Some), None);
        }
        let asked = step.duration + std::mem::take(&mut self.owed);
        if !(asked.is_finite() && asked > 0.0) {
            return Err(Diagnostic::error(format!("the block after line {} is to take {asked} s", self.line)));
        }
        let (tcp, rules, options) = (self.request.tcp, self.rules, self.options);
        let (words, word) = match feed_word(options, &rules, way, tcp, asked) {
            Ok(word) => (words.map(Some), word),
            Err(NoFeedWord::TipStill) => {
                // The tip moves by less than any feed word tells: it waits for the next block.
                let turning = Travelled { linear: 0.0, ..way };
                let word = feed_word(options, &rules, turning, tcp, asked).map_err(|_| self.too_slow(asked))?;
                (self.only(&words, &[3, 4]), word)
            }
            Err(NoFeedWord::TooSlow) => return Err(self.too_slow(asked)),
        };
        self.motion_block("G1", &words, Some(word))?;
        self.out.lost += word.seconds - asked;
        if word.seconds > asked * (1.0 + ROUNDING) {
            self.out.slowed.push(self.line);
        }
        Ok(())
    }

    fn too_slow(&self, seconds: f64) -> Box<Diagnostic> {
        Diagnostic::error(format!("the block after line {} is to take {seconds} s: no F word is that slow", self.line))
            .help("raise feed_digits, or raise the feed")
    }

    /// How far a block goes from the words in force.
    fn way(&self, words: &Words) -> Result<Travelled> {
        let delta = |index: usize| words[index] - self.words[index].unwrap_or(words[index]);
        let linear = |index: usize| value_of(delta(index), self.options.linear_digits);
        let mut turned = [0.0; 2];
        for (slot, axis) in self.request.setup.machine().rotary.iter().enumerate() {
            let mut steps = delta(3 + slot);
            if axis.travel == Travel::Wrapped {
                let turn = self.turn();
                steps = (steps + turn / 2).rem_euclid(turn) - turn / 2;
                if steps == -turn / 2 {
                    return Err(Diagnostic::error(format!(
                        "{} turns by half a turn in the block after line {}: the control may go either way",
                        axis.letter, self.line
                    ))
                    .help("put more blocks there"));
                }
            }
            turned[slot] = value_of(steps, self.options.rotary_digits);
        }
        Ok(Travelled { linear: linear(0).hypot(linear(1)).hypot(linear(2)), rotary: turned[0].hypot(turned[1]) })
    }

    /// Writes a motion block, behind what [`Self::block`] already holds.
    fn motion_block(&mut self, code: &'static str, words: &[Option<i64>; 5], feed: Option<FeedWord>) -> Result<()> {
        let mut block = std::mem::take(&mut self.block);
        if let Some(feed) = feed.filter(|feed| feed.unit != self.feed_unit) {
            self.feed_unit = feed.unit;
            self.feed = None;
            block.push_str(if feed.unit == FeedUnit::InverseTime { "G93 " } else { "G94 " });
        }
        if !self.request.modal || self.motion != Some(code) {
            self.motion = Some(code);
            block.push_str(code);
            block.push(' ');
        }
        for (index, word) in words.iter().enumerate() {
            let Some(steps) = word.filter(|_| self.request.setup.machine().has_axis(index)) else { continue };
            if self.request.modal && self.words[index] == Some(steps) {
                continue;
            }
            self.words[index] = Some(steps);
            block.push(self.letters[index]);
            push_steps(&mut block, steps, self.digits(index));
            block.push(' ');
        }
        if let Some(feed) = feed
            && (feed.unit == FeedUnit::InverseTime || !self.request.modal || self.feed != Some(feed.steps))
        {
            self.feed = Some(feed.steps);
            block.push('F');
            push_steps(&mut block, feed.steps, self.options.feed_digits);
        }
        let pushed = self.push(block.trim_end());
        block.clear();
        self.block = block;
        pushed
    }

    fn end(&mut self) -> Result<()> {
        let options = self.options;
        self.tcp_off()?;
        self.lines(&options.retract_lines)?;
        if self.plain_length() {
            self.push("G49")?;
        }
        self.push("M5")?;
        self.lines(&options.end_lines)?;
        self.style.closing.iter().try_for_each(|line| self.push(line))
    }
}
